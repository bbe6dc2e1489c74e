"""The deformed centrelines, for plots; NumPy only once the frame is solved."""

from dataclasses import dataclass

import jax
import numpy as np
from numpy.typing import NDArray

from .arrays import frame_arrays
from .elements import XY, XZ, XZ_SIGNS, local_axes, shear_parameters
from .linear import Solution
from .precision import in_float64


@dataclass(frozen=True, eq=False)
class Centreline:
    """A member's axis and how it moves.

    Parameters
    ----------
    member : str
        Name of the member.
    points : ndarray, shape (n, 3)
        Undeformed, from start to end, m.
    displacement : ndarray, shape (n, 3)
        In global axes, m.
    """

    member: str
    points: NDArray[np.float64]
    displacement: NDArray[np.float64]


@in_float64
def centrelines(solution: Solution, case: int = 0, n_points: int = 21) -> tuple[Centreline, ...]:
    """One centreline per member under one load case, by the element's exact shape functions.

    Parameters
    ----------
    solution : Solution
    case : int
        Which load case.
    n_points : int
        Points along each member, ends included.

    Raises
    ------
    ValueError
        If there is no such case, or fewer than two points.
    """
    if not 0 <= case < len(solution.displacements):
        raise ValueError(f"load case {case} does not exist: there are {len(solution.displacements)}, from 0 on")
    if n_points < 2:
        raise ValueError(f"n_points must be 2 or more, for the two ends; got {n_points}")
    a = frame_arrays(solution.frame)
    start, end = a.coordinates[a.ends[:, 0]], a.coordinates[a.ends[:, 1]]
    length = np.linalg.norm(end - start, axis=1)
    axes = np.asarray(_local_axes(start, end, a.up))
    phi_y, phi_z = map(np.asarray, shear_parameters(length, a.properties))

    s = np.linspace(0.0, 1.0, n_points)
    moved = solution.displacements[case][a.ends].reshape(-1, 4, 3)
    local = np.einsum("mij,mkj->mki", axes, moved).reshape(-1, 12)
    axial = local[:, [0, 6]] @ np.stack([1 - s, s])
    across_y = np.einsum("mk,mkp->mp", local[:, XY], shape_functions(s, length, phi_y))
    across_z = np.einsum("mk,mkp->mp", local[:, XZ] * XZ_SIGNS, shape_functions(s, length, phi_z))
    displacement = np.einsum("mij,ipm->mpj", axes, np.stack([axial, across_y, across_z]).transpose(0, 2, 1))
    points = start[:, None] + s[:, None] * (end - start)[:, None]
    return tuple(Centreline(m.name, p, u) for m, p, u in zip(solution.frame.members, points, displacement, strict=True))


_local_axes = jax.jit(jax.vmap(local_axes))


def shape_functions(
    s: NDArray[np.float64], length: NDArray[np.float64], phi: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Deflection per unit of (v₁, slope₁, v₂, slope₂) at s = x/L, shape (n_members, 4, n_points).

    Exact between nodal loads; a cubic in s, with the shear parameter Φ.

    Parameters
    ----------
    s : ndarray, shape (n_points,)
        In [0, 1].
    length, phi : ndarray, shape (n_members,)
    """
    length, phi = length[:, None], phi[:, None]
    shape = np.stack(
        [
            1 - 3 * s**2 + 2 * s**3 + phi * (1 - s),
            length * (s - 2 * s**2 + s**3 + phi / 2 * (s - s**2)),
            3 * s**2 - 2 * s**3 + phi * s,
            length * (s**3 - s**2 - phi / 2 * (s - s**2)),
        ],
        axis=1,
    )
    return shape / (1 + phi[:, None])

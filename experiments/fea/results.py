"""The deformed centrelines, for plots; NumPy only once the frame is solved."""

from dataclasses import dataclass
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from numpy.typing import NDArray

from .arrays import FrameArrays, frame_arrays
from .assembly import member_shapes
from .elements import XY, XZ, XZ_SIGNS, Properties, along, flexibility, shear_parameters
from .linear import Solution
from .precision import in_float64
from .shapes import Shapes
from .stress import internal_forces


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
    """One centreline per member under one load case, exact for loads at the nodes.

    Straight members follow the element's shape functions; arcs the rigid motion of their start and the
    flexibility of the part up to each point.

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
    s = np.linspace(0.0, 1.0, n_points)
    moved = solution.displacements[case][a.ends].reshape(-1, 4, 3)
    displacement = _straight(a, s, np.einsum("mij,mkj->mki", a.axes, moved))
    place = s[:, None] * np.array([1.0, 0.0, 0.0]) * a.lengths[:, None, None]
    if a.is_curved.any():
        at = np.tile(s, (len(a.ends), 1))
        internal = internal_forces(a, solution.end_forces[case : case + 1], at)[:, 0]
        start = np.einsum("mij,mkj->mki", a.axes, moved[:, :2]).reshape(-1, 6)
        arcs = _arcs(member_shapes(a), a.properties, at, internal, start)
        curved = a.is_curved[:, None, None]
        place, displacement = (np.where(curved, x, y) for x, y in zip(arcs, (place, displacement), strict=True))
    points = a.coordinates[a.ends[:, 0], None] + place @ a.axes
    return tuple(
        Centreline(m.name, p, u) for m, p, u in zip(solution.frame.members, points, displacement @ a.axes, strict=True)
    )


def _straight(a: FrameArrays, s: NDArray[np.float64], moved: NDArray[np.float64]) -> NDArray[np.float64]:
    """Displacement along straight members in local axes, (n_members, n_points, 3), from both ends' motions."""
    phi_y, phi_z = map(np.asarray, shear_parameters(jnp.asarray(a.lengths), a.properties))
    local = moved.reshape(-1, 12)
    axial = local[:, [0, 6]] @ np.stack([1 - s, s])
    across_y = np.einsum("mk,mkp->mp", local[:, XY], shape_functions(s, a.lengths, phi_y))
    across_z = np.einsum("mk,mkp->mp", local[:, XZ] * XZ_SIGNS, shape_functions(s, a.lengths, phi_z))
    return np.stack([axial, across_y, across_z], axis=-1)


@jax.jit
@partial(jax.vmap, in_axes=(-1, 0, 0, 1, 0))
@partial(jax.vmap, in_axes=(None, None, 0, 1, None))
def _arcs(shape: Shapes, p: Properties, s: Array, internal: Array, start: Array) -> tuple[Array, Array]:
    """Place and displacement of the section at `s` in the axes of the start, (3,) each."""
    place, turn = along(shape, s)
    wrench = jnp.concatenate([turn @ internal[:3], turn @ internal[3:]])
    return place, start[:3] + jnp.cross(start[3:], place) + (flexibility(shape, p, s) @ wrench)[:3]


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

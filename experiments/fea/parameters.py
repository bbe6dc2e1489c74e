"""How the geometry of a frame changes with the numbers that it is built from: lengths, thicknesses, moduli."""

from collections.abc import Callable, Sequence

import jax
import numpy as np
from numpy.typing import NDArray

from .arrays import frame_arrays
from .model import Frame
from .scaling import Geometry, geometry

WEIGHTS = ((-2, 1 / 12), (-1, -2 / 3), (1, 2 / 3), (2, -1 / 12))
"""Central difference of the fourth order."""


def geometry_rates(build: Callable[..., Frame], at: Sequence[float], steps: Sequence[float] | None = None) -> Geometry:
    """Change of coordinates, sections and materials per unit of each of m numbers, for ``differentiate``.

    By central differences of what is built, not of what is solved: a few formulas of geometry, so that the
    error is about 1e-11 of a change. For example ``geometry_rates(lambda t: HexFlex(thickness=t).frame, [5e-4])``.

    Parameters
    ----------
    build : callable
        From m numbers to a frame; what joins what must not depend on them.
    at : sequence of float, length m
    steps : sequence of float, optional
        Of the differences; a thousandth of each number if nothing is given.

    Returns
    -------
    Geometry
        Of shape (m, ...); see :class:`.scaling.Geometry`.

    Raises
    ------
    ValueError
        If a step is zero, or two frames are not joined alike.
    """
    place = np.array(at, dtype=np.float64)
    chosen = 1e-3 * np.abs(place) if steps is None else np.array(steps, dtype=np.float64)
    if chosen.shape != place.shape or not (chosen > 0).all():
        raise ValueError(f"there must be a positive step for each of the {place.size} numbers, got {chosen.tolist()}")
    base = build(*place.tolist())
    parts = []
    for unit, step in zip(np.eye(place.size), chosen, strict=True):
        near = [_geometry(base, build(*(place + k * step * unit).tolist())) for k, _ in WEIGHTS]
        parts.append(jax.tree.map(lambda *g, h=step: _difference(g) / h, *near))
    return jax.tree.map(lambda *rows: np.stack(rows), *parts)


def _difference(values: Sequence[NDArray[np.float64]]) -> NDArray[np.float64]:
    """An infinite shear area stays what it is."""
    finite = np.isfinite(values[0])
    weights = np.array([weight for _, weight in WEIGHTS])
    return np.tensordot(weights, np.where(finite, np.stack(values), 0.0), 1)


def _geometry(base: Frame, frame: Frame) -> Geometry:
    def joints(frame: Frame) -> tuple[object, ...]:
        members = tuple((m.name, m.start, m.end, m.through is None) for m in frame.members)
        return tuple(frame.nodes), members, frame.bodies, frame.clamps, frame.supports

    if joints(frame) != joints(base):
        raise ValueError("the numbers change what joins what: nodes, members, bodies and supports must stay the same")
    return geometry(frame_arrays(frame))

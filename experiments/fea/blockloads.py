"""Loads and motions of nodes as those of the blocks that the nonlinear solver moves; NumPy, units of order one."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from .arrays import FrameArrays
from .condensed import Space
from .planar import Planar
from .scaling import Units

Floats = NDArray[np.float64]


def dead_loads(arrays: FrameArrays, space: Space, unit: Units, coordinates: Floats, loads: Floats) -> Floats:
    """Loads of constant direction, (n_cases, n_nodes, 6) in N and N m, to (n_dead, n_blocks, n_cases).

    The coordinates, m, have the shape (3, n_nodes, n_cases or 1).
    """
    out = np.zeros((space.n_dead, arrays.n_blocks, len(loads)))
    for block, arm, force, moment in _each(arrays, unit, coordinates, loads):
        if isinstance(space, Planar):
            (x, y, _), (fx, fy, _) = arm, force
            out[:, block] += fx, fy, moment[2], x * fy - y * fx, x * fx + y * fy
        else:
            out[:, block] += np.concatenate([force, moment, (arm[:, None] * force).reshape(9, -1)])
    return out


def follower_loads(arrays: FrameArrays, space: Space, unit: Units, coordinates: Floats, loads: Floats) -> Floats:
    """Loads that turn with their body, (n_cases, n_nodes, 6) in N and N m, to (D, n_blocks, n_cases)."""
    out = np.zeros((6, arrays.n_blocks, len(loads)))
    for block, arm, force, moment in _each(arrays, unit, coordinates, loads):
        out[:, block] += np.concatenate([force, moment + np.cross(arm.T, force.T).T])
    return out[list(space.motions)]


def prescribed(arrays: FrameArrays, space: Space, unit: Units, motions: Floats) -> Floats:
    """Prescribed motions, (n_cases, n_nodes, 6) in m and rad, to (D, n_free, n_cases)."""
    out = np.zeros((6, arrays.n_free, len(motions)))
    scale = np.repeat([1 / unit.length, 1.0], 3)
    for node in np.flatnonzero(motions.any(axis=(0, 2))):
        out[:, arrays.block[node]] = (motions[:, node] * scale).T
    return out[list(space.motions)]


def _each(
    arrays: FrameArrays, unit: Units, coordinates: Floats, loads: Floats
) -> Iterator[tuple[int, Floats, Floats, Floats]]:
    """Block, arm from its origin, force and moment, (3, n_cases) each, of every node that is loaded in some case."""
    for node in np.flatnonzero(loads.any(axis=(0, 2))):
        arm = (coordinates[:, node] - coordinates[:, arrays.master[node]]) / unit.length
        force = loads[:, node, :3].T / unit.force
        yield arrays.block[node], arm, force, loads[:, node, 3:].T / (unit.force * unit.length)

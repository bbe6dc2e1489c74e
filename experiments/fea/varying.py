"""Small displacements of one frame in many geometries: a tolerance study, a search for dimensions.

Bodies are eliminated block by block: the cost grows with their number and not its cube, and all is compiled once.
"""

from collections.abc import Sequence
from functools import lru_cache
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.typing import ArrayLike
from numpy.typing import NDArray

from .arrays import FrameArrays, frame_arrays
from .between import joined, stiffness
from .blocks import cross
from .condensed import Topology, topology
from .elimination import solve
from .kernel import in_blocks, taken
from .loads import checked
from .mechanisms import check_held
from .model import Frame
from .nonlinear import CHUNK, chunks, filled, in_threads
from .precision import in_float64
from .scaling import Geometry
from .spatial import Spatial
from .tangent import prescribe

BLOCK = 32
"""Geometries that are worked on together; by measurement."""


def linear_displacements(
    frame: Frame, loads: ArrayLike, geometry: Geometry, nodes: Sequence[str]
) -> NDArray[np.float64]:
    """Small displacements of `nodes` under each load case in each geometry.

    Parameters
    ----------
    frame : Frame
        What joins what. Its supports hold without moving.
    loads : array-like, shape (n_loads, n_nodes, 6)
        N and N m, the same in all geometries.
    geometry : Geometry
        Coordinates and properties; the last axes are n_geometries or 1.
    nodes : sequence of str

    Returns
    -------
    ndarray, shape (n_geometries, n_loads, len(nodes), 6)
        m and rad.

    Raises
    ------
    ValueError
        If the loads have another shape or are not finite, a node is unknown, or the frame is free to move.
    """
    loads = checked("loads", frame, loads)
    arrays = frame_arrays(frame)
    check_held(frame, arrays)
    where = tuple(frame.index(node) for node in nodes)
    loaded = tuple(np.flatnonzero(loads.any(axis=(0, 2))).tolist())
    displaced = _compiled(frame, loaded, where)
    n = max(np.shape(leaf)[-1] for leaf in jax.tree.leaves(geometry))

    @in_float64
    def solved(rows: NDArray[np.int64]) -> NDArray[np.float64]:
        some = taken(geometry, filled(rows))
        some = some._replace(coordinates=np.broadcast_to(some.coordinates, (*np.shape(some.coordinates)[:-1], CHUNK)))
        return np.asarray(displaced(some, loads[:, list(loaded)]))[..., : len(rows)].transpose(3, 1, 2, 0)

    return np.concatenate(list(in_threads(solved, chunks(n))))


@lru_cache(maxsize=8)
def _compiled(frame: Frame, loaded: tuple[int, ...], where: tuple[int, ...]) -> Any:
    arrays = frame_arrays(frame)
    plan = topology(arrays, Spatial(), n_steps=0)

    def some(loads: Array, geometry: Geometry) -> Array:
        motion = _motions(arrays, plan, geometry, _on_blocks(arrays, geometry, loaded, loads))
        arm = _arms(arrays, geometry, where)
        at = motion[:, :, arrays.block[list(where)]]
        carried = cross(at[3:], jnp.broadcast_to(arm[:, None], at[3:].shape))
        return at.at[:3].add(carried)

    def blockwise(geometry: Geometry, loads: Array) -> Array:
        return in_blocks(lambda g: some(loads, g), BLOCK, geometry)

    return jax.jit(blockwise)


def _motions(arrays: FrameArrays, plan: Topology, geometry: Geometry, forces: Array) -> Array:
    """Of the blocks, (6, n_loads, n_blocks, n_points), SI."""
    blocks = stiffness(arrays, joined(arrays, plan.plan), geometry)
    right = forces[:, :, : plan.n_free]
    if plan.held.any():
        blocks, right = prescribe(plan, blocks, right, jnp.zeros_like(right))
    motion, _ = solve(plan.plan, blocks, right)
    return jnp.pad(motion, [(0, 0), (0, 0), (0, plan.n_blocks - plan.n_free), (0, 0)])


def _on_blocks(arrays: FrameArrays, geometry: Geometry, loaded: tuple[int, ...], loads: Array) -> Array:
    """Loads on the blocks about their origins, (6, n_loads, n_blocks, n_points), SI."""
    n_points = max(jnp.shape(leaf)[-1] for leaf in jax.tree.leaves(geometry))
    force = jnp.moveaxis(loads[..., :3], -1, 0)[..., None] + jnp.zeros(n_points)
    moment = jnp.moveaxis(loads[..., 3:], -1, 0)[..., None]
    arm = jnp.broadcast_to(_arms(arrays, geometry, loaded)[:, None], force.shape)
    wrench = jnp.concatenate([force, moment + cross(arm, force)])
    total = jnp.zeros((6, len(loads), arrays.n_blocks, n_points))
    for i, node in enumerate(loaded):
        total = total.at[:, :, arrays.block[node]].add(wrench[:, :, i])
    return total


def _arms(arrays: FrameArrays, geometry: Geometry, nodes: tuple[int, ...]) -> Array:
    """From the origins of their blocks to nodes, (3, n, n_points or 1), m."""
    x = jnp.asarray(geometry.coordinates)
    return x[:, list(nodes)] - x[:, arrays.master[list(nodes)]]

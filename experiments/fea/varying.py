"""Small displacements of one frame in many geometries: a tolerance study, a search for dimensions.

One Newton step from rest of the condensed frame is its linear solution, so bodies are eliminated block
by block: the cost grows with their number and not its cube, and all is compiled once.
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

from . import scaling
from .arrays import FrameArrays, frame_arrays
from .blocks import cross
from .condensed import Problem, State, Topology, topology
from .kernel import in_blocks, taken
from .loads import checked
from .mechanisms import check_held
from .model import Frame
from .nonlinear import CHUNK, chunks, in_threads
from .precision import in_float64
from .scaling import Geometry, Units
from .spatial import Spatial
from .tangent import step, tangent

N_STEPS, N_STEPS_ARC = 4, 32
"""Steps along members: the flexibility of a straight one is a cubic of the length, exact by any number."""


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
    steps = N_STEPS_ARC if arrays.is_curved.any() else N_STEPS
    solve = _compiled(frame, steps, loaded, where)
    n = max(np.shape(leaf)[-1] for leaf in jax.tree.leaves(geometry))

    @in_float64
    def solved(rows: NDArray[np.int64]) -> NDArray[np.float64]:
        full = rows[np.minimum(np.arange(CHUNK), len(rows) - 1)]
        found = np.asarray(solve(taken(geometry, full), loads[:, list(loaded)]))
        return np.broadcast_to(found, (*found.shape[:-1], CHUNK))[..., : len(rows)].transpose(3, 1, 2, 0)

    return np.concatenate(list(in_threads(solved, chunks(n))))


@lru_cache(maxsize=8)
def _compiled(frame: Frame, n_steps: int, loaded: tuple[int, ...], where: tuple[int, ...]) -> Any:
    arrays, space = frame_arrays(frame), Spatial()
    plan, units = topology(arrays, space, n_steps), scaling.units(arrays)

    def some(loads: Array, geometry: Geometry) -> Array:
        forces = _on_blocks(arrays, units, geometry, loaded, loads)
        motion = _motions(arrays, plan, units, geometry, forces)
        scale = jnp.array([units.length] * 3 + [1.0] * 3).reshape(6, 1, 1, 1)
        arm = _arms(arrays, geometry, where)
        at = scale * motion[:, :, arrays.block[list(where)]]
        carried = cross(at[3:], jnp.broadcast_to(arm[:, None], at[3:].shape))
        return at.at[:3].add(carried)

    def blockwise(geometry: Geometry, loads: Array) -> Array:
        return in_blocks(lambda g: some(loads, g), space.block, geometry)

    return jax.jit(blockwise)


def _motions(arrays: FrameArrays, plan: Topology, units: Units, geometry: Geometry, forces: Array) -> Array:
    """Of the blocks from rest, (6, n_loads, n_blocks, n_points)."""
    space, n_points = plan.space, forces.shape[-1]
    rods, rest, _ = scaling.condensed(arrays, space, units, plan.n_steps, geometry)
    zero = jnp.zeros(n_points)
    state = State(jnp.zeros((space.size, len(plan.start), n_points)), rest + zero)
    dead = jnp.zeros((space.n_dead, plan.n_blocks, 1))
    still = jnp.zeros((space.size, plan.n_free, n_points))
    problem = Problem(rods, rest, dead, dead[: space.size], still)
    _, twist, _ = space.law(state.wrench, rods, plan.n_steps)
    slope = tangent(plan, problem, state, zero, twist)
    n_loads = forces.shape[1]
    gap = jnp.zeros((space.size, n_loads, len(plan.start), n_points))
    ahead = jnp.zeros((space.size, n_loads, plan.n_free, n_points))
    return step(plan, slope, gap, forces[:, :, : plan.n_free], ahead).motion


def _on_blocks(arrays: FrameArrays, units: Units, geometry: Geometry, loaded: tuple[int, ...], loads: Array) -> Array:
    """Loads on the blocks about their origins, (6, n_loads, n_blocks, n_points), in units of order one."""
    n_points = max(jnp.shape(leaf)[-1] for leaf in jax.tree.leaves(geometry))
    force = jnp.moveaxis(loads[..., :3], -1, 0)[..., None] / units.force + jnp.zeros(n_points)
    moment = jnp.moveaxis(loads[..., 3:], -1, 0)[..., None] / (units.force * units.length)
    arm = jnp.broadcast_to((_arms(arrays, geometry, loaded) / units.length)[:, None], force.shape)
    wrench = jnp.concatenate([force, moment + cross(arm, force)])
    total = jnp.zeros((6, len(loads), arrays.n_blocks, n_points))
    for i, node in enumerate(loaded):
        total = total.at[:, :, arrays.block[node]].add(wrench[:, :, i])
    return total


def _arms(arrays: FrameArrays, geometry: Geometry, nodes: tuple[int, ...]) -> Array:
    """From the origins of their blocks to nodes, (3, n, n_points or 1), m."""
    x = jnp.asarray(geometry.coordinates)
    return x[:, list(nodes)] - x[:, arrays.master[list(nodes)]]

"""A frame for the nonlinear solver: whole numbers apart from the arrays, all lengths and forces of order one.

Units: a length L and a bending stiffness EI of the frame make forces multiples of EI / L², moments of
EI / L, and motions of L or radians.
"""

from dataclasses import dataclass
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from jax import Array
from numpy.typing import NDArray

from .arrays import FrameArrays
from .elimination import Pair, Plan, Sum, plan
from .planar import Planar
from .rods import Rods
from .spatial import Spatial

Space = Planar | Spatial


@dataclass(frozen=True, eq=False)
class Topology:
    """What joins what, settled when the frame is condensed.

    Parameters
    ----------
    space : Planar or Spatial
    n_steps : int
        Steps of the integration along each member.
    start, end : ndarray of int, shape (n_members,)
        Blocks that each member joins.
    n_free, n_blocks : int
        Blocks that may move, which come first, and all.
    held : ndarray of bool, shape (D, n_free, 1)
        Motions that are prescribed.
    plan : Plan
        How the stiffness of the free blocks is eliminated.
    stiffness : Sum
        Entries of the plan from the blocks of the members, in the order (start, start), (start, end),
        (end, start), (end, end), and those of the loads, one a block.
    columns : ndarray of int, shape (n_entries,)
        Block column of each entry of the plan.
    rows : Sum
        Blocks from the entries of their row.
    forces : Sum
        All blocks from the wrenches at the starts and ends of members, and those of the loads.
    """

    space: Space
    n_steps: int
    start: NDArray[np.int64]
    end: NDArray[np.int64]
    n_free: int
    n_blocks: int
    held: NDArray[np.bool_]
    plan: Plan
    stiffness: Sum
    columns: NDArray[np.int64]
    rows: Sum
    forces: Sum


class Problem(NamedTuple):
    """What is solved for a batch of points; the last axis of every array is n_points or 1.

    Parameters
    ----------
    rods : Rods
    rest : Array, shape (P, n_blocks, ...)
        Poses at rest.
    dead, follower : Array, shape (n_dead, n_blocks, ...) and (D, n_blocks, ...)
        Loads of constant direction, and loads that turn with their body.
    motion : Array, shape (D, n_free, ...)
        Prescribed motions, zero where none is.
    along : pytree of Array
        What the view that is handed out needs beside; the solver does not look at it.
    """

    rods: Rods
    rest: Array
    dead: Array
    follower: Array
    motion: Array
    along: Any = ()


class State(NamedTuple):
    """Wrenches at the starts of members in the axes of their bodies, (D, n_members, …), and poses (P, n_blocks, …)."""

    wrench: Array
    pose: Array


def topology(arrays: FrameArrays, space: Space, n_steps: int) -> Topology:
    """The topology of a frame: the same object for frames alike, so that what is compiled for one serves the other."""
    ends = tuple((a, b) for a, b in arrays.block[arrays.ends].tolist())
    held = arrays.held[: arrays.n_free, list(space.motions)]
    return _settled(space, n_steps, ends, arrays.n_free, arrays.n_blocks, tuple(map(tuple, held.tolist())))


@lru_cache(maxsize=32)  # as many as the kernel keeps programs
def _settled(
    space: Space, n_steps: int, ends: tuple[Pair, ...], n_free: int, n_blocks: int, held: tuple[tuple[bool, ...], ...]
) -> Topology:
    """From the blocks that each member joins, and the motions of each free block that are held."""
    n_members = len(ends)
    pattern = plan(n_free, [(a, b) for a, b in ends if a < n_free and b < n_free])
    place = {pair: i for i, pair in enumerate(pattern.entries)}

    entries: list[list[int]] = [[] for _ in place]
    bodies: list[list[int]] = [[] for _ in range(n_blocks)]
    for m, (a, b) in enumerate(ends):
        for corner, pair in enumerate([(a, a), (a, b), (b, a), (b, b)]):
            if pair in place:
                entries[place[pair]].append(corner * n_members + m)
        bodies[a].append(m)
        bodies[b].append(n_members + m)
    for block in range(n_blocks):
        bodies[block].append(2 * n_members + block)
        if block < n_free:
            entries[place[block, block]].append(4 * n_members + block)
    rows: list[list[int]] = [[] for _ in range(n_free)]
    for i, (row, _) in enumerate(pattern.entries):
        rows[row].append(i)
    start, end = np.array(ends, dtype=np.int64).T
    return Topology(
        space,
        n_steps,
        start,
        end,
        n_free,
        n_blocks,
        np.array(held, dtype=bool).reshape(n_free, space.size).T[:, :, None],
        pattern,
        Sum.of(entries),
        np.array([column for _, column in pattern.entries], dtype=np.int64),
        Sum.of(rows),
        Sum.of(bodies),
    )

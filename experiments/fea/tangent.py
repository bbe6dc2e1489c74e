"""Residual, tangent and Newton step of a condensed frame, for a batch of points at once.

The unknowns are the poses of the bodies and the wrenches of the members. Each member's law says where
its end is under its wrench; the gap to where the end is, and the forces that are left on the bodies,
are the residuals. A member's wrench is eliminated by the inverse of its own flexibility, and what is
left are the bodies, whose stiffness is eliminated block by block. Since wrenches are unknowns too, a
stiff direction costs no iterations, as it does where displacements are the only unknowns.

Notation: for a member from A to B with the wrench W = (n, m) on A, X takes a motion of A to that of
the point B that it would carry, so the wrench on B is −X⁻ᵀ W. The tangent is that of the spatially
parametrised rod (Simo and Vu-Quoc, Comput. Methods Appl. Mech. Engrg. 58 (1986), 79–116, §4),
condensed to its ends. It is symmetric at an equilibrium under dead forces.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from .blocks import inverse, multiply, transpose
from .condensed import Problem, State, Topology
from .elimination import solve


class Residual(NamedTuple):
    """What is not yet satisfied, in global axes.

    Parameters
    ----------
    gap : Array, shape (D, n_members, n_points)
        Motion from where the member's law puts its end to where that is.
    force : Array, shape (D, n_blocks, n_points)
        What members and loads exert on each block; on a held motion minus its reaction.
    ahead : Array, shape (D, n_free, n_points)
        Prescribed motion that is still to be made.
    """

    gap: Array
    force: Array
    ahead: Array


class Tangent(NamedTuple):
    """What turns residuals into steps.

    Parameters
    ----------
    turn, shift, stiffness : Array, shape (D, D, n_members, n_points)
        Axes of the start body; X; stiffness of the member about its end, in global axes.
    blocks : Array, shape (D, D, n_entries, n_points)
        Stiffness of the bodies, in the order of the plan.
    """

    turn: Array
    shift: Array
    stiffness: Array
    blocks: Array


class Step(NamedTuple):
    """Motions of all blocks (D, m, n_blocks, n_points), changes of the wrenches in body axes and of the relative motions
    (D, m, n_members, n_points), m of each, and how many pivots were negative (n_points,).
    """

    motion: Array
    wrench: Array
    relative: Array
    negative: Array


def residual(topology: Topology, problem: Problem, state: State, level: Array, law: Array) -> Residual:
    """Residual with loads and prescribed motions times `level`, (n_points,); `law` as from :func:`flexibility`."""
    space = topology.space
    start, end = state.pose[:, topology.start], state.pose[:, topology.end]
    turn = space.turn(start)
    gap = multiply(turn, space.gap(start, end, law)[:, None])[:, 0]
    wrench = multiply(turn, state.wrench[:, None])
    at_end = -multiply(transpose(space.shift(end, start)), wrench)
    dead, _ = space.dead(state.pose, problem.dead * level)
    follower, _ = space.follower(state.pose, problem.follower * level)
    force = topology.forces(jnp.concatenate([wrench[:, 0], at_end[:, 0], dead + follower], axis=1))
    free = slice(topology.n_free)
    goal = space.moved(problem.rest[:, free] + 0 * state.pose[:, free], problem.motion * level)
    ahead = jnp.where(topology.held, space.towards(goal, state.pose[:, free]), 0.0)
    return Residual(gap, force, ahead)


def tangent(topology: Topology, problem: Problem, state: State, level: Array, own: Array) -> Tangent:
    """Tangent at a state, which need not be an equilibrium; `own` as from :func:`flexibility`."""
    space = topology.space
    start, end = state.pose[:, topology.start], state.pose[:, topology.end]
    turn, shift = space.turn(start), space.shift(start, end)
    wrench = multiply(turn, state.wrench[:, None])[:, 0]
    own = multiply(multiply(turn, own), transpose(turn))
    stiffness, _ = inverse(multiply(own, transpose(shift)))

    swing, lever = space.swing(wrench), space.lever(wrench)
    back = transpose(space.shift(end, start))
    carried = multiply(stiffness, shift)
    corners = [
        multiply(transpose(shift), carried) + swing,
        -multiply(transpose(shift), stiffness),
        -carried - multiply(back, swing) - lever,
        stiffness + lever,
    ]
    free = slice(topology.n_free)
    _, dead = space.dead(state.pose[:, free], problem.dead[:, free] * level)
    _, follower = space.follower(state.pose[:, free], problem.follower[:, free] * level)
    blocks = topology.stiffness(jnp.concatenate([*corners, _as_blocks(topology, dead + follower)], axis=2))
    return Tangent(turn, shift, stiffness, blocks)


def flexibility(topology: Topology, problem: Problem, wrench: Array) -> tuple[Array, Array]:
    """Each member's law, (P, n_members, n_points), and the motion of its end per wrench at its start.

    The latter, (D, D, n_members, n_points), in the axes of the start body.
    """

    def law(wrench: Array) -> Array:
        return topology.space.law(wrench, problem.rods, topology.n_steps)

    pose, change = columns(topology, law, wrench)
    return pose, jax.vmap(topology.space.spin, in_axes=(None, 1), out_axes=1)(pose, change)


def columns(topology: Topology, function: Callable[[Array], Any], wrench: Array) -> tuple[Any, Any]:
    """`function` of the wrenches, and its change per component of them, on a new second axis of every array."""

    def column(direction: Array) -> tuple[Any, Any]:
        return jax.jvp(function, (wrench,), (jnp.broadcast_to(direction.reshape(-1, 1, 1), wrench.shape),))

    # The value does not depend on the direction, so it is computed once.
    return jax.vmap(column, out_axes=(None, 1))(jnp.eye(topology.space.size))


def step(topology: Topology, tangent: Tangent, gap: Array, force: Array, ahead: Array) -> Step:
    """Newton's step for m columns of residuals: gap (D, m, n_members, …), force and ahead (D, m, n_free, …)."""
    turn, shift, stiffness, blocks = tangent
    pull = multiply(stiffness, gap)
    none = jnp.zeros((*force.shape[:2], topology.n_blocks, force.shape[-1]))
    right = (
        force
        + topology.forces(jnp.concatenate([multiply(transpose(shift), pull), -pull, none], axis=2))[
            :, :, : topology.n_free
        ]
    )
    if topology.held.any():
        blocks, right = _held(topology, blocks, right, ahead)
    motion, negative = solve(topology.plan, blocks, right)
    motion = jnp.pad(motion, [(0, 0), (0, 0), (0, topology.n_blocks - topology.n_free), (0, 0)])
    relative = gap + motion[:, :, topology.end] - multiply(shift, motion[:, :, topology.start])
    wrench = multiply(transpose(turn), multiply(transpose(shift), multiply(stiffness, relative)))
    return Step(motion, wrench, relative, negative)


def _held(topology: Topology, blocks: Array, right: Array, ahead: Array) -> tuple[Array, Array]:
    """Rows of prescribed motions become δ = ahead, and what they do to the others goes to the right-hand side."""
    known = topology.rows(multiply(blocks, ahead[:, :, topology.columns]))
    held = topology.held[:, None]
    right = jnp.where(held, ahead, right - known)
    free = ~topology.held[:, :, 0]
    entry_rows = np.array([row for row, _ in topology.plan.entries])
    mask = free[:, None, entry_rows] & free[None, :, topology.columns]
    blocks = jnp.where(mask[..., None], blocks, 0.0)
    unit = jnp.zeros(blocks.shape[:3]).at[:, :, : topology.n_free].set(jnp.eye(len(free))[:, :, None] * ~free[None])
    return blocks + unit[..., None], right


def _as_blocks(topology: Topology, matrix: Array) -> Array:
    """Pad the stiffness of loads on the free blocks with zeros for the clamped."""
    return jnp.pad(matrix, [(0, 0), (0, 0), (0, topology.n_blocks - topology.n_free), (0, 0)])

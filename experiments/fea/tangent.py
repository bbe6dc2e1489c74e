"""Residual, tangent and Newton step of a condensed frame, for a batch of points at once.

The unknowns are the poses of the bodies and the wrenches of the members. Each member's law says where
its end is under its wrench; the gap to where the end is, and the forces that are left on the bodies,
are the residuals. A member's wrench is eliminated by the inverse of its own flexibility, and what is
left are the bodies, whose stiffness is eliminated block by block. Since wrenches are unknowns too, a
stiff direction costs no iterations, as it does where displacements are the only unknowns.

Notation: for a member from A to B with the wrench W = (n, m) on A, X takes a motion of A to that of
the point B that it would carry, so the wrench on B is −X⁻ᵀ W. With η the flexibility of the member
about A, δW = η⁻¹ (X⁻¹ (gap + δB) − δA). The tangent is that of the spatially
parametrised rod (Simo and Vu-Quoc, Comput. Methods Appl. Mech. Engrg. 58 (1986), 79–116, §4),
condensed to its ends. It is symmetric at an equilibrium under dead forces.
"""

from typing import NamedTuple

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
    turn, back, stiffness : Array, shape (D, D, n_members, n_points)
        Axes of the start body; X⁻¹; stiffness of the member about its start, in global axes.
    blocks : Array, shape (D, D, n_entries, n_points)
        Stiffness of the bodies, in the order of the plan.
    """

    turn: Array
    back: Array
    stiffness: Array
    blocks: Array


class Step(NamedTuple):
    """What is to be changed, in m columns.

    Parameters
    ----------
    motion : Array, shape (D, m, n_blocks, n_points)
        Of the blocks, in global axes.
    wrench : Array, shape (D, m, n_members, n_points)
        At the start of the members, in the axes of the body.
    relative : Array, shape (D, m, n_members, n_points)
        Motion of the members' ends relative to their starts, about these.
    negative : Array of int, shape (n_points,)
        How many pivots were negative.
    """

    motion: Array
    wrench: Array
    relative: Array
    negative: Array


def residual(topology: Topology, problem: Problem, state: State, level: Array, law: Array) -> Residual:
    """Residual with loads and prescribed motions times `level`; `law` is where the members put their ends."""
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


def tangent(topology: Topology, problem: Problem, state: State, level: Array, twist: Array) -> Tangent:
    """Tangent at a state, equilibrium or not; `twist` is the flexibility of the members about their starts."""
    space = topology.space
    start, end = state.pose[:, topology.start], state.pose[:, topology.end]
    turn, back = space.turn(start), space.shift(end, start)
    wrench = multiply(turn, state.wrench[:, None])[:, 0]
    stiffness = multiply(multiply(turn, inverse(twist)[0]), transpose(turn))

    swing, lever = space.swing(wrench), space.lever(wrench)
    to_end = multiply(stiffness, back)
    corners = [
        stiffness + swing,
        -to_end,
        -multiply(transpose(back), stiffness + swing) - lever,
        multiply(transpose(back), to_end) + lever,
    ]
    free = slice(topology.n_free)
    _, dead = space.dead(state.pose[:, free], problem.dead[:, free] * level)
    _, follower = space.follower(state.pose[:, free], problem.follower[:, free] * level)
    blocks = topology.stiffness(jnp.concatenate([*corners, _as_blocks(topology, dead + follower)], axis=2))
    return Tangent(turn, back, stiffness, blocks)


def step(topology: Topology, tangent: Tangent, gap: Array, force: Array, ahead: Array) -> Step:
    """Newton's step for m columns of residuals: gap (D, m, n_members, …), force and ahead (D, m, n_free, …)."""
    turn, back, stiffness, blocks = tangent
    pull = multiply(stiffness, multiply(back, gap))
    none = jnp.zeros((*force.shape[:2], topology.n_blocks, force.shape[-1]))
    pulls = jnp.concatenate([pull, -multiply(transpose(back), pull), none], axis=2)
    right = force + topology.forces(pulls)[:, :, : topology.n_free]
    if topology.held.any():
        blocks, right = prescribe(topology, blocks, right, ahead)
    motion, negative = solve(topology.plan, blocks, right)
    motion = jnp.pad(motion, [(0, 0), (0, 0), (0, topology.n_blocks - topology.n_free), (0, 0)])
    relative = multiply(back, gap + motion[:, :, topology.end]) - motion[:, :, topology.start]
    wrench = multiply(transpose(turn), multiply(stiffness, relative))
    return Step(motion, wrench, relative, negative)


def prescribe(topology: Topology, blocks: Array, right: Array, ahead: Array) -> tuple[Array, Array]:
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

"""Newton's method on a batch of points: at one go where it contracts at once, else along the load in steps.

A batch goes on until its slowest point is done, so the points that do not make it at one go are
gathered and sent again, in steps of their own size: halved where Newton's method does not contract,
doubled where it does so with ease. Nothing here raises: what becomes of a point is a number.

Source: Deuflhard, Newton Methods for Nonlinear Problems (2004), §5.1 (a step along a path is short
enough if the first corrections contract).
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from .condensed import Problem, State, Topology
from .flexibility import exact
from .rods import Along
from .tangent import Residual, Step, residual, step, tangent

ACTIVE, CONVERGED, FAILED = 0, 1, 2

SMALL = 1e-6
"""Largest correction, in lengths and radians, after which the next is believed to be smaller still."""

AIM, EXACT = 1e-10, 1e-8
"""What may be left undone; and, where rounding does not let it become that small, what must not be exceeded."""

CONTRACTION = 0.5
"""Corrections that shrink less than this end the attempt; in steps the first two are judged by their growth alone."""

EASE = 0.1
"""Corrections that shrink more than this let the next step be longer."""

MOST = 3.0
"""Largest correction, in lengths and radians, that is believed."""

PATIENCE = 12
"""Corrections in one attempt."""

SHORTEST = 2.0**-14
"""Fraction of the load below which a step is given up."""


class Evaluated(NamedTuple):
    """What was found at a state.

    Parameters
    ----------
    left : Residual
    met : Along
    direction : Array, shape (D, n_blocks, n_points)
        Motion per fraction of the load.
    negative : Array of int, shape (n_points,)
        Negative pivots of the stiffness of the bodies.
    undone : Array, shape (n_points,)
        Largest gap in lengths and radians, or force over the largest in a member, that is left.
    """

    left: Residual
    met: Along
    direction: Array
    negative: Array
    undone: Array


class March(NamedTuple):
    """Where each point is; all arrays but the states have shape (n_points,).

    Parameters
    ----------
    state, base : State
        The current iterate, and the equilibrium that the attempt started from.
    done, target, stride : Array
        Fraction of the load at `base`, that aimed at, and their difference when it was chosen.
    size, first : Array
        Last correction, and the contraction of the first two in this attempt.
    tries, iterations : Array of int
        Corrections in this attempt, and in all.
    status : Array of int
    outset : Array, shape (D, n_blocks, n_points)
        Motion of the very first correction.
    """

    state: State
    base: State
    done: Array
    target: Array
    stride: Array
    size: Array
    first: Array
    tries: Array
    iterations: Array
    status: Array
    outset: Array


def begin(topology: Topology, problem: Problem, stride: Array) -> March:
    """At rest, aiming at the fraction `stride` of the load, shape (n_points,); a point of stride zero stays there."""
    zero = jnp.zeros_like(stride)
    n_members = len(topology.start)
    wrench = jnp.zeros((topology.space.size, n_members, len(stride)))
    state = State(wrench, problem.rest + zero)
    none = jnp.zeros(stride.shape, int)
    status = jnp.where(stride > 0, ACTIVE, FAILED)
    outset = jnp.zeros((topology.space.size, topology.n_blocks, len(stride)))
    return March(state, state, zero, stride, stride, zero, zero, none, none, status, outset)


def march(topology: Topology, problem: Problem, start: March, in_steps: bool, most: int) -> tuple[March, Evaluated]:
    """Go on until no point is active, or `most` corrections are made; unless `in_steps`, the first attempt decides.

    In steps, tangents are exact: the points that come to that are the hard ones.

    A point is done when what an evaluation finds undone is small enough, and is left as it is, so that
    what the last evaluation found belongs to the states that are handed out.
    """

    def go_on(carry: tuple[March, Evaluated, Array]) -> Array:
        now, _, count = carry
        return jnp.any(now.status == ACTIVE) & (count < most)

    def correct(carry: tuple[March, Evaluated, Array]) -> tuple[March, Evaluated, Array]:
        now, _, count = carry
        taken, found = evaluate(topology, problem, now.state, now.target, in_steps)
        motion, relative = taken.motion[:, 0], taken.relative[:, 0]
        moved = State(now.state.wrench + taken.wrench[:, 0], topology.space.moved(now.state.pose, motion))
        outset = jnp.where(now.iterations == 0, motion, now.outset)
        size = jnp.maximum(largest(motion), largest(relative))
        return _next(now._replace(outset=outset), moved, size, found.undone, in_steps), found, count + 1

    shape = jax.eval_shape(lambda: evaluate(topology, problem, start.state, start.target, in_steps)[1])
    nothing = jax.tree.map(lambda x: jnp.zeros(x.shape, x.dtype), shape)
    return jax.lax.while_loop(go_on, correct, (start, nothing, jnp.array(0)))[:2]


def evaluate(topology: Topology, problem: Problem, state: State, level: Array, exactly: bool) -> tuple[Step, Evaluated]:
    """A step of two columns, Newton's correction and the change per fraction of the load, and what was found.

    With the flexibility that comes along with the law or, `exactly`, with the derivative of the law.
    """
    space, free = topology.space, slice(topology.n_free)
    law, twist, met = space.law(state.wrench, problem.rods, topology.n_steps)
    if exactly:
        _, twist = exact(topology, problem.rods, state.wrench)
        met = met._replace(twist=met.twist.at[:, :, -1].set(twist))
    left = residual(topology, problem, state, level, law)
    slope = tangent(topology, problem, state, level, twist)
    dead, _ = space.dead(state.pose[:, free], problem.dead[:, free])
    follower, _ = space.follower(state.pose[:, free], problem.follower[:, free])
    taken = step(
        topology,
        slope,
        jnp.stack([left.gap, jnp.zeros_like(left.gap)], axis=1),
        jnp.stack([left.force[:, free], dead + follower], axis=1),
        jnp.stack([left.ahead, problem.motion + jnp.zeros_like(left.ahead)], axis=1),
    )
    return taken, Evaluated(left, met, taken.motion[:, 1], taken.negative, _undone(topology, state, left))


def _undone(topology: Topology, state: State, left: Residual) -> Array:
    force = jnp.where(topology.held, 0.0, left.force[:, : topology.n_free])
    tiny = jnp.finfo(force.dtype).tiny
    missed = largest(force) / jnp.maximum(largest(state.wrench), tiny)
    return jnp.maximum(jnp.maximum(largest(left.gap), largest(left.ahead)), missed)


def largest(values: Array) -> Array:
    """Largest magnitude of all but the last axis; NaN where one is."""
    return jnp.max(jnp.abs(values), axis=tuple(range(values.ndim - 1)), initial=0.0)


def _next(now: March, state: State, size: Array, undone: Array, in_steps: bool) -> March:
    """What an evaluation, and the correction that it gives, mean for each point."""
    active = now.status == ACTIVE
    exact = (undone < AIM) | ((undone < EXACT) & (now.tries >= PATIENCE))
    final = active & (now.target >= 1.0) & (now.tries > 0) & (now.size < SMALL) & exact
    tries = now.tries + 1
    again = tries > 1
    contraction = size / jnp.where(again, now.size, 1.0)
    first = jnp.where(tries == 2, contraction, now.first)
    most = jnp.where(tries == 2, 1.0, CONTRACTION) if in_steps else CONTRACTION
    bad = ~jnp.isfinite(size) | (size > MOST) | (again & (contraction > most) & (size > SMALL))
    between = active & ~bad & (size < SMALL) & (now.target < 1.0)
    back = active & ~final & ~between & (bad | (tries > PATIENCE))
    arrived = final | between
    state = _where(active & ~final, state, now.state)

    longer = jnp.where((tries <= 2) | (first < EASE), 2 * now.stride, now.stride)
    stride = jnp.where(between, longer, jnp.where(back, now.stride / 2, now.stride))
    done = jnp.where(arrived, now.target, now.done)
    status = jnp.where(final, CONVERGED, now.status)
    status = jnp.where(back & ((stride < SHORTEST) if in_steps else True), FAILED, status)
    anew = between | back
    return now._replace(
        state=_where(back, now.base, state),
        base=_where(between, state, now.base),
        done=done,
        target=jnp.where(anew, jnp.minimum(1.0, done + stride), now.target),
        stride=stride,
        size=size,
        first=jnp.where(anew, 0.0, first),
        tries=jnp.where(anew, 0, tries),
        iterations=now.iterations + (active & ~final),
        status=status,
    )


def _where(mask: Array, one: State, other: State) -> State:
    return State(*(jnp.where(mask, a, b) for a, b in zip(one, other, strict=True)))

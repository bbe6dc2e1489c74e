"""What is read off equilibria, and its derivatives with respect to loads and prescribed motions.

By the implicit function theorem: at an equilibrium the residual stays zero, so the state changes by a
Newton step on the change of the residual. The tangent here is that of the law as it is integrated,
by differentiation of the integration, so the derivatives are those of the answers to rounding.
"""

from collections.abc import Callable
from functools import lru_cache
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from numpy.typing import NDArray

from .conclusion import Conclusion
from .condensed import Problem, State, Topology
from .flexibility import exact
from .scaling import Units
from .tangent import residual, step, tangent


class Answer(NamedTuple):
    """What can be read off equilibria, SI units; the points come last.

    Parameters
    ----------
    motion : Array, shape (6, n_blocks, n_points)
        Translation and rotation vector of the origin of each block, m and rad.
    force : Array, shape (6, n_blocks, n_points)
        What members and loads exert on each block; minus the reaction where it is held. N and N m.
    internal : Array, shape (6, n_steps + 1, n_members, n_points)
        N, Vy, Vz, T, My, Mz along the members, in section axes.
    """

    motion: Array
    force: Array
    internal: Array


class Directions(NamedTuple):
    """m directions in which loads and prescribed motions change; arrays as in :class:`.condensed.Problem`, m first."""

    dead: Array
    follower: Array
    motion: Array


class Reading(NamedTuple):
    """What was read off a batch of cases.

    Parameters
    ----------
    values : ndarray, shape (n_cases, n_values)
        NaN where a case has no answer.
    ok : ndarray of bool, shape (n_cases,)
    reasons : tuple of str
        Why a case has no answer; empty where it has.
    """

    values: NDArray[np.float64]
    ok: NDArray[np.bool_]
    reasons: tuple[str, ...]


Read = Callable[[Answer], Array]
"""From answers to responses, (n_responses, n_points); traceable."""


class Frozen:
    """An array that can be a key: equal where the numbers are."""

    def __init__(self, values: NDArray[np.float64]) -> None:
        self.values = values
        self._key = (values.shape, values.tobytes())

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Frozen) and self._key == other._key

    def __hash__(self) -> int:
        return hash(self._key)


@lru_cache(maxsize=32)
def differentiating(read: Read, units: Units, *directions: Frozen) -> Any:
    """The view of the solver that gives the derivatives of what `read` reads along `directions`."""

    def view(topology: Topology, problem: Problem, state: State, found: Conclusion) -> Array:
        along = Directions(*(jnp.asarray(part.values) for part in directions))
        return rates(topology, units, read, problem, state, along)

    return view


def rates(topology: Topology, units: Units, read: Read, problem: Problem, state: State, along: Directions) -> Array:
    """Change of what is read per unit of each direction, (n_responses, m, n_points), at equilibria."""
    space, free = topology.space, slice(topology.n_free)
    level = jnp.ones(state.wrench.shape[-1])
    law, twist = exact(topology, problem.rods, state.wrench)
    slope = tangent(topology, problem, state, level, twist)

    def changed(direction: Directions) -> Problem:
        return problem._replace(**direction._asdict())

    def left(given: Directions) -> tuple[Array, Array]:
        found = residual(topology, changed(given), state, level, law)
        return found.force[:, free], found.ahead

    def answer(state: State, given: Directions) -> Array:
        return read(answers(topology, units, changed(given), state))

    given = Directions(problem.dead, problem.follower, problem.motion)
    along = Directions(*(jnp.broadcast_to(a, (len(a), *g.shape)) for a, g in zip(along, given, strict=True)))
    forces, ahead = jax.vmap(lambda d: jax.jvp(left, (given,), (d,))[1], out_axes=1)(along)
    gap = jnp.zeros((*forces.shape[:2], *state.wrench.shape[1:]))
    taken = step(topology, slope, gap, forces, ahead)

    def rate(motion: Array, wrench: Array, direction: Directions) -> Array:
        _, pose = jax.jvp(lambda m: space.moved(state.pose, m), (jnp.zeros_like(motion),), (motion,))
        return jax.jvp(answer, (state, given), (State(wrench, pose), direction))[1]

    return jax.vmap(rate, in_axes=(1, 1, 0), out_axes=1)(taken.motion, taken.wrench, along)


def answers(topology: Topology, units: Units, problem: Problem, state: State) -> Answer:
    """Answers of equilibria in SI units, as :class:`.conclusion.Conclusion` has them, but traceable from the state."""
    space = topology.space
    law, _, met = space.law(state.wrench, problem.rods, topology.n_steps)
    force = residual(topology, problem, state, jnp.ones(state.wrench.shape[-1]), law).force
    motion = space.towards(state.pose, problem.rest + 0 * state.pose)
    return in_si(topology, units, motion, force, met.internal)


@lru_cache(maxsize=32)
def reading(read: Read, units: Units) -> Any:
    """The view of the solver that gives what `read` reads."""

    def view(topology: Topology, problem: Problem, state: State, found: Conclusion) -> Array:
        return read(in_si(topology, units, found.motion, found.force, found.internal))

    return view


def in_si(topology: Topology, units: Units, motion: Array, force: Array, internal: Array) -> Answer:
    """From D motions in units of order one to six in SI units."""
    forces = jnp.array([units.force] * 3 + [units.force * units.length] * 3)
    lengths = jnp.array([units.length] * 3 + [1.0] * 3)

    def real(values: Array, scale: Array) -> Array:
        full = jnp.zeros((6, *values.shape[1:])).at[jnp.array(topology.space.motions)].set(values)
        return full * scale.reshape(6, *(1,) * (values.ndim - 1))

    return Answer(real(motion, lengths), real(force, forces), real(internal, forces))

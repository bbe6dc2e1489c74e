"""What is read off equilibria, and its derivatives with respect to loads, prescribed motions and geometry.

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
from .rods import Rods
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
    """m directions in which a problem changes; arrays as in :class:`.condensed.Problem`, m first.

    Without `rods` and `rest` the members and the places of the bodies stay as they are.
    """

    dead: Array
    follower: Array
    motion: Array
    rods: Rods | None = None
    rest: Array | None = None


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


@lru_cache(maxsize=32)
def differentiating(read: Read, units: Units) -> Any:
    """The view of the solver that gives the derivatives of what `read` reads along ``problem.along``."""

    def view(topology: Topology, problem: Problem, state: State, found: Conclusion) -> Array:
        return rates(topology, units, read, problem, state, problem.along)

    return view


def rates(topology: Topology, units: Units, read: Read, problem: Problem, state: State, along: Directions) -> Array:
    """Change of what is read per unit of each direction, (n_responses, m, n_points), at equilibria."""
    space, free = topology.space, slice(topology.n_free)
    level = jnp.ones(state.wrench.shape[-1])
    law, twist = exact(topology, problem.rods, state.wrench)
    slope = tangent(topology, problem, state, level, twist)
    given, along = _alike(problem, along, len(level))

    def placed(given: Directions) -> Array:
        """Poses of the blocks, those that cannot move where they are at rest."""
        if given.rest is None:
            return state.pose
        return jnp.concatenate([state.pose[:, free], given.rest[:, topology.n_free :]], axis=1)

    def left(given: Directions) -> tuple[Array, Array, Array]:
        changed = _changed(problem, given)
        ends = law if given.rods is None else space.law(state.wrench, given.rods, topology.n_steps)[0]
        found = residual(topology, changed, State(state.wrench, placed(given)), level, ends)
        return found.gap, found.force[:, free], found.ahead

    right = jax.vmap(lambda d: jax.jvp(left, (given,), (d,))[1], out_axes=1)(along)
    taken = step(topology, slope, *right)

    def answer(motion: Array, wrench: Array, given: Directions) -> Array:
        moved = State(wrench, space.moved(placed(given), motion))
        return read(answers(topology, units, _changed(problem, given), moved))

    def rate(motion: Array, wrench: Array, direction: Directions) -> Array:
        at = (jnp.zeros_like(motion), state.wrench, given)
        return jax.jvp(answer, at, (motion, wrench, direction))[1]

    return jax.vmap(rate, in_axes=(1, 1, 0), out_axes=1)(taken.motion, taken.wrench, along)


def _alike(problem: Problem, along: Directions, n_points: int) -> tuple[Directions, Directions]:
    """What changes, and its directions, with all points in both."""
    given = Directions(problem.dead, problem.follower, problem.motion)
    if along.rods is not None:
        given = given._replace(rods=problem.rods, rest=problem.rest)
    given = jax.tree.map(lambda g: jnp.broadcast_to(g, (*g.shape[:-1], n_points)), given)
    return given, jax.tree.map(lambda a, g: jnp.broadcast_to(a, (len(a), *g.shape)), along, given)


def _changed(problem: Problem, given: Directions) -> Problem:
    return problem._replace(**{name: value for name, value in given._asdict().items() if value is not None})


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

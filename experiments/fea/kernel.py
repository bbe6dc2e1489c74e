"""The compiled heart of the nonlinear solver: problems of one topology, in units of order one, a chunk at a time."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from numpy.typing import NDArray

from .conclusion import Conclusion, conclude
from .condensed import Problem, State, Topology
from .newton import CONVERGED, March, begin, march
from .scaling import Units
from .sensitivity import Directions, Read, rates

MOST_AT_ONCE, MOST_IN_STEPS = 16, 4000
"""Newton corrections after which a chunk is given up."""

ASTRAY = 0.25
"""A state found at one go this far, relatively, from where a smooth path would lead is looked for again in steps."""

EXACT = 1e-8
"""Residual above which a state is no equilibrium."""

TURN = 0.5
"""Largest prescribed motion, in lengths and radians, of a first step: turns beyond π would be made the other way."""


class Settled(NamedTuple):
    """What became of the points of a chunk; NumPy arrays with the points last.

    Parameters
    ----------
    state : State
    conclusion : Conclusion
        Of that state, if it is an equilibrium at the full load.
    arrived : ndarray of bool, shape (n_points,)
        Whether Newton's method got to the full load.
    reached : ndarray, shape (n_points,)
        Fraction of the load up to which it got.
    iterations : ndarray of int, shape (n_points,)
        All corrections that were made.
    """

    state: State
    conclusion: Conclusion
    arrived: NDArray[np.bool_]
    reached: NDArray[np.float64]
    iterations: NDArray[np.int64]

    def is_sound(self, only_stable: bool) -> NDArray[np.bool_]:
        """Which points are equilibria, and stable if that is asked for."""
        sound = self.arrived & (self.conclusion.residual < EXACT)
        return sound & (self.conclusion.unstable == 0) if only_stable else sound


@dataclass(frozen=True, eq=False)
class Kernel:
    """Compiled functions of one topology and one size of chunk; to be used in a float64 scope."""

    topology: Topology

    def settle(self, problem: Problem, n: int, only_stable: bool = True) -> Settled:
        """Equilibria of the first `n` points: all at one go; what that does not find beyond doubt, in steps."""
        n_points = problem.dead.shape[-1]
        first = self._tried(problem, np.ones(n_points), False, MOST_AT_ONCE)
        again = ~first.arrived | (first.conclusion.astray > ASTRAY)
        if only_stable:
            again |= first.conclusion.unstable > 0
        chosen = np.flatnonzero(again[:n])
        if not chosen.size:
            return first
        rows = np.resize(chosen, n_points)
        hard = taken(problem, rows)
        far = np.abs(hard.motion).max(axis=(0, 1), initial=0.0)
        stride = np.minimum(0.5, TURN / np.maximum(far, TURN)) + np.zeros(n_points)
        second = self._tried(hard, stride, True, MOST_IN_STEPS)
        second = second._replace(iterations=first.iterations[rows] + second.iterations)
        return jax.tree.map(lambda a, b: _replaced(a, chosen, b), first, second)

    def _tried(self, problem: Problem, stride: NDArray[np.float64], in_steps: bool, most: int) -> Settled:
        found, conclusion = self._solve(problem, stride, np.array(in_steps), np.array(most))
        state, conclusion, done, status, iterations = jax.tree.map(
            np.asarray, (found.state, conclusion, found.done, found.status, found.iterations)
        )
        return Settled(state, conclusion, status == CONVERGED, done, iterations)

    @cached_property
    def _solve(self) -> Any:
        def from_rest(problem: Problem, stride: Array, in_steps: Array, most: Array) -> tuple[March, Conclusion]:
            found = march(self.topology, problem, begin(self.topology, problem, stride), in_steps, most)
            return found, conclude(self.topology, problem, found.state, found.outset)

        def blockwise(problem: Problem, stride: Array, in_steps: Array, most: Array) -> tuple[March, Conclusion]:
            return in_blocks(lambda p, s: from_rest(p, s, in_steps, most), self.topology.space.block, problem, stride)

        return jax.jit(blockwise)

    def rates(self, read: Read, units: Units, problem: Problem, state: State, along: Directions) -> NDArray[np.float64]:
        """:func:`.sensitivity.rates`, compiled once for each `read`."""
        return np.array(_compiled_rates(self.topology, units, read)(problem, state, along))


@lru_cache(maxsize=16)
def _compiled_rates(topology: Topology, units: Units, read: Read) -> Any:
    def blockwise(problem: Problem, state: State, along: Directions) -> Array:
        def some(problem: Problem, state: State) -> Array:
            return rates(topology, units, read, problem, state, along)

        return in_blocks(some, topology.space.block, problem, state)

    return jax.jit(blockwise)


def in_blocks(function: Callable[..., Any], size: int, *given: Any) -> Any:
    """`function` of `size` points at a time, so that what it works on stays in the cache.

    The last axis of every array is that of the points, whose number is a multiple of `size`, or 1.
    """
    leaves, tree = jax.tree.flatten(given)
    n_points = max(leaf.shape[-1] for leaf in leaves)
    own = [leaf.shape[-1] > 1 for leaf in leaves]

    def split(x: Array) -> Array:
        return jnp.moveaxis(x.reshape(*x.shape[:-1], -1, size), -2, 0)

    def one(block: list[Array]) -> Any:
        parts = iter(block)
        return function(*jax.tree.unflatten(tree, [next(parts) if o else x for x, o in zip(leaves, own, strict=True)]))

    answers = jax.lax.map(one, [split(x) for x, o in zip(leaves, own, strict=True) if o])
    return jax.tree.map(lambda x: jnp.moveaxis(x, 0, -2).reshape(*x.shape[1:-1], n_points), answers)


def taken(tree: Any, rows: NDArray[np.int64]) -> Any:
    """The points `rows` of every array of `tree`; an array that is the same for all points stays as it is."""
    return jax.tree.map(lambda x: x[..., rows] if np.shape(x)[-1] > 1 else x, tree)


def _replaced(whole: NDArray[Any], chosen: NDArray[np.int64], by: NDArray[Any]) -> NDArray[Any]:
    out = np.array(whole)
    out[..., chosen] = by[..., : len(chosen)]
    return out

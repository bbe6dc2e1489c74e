"""The compiled heart of the nonlinear solver: problems of one topology, in units of order one, a chunk at a time."""

from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any, NamedTuple

import jax
import numpy as np
from numpy.typing import NDArray

from .conclusion import Conclusion, conclude
from .condensed import Problem, State, Topology
from .newton import CONVERGED, March, begin, march

MOST_AT_ONCE, MOST_IN_STEPS = 16, 4000
"""Newton corrections after which a chunk is given up."""

ASTRAY = 0.25
"""A state found at one go this far, relatively, from where a smooth path would lead is looked for again in steps."""

TURN = 0.5
"""Largest prescribed motion, in lengths and radians, of the first step: a turn by more than π would be made the other way."""


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
        found = self._march(problem, stride, np.array(in_steps), np.array(most))
        conclusion = self._conclude(problem, found.state, found.outset)
        state, conclusion, done, status, iterations = jax.tree.map(
            np.asarray, (found.state, conclusion, found.done, found.status, found.iterations)
        )
        return Settled(state, conclusion, status == CONVERGED, done, iterations)

    @cached_property
    def _march(self) -> Any:
        def from_rest(problem: Problem, stride: Any, in_steps: Any, most: Any) -> March:
            return march(self.topology, problem, begin(self.topology, problem, stride), in_steps, most)

        return jax.jit(from_rest)

    @cached_property
    def _conclude(self) -> Any:
        return jax.jit(partial(conclude, self.topology))


def taken(tree: Any, rows: NDArray[np.int64]) -> Any:
    """The points `rows` of every array of `tree`; an array that is the same for all points stays as it is."""
    return jax.tree.map(lambda x: x[..., rows] if np.shape(x)[-1] > 1 else x, tree)


def _replaced(whole: NDArray[Any], chosen: NDArray[np.int64], by: NDArray[Any]) -> NDArray[Any]:
    out = np.array(whole)
    out[..., chosen] = by[..., : len(chosen)]
    return out

"""The compiled heart of the nonlinear solver: problems of one topology, in units of order one, a chunk at a time."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from numpy.typing import NDArray

from .conclusion import Conclusion, conclude
from .condensed import Problem, State, Topology
from .newton import CONVERGED, EXACT, begin, evaluate, march

MOST_AT_ONCE, MOST_IN_STEPS = 16, 1500
"""Newton corrections after which a chunk is given up."""

ASTRAY = 0.25
"""A state found at one go this far, relatively, from where a smooth path would lead is looked for again in steps."""

TURN = 0.5
"""Largest prescribed motion, in lengths and radians, of a first step: turns beyond π would be made the other way."""


Numbers = Any
"""An array: JAX's where it is compiled, NumPy's where it has come out."""

View = Callable[[Topology, Problem, State, Conclusion], Any]
"""What is handed out of the compiled part: arrays with the points last, of converged states."""


class Settled(NamedTuple):
    """What became of the points of a chunk; NumPy arrays with the points last, (n_points,) if nothing else is said.

    Parameters
    ----------
    seen : pytree of ndarray
        The view, for what it is worth.
    arrived : ndarray of bool
        Whether Newton's method got to the full load.
    reached, residual, astray : ndarray
        Fraction of the load up to which it got; see :class:`.conclusion.Conclusion` for the others.
    unstable, iterations : ndarray of int
        Unstable modes, and all corrections that were made.
    """

    seen: Any
    arrived: Numbers
    reached: Numbers
    residual: Numbers
    astray: Numbers
    unstable: Numbers
    iterations: Numbers

    def is_sound(self, only_stable: bool) -> NDArray[np.bool_]:
        """Which points are equilibria, and stable if that is asked for."""
        sound = self.arrived & (self.residual < EXACT)
        return sound & (self.unstable == 0) if only_stable else sound

    def reasons(self, only_stable: bool) -> tuple[str, ...]:
        """Why a point has no answer; empty where it has."""
        sound = self.is_sound(only_stable)
        return tuple("" if fine else self._reason(i, only_stable) for i, fine in enumerate(sound))

    def _reason(self, i: int, only_stable: bool) -> str:
        if not self.arrived[i]:
            found = f"no equilibrium was found beyond {self.reached[i]:.1%} of the load"
            if self.iterations[i] > MOST_IN_STEPS:
                return f"{found} in {MOST_IN_STEPS} corrections: load it less, or follow the path"
            return f"{found}: it snaps, buckles or is out of reach there; load it less, or follow the path"
        if self.unstable[i] and only_stable:
            modes = "one mode" if self.unstable[i] == 1 else f"{self.unstable[i]} modes"
            return f"the equilibrium at the full load is unstable in {modes}: the mechanism has buckled; load it less"
        left = f"a residual of {self.residual[i]:.1g} is left, more than {EXACT:g}"
        return f"{left}: its stiffnesses are too uneven for float64"


@dataclass(frozen=True, eq=False)
class Kernel:
    """Compiled functions of one topology; to be used in a float64 scope."""

    topology: Topology

    def settle(self, problem: Problem, view: View, only_stable: bool, n_cases: int) -> Settled:
        """Equilibria of the first `n_cases` points: all at one go; what that does not find beyond doubt, in steps.

        The others only fill the chunk: they stay at rest, so that blocks of them cost nothing.
        """
        n_points = problem.dead.shape[-1]
        asked = np.arange(n_points) < n_cases
        first = self._tried(problem, view, asked.astype(np.float64), False, MOST_AT_ONCE)
        chosen = np.flatnonzero(asked & (~first.is_sound(only_stable) | (first.astray > ASTRAY)))
        if not chosen.size:
            return first
        rows = np.resize(chosen, n_points)
        hard = taken(problem, rows)
        far = np.abs(hard.motion).max(axis=(0, 1), initial=0.0)
        stride = np.minimum(0.5, TURN / np.maximum(far, TURN)) + np.zeros(n_points)
        stride[len(chosen) :] = 0.0
        second = self._tried(hard, view, stride, True, MOST_IN_STEPS)
        second = second._replace(iterations=first.iterations[rows] + second.iterations)
        return jax.tree.map(lambda a, b: _replaced(a, chosen, b), first, second)

    def _tried(self, problem: Problem, view: View, stride: NDArray[np.float64], in_steps: bool, most: int) -> Settled:
        found = _compiled(self.topology, view, in_steps, most)(problem, stride)
        return Settled(*jax.tree.map(np.asarray, found))


@lru_cache(maxsize=32)
def _compiled(topology: Topology, view: View, in_steps: bool, most: int) -> Any:
    def from_rest(problem: Problem, stride: Array) -> Settled:
        found, last = march(topology, problem, begin(topology, problem, stride), in_steps, most)
        if in_steps:  # Stability is judged alike, however a point was reached.
            _, last = evaluate(topology, problem, found.state, found.target, exactly=False)
        worth = conclude(topology, problem, found.state, found.outset, last)
        arrived = found.status == CONVERGED
        unstable = jnp.where(arrived, worth.unstable, 0)
        seen = view(topology, problem, found.state, worth)
        return Settled(seen, arrived, found.done, worth.residual, worth.astray, unstable, found.iterations)

    def blockwise(problem: Problem, stride: Array) -> Settled:
        return in_blocks(from_rest, topology.space.block, problem, stride)

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

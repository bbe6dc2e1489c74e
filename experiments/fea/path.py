"""Along an equilibrium path, past limit points: arc length instead of load.

The step is a length in the space of the motions of the bodies; the fraction of the load is an unknown
like the others. The corrections are normal to the predictor, and the step is halved where they do not
contract. Where the load has an extremum along the path the point is found by secants; if it is not, that is told.

Sources: Riks, Int. J. Solids Structures 15 (1979), 529–551; Ramm, in Nonlinear Finite Element Analysis
in Structural Mechanics (1981), 63–89 (the normal that is used).
"""

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
from .newton import AIM, CONTRACTION, EASE, EXACT, PATIENCE, Evaluated, evaluate, largest
from .tangent import Step

SMALL = 1e-7
"""Last correction, in lengths and radians, at a point of a path: the next would be its square."""

SHORTEST = 1e-4
"""Fraction of the first step below which the path is given up."""

LIMIT = 1e-8
"""Change of the load per arc length, beside its largest on the path, that is taken for zero at a limit point."""


class PathPoint(NamedTuple):
    """A point of a path; arrays as in the kernel, of one point.

    Parameters
    ----------
    state : State
    level : float
        Fraction of the load.
    arc : float
        Length of the path from rest, in lengths and radians.
    slope : float
        Change of the level per arc length: its sign turns at a limit point.
    conclusion : Conclusion
    iterations : int
    is_limit : bool
    """

    state: State
    level: float
    arc: float
    slope: float
    conclusion: Conclusion
    iterations: int
    is_limit: bool


@dataclass(frozen=True)
class Follower:
    """Settings of a path.

    Parameters
    ----------
    step : float
        First arc length, in mean lengths of members and radians: the root of the sum of the squares of
        the motions of all bodies.
    most : int
        Points after which the path ends.
    levels : tuple of 2 float
        Fractions of the load at which it ends.

    Raises
    ------
    ValueError
        If the step is not positive, there is no point to find, or the levels do not enclose zero.
    """

    step: float = 0.1
    most: int = 200
    levels: tuple[float, float] = (-np.inf, np.inf)

    def __post_init__(self) -> None:
        if not self.step > 0:
            raise ValueError(f"step must be a positive arc length, got {self.step}")
        if self.most < 1:
            raise ValueError(f"most must be at least one point, got {self.most}")
        if not self.levels[0] <= 0 < self.levels[1]:
            raise ValueError(f"levels must enclose 0, where the path starts, got {self.levels}")

    def follow(self, topology: Topology, problem: Problem) -> tuple[list[PathPoint], str, list[str]]:
        """Points of the path from rest, why it ended, and the limit points passed that were not found.

        `problem` is of one point.
        """
        walk = _Walk(topology, problem)
        points, step, heading, why = [walk.rest()], self.step, None, ""
        missed: list[str] = []
        while len(points) <= self.most:
            found, ease, direction = walk.advance(points[-1], step, heading)
            if found is None:
                step /= 2
                if step < SHORTEST * self.step:
                    why = "the corrections do not contract however short the step is: a bifurcation, or a loose mode"
                    break
                continue
            if points[-1].slope * found.slope < 0:
                limit = walk.limit(points[-1], found, heading)
                points.extend([limit] if limit else [])
                if limit is None:
                    between = f"between the levels {points[-1].level:.6g} and {found.level:.6g}"
                    missed.append(f"{between} the load has an extremum: the corrections do not contract near it")
            points.append(found)
            heading = direction
            step = min(step * (1.5 if ease else 1.0), self.step)
            if not self.levels[0] <= found.level <= self.levels[1]:
                why = f"the level {found.level:.6g} is outside {self.levels}"
                break
        return points, why or f"{self.most} points were found", missed


class _Walk:
    """Steps of one path."""

    def __init__(self, topology: Topology, problem: Problem) -> None:
        self.topology = topology
        self.problem = jax.tree.map(jnp.asarray, problem)
        self._evaluate, self._conclude, self._moved = _compiled(topology)

    def rest(self) -> PathPoint:
        """The unloaded frame."""
        n_members = len(self.topology.start)
        state = State(jnp.zeros((self.topology.space.size, n_members, 1)), jnp.asarray(self.problem.rest))
        taken, _ = self._evaluate(self.problem, state, jnp.zeros(1))
        return self._arrived(state, 0.0, 0.0, 0, taken.motion[:, 1])

    def advance(
        self, base: PathPoint, step: float, heading: Array | None
    ) -> tuple[PathPoint | None, bool, Array | None]:
        """The point one step further, whether it was easy, and the way that was gone; nothing if it failed."""
        taken, _ = self._evaluate(self.problem, base.state, jnp.full(1, base.level))
        way = taken.motion[:, 1]
        sign = 1.0 if heading is None or float(jnp.vdot(way, heading)) > 0 else -1.0
        rise = sign * step / _norm(way)
        normal = rise * way
        state, level = self._moved(base.state, taken, jnp.array([0.0, rise])), base.level + rise
        before, first = np.inf, 0.0
        for tries in range(1, PATIENCE + 1):
            taken, _ = self._evaluate(self.problem, state, jnp.full(1, level))
            correction, way = taken.motion[:, 0], taken.motion[:, 1]
            rise = -float(jnp.vdot(normal, correction) / jnp.vdot(normal, way))
            size = float(largest(correction + rise * way)[0])
            contraction = size / before
            first = contraction if tries == 2 else first
            if not np.isfinite(size) or (tries > 1 and contraction > CONTRACTION and size > SMALL):
                return None, False, None
            state, level, before = self._moved(state, taken, jnp.array([1.0, rise])), level + rise, size
            if size < SMALL:
                point = self._arrived(state, level, base.arc + step, tries, normal)
                # Near a limit point corrections at its level lead away: what is missing is corrected along the path.
                if point.conclusion.residual[0] <= EXACT:
                    return point, tries <= 3 or first < EASE, normal
        return None, False, None

    def _arrived(self, state: State, level: float, arc: float, tries: int, normal: Array) -> PathPoint:
        """The point of a state that is nearly there; the last corrections are made at a constant level.

        At a limit point that level may be out of reach, and the corrections lead away: then they are not made.
        """
        taken, found = self._evaluate(self.problem, state, jnp.full(1, level))
        for _ in range(PATIENCE):
            if not found.undone[0] > AIM:
                break
            moved = self._moved(state, taken, jnp.array([1.0, 0.0]))
            next_taken, next_found = self._evaluate(self.problem, moved, jnp.full(1, level))
            if not next_found.undone[0] < found.undone[0]:
                break
            state, taken, found = moved, next_taken, next_found
        way = taken.motion[:, 1]
        slope = float(np.sign(jnp.vdot(normal, way))) / _norm(way)
        worth = self._conclude(self.problem, state, found)
        return PathPoint(state, level, arc, slope, jax.tree.map(np.asarray, worth), tries, False)

    def limit(self, before: PathPoint, after: PathPoint, heading: Array | None) -> PathPoint | None:
        """The limit point between two points, by secants with the sides kept (Illinois); None if it is not found.

        Where a step fails the next one halves the bracket.
        """
        low, high = 0.0, after.arc - before.arc
        slope_low, slope_high = before.slope, after.slope
        scale = max(abs(slope_low), abs(slope_high))
        failed, kept = False, 0
        for _ in range(40):
            secant = (low * slope_high - high * slope_low) / (slope_high - slope_low)
            step = 0.5 * (low + high) if failed else secant
            found, _, _ = self.advance(before, step, heading)
            if found is None and failed:
                return None
            failed = found is None
            if found is None:
                continue
            if abs(found.slope) < LIMIT * scale or high - low < 1e-12:
                return found._replace(is_limit=True)
            if found.slope * slope_low > 0:
                low, slope_low = step, found.slope
                slope_high = slope_high / 2 if kept == 1 else slope_high
                kept = 1
            else:
                high, slope_high = step, found.slope
                slope_low = slope_low / 2 if kept == -1 else slope_low
                kept = -1
        return None


@lru_cache(maxsize=8)
def _compiled(topology: Topology) -> tuple[Any, Any, Any]:
    """Evaluation, conclusion and move of one point."""

    def moved(state: State, taken: Step, weights: Array) -> State:
        motion = jnp.tensordot(weights, taken.motion, (0, 1))
        wrench = jnp.tensordot(weights, taken.wrench, (0, 1))
        return State(state.wrench + wrench, topology.space.moved(state.pose, motion))

    def concluded(problem: Problem, state: State, found: Evaluated) -> Conclusion:
        return conclude(topology, problem, state, jnp.zeros_like(found.direction), found)

    def evaluated(problem: Problem, state: State, level: Array) -> tuple[Step, Evaluated]:
        return evaluate(topology, problem, state, level, exactly=True)

    return jax.jit(evaluated), jax.jit(concluded), jax.jit(moved)


def _norm(motion: Array) -> float:
    return float(jnp.sqrt(jnp.vdot(motion, motion)))


def gathered(points: list[PathPoint]) -> tuple[Conclusion, NDArray[np.int64]]:
    """The conclusions of a path as those of one batch, and the iterations of its points."""
    worth = jax.tree.map(lambda *parts: np.concatenate(parts, axis=-1), *(point.conclusion for point in points))
    return worth, np.array([point.iterations for point in points])

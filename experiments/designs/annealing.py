"""Exchange annealing: lowers a discrepancy by exchanging two entries of one column at a time."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from .discrepancy import Criterion

if TYPE_CHECKING:
    from .exchanges import Walker

Ints = NDArray[np.int64]

HOTTEST, COLDEST = 0.2, 0.1
"""First temperature: HOTTEST / √h of the median change at a local optimum, h runs kept; the last: COLDEST of the first.
Measured between 16 and 100 runs and 4 and 100 levels."""

QUENCH = 20
"""One part in so many of the budget ends the annealing at no temperature: straight down into the nearest dip."""

FEW = 20
"""With fewer visits to each column than these there is no time to anneal: straight down."""

CHUNK = 1000
"""Visits between two fresh sums of the products, so that rounding cannot pile up over a long walk."""


@dataclass(frozen=True)
class Start:
    """What an annealing starts from.

    Parameters
    ----------
    runs : ndarray of int, shape (h, s)
        Levels 0 … levels − 1.
    levels : int
    mirrored : bool
        The image of every run, level q − 1 − k for k, belongs to the design too.
    still : int
        The first so many runs do not move.
    """

    runs: Ints
    levels: int
    mirrored: bool = False
    still: int = 0

    @property
    def design(self) -> Ints:
        """All runs, images included, shape (n, s)."""
        return np.vstack([self.runs, self.levels - 1 - self.runs]) if self.mirrored else self.runs

    def value(self, criterion: Criterion) -> float:
        """Squared discrepancy, level k of q counting as (2k + 1)/(2q)."""
        return criterion.value((self.design + 0.5) / self.levels)

    def with_runs(self, runs: Ints) -> "Start":
        """The same with other levels."""
        return Start(runs, self.levels, self.mirrored, self.still)


def anneal(start: Start, criterion: Criterion, budget: int, rng: np.random.Generator, heat: float = 1.0) -> Start:
    """The design of lowest discrepancy met while trying `budget` exchanges, never worse than `start`.

    Parameters
    ----------
    start : Start
    criterion : Criterion
    budget : int
        Exchanges tried, in sweeps over all pairs of runs of one column.
    rng : numpy.random.Generator
    heat : float
        Scales all temperatures; 0 goes straight down.

    Notes
    -----
    The exchange search of Fang, Lu and Winker (2003), "Lower bounds for centered and wrap-around
    L2-discrepancies and construction of uniform designs by threshold accepting", J. Complexity 19,
    692–711, with random (Metropolis) thresholds and geometric cooling. While a column is visited,
    the part of the discrepancy that each run would have at each level is at hand, so an exchange is
    priced in a few operations; making one costs O(n q).
    """
    runs = start.runs
    moving = len(runs) - start.still
    if moving < 1 or budget < 1 or runs.shape[1] == 1 or (moving < 2 and not start.mirrored):
        return start  # the order of a single column does not matter
    sweeps = 1 + start.levels // 32  # a visit begins with O(n² + n q²) work, a sweep is O(n²)
    visits = -(-budget // (sweeps * tried(moving, start.mirrored)))
    temperatures = np.zeros(visits)
    if visits > FEW * runs.shape[1] and heat > 0.0:
        first = HOTTEST / len(runs) ** 0.5 * heat * _typical_change(start, criterion, rng)
        temperatures = first * np.geomspace(1.0, COLDEST, visits)
        temperatures[visits - visits // QUENCH :] = 0.0
    return _walked(start, criterion, temperatures, sweeps, rng)


def tried(moving: int, mirrored: bool) -> int:
    """Exchanges of one sweep over a column with `moving` runs: of two runs, or of one with its own image."""
    pairs = moving * (moving - 1) // 2
    return 2 * pairs + moving if mirrored else pairs


def _walked(
    start: Start, criterion: Criterion, temperatures: NDArray[np.float64], sweeps: int, rng: np.random.Generator
) -> Start:
    from .exchanges import walk  # the compiler takes 0.3 s to import, and a surrogate that only predicts needs none

    now = best = start
    for begin in range(0, len(temperatures), CHUNK):
        walker = _walker(now, best, criterion)
        walk(walker, start.still, temperatures[begin : begin + CHUNK], sweeps, rng)
        now = start.with_runs(np.ascontiguousarray(walker.columns.T))
        found = start.with_runs(np.ascontiguousarray(walker.best.T))
        if found.value(criterion) < best.value(criterion):
            best = found
    return best


def _typical_change(start: Start, criterion: Criterion, rng: np.random.Generator) -> float:
    """Median size of what an exchange of two runs changes, at the nearest dip."""
    dip = _walked(start, criterion, np.zeros(2 * start.runs.shape[1]), 1, rng)
    walker = _walker(dip, dip, criterion)
    free = slice(start.still, None)
    sizes = np.abs([changes(walker, k)[free, free] for k in range(len(walker.columns))])
    return float(np.median(sizes[sizes > 0.0])) if sizes.any() else 0.0


def changes(walker: "Walker", k: int) -> NDArray[np.float64]:
    """Change of the discrepancy if two runs exchanged their levels of factor `k`, shape (h, h)."""
    from .exchanges import visited

    levels, between, _, _, energy = visited(walker, k)
    own = np.arange(len(levels)), levels
    there = energy[:, levels] - energy[own][:, None]
    shared = 0.0
    for weight, pair in zip(between, walker.pair, strict=True):
        alone = pair[levels, levels]
        shared = shared + weight * (alone[:, None] + alone[None, :] - 2.0 * pair[levels][:, levels])
    return there + there.T - 2.0 * shared


def _walker(now: Start, best: Start, criterion: Criterion) -> "Walker":
    from .exchanges import Walker, tables

    images = 2 if now.mirrored else 1
    single, pair = tables(criterion, now.levels, images)
    columns = np.ascontiguousarray(now.runs.T, dtype=np.int64)
    h = columns.shape[1]
    once, twice = np.ones(h), np.ones((images, h, h))
    for levels in columns:
        once *= single[levels]
        twice *= pair[:, levels][:, :, levels]
    values = np.array([now.value(criterion), best.value(criterion)])
    return Walker(columns, np.ascontiguousarray(best.runs.T, dtype=np.int64), once, twice, single, pair, values)

"""Prediction intervals: predicted ± h, h from the residuals of fresh runs, and how often that held on other ones."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

LEVELS = (0.9, 0.95, 0.99)
"""Levels that are calibrated where there are runs enough."""

SEED = 0
"""Of the random halves. Fresh runs may come in an order of their own, from a table, so it is not the first half."""


@dataclass(frozen=True)
class Interval:
    """An interval of one response, predicted ± `half_width`, calibrated on fresh runs and tried on others.

    Parameters
    ----------
    level : float
        Share of runs that should lie inside, over runs drawn like the fresh ones; 0 < level < 1.
    half_width : float
        SI.
    n_calibration : int
        Fresh runs whose residuals set the half-width.
    coverage : float
        Share of `n_check` other fresh runs that lie inside.
    n_check : int
        Fresh runs that were not used for the half-width.

    Raises
    ------
    ValueError
        If a number is out of its range.
    """

    level: float
    half_width: float
    n_calibration: int
    coverage: float
    n_check: int

    def __post_init__(self) -> None:
        if not 0.0 < self.level < 1.0:
            raise ValueError(f"the level of an interval must lie between 0 and 1, got {self.level!r}")
        if not 0.0 <= self.half_width < math.inf:
            raise ValueError(f"half_width must be finite and at least 0, got {self.half_width!r}")
        if not 0.0 <= self.coverage <= 1.0:
            raise ValueError(f"coverage must be from 0 to 1, got {self.coverage!r}")
        if self.n_calibration < 1 or self.n_check < 1:
            raise ValueError(
                f"an interval needs runs, got {self.n_calibration} to calibrate and {self.n_check} to check"
            )


def fewest_runs(level: float) -> int:
    """Fewest fresh runs that give an interval of that level, both halves counted: about 2/(1 − level)."""
    return 2 * math.ceil(level / (1.0 - level) - 1e-9) - 1  # of an odd number the larger part sets the width


def conformal_half_width(residuals: ArrayLike, level: float) -> float:
    """The ⌈(n + 1)·level⌉-th smallest of n absolute residuals; infinite if n is too small.

    One more residual, exchangeable with these, is no larger with probability `level` at least, and at most
    level + 1/(n + 1) if there are no ties: split conformal prediction, whatever the residuals' distribution.

    Notes
    -----
    Vovk, Gammerman & Shafer (2005), *Algorithmic Learning in a Random World*; Lei, G'Sell, Rinaldo, Tibshirani &
    Wasserman (2018), J. Am. Stat. Assoc. 113, 1094–1111, Algorithm 2 and Theorem 2.2.
    """
    size = np.abs(np.asarray(residuals, dtype=np.float64))
    rank = math.ceil((len(size) + 1) * level - 1e-9)  # 1e-9: 20 · 0.95 must not become 19.000000000000004
    if rank > len(size):
        return math.inf
    # A residual that is not a number is larger than any.
    return float(np.sort(np.where(np.isnan(size), np.inf, size))[rank - 1])


def calibrated(residuals: ArrayLike, levels: Sequence[float] = LEVELS, seed: int = SEED) -> tuple[Interval, ...]:
    """Intervals from residuals (n_runs,) of fresh runs, SI: a random half sets the half-widths, the other tries them.

    Levels for which there are too few runs (:func:`fewest_runs`) are left out.
    """
    residuals = np.asarray(residuals, dtype=np.float64)
    order = np.random.default_rng(seed).permutation(len(residuals))
    given, tried = residuals[order[len(order) // 2 :]], residuals[order[: len(order) // 2]]
    widths = {level: conformal_half_width(given, level) for level in levels}
    return tuple(
        Interval(level, width, len(given), float(np.mean(np.abs(tried) <= width)), len(tried))
        for level, width in widths.items()
        if math.isfinite(width) and len(tried)
    )


def half_widths(intervals: Sequence[tuple[str, int, Sequence[Interval]]], level: float) -> NDArray[np.float64]:
    """Half-widths of one level, shape (n_responses,), SI.

    Parameters
    ----------
    intervals : sequence of (str, int, sequence of Interval)
        Name, number of fresh runs and intervals of each response.
    level : float
        One of those calibrated.

    Raises
    ------
    ValueError
        If there is no response, or one has no interval of that level; the sentence says what there is.
    """
    if not intervals:
        raise ValueError(
            "this model was not validated, so nothing is known of its residuals: validate it on fresh runs"
        )
    return np.array([_of_level(name, n_runs, offered, level) for name, n_runs, offered in intervals])


def _of_level(name: str, n_runs: int, offered: Sequence[Interval], level: float) -> float:
    for interval in offered:
        if abs(interval.level - level) < 1e-9:
            return interval.half_width
    known = ", ".join(f"{i.level:g}" for i in offered) or "none"
    if level in LEVELS and n_runs < fewest_runs(level):
        raise ValueError(
            f"response {name!r} has no interval of level {level:g}: that takes {fewest_runs(level)} validation runs "
            f"or more, this model had {n_runs}; levels there are: {known}"
        )
    if not offered:
        raise ValueError(
            f"response {name!r} has no intervals, as in models from before they were calibrated; validate it again"
        )
    raise ValueError(f"response {name!r} has no interval of level {level:g}; levels there are: {known}")

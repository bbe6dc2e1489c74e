"""Critical values by simulation: how large |contrast| / standard error gets when nothing acts."""

from dataclasses import dataclass
from functools import lru_cache
from math import ceil

import numpy as np
from numpy.typing import NDArray

from .standard_errors import ESTIMATORS

BUDGET = 1_500_000
"""Normal numbers drawn for one reference distribution: the upper 5 % points are then good to about half a percent."""
SETS = (20_000, 200_000)
"""Fewest and most experiments simulated."""


@dataclass(frozen=True, eq=False)
class ReferenceDistribution:
    """Simulated distribution of |c| / standard error over experiments in which no contrast acts.

    Parameters
    ----------
    ratios : ndarray, shape (n_sets · m,)
        All ratios, sorted: the individual error rate is counted on them.
    largest : ndarray, shape (n_sets,)
        Largest ratio of each experiment, sorted: the experimentwise error rate is counted on them.
    """

    ratios: NDArray[np.float64]
    largest: NDArray[np.float64]

    def critical(self, alpha: float) -> tuple[float, float]:
        """Ratios exceeded with probability `alpha` by one contrast (IER), and by any of the experiment (EER)."""
        return float(np.quantile(self.ratios, 1.0 - alpha)), float(np.quantile(self.largest, 1.0 - alpha))

    def p_values(self, ratios: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Individual and simultaneous p-values of |c| / standard error, each shape (m,)."""

        def exceeding(sample: NDArray[np.float64]) -> NDArray[np.float64]:
            return 1.0 - np.searchsorted(sample, np.abs(ratios), side="left") / len(sample)

        return exceeding(self.ratios), exceeding(self.largest)


@lru_cache(maxsize=8)
def reference_distribution(estimator: str, m: int, seed: int = 0) -> ReferenceDistribution:
    """Simulate one, reproducibly.

    Parameters
    ----------
    estimator : str
        Key of :data:`~.standard_errors.ESTIMATORS`: ``"lenth"``, ``"dong"``, ``"zahn"``, ``"daniel"``.
    m : int
        Number of contrasts.
    seed : int
        Seed of the generator.

    Raises
    ------
    ValueError
        If the estimator is unknown.

    Notes
    -----
    Ye and Hamada (2000), "Critical values of the Lenth method for unreplicated factorial designs",
    J. Quality Technology 32, 57–66: with t on m/3 degrees of freedom Lenth's ME is too wide, so the
    individual (IER) and experimentwise (EER) critical values are simulated.
    """
    if estimator not in ESTIMATORS:
        raise ValueError(f"unknown estimator {estimator!r}; known are {', '.join(ESTIMATORS)}")
    n_sets = int(np.clip(ceil(BUDGET / m), *SETS))
    sizes = np.abs(np.random.default_rng(seed).standard_normal((n_sets, m)))
    sizes.sort(axis=1)
    sizes /= ESTIMATORS[estimator](sizes)[:, None]
    return ReferenceDistribution(np.sort(sizes, axis=None), np.sort(sizes[:, -1]))

"""Standard errors of contrasts from the contrasts themselves, most of which are taken to be inert.

Every estimator takes absolute contrasts sorted along the last axis, shape (…, m), and returns shape (…,):
the same code judges one experiment and simulates many.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri

LIMIT = 2.5
"""Contrasts at or beyond this many first estimates are set aside, by Lenth and by Dong."""
INERT = 0.683
"""Fraction of the contrasts, the smallest, that Daniel and Zahn take for inert: P(|z| < 1)."""


def first_estimate(sizes: NDArray[np.float64]) -> NDArray[np.float64]:
    """s0 = 1.5 × median: Lenth (1989)."""
    return 1.5 * np.median(sizes, axis=-1)


def lenth_error(sizes: NDArray[np.float64]) -> NDArray[np.float64]:
    """1.5 × median of the contrasts below 2.5·s0: Lenth (1989); zero if none is below."""
    count = (sizes < LIMIT * first_estimate(sizes)[..., None]).sum(axis=-1)
    lower, upper = np.maximum((count - 1) // 2, 0), np.maximum(count // 2, 0)
    pick = [np.take_along_axis(sizes, i[..., None], axis=-1)[..., 0] for i in (lower, upper)]
    return np.where(count > 0, 0.75 * (pick[0] + pick[1]), 0.0)


def dong_error(sizes: NDArray[np.float64]) -> NDArray[np.float64]:
    """Root mean square of the contrasts up to 2.5·s0: Dong (1993)."""
    inert = sizes <= LIMIT * first_estimate(sizes)[..., None]
    return np.sqrt((inert * sizes**2).sum(axis=-1) / inert.sum(axis=-1))


def daniel_error(sizes: NDArray[np.float64]) -> NDArray[np.float64]:
    """The contrast at the 68.3 % point of the half-normal plot: Daniel (1959)."""
    return sizes[..., n_inert(sizes.shape[-1]) - 1]


def zahn_error(sizes: NDArray[np.float64]) -> NDArray[np.float64]:
    """Slope of the line through the origin and the smallest 68.3 % on the half-normal plot: Zahn (1975)."""
    m = sizes.shape[-1]
    line = half_normal_quantiles(m)[: n_inert(m)]
    return sizes[..., : len(line)] @ line / (line @ line)


def n_inert(m: int) -> int:
    """How many of m contrasts the half-normal line is drawn through."""
    return int(INERT * m + 0.5)


def half_normal_quantiles(m: int) -> NDArray[np.float64]:
    """Expected places of m sorted half-normal numbers, shape (m,).

    Plotting positions (i − 3/8)/(m + 1/4): Blom (1958), "Statistical Estimates and Transformed Beta-Variables".
    """
    return ndtri(0.5 + 0.5 * (np.arange(1, m + 1) - 0.375) / (m + 0.25))


ESTIMATORS: dict[str, Callable[[NDArray[np.float64]], NDArray[np.float64]]] = {
    "lenth": lenth_error,
    "dong": dong_error,
    "zahn": zahn_error,
    "daniel": daniel_error,
}

"""Half or more of the contrasts act: detected, because no method that trusts the median then sees anything."""

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtrit

from .standard_errors import n_inert

RARE = 0.01
"""How rarely contrasts without any active one may look crowded."""
FEWEST_DUMMIES = 3
"""Fewer dummy columns measure no error: t on two degrees of freedom is 4.3 at 5 %, on three 3.2."""


def gap(sizes: NDArray[np.float64]) -> int:
    """How many of the contrasts lie below a gap that chance does not leave; 0 if there is no such gap.

    Parameters
    ----------
    sizes : ndarray, shape (m,)
        Absolute contrasts, sorted, none below the noise floor.

    Notes
    -----
    Near zero a half-normal density is flat, and of uniform numbers the ratio of the k-th smallest to the
    next is less than r with probability r^k (Rényi's representation of order statistics). Only gaps with at most
    half of the contrasts below are sought: above that the median is sound. Each of them may err with probability
    RARE over their number.
    """
    most = len(sizes) // 2
    k = np.arange(1, most + 1)
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.where(sizes[1 : most + 1] > 0.0, sizes[:most] / sizes[1 : most + 1], 1.0)
    found = np.flatnonzero(ratio**k < RARE / most)
    return int(k[found[-1]]) if found.size else 0


def none_is_small(sizes: NDArray[np.float64]) -> bool:
    """Whether the smallest contrast is too near to the others for noise to be among them.

    Parameters
    ----------
    sizes : ndarray, shape (m,)
        Absolute contrasts, sorted.

    Notes
    -----
    Below any value half-normal numbers are at most as large as uniform ones, since their density falls: given the
    q-th smallest, the smallest exceeds a fraction r of it with probability (1 − r)^(q − 1) at most.
    """
    q = n_inert(len(sizes))
    return bool(sizes[q - 1] > 0.0 and (1.0 - sizes[0] / sizes[q - 1]) ** (q - 1) < RARE)


def is_crowded(sizes: NDArray[np.float64], dummies: NDArray[np.bool_] | None, floor: float) -> bool:
    """Whether half or more of the contrasts stand out from the rest, or from the dummy columns.

    Parameters
    ----------
    sizes : ndarray, shape (m,)
        Absolute contrasts.
    dummies : ndarray of bool, shape (m,), or None
        Columns that no factor was assigned to.
    floor : float
        Differences below it are rounding.
    """
    believed = np.sort(np.maximum(sizes, floor))
    if gap(believed) or (sizes.min() > floor and none_is_small(believed)):
        return True
    if dummies is None or dummies.sum() < FEWEST_DUMMIES:
        return False
    n = int(dummies.sum())
    margin = float(stdtrit(n, 1.0 - 0.5 * RARE)) * max(dummy_error(sizes, dummies), floor)
    return margin > 0.0 and 2 * int((sizes > margin).sum()) >= len(sizes)


def dummy_error(sizes: NDArray[np.float64], dummies: NDArray[np.bool_]) -> float:
    """Standard error from the dummy columns: their root mean square, with as many degrees of freedom."""
    return float(np.sqrt(np.mean(sizes[dummies] ** 2)))

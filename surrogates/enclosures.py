"""Proven bounds on polynomials over boxes: Bernstein coefficients with a-priori bounds on rounding.

A polynomial on a box is a convex combination of its Bernstein coefficients, so they enclose its range
(Farouki and Rajan, 1987, "On the numerical condition of polynomials in Bernstein form", CAGD 4, 191–216).
They come from the power coefficients by one small matrix per factor. Every number is a *ball*, a float and
a bound on its distance from the exact one: a sum of k products, in whatever order and with or without
fused operations, is off by at most γ = k u/(1 − k u) times the sum of their sizes (Higham, 2002, Accuracy
and Stability of Numerical Algorithms, §3.1). The bounds themselves are computed in floats and then
enlarged by far more than they can be off.
"""

from fractions import Fraction
from functools import lru_cache
from math import comb
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

UNIT = 2.0**-53
ENLARGED = 1.0 + 1e-9
"""More than the relative rounding error of any bound here, by orders."""

TINY = 1e-290
"""More than any underflow adds."""


class Ball(NamedTuple):
    """Numbers `mid` whose exact counterparts are at most `rad` away; arrays of one shape."""

    mid: Floats
    rad: Floats

    @property
    def size(self) -> Floats:
        """Bound on the absolute values."""
        return (np.abs(self.mid) + self.rad) * ENLARGED + TINY


def product(left: Floats, right: Ball, entries: float = 0.0) -> Ball:
    """Matrix product of `left` with a ball; each entry of `left` may itself be off by the relative error `entries`."""
    k = left.shape[-1]
    relative = (2.0 * (k + 2) * UNIT + entries) * ENLARGED
    grown = np.abs(left) @ (right.rad * (1.0 + relative) + relative * np.abs(right.mid))
    return Ball(left @ right.mid, grown * ENLARGED + TINY)


@lru_cache(maxsize=100_000)
def to_bernstein(degree: int, low: float, high: float) -> Floats:
    """Matrix from power coefficients in x to Bernstein coefficients on [low, high]; entries correctly rounded."""
    lower, width = Fraction(low), Fraction(high) - Fraction(low)
    powers = [
        [comb(k, j) * lower ** (k - j) * width**j if k >= j else Fraction(0) for k in range(degree + 1)]
        for j in range(degree + 1)
    ]
    matrix = [
        [
            sum((Fraction(comb(i, j), comb(degree, j)) * powers[j][k] for j in range(i + 1)), Fraction(0))
            for k in range(degree + 1)
        ]
        for i in range(degree + 1)
    ]
    return np.array([[float(entry) for entry in row] for row in matrix])


def control(power: Ball, low: Floats, high: Floats) -> Ball:
    """Bernstein coefficients on the box from `low` to `high`.

    Parameters
    ----------
    power : Ball, shape (…, d₁ + 1, …, dₙ + 1)
        Power coefficients, the last n axes the exponents of the n factors.
    low, high : ndarray, shape (n,)

    Returns
    -------
    Ball, shape (…, n_coefficients)
    """
    n = len(low)
    lead = power.mid.ndim - n
    for k in range(n):
        axis = lead + k
        change = to_bernstein(power.mid.shape[axis] - 1, float(low[k]), float(high[k]))
        shape = np.moveaxis(power.mid, axis, 0).shape
        flat = Ball(*(np.moveaxis(part, axis, 0).reshape(shape[0], -1) for part in power))
        power = Ball(*(np.moveaxis(part.reshape(shape), 0, axis) for part in product(change, flat, entries=UNIT)))
    return Ball(*(part.reshape(*part.shape[:lead], -1) for part in power))

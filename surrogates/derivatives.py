"""The Jacobian of a model, multiplied by a constant matrix, as tensors of power coefficients with error bounds."""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from .enclosures import TINY, UNIT, Ball, Floats

if TYPE_CHECKING:
    from .model import Surrogate


MOST_COEFFICIENTS = 10_000_000
"""Entries of the tensor of derivatives for which a proof is tried."""


def exponents_of(model: "Surrogate") -> NDArray[np.int64]:
    """Exponents of the terms that some response uses, shape (n_used, n_factors)."""
    table = np.array(model.terms.exponents, dtype=np.int64).reshape(len(model.terms), len(model.factors))
    return table[(model.coefficients != 0.0).any(axis=1)]


def tensor_size(model: "Surrogate") -> float:
    """Entries of :func:`jacobian_tensor`."""
    degrees = exponents_of(model).max(axis=0, initial=0) + 1.0
    return float(np.prod(degrees)) * len(model.factors) ** 2


def mixed(model: "Surrogate", left: Floats) -> Ball:
    """Coefficients of ``left @ f``, shape (n_used, n_rows): `left` is taken as exact, the products are not."""
    used = model.coefficients[(model.coefficients != 0.0).any(axis=1)]
    size = np.abs(used) @ np.abs(left.T)
    return Ball(used @ left.T, 2.0 * (left.shape[1] + 2) * UNIT * size + TINY)


def jacobian_tensor(model: "Surrogate", left: Floats) -> Ball:
    """Power coefficients of ``left @ J`` in coded factors.

    Returns
    -------
    Ball, shape (n_rows, n_factors, d₁ + 1, …, dₙ + 1)
        The last axes are the exponents of the factors.
    """
    exponents, coefficients = exponents_of(model), mixed(model, left)
    n = exponents.shape[1]
    degrees = exponents.max(axis=0, initial=0)
    shape = (left.shape[0], n, *(degrees + 1))
    mid, rad = np.zeros(shape), np.zeros(shape)
    for k in range(n):
        for row in np.flatnonzero(exponents[:, k] > 0):
            order = exponents[row, k]
            at = (slice(None), k, *(exponents[row] - (np.arange(n) == k)))
            mid[at] = order * coefficients.mid[row]
            rad[at] = order * (coefficients.rad[row] + 2.0 * UNIT * np.abs(coefficients.mid[row]))
    return Ball(mid, rad)


def inverse_of_mean_slope(model: "Surrogate", points: Floats) -> Floats:
    """Pseudo-inverse of the mean Jacobian over coded `points`, shape (n_factors, n_responses); responses in SI."""
    slope = model.jacobian_coded(points).mean(axis=0) / model.scale[:, None]
    return np.linalg.pinv(slope) / model.scale


def curvature_bound(model: "Surrogate", left: Floats, weights: Floats) -> float:
    """Lipschitz constant of ``left @ J`` on the box in the norm max |xᵢ| / weightsᵢ, from the coefficients' sizes."""
    exponents, size = exponents_of(model), mixed(model, left).size
    second = np.einsum("tj,tk,j,k->t", exponents, exponents, weights, weights)
    second -= exponents @ weights**2  # the square of a factor loses one from its exponent
    return float((second @ size / weights).max() * (1.0 + 1e-9))

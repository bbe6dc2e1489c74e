"""How large the coefficients of a smooth response may be expected to be, learned by maximum evidence.

Every coefficient is taken as normal about zero. Its variance is a product over the factors of its term: one scale
for acting at all, one for each power more, one for even powers, one for pure powers; one scale for each factor more in
a product; and one for each pair of factors in it. So few numbers say how fast a polynomial series decays, factor by
factor, and far more terms than runs can be fitted. The numbers, and the noise, are those that make the runs most
probable (type II maximum likelihood: MacKay, 1992, "Bayesian interpolation", Neural Computation 4, 415–447; Rasmussen
and Williams, 2006, Gaussian Processes for Machine Learning, section 5.4.1, for the gradient).
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

CONSTANT = 10.0
"""Prior variance of the constant, in variances of the response: wide enough to leave it to the data."""

DECAY, DECAY_WIDTH = -2.0, 2.0
"""Before the runs speak: logarithm of what a power more multiplies the variance by, and its standard deviation."""

PRODUCT, PRODUCT_WIDTH = -0.5, 1.0
"""The same for a factor more in a product."""

PAIR_WIDTH = 1.0
"""Standard deviation of the logarithms of the scales of pairs."""

OTHER_WIDTH = 2.0
"""Standard deviation of the logarithms of all other scales."""

SMALLEST_NOISE, LARGEST_NOISE = 1e-12, 10.0
"""Range of the noise's variance beside that of the scales; also bounds the condition of what is solved."""

STARTS = ((DECAY, 1e-4), (-1.0, 1e-8))
"""Decay and noise from which the search, which is local, starts: smooth and noisy, rough and exact."""

MOST_STEPS = 300
IMPOSSIBLE = 1e10
ROUNDING = 1e-15
"""Added to what is decomposed, beside its mean diagonal: less than it is off by."""


@dataclass(frozen=True, eq=False)
class Rows:
    """What a polynomial is taught: rows of values, and of derivatives where there are any.

    Parameters
    ----------
    matrix : ndarray, shape (n_rows, n_terms)
        Of values, and of derivatives by the coded factors.
    target : ndarray, shape (n_rows,)
    kind : ndarray of int, shape (n_rows,)
        0 for a value, 1 for a derivative: each kind has a noise of its own.
    """

    matrix: Floats
    target: Floats
    kind: NDArray[np.int64]

    def some(self, most: int) -> "Rows":
        """At most about so many rows, of whole points, which are taken in one fixed shuffled order."""
        starts = np.flatnonzero(self.kind == 0)
        each = len(self.kind) // len(starts)
        if len(self.kind) <= most:
            return self
        chosen = np.random.default_rng(0).permutation(starts)[: max(2, most // each)]
        rows = (np.sort(chosen)[:, None] + np.arange(each)).ravel()
        return Rows(self.matrix[rows], self.target[rows], self.kind[rows])

    @classmethod
    def of(cls, matrix: Floats, y: Floats, gradient: Floats | None = None, slopes: Floats | None = None) -> "Rows":
        """Rows point by point, a value first and its derivatives after it.

        Parameters
        ----------
        matrix, y : ndarray, shape (n_runs, n_terms) and (n_runs,)
        gradient, slopes : ndarray, shape (n_runs, n_terms, n_factors) and (n_runs, n_factors), optional
            By the coded factors.
        """
        if gradient is None or slopes is None:
            return cls(matrix, y, np.zeros(len(y), dtype=np.int64))
        n, p, k = gradient.shape
        rows = np.concatenate([matrix[:, None, :], gradient.transpose(0, 2, 1)], axis=1).reshape(-1, p)
        kind = np.tile((np.arange(k + 1) > 0).astype(np.int64), n)
        return cls(rows, np.concatenate([y[:, None], slopes], axis=1).ravel(), kind)


@dataclass(frozen=True, eq=False)
class Scales:
    """What maximum evidence found.

    Parameters
    ----------
    logs : ndarray, shape (n_scales,)
        Logarithms of the scales themselves.
    variance : ndarray, shape (n_terms,)
        Prior variances of the coefficients that follow from them.
    noise : ndarray, shape (n_kinds,)
        Variances of the noise, by kind of row. Only ratios to `variance` matter for the fit.
    evidence : float
        Logarithm of the probability density of the rows, up to a constant.
    """

    logs: Floats
    variance: Floats
    noise: Floats
    evidence: float

    def log_variance_of(self, exponents: NDArray[np.int64]) -> Floats:
        """Logarithms of the prior variances that the scales give any terms (n_terms, n_factors)."""
        return _features(exponents)[0] @ self.logs


def learned_scales(rows: Rows, exponents: NDArray[np.int64]) -> Scales:
    """Scales of largest evidence.

    Parameters
    ----------
    rows : Rows
        Of Legendre polynomials of mean square one (others would need another prior); the values of mean about zero
        and standard deviation about one.
    exponents : ndarray of int, shape (n_terms, n_factors)
    """
    from scipy.optimize import minimize

    features, centre, width = _features(exponents)
    constant = exponents.sum(axis=1) == 0
    n_kinds = int(rows.kind.max()) + 1
    n_scales = features.shape[1]

    def cost(theta: Floats) -> tuple[float, Floats]:
        variance = _variance(features, theta[:n_scales], constant)
        noise = np.exp(theta[n_scales:])
        try:
            value, by_variance, by_noise = _evidence(rows, variance, noise)
        except np.linalg.LinAlgError:  # too ill-conditioned to tell: the search turns back
            return IMPOSSIBLE, np.zeros_like(theta)
        by_variance[constant] = 0.0
        away = (theta[:n_scales] - centre) / width
        slope = np.concatenate([-features.T @ by_variance + away / width, -by_noise])
        return -value + 0.5 * float(away @ away), slope

    bounds = [(-14.0, 4.0)] * n_scales + [(np.log(SMALLEST_NOISE), np.log(LARGEST_NOISE))] * n_kinds
    settings: Any = {"jac": True, "method": "L-BFGS-B", "bounds": bounds, "options": {"maxiter": MOST_STEPS}}
    found: Any = None
    for decay, noise in STARTS:
        begin = np.concatenate([centre, np.full(n_kinds, np.log(noise))])
        begin[: exponents.shape[1]] = decay
        trial = minimize(cost, begin, **settings)
        found = trial if found is None or trial.fun < found.fun else found
    theta = np.asarray(found.x, dtype=np.float64)
    variance = _variance(features, theta[:n_scales], constant)
    return Scales(theta[:n_scales], variance, np.exp(theta[n_scales:]), -float(found.fun))


def _features(exponents: NDArray[np.int64]) -> tuple[Floats, Floats, Floats]:
    """What multiplies the logarithms of the scales in each term, and what is expected of them."""
    k = exponents.shape[1]
    first, second = np.triu_indices(k, 1)
    acting = exponents > 0
    n_acting = acting.sum(axis=1)
    parts = (
        exponents,
        np.maximum(n_acting - 1, 0)[:, None],
        acting,
        acting & (exponents % 2 == 0),
        (n_acting == 1)[:, None] & (exponents > 1),
        acting[:, first] & acting[:, second],
    )
    n_pairs = len(first)
    centre = np.concatenate([np.full(k, DECAY), [PRODUCT], np.zeros(3 * k + n_pairs)])
    width = np.concatenate(
        [np.full(k, DECAY_WIDTH), [PRODUCT_WIDTH], np.full(3 * k, OTHER_WIDTH), np.full(n_pairs, PAIR_WIDTH)]
    )
    return np.column_stack(parts).astype(np.float64), centre, width


def _variance(features: Floats, scales: Floats, constant: NDArray[np.bool_]) -> Floats:
    return np.where(constant, CONSTANT, np.exp(np.clip(features @ scales, -60.0, 20.0)))


def _evidence(rows: Rows, variance: Floats, noise: Floats) -> tuple[float, Floats, Floats]:
    """Log evidence, and its derivatives by the logarithms of the terms' variances and of the noise.

    The common scale of `variance` and `noise` is profiled out.
    """
    n, p = rows.matrix.shape
    return (_by_rows if n <= p else _by_terms)(rows, variance, noise)


def _by_rows(rows: Rows, variance: Floats, noise: Floats) -> tuple[float, Floats, Floats]:
    """From the covariance of the rows, (n_rows, n_rows)."""
    from scipy.linalg import solve_triangular

    n = len(rows.target)
    scaled = rows.matrix * np.sqrt(variance)
    covariance = scaled @ scaled.T
    covariance[np.diag_indices(n)] += noise[rows.kind] + ROUNDING * float(np.trace(covariance)) / n
    lower = np.linalg.cholesky(covariance)
    inverse = solve_triangular(lower, np.eye(n), lower=True)
    white = inverse @ rows.target
    common = float(white @ white) / n
    dual = inverse.T @ white
    value = -0.5 * n * np.log(common) - float(np.log(np.diag(lower)).sum())
    by_variance = 0.5 * ((scaled.T @ dual) ** 2 / common - ((inverse @ scaled) ** 2).sum(axis=0))
    each = 0.5 * noise[rows.kind] * (dual**2 / common - (inverse**2).sum(axis=0))
    return value, by_variance, np.bincount(rows.kind, each, len(noise)).astype(np.float64)


def _by_terms(rows: Rows, variance: Floats, noise: Floats) -> tuple[float, Floats, Floats]:
    """From the posterior's precision, (n_terms, n_terms)."""
    from scipy.linalg import solve_triangular

    n, p = rows.matrix.shape
    scaled = rows.matrix * np.sqrt(variance)
    weight = 1.0 / noise[rows.kind]
    precision = scaled.T @ (scaled * weight[:, None])
    precision[np.diag_indices(p)] += 1.0 + ROUNDING * float(np.trace(precision)) / p
    lower = np.linalg.cholesky(precision)
    inverse = solve_triangular(lower, np.eye(p), lower=True)
    mean = inverse.T @ (inverse @ (scaled.T @ (weight * rows.target)))
    residual = rows.target - scaled @ mean
    common = float(weight @ residual**2 + mean @ mean) / n
    value = (
        -0.5 * n * np.log(common) - float(np.log(np.diag(lower)).sum()) - 0.5 * float(np.log(noise[rows.kind]).sum())
    )
    by_variance = 0.5 * (mean**2 / common - 1.0 + (inverse**2).sum(axis=0))
    leverage = ((inverse @ scaled.T) ** 2).sum(axis=0) * weight
    each = 0.5 * (residual**2 * weight / common - 1.0 + leverage)
    return value, by_variance, np.bincount(rows.kind, each, len(noise)).astype(np.float64)

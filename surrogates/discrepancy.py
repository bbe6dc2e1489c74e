"""Two fidelities: a cheap model's polynomial corrected with a few runs of a dear one.

With y₁ the cheap model's polynomial and d, ρ polynomials of low degree fitted to the dear runs:

- additive: y₁ + d
- scaled: ρ₀ y₁ + d, with one number ρ₀ for each response
- multiplicative: ρ y₁; fitted without dividing, so that a zero of y₁ does no harm

Sums and products of polynomials are polynomials: the answer is a plain :class:`.Surrogate`, which can be validated,
certified, inverted and exported like any other.

Source: Kennedy and O'Hagan (2000), Predicting the output from a complex computer code when fast approximations are
available, Biometrika 87, 1–13 (there ρ is a number and d a Gaussian process); multiplicative and additive
corrections by polynomials: Fernández-Godino, Park, Kim and Haftka (2019), Issues in deciding whether to use
multifidelity surrogates, AIAA Journal 57, 2039–2054.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from experiments.factors import FactorSpace
from experiments.terms import Terms, model_matrix

from .model import Surrogate
from .polynomial import PolynomialRegressor

KINDS = ("additive", "scaled", "multiplicative")

_Rows = dict[tuple[int, ...], NDArray[np.float64]]


@dataclass(frozen=True, eq=False)
class Corrected:
    """A cheap model corrected.

    Parameters
    ----------
    surrogate : Surrogate
        The corrected model; without validation, standard errors or certificate, which it has to earn anew.
    kind : str
        One of :data:`KINDS`.
    scale : ndarray, shape (n_responses,)
        What the cheap model is multiplied with: ρ₀, the constant of ρ, or 1.
    loo_rmse : ndarray, shape (n_responses,)
        Leave-one-out error of the correction over the dear runs, SI. ρ₀ is taken as known, which flatters a little.
    """

    surrogate: Surrogate
    kind: str
    scale: NDArray[np.float64]
    loo_rmse: NDArray[np.float64]


def correct(cheap: Surrogate, X: ArrayLike, y: ArrayLike, kind: str = "scaled", degree: int = 1) -> Corrected:
    """Correct a cheap model with dear runs.

    Parameters
    ----------
    cheap : Surrogate
        Fitted to many runs of the cheap oracle.
    X : array_like, shape (n_runs, n_factors)
        Settings of the dear runs, in the factors' units.
    y : array_like, shape (n_runs, n_responses)
        Their responses, SI.
    kind : str
        One of :data:`KINDS`.
    degree : int
        Of d, from 1, or of ρ, from 0. Terms of d are chosen by evidence and may outnumber the runs; ρ is by plain
        least squares.

    Raises
    ------
    ValueError
        If the kind is unknown, the degree too low or no whole number, the shapes disagree, a value is not finite, the
        cheap model has logarithms, or there are too few runs: more than ρ has terms, or 3.

    Notes
    -----
    ρ₀ is the slope of the regression of the dear responses on the cheap ones, over the dear runs.
    """
    X, y = _checked(cheap, X, y, kind, degree)
    predicted = cheap.predict(X)
    if kind == "multiplicative":
        return _multiplied(cheap, X, y, predicted, degree)
    scale = _slopes(predicted, y) if kind == "scaled" else np.ones(y.shape[1])
    fit = PolynomialRegressor(degree=degree, selection="evidence", space=cheap.factors, responses=cheap.responses).fit(
        X, y - scale * predicted
    )
    rows = _sum(_rows(cheap.terms, cheap.coefficients * scale), _rows(fit.surrogate_.terms, fit.coef_))
    return Corrected(_with(cheap, rows), kind, scale, np.asarray(fit.loo_rmse_))


def _checked(
    cheap: Surrogate, X: ArrayLike, y: ArrayLike, kind: str, degree: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    X, y = np.asarray(X, dtype=np.float64), np.asarray(y, dtype=np.float64)
    if kind not in KINDS:
        raise ValueError(f"kind must be one of {', '.join(KINDS)}, got {kind!r}")
    lowest = 0 if kind == "multiplicative" else 1
    if isinstance(degree, bool) or not isinstance(degree, (int, np.integer)) or degree < lowest:
        raise ValueError(f"the degree of a correction {kind!r} must be a whole number from {lowest}, got {degree!r}")
    if cheap.has_logs:
        raise ValueError("the cheap model has logarithms of responses; fit it with response_transform='none'")
    expected = (len(cheap.factors), len(cheap.responses))
    if X.ndim != 2 or y.ndim != 2 or len(X) != len(y) or (X.shape[1], y.shape[1]) != expected:
        raise ValueError(
            f"X and y must be tables of the same runs with {expected[0]} factors and {expected[1]} responses; "
            f"got shapes {X.shape} and {y.shape}"
        )
    if not (np.isfinite(X).all() and np.isfinite(y).all()):
        raise ValueError("X and y must be finite: leave out runs that failed")
    needed = len(_polynomial(cheap.factors, degree)) + 1 if kind == "multiplicative" else 3
    if len(X) < needed:
        raise ValueError(f"correction {kind!r} of degree {degree} needs {needed} runs or more, got {len(X)}")
    return X, y


def _polynomial(space: FactorSpace, degree: int) -> Terms:
    return Terms.polynomial(space.names, degree)


def _slopes(cheap: NDArray[np.float64], dear: NDArray[np.float64]) -> NDArray[np.float64]:
    """Slope of each response's regression line; 1 where the cheap one does not move."""
    from_mean = cheap - cheap.mean(axis=0)
    size = (from_mean**2).sum(axis=0)
    return np.where(size > 0.0, (from_mean * dear).sum(axis=0) / np.where(size > 0.0, size, 1.0), 1.0)


def _multiplied(
    cheap: Surrogate, X: NDArray[np.float64], y: NDArray[np.float64], predicted: NDArray[np.float64], degree: int
) -> Corrected:
    terms = _polynomial(cheap.factors, degree)
    basis = model_matrix(terms, cheap.factors.code(X))
    factor, loo = np.empty((len(terms), y.shape[1])), np.empty(y.shape[1])
    for j in range(y.shape[1]):
        size = np.abs(predicted[:, j]).max() or 1.0
        matrix = basis * (predicted[:, [j]] / size)
        factor[:, j] = np.linalg.lstsq(matrix, y[:, j] / size, rcond=None)[0]
        residual = y[:, j] - size * (matrix @ factor[:, j])
        leverage = np.einsum("ij,ji->i", matrix, np.linalg.pinv(matrix))
        loo[j] = np.sqrt(np.mean((residual / np.maximum(1.0 - leverage, 1e-12)) ** 2))
    rows = _product(_rows(terms, factor), _rows(cheap.terms, cheap.coefficients))
    return Corrected(_with(cheap, rows), "multiplicative", factor[0], loo)


def _rows(terms: Terms, coefficients: NDArray[np.float64]) -> _Rows:
    return dict(zip(terms.exponents, coefficients, strict=True))


def _sum(one: _Rows, other: _Rows) -> _Rows:
    nothing = np.zeros_like(next(iter(one.values())))
    return {key: one.get(key, nothing) + other.get(key, nothing) for key in (*one, *(k for k in other if k not in one))}


def _product(one: _Rows, other: _Rows) -> _Rows:
    found: _Rows = {}
    for left, a in one.items():
        for right, b in other.items():
            key = tuple(i + j for i, j in zip(left, right, strict=True))
            found[key] = found[key] + a * b if key in found else a * b
    return found


def _with(cheap: Surrogate, rows: _Rows) -> Surrogate:
    """The cheap model's factors and responses with other terms, by degree; nothing else of it holds any more."""
    order = sorted(rows, key=lambda row: (sum(row), tuple(-e for e in row)))
    return replace(
        cheap,
        terms=Terms(cheap.terms.names, tuple(order)),
        coefficients=np.array([rows[row] for row in order]),
        validation=(),
        certificate=None,
        provenance={},
        standard_errors=None,
        links=(),
    )

"""Polynomial bases on coded factors: fitted in the one that is best conditioned, kept as monomials."""

from collections.abc import Iterable
from math import sqrt

import numpy as np
from numpy.polynomial import chebyshev, legendre
from numpy.typing import ArrayLike, NDArray

from experiments.terms import Terms

BASES = ("monomial", "legendre", "chebyshev")
"""Legendre polynomials are scaled to a mean square of one on [−1, 1]; Chebyshev's are those of the first kind."""


def basis_matrix(basis: str, terms: Terms, coded: ArrayLike) -> NDArray[np.float64]:
    """Products of basis polynomials on a design; for monomials the model matrix.

    Parameters
    ----------
    basis : str
        One of :data:`BASES`.
    terms : Terms
        The exponents are the degrees of the factors' polynomials.
    coded : array_like, shape (n_runs, n_factors)

    Returns
    -------
    ndarray, shape (n_runs, n_terms)
    """
    values, _ = _one_dimensional(basis, terms, coded)
    return _products([values] * len(terms.names), terms)


def basis_gradient(basis: str, terms: Terms, coded: ArrayLike) -> NDArray[np.float64]:
    """Derivatives of :func:`basis_matrix` by the coded factors, shape (n_runs, n_terms, n_factors)."""
    values, slopes = _one_dimensional(basis, terms, coded)
    n = len(terms.names)
    by_factor = [_products([slopes if j == by else values for j in range(n)], terms) for by in range(n)]
    return np.stack(by_factor, axis=-1) if n else np.zeros((len(np.asarray(coded)), len(terms), 0))


def power_matrix(basis: str, degree: int) -> NDArray[np.float64]:
    """Power coefficients of the basis polynomials of one factor, a column each, shape (degree + 1, degree + 1)."""
    if basis == "monomial":
        return np.eye(degree + 1)
    change = legendre.leg2poly if basis == "legendre" else chebyshev.cheb2poly
    matrix = np.zeros((degree + 1, degree + 1))
    for d in range(degree + 1):
        matrix[: d + 1, d] = change(np.eye(d + 1)[d])
        if basis == "legendre":
            matrix[:, d] *= sqrt(2 * d + 1)
    return matrix


def as_monomials(basis: str, terms: Terms, columns: Iterable[int]) -> tuple[Terms, NDArray[np.float64]]:
    """Some columns of a basis written in monomials.

    Parameters
    ----------
    basis : str
    terms : Terms
    columns : iterable of int, length n_columns
        Positions in `terms`.

    Returns
    -------
    Terms
        The monomials that occur, by degree.
    ndarray, shape (n_monomials, n_columns)
        ``monomials = change @ coefficients``.
    """
    chosen = [terms.exponents[int(i)] for i in columns]
    if basis == "monomial":
        return Terms(terms.names, tuple(chosen)), np.eye(len(chosen))
    powers = power_matrix(basis, max((e for row in chosen for e in row), default=0))
    parts = [_expanded(row, powers) for row in chosen]
    found = sorted({row for part in parts for row in part}, key=lambda row: (sum(row), tuple(-e for e in row)))
    order = {row: i for i, row in enumerate(found)}
    change = np.zeros((len(order), len(chosen)))
    for column, part in enumerate(parts):
        for row, value in part.items():
            change[order[row], column] = value
    return Terms(terms.names, tuple(found)), change


def check_basis(basis: object) -> None:
    """``ValueError`` if there is no such basis."""
    if basis not in BASES:
        raise ValueError(f"basis must be one of {', '.join(BASES)}, got {basis!r}")


def _expanded(row: tuple[int, ...], powers: NDArray[np.float64]) -> dict[tuple[int, ...], float]:
    """Monomials of a product of basis polynomials, with their coefficients."""
    parts: dict[tuple[int, ...], float] = {(): 1.0}
    for degree in row:
        column = powers[: degree + 1, degree]
        parts = {
            (*lower, power): value * float(column[power])
            for lower, value in parts.items()
            for power in np.flatnonzero(column).tolist()
        }
    return parts


def _one_dimensional(basis: str, terms: Terms, coded: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Values and slopes of the basis polynomials, each of shape (degree + 1, n_runs, n_factors)."""
    x = np.asarray(coded, dtype=np.float64)
    if x.ndim != 2 or x.shape[1] != len(terms.names):
        raise ValueError(f"coded settings must have shape (n_runs, {len(terms.names)}); got {x.shape}")
    highest = max((e for row in terms.exponents for e in row), default=0)
    values, slopes = np.ones((highest + 1, *x.shape)), np.zeros((highest + 1, *x.shape))
    for d in range(1, highest + 1):
        if basis == "monomial" or d == 1:
            values[d] = x * values[d - 1]
            slopes[d] = d * values[d - 1]
        elif basis == "legendre":
            values[d] = ((2 * d - 1) * x * values[d - 1] - (d - 1) * values[d - 2]) / d
            slopes[d] = slopes[d - 2] + (2 * d - 1) * values[d - 1]
        else:
            values[d] = 2.0 * x * values[d - 1] - values[d - 2]
            slopes[d] = 2.0 * values[d - 1] + 2.0 * x * slopes[d - 1] - slopes[d - 2]
    if basis == "legendre":
        size = np.sqrt(2.0 * np.arange(highest + 1) + 1.0)[:, None, None]
        return values * size, slopes * size
    return values, slopes


def _products(tables: list[NDArray[np.float64]], terms: Terms) -> NDArray[np.float64]:
    exponents = np.array(terms.exponents, dtype=np.int64).reshape(len(terms), len(terms.names))
    n_runs = tables[0].shape[1] if tables else 0
    matrix = np.ones((n_runs, len(terms)))
    for j, table in enumerate(tables):
        matrix *= table[exponents[:, j], :, j].T
    return matrix

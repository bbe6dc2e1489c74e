"""Which two-factor interactions hide in which column of a two-level design."""

from itertools import combinations

import numpy as np
from numpy.typing import NDArray

MOST_FACTORS = 30
"""With more factors no products of three are tried as names of a column: they are too many."""


def interaction_columns(factors: NDArray[np.float64]) -> tuple[list[tuple[int, int]], NDArray[np.float64]]:
    """Pairs of factors and their products, shape (n_runs, n_pairs)."""
    pairs = list(combinations(range(factors.shape[1]), 2))
    left, right = (np.array([p[i] for p in pairs], dtype=int) for i in (0, 1))
    return pairs, factors[:, left] * factors[:, right]


def alias_matrix(columns: NDArray[np.float64], n_factors: int) -> NDArray[np.float64]:
    """How much of each two-factor interaction each contrast carries, shape (n_contrasts, n_pairs).

    Parameters
    ----------
    columns : ndarray, shape (n_runs, n_contrasts)
        Orthogonal ±1 columns, the `n_factors` factors first; rows of zeros are left out.
    n_factors : int
        How many of the columns are factors.

    Notes
    -----
    E[effects] = β₁ + A β₂ with A = (X₁'X₁)⁻¹X₁'X₂: Box and Wilson (1951), "On the experimental attainment
    of optimum conditions", J. Roy. Statist. Soc. B 13, 1–45. Here X₁'X₁ is n times the identity.
    """
    _, products = interaction_columns(columns[:, :n_factors])
    return columns.T @ products / np.abs(columns[:, 0]).sum()


def main_effect_aliases(factors: NDArray[np.float64]) -> NDArray[np.float64]:
    """How much of each two-factor interaction each main effect carries by least squares, shape (n_factors, n_pairs).

    Parameters
    ----------
    factors : ndarray, shape (n_runs, n_factors)
        ±1, of full rank with a constant, but not orthogonal: runs are missing. Rows of zeros are left out.

    Notes
    -----
    As :func:`alias_matrix`, where X₁'X₁ is not the identity: even a foldover is not clear without one of its runs.
    """
    here = factors[np.abs(factors).max(axis=1) > 0.0]
    _, products = interaction_columns(here)
    matrix = np.hstack([np.ones((len(here), 1)), here])
    return np.asarray(np.linalg.lstsq(matrix, products, rcond=None)[0][1:], dtype=np.float64)


def named_columns(
    columns: NDArray[np.float64], factors: tuple[str, ...], dummies: tuple[str, ...]
) -> tuple[NDArray[np.float64], tuple[str, ...], tuple[str, ...]]:
    """Columns, their names and the interactions that alias them in full.

    A dummy column that is a product of two factors is named after it and takes its sign; one that carries no
    part of any such product, after a product of more, where the design is small enough to try them all.
    """
    n = len(factors)
    pairs, _ = interaction_columns(columns[:, :n])
    labels = [f"{factors[i]}:{factors[j]}" for i, j in pairs]
    matrix = np.rint(1e9 * alias_matrix(columns, n)) / 1e9
    columns, names, aliases = columns.copy(), list(factors + dummies), [""] * columns.shape[1]
    for c in range(columns.shape[1]):
        whole = np.flatnonzero(np.abs(matrix[c]) == 1.0)
        if c >= n and not matrix[c].any():
            names[c], sign = _higher_product(columns[:, c], columns[:, :n], factors) or (names[c], 1.0)
            columns[:, c] *= sign
        if not len(whole):
            continue
        if c >= n:
            columns[:, c] *= matrix[c, whole[0]]
            names[c] = labels[whole[0]]
            matrix[c] *= matrix[c, whole[0]]
        terms = [(" - " if matrix[c, p] < 0 else " + ") + labels[p] for p in whole]
        aliases[c] = "".join(terms).removeprefix(" + ").lstrip()
    return columns, tuple(names), tuple(aliases)


def _higher_product(
    column: NDArray[np.float64], factors: NDArray[np.float64], names: tuple[str, ...]
) -> tuple[str, float] | None:
    """Name and sign of the lowest product of three or more factors that equals ±`column`, if few must be tried."""
    n = factors.shape[1]
    orders = range(3, n + 1) if n <= 10 else (3,) if n <= MOST_FACTORS else ()
    for order in orders:
        subsets = np.array(list(combinations(range(n), order)), dtype=int)
        if not len(subsets):
            continue
        inner = column @ factors[:, subsets].prod(axis=2)
        found = np.flatnonzero(np.abs(inner) == np.abs(column).sum())
        if found.size:
            return ":".join(names[i] for i in subsets[found[0]]), float(np.sign(inner[found[0]]))
    return None

"""Measures of tables of settings, each a plain function of an array."""

from math import prod

import numpy as np
from numpy.typing import NDArray

from ..terms import Terms

ROUNDING = 1e-9


def rank(matrix: NDArray[np.float64]) -> int:
    """Numerical rank of a model matrix."""
    return int(np.linalg.matrix_rank(matrix, rtol=1e-9))


def correlation(columns: NDArray[np.float64]) -> NDArray[np.float64]:
    """Correlation matrix of columns; a constant one correlates with itself only."""
    centred = columns - columns.mean(axis=0)
    norm = np.linalg.norm(centred, axis=0)
    constant = norm <= ROUNDING
    centred = np.where(constant, 0.0, centred / np.where(constant, 1.0, norm))
    found = centred.T @ centred
    np.fill_diagonal(found, 1.0)
    return found


def minimum_distance(coded: NDArray[np.float64]) -> float:
    """Smallest Euclidean distance of two rows; infinite for one row."""
    squared = [((coded[i + 1 :] - coded[i]) ** 2).sum(axis=1).min() for i in range(len(coded) - 1)]
    return float(np.sqrt(min(squared, default=np.inf)))


def box_moments(terms: Terms) -> NDArray[np.float64]:
    """Mean of every product of two terms over the coded cube, exact, shape (n_terms, n_terms)."""
    rows = np.array(terms.exponents)
    powers = rows[:, None, :] + rows[None, :, :]
    return np.where(powers % 2 == 0, 1.0 / (powers + 1), 0.0).prod(axis=2)


def inflation(columns: NDArray[np.float64]) -> NDArray[np.float64]:
    """Variance inflation of each of the centred columns: infinite where others make it up, or it is constant."""
    norm = np.linalg.norm(columns, axis=0)
    constant = norm <= ROUNDING
    _, singular, rows = np.linalg.svd(columns / np.where(constant, 1.0, norm), full_matrices=True)
    kept = int((singular > ROUNDING * max(singular, default=1.0)).sum())
    aliased = np.linalg.norm(rows[kept:], axis=0) > ROUNDING**0.5
    found = ((rows[:kept] / singular[:kept, None]) ** 2).sum(axis=0)
    return np.where(aliased | constant, np.inf, found)


def two_level_strength(table: NDArray[np.float64]) -> int:
    """Strength of ±1 columns, at most 4: any up to so many of them multiply to a balanced column."""
    k = table.shape[1]
    first, second = np.triu_indices(k, 1)
    pairs = table[:, first] * table[:, second]
    apart = (first[:, None] != np.arange(k)) & (second[:, None] != np.arange(k))
    disjoint = apart[:, first] & apart[:, second]
    found = 0
    for needed, sums in (
        (1, table.sum(axis=0)),
        (2, pairs.sum(axis=0)),
        (3, (pairs.T @ table)[apart]),
        (4, (pairs.T @ pairs)[disjoint]),
    ):
        if needed > k or np.any(sums):
            break
        found = needed
    return found


def complete(columns: NDArray[np.float64]) -> bool:
    """Whether all combinations of the columns' levels appear, equally often."""
    rounded = np.round(columns, 9)
    wanted = prod(len(np.unique(column)) for column in rounded.T)
    if len(rounded) % wanted:
        return False
    found, counts = np.unique(rounded, axis=0, return_counts=True)
    return bool(len(found) == wanted and np.ptp(counts) == 0)

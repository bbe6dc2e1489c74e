"""Discrepancies: how far a set of points is from filling the unit cube evenly."""

import numpy as np
from numpy.typing import ArrayLike, NDArray


def unit_levels(levels: int) -> NDArray[np.float64]:
    """Where `levels` levels sit in [0, 1]: (2k − 1)/(2q) for k = 1 … q, shape (levels,)."""
    return (np.arange(1, levels + 1, dtype=np.float64) - 0.5) / levels


def centred_discrepancy_squared(points: ArrayLike) -> float:
    """Squared centred L2-discrepancy CD₂² of points in the unit cube.

    Parameters
    ----------
    points : array_like, shape (n, s)
        Points in [0, 1]^s.

    Raises
    ------
    ValueError
        If `points` is not two-dimensional or leaves the unit cube.

    Notes
    -----
    Hickernell (1998), "A generalized discrepancy and quadrature error bound", Math. Comp. 67,
    299–322, the centred discrepancy. The square, not the root, is what tables of uniform designs
    usually print.
    """
    points = np.asarray(points, dtype=np.float64)
    if points.ndim != 2 or not ((points >= 0.0) & (points <= 1.0)).all():
        raise ValueError(f"points must be a table of shape (n, s) inside the unit cube; got shape {points.shape}")
    n, s = points.shape
    once = np.ones(n)
    twice = np.ones((n, n))
    for column in points.T:
        single, pair = centred_kernels(column)
        once *= single
        twice *= pair
    return float((13.0 / 12.0) ** s - 2.0 / n * once.sum() + twice.sum() / n**2)


def level_discrepancy_squared(coded: ArrayLike) -> float:
    """CD₂² of a design by the ranks of its levels: level k of q counts as (2k − 1)/(2q), whatever its setting.

    This is how tables of uniform designs are computed. `coded` has shape (n_runs, n_factors) and
    equally spaced levels in each column.
    """
    columns = []
    for column in np.asarray(coded, dtype=np.float64).T:
        found, rank = np.unique(np.round(column, 9), return_inverse=True)
        columns.append(unit_levels(len(found))[rank])
    return centred_discrepancy_squared(np.column_stack(columns))


def centred_kernels(column: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The one-point and two-point factors of CD₂² in one dimension, shapes (n,) and (n, n)."""
    away = np.abs(column - 0.5)
    single = 1.0 + 0.5 * away - 0.5 * away**2
    pair = 1.0 + 0.5 * away[:, None] + 0.5 * away[None, :] - 0.5 * np.abs(column[:, None] - column[None, :])
    return single, pair

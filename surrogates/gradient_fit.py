"""Fits taught by gradients: derivatives enter as weighted rows, the weight chosen by leaving out whole points."""

import numpy as np
from numpy.typing import NDArray

from .fits import Fit
from .selection import folds, noise_level, supported
from .stepwise import as_long, forward_path, parents_of

WEIGHTS = (0.03, 0.1, 0.3, 1.0)
"""Weights tried: of a derivative by a coded factor, beside 1 for a value."""


def gradient_fit(
    matrix: NDArray[np.float64],
    y: NDArray[np.float64],
    gradient: NDArray[np.float64],
    slopes: NDArray[np.float64],
    exponents: NDArray[np.int64],
    heredity: str = "none",
    floor: float = 0.0,
) -> Fit:
    """The smallest model on the forward paths that predicts values as well as the best one.

    Parameters
    ----------
    matrix : ndarray, shape (n_runs, n_terms)
        Model matrix; its column without any exponent is the constant.
    y : ndarray, shape (n_runs,)
    gradient : ndarray, shape (n_runs, n_terms, n_factors)
        Derivatives of the model matrix by the coded factors.
    slopes : ndarray, shape (n_runs, n_factors)
        Derivatives of `y` by the coded factors.
    exponents : ndarray of int, shape (n_terms, n_factors)
    heredity, floor
        As for :func:`.forward_fit`.

    Notes
    -----
    A point that is left out takes its value and its derivatives with it. The number of terms and the weight are
    chosen together by cross-validating whole paths in which points are left out; the residuals kept are those
    of leaving out one point at a time, in closed form: with H the block of the smoother that belongs to a point,
    they are (I − H)⁻¹ times the point's residuals.
    """
    n, p, k = gradient.shape
    rows = np.concatenate([matrix[:, None, :], gradient.transpose(0, 2, 1)], axis=1)
    wanted = np.concatenate([y[:, None], slopes], axis=1)
    parents = parents_of(exponents)
    constants = np.flatnonzero(exponents.sum(axis=1) == 0)
    constant = int(constants[0]) if constants.size else -1
    start = 1 if constant >= 0 else 0
    found: list[tuple[float, Fit]] = []
    for weight in WEIGHTS:
        by = np.concatenate([[1.0], np.full(k, weight)])
        a, b = rows * by[None, :, None], wanted * by
        order, own = forward_path(a.reshape(-1, p), b.ravel(), matrix, parents, heredity, constant)
        small = np.abs(own[:, start:] - y[:, None]).max(axis=0) <= floor
        for step in start + np.flatnonzero(small):
            if (fit := _fit(a, b, np.sort(order[:step]).astype(np.int64))).loo_rmse <= floor:
                return fit
        errors = np.zeros((n, own.shape[1] - start))
        for out in folds(n):
            kept = a[~out].reshape(-1, p), b[~out].ravel()
            _, predicted = forward_path(*kept, matrix[out], parents, heredity, constant)
            errors[out] = y[out, None] - as_long(predicted[:, start:], errors.shape[1])
        step = int(np.flatnonzero(supported(errors, floor))[0])
        fit = _fit(a, b, np.sort(order[: start + step]).astype(np.int64))
        found.append((float(np.mean(errors[:, step] ** 2)), fit))
    return min(found, key=lambda one: one[0])[1]


def _fit(a: NDArray[np.float64], b: NDArray[np.float64], columns: NDArray[np.int64]) -> Fit:
    """Least squares on weighted rows, shapes (n_points, n_rows, n_terms) and (n_points, n_rows)."""
    used = a[:, :, columns]
    flat = used.reshape(-1, len(columns))
    left, sizes, right = np.linalg.svd(flat, full_matrices=False)
    inverse = (right.T / np.where(sizes > 0.0, sizes, np.inf)) @ left.T
    slope = inverse @ b.ravel()
    residuals = b - used @ slope
    smoother = left.reshape(*used.shape[:2], -1)
    blocks = np.eye(b.shape[1]) - np.einsum("prs,pqs->prq", smoother, smoother)
    # A point that a term rests on alone cannot be left out: its block is singular.
    sure = np.linalg.cond(blocks) < 1e10
    out = np.full(len(b), np.inf)
    out[sure] = np.linalg.solve(blocks[sure], residuals[sure][..., None])[:, 0, 0]
    spread = np.sqrt((inverse**2).sum(axis=1))
    strength = np.abs(slope) / np.where(spread > 0.0, spread, np.inf)
    root = inverse @ left * noise_level(residuals, b.size - len(columns))
    return Fit(columns, slope, 0.0, out, strength, root)

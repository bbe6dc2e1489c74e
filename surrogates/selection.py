"""Penalty and terms by exact leave-one-out: what the data support, and no more."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

PENALTIES = (0.0, *np.geomspace(1e-12, 1.0, 25))
"""Ridge penalties tried, as fractions of the largest squared singular value of the centred model matrix."""


@dataclass(frozen=True, eq=False)
class Fit:
    """One response fitted on some columns of a model matrix.

    Parameters
    ----------
    columns : ndarray of int, shape (n_used,)
        Columns used.
    coefficients : ndarray, shape (n_used,)
    penalty : float
        The relative ridge penalty chosen.
    loo : ndarray, shape (n_runs,)
        Exact leave-one-out residuals.
    strength : ndarray, shape (n_used,)
        Each coefficient over its standard error, up to the common noise level.
    """

    columns: NDArray[np.int64]
    coefficients: NDArray[np.float64]
    penalty: float
    loo: NDArray[np.float64]
    strength: NDArray[np.float64]

    @property
    def loo_rmse(self) -> float:
        """Root mean square of the leave-one-out residuals."""
        return float(np.sqrt(np.mean(self.loo**2)))


def penalised_fit(
    matrix: NDArray[np.float64],
    y: NDArray[np.float64],
    columns: NDArray[np.int64],
    penalties: tuple[float, ...] = PENALTIES,
    floor: float = 0.0,
) -> Fit:
    """Ridge regression with the penalty of least leave-one-out error; the constant is not penalised.

    Parameters
    ----------
    matrix : ndarray, shape (n_runs, n_terms)
        Model matrix; a column of ones is the constant.
    y : ndarray, shape (n_runs,)
    columns : ndarray of int
        Columns to use.
    penalties : tuple of float
        Candidates, smallest first; of those whose error is below `floor` the first is taken.
    floor : float
        Leave-one-out error that counts as none.

    Notes
    -----
    With the penalty fixed, the residual of run i when it is left out is e_i/(1 − h_ii) exactly, h
    being the diagonal of the smoother (Golub, Heath and Wahba 1979, Technometrics 21, 215–223).
    """
    constant = [i for i, c in enumerate(columns) if (matrix[:, c] == 1.0).all()]
    sloped = np.delete(np.arange(len(columns)), constant)
    X = matrix[:, columns[sloped]]
    shift = X.mean(axis=0) if constant else np.zeros(X.shape[1])
    level = y.mean() if constant else 0.0
    U, s, Vt = np.linalg.svd(X - shift, full_matrices=False)
    keep = s > max(X.shape) * np.finfo(float).eps * s.max(initial=0.0)
    U, s, Vt = U[:, keep], s[keep], Vt[keep]
    projected = U.T @ (y - level)
    best = None
    for penalty in penalties:
        shrink = s**2 / (s**2 + penalty * s.max(initial=0.0) ** 2)
        residual = y - level - U @ (shrink * projected)
        leverage = (1.0 / len(y) if constant else 0.0) + (U**2) @ shrink
        free = 1.0 - leverage
        saturated = free <= 1e-10
        loo = np.where(saturated, np.inf, residual / np.where(saturated, 1.0, free))
        error = float(np.sqrt(np.mean(loo**2)))
        if best is None or error < best[0]:
            best = (error, penalty, shrink, loo)
        if error <= floor:
            break
    assert best is not None
    _, penalty, shrink, loo = best
    slope = Vt.T @ (shrink / s * projected)
    spread = np.sqrt(((Vt.T * (shrink / s)) ** 2).sum(axis=1))
    coefficients, strength = np.zeros(len(columns)), np.full(len(columns), np.inf)
    coefficients[sloped] = slope
    strength[sloped] = np.abs(slope) / np.where(spread > 0.0, spread, np.inf)
    coefficients[constant] = level - shift @ slope
    return Fit(columns, coefficients, penalty, loo, strength)


def trimmed_fit(
    matrix: NDArray[np.float64],
    y: NDArray[np.float64],
    penalties: tuple[float, ...] = PENALTIES,
    floor: float = 0.0,
) -> Fit:
    """The smallest model on the backward path that predicts as well as the best one.

    Terms leave one at a time, the weakest first. Of all models met, the smallest is kept whose mean
    squared leave-one-out error is within one standard error of the least, or below `floor`: more
    terms are not supported by these data. The constant is judged last, by the same rule.

    Notes
    -----
    The one-standard-error rule is Breiman, Friedman, Olshen and Stone (1984), *Classification and
    Regression Trees*, section 3.4.3.
    """
    columns = np.arange(matrix.shape[1])
    path = [penalised_fit(matrix, y, columns, penalties, floor)]
    while np.isfinite(path[-1].strength).any():
        columns = np.delete(columns, int(np.argmin(path[-1].strength)))
        path.append(penalised_fit(matrix, y, columns, penalties, floor))
    best = min(path, key=lambda fit: fit.loo_rmse)
    chosen = next(fit for fit in reversed(path) if _as_good(fit, best, floor))
    sloped = np.array([c for c in chosen.columns if not (matrix[:, c] == 1.0).all()], dtype=np.int64)
    if len(sloped) < len(chosen.columns):
        without = penalised_fit(matrix, y, sloped, penalties, floor)
        if _as_good(without, best, floor):
            return without
    return chosen


def _as_good(fit: Fit, best: Fit, floor: float) -> bool:
    squares = best.loo**2
    if not np.isfinite(squares).all():
        return fit is best
    error = float(squares.std(ddof=1) / np.sqrt(len(squares)))
    return fit.loo_rmse**2 <= max(float(squares.mean()) + error, floor**2)

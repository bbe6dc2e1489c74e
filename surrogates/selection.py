"""Penalty and terms by exact leave-one-out: what the data support, and no more."""

import numpy as np
from numpy.typing import NDArray

from .fits import Fit

PENALTIES = (0.0, *np.geomspace(1e-12, 1.0, 25))
"""Ridge penalties tried, as fractions of the largest squared singular value of the centred model matrix."""

FOLDS = 10
"""Folds in which the choice of the number of terms is repeated, removal of terms included."""


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
        Model matrix; its first column of ones is the constant. A further one (a square on two levels)
        cannot be told from it and gets the coefficient zero.
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
    constant = [i for i, c in enumerate(columns) if c == constant_column(matrix)]
    sloped = np.delete(np.arange(len(columns)), constant)
    X = matrix[:, columns[sloped]]
    shift = X.mean(axis=0) if constant else np.zeros(X.shape[1])
    level = y.mean() if constant else 0.0
    U, s, Vt = np.linalg.svd(X - shift, full_matrices=False)
    keep = s > max(X.shape) * np.finfo(float).eps * s.max(initial=0.0)
    U, s, Vt = U[:, keep], s[keep], Vt[keep]
    projected = U.T @ (y - level)
    # All penalties at once: one row each.
    ridge = np.asarray(penalties)[:, None] * s.max(initial=0.0) ** 2
    shrinks = s**2 / (s**2 + ridge)
    residuals = y - level - (shrinks * projected) @ U.T
    free = 1.0 - (1.0 / len(y) if constant else 0.0) - shrinks @ (U**2).T
    saturated = free <= 1e-10
    loos = np.where(saturated, np.inf, residuals / np.where(saturated, 1.0, free))
    errors = np.sqrt(np.mean(loos**2, axis=1))
    good = np.flatnonzero(errors <= floor)
    best = int(good[0]) if good.size else int(np.argmin(errors))
    penalty, shrink, loo = penalties[best], shrinks[best], loos[best]
    slope = Vt.T @ (shrink / s * projected)
    spread = np.sqrt(((Vt.T * (shrink / s)) ** 2).sum(axis=1))
    coefficients, strength = np.zeros(len(columns)), np.full(len(columns), np.inf)
    coefficients[sloped] = slope
    strength[sloped] = np.abs(slope) / np.where(spread > 0.0, spread, np.inf)
    coefficients[constant] = level - shift @ slope
    root = np.zeros((len(columns), len(s) + 1))
    root[sloped, : len(s)] = Vt.T * (shrink / s)
    root[constant, : len(s)] = -shift @ root[sloped, : len(s)]
    root[constant, len(s)] = 1.0 / np.sqrt(len(y))
    noise = noise_level(residuals[best], float(free[best].sum()))
    return Fit(columns, coefficients, penalty, loo, strength, noise * root)


def trimmed_fit(
    matrix: NDArray[np.float64],
    y: NDArray[np.float64],
    penalties: tuple[float, ...] = PENALTIES,
    floor: float = 0.0,
) -> Fit:
    """The smallest model on the backward path that predicts as well as the best one.

    Terms leave one at a time, the weakest first. If a model on that path predicts to `floor`, the
    smallest such is taken: the data are explained. Otherwise the *number* of terms is chosen by
    cross-validation of the whole procedure, the removal of terms included, and the smallest number
    within one standard error of the best is taken: more terms are not supported by these data. The
    constant is judged last, by its leave-one-out error.

    Notes
    -----
    Leave-one-out residuals of a model whose terms were picked on the same runs are too small, most of
    all with hardly more runs than candidates; removing terms anew in every fold is the cure (Hastie,
    Tibshirani and Friedman 2009, *The Elements of Statistical Learning*, 2nd ed., section 7.10.2). The
    one-standard-error rule is Breiman, Friedman, Olshen and Stone (1984), *Classification and
    Regression Trees*, section 3.4.3.
    """
    path = backward_path(matrix, y, penalties, floor)
    explained = [fit for fit in path if fit.loo_rmse <= floor]
    chosen = explained[-1] if explained else path[_supported_step(matrix, y, floor, path)]
    sloped = chosen.columns[chosen.columns != constant_column(matrix)]
    if len(sloped) < len(chosen.columns) and np.isfinite(chosen.loo).all():
        without = penalised_fit(matrix, y, sloped, penalties, floor)
        allowed = np.mean(chosen.loo**2) + _standard_error(chosen.loo)
        if np.mean(without.loo**2) <= max(float(allowed), floor**2):
            return without
    return chosen


def constant_column(matrix: NDArray[np.float64]) -> int:
    """Position of the first column of ones; −1 if there is none."""
    ones = np.flatnonzero((matrix == 1.0).all(axis=0))
    return int(ones[0]) if ones.size else -1


def backward_path(
    matrix: NDArray[np.float64], y: NDArray[np.float64], penalties: tuple[float, ...], floor: float
) -> list[Fit]:
    """Fits of all columns, then without the weakest, and so on down to the constant."""
    columns = np.arange(matrix.shape[1])
    path = [penalised_fit(matrix, y, columns, penalties, floor)]
    while np.isfinite(path[-1].strength).any():
        columns = np.delete(columns, int(np.argmin(path[-1].strength)))
        path.append(penalised_fit(matrix, y, columns, penalties, floor))
    return path


def _supported_step(matrix: NDArray[np.float64], y: NDArray[np.float64], floor: float, path: list[Fit]) -> int:
    """How many terms to remove, by cross-validation of the whole path."""
    penalties = [fit.penalty for fit in path]
    errors = np.zeros((len(y), len(path)))
    for out in folds(len(y)):
        predicted = _path_predictions(matrix[~out], y[~out], matrix[out], penalties, constant_column(matrix))
        errors[out] = y[out, None] - predicted
    return int(np.flatnonzero(supported(errors, floor))[-1])


def folds(n_runs: int) -> list[NDArray[np.bool_]]:
    """Which runs are left out, one mask per fold.

    Dealt in one fixed shuffled order: runs in standard order have patterns that a plain count would follow.
    """
    n_folds = min(n_runs, FOLDS)
    fold = np.random.default_rng(0).permutation(n_runs) % n_folds
    return [fold == k for k in range(n_folds)]


def supported(errors: NDArray[np.float64], floor: float) -> NDArray[np.bool_]:
    """Which models predict within one standard error of the best, or to `floor`.

    Parameters
    ----------
    errors : ndarray, shape (n_runs, n_models)
        Of each run, predicted without it.
    """
    squares = np.mean(errors**2, axis=0)
    best = int(np.argmin(squares))
    return squares <= max(squares[best] + _standard_error(errors[:, best]), floor**2)


def _path_predictions(
    matrix: NDArray[np.float64],
    y: NDArray[np.float64],
    asked: NDArray[np.float64],
    penalties: list[float],
    constant: int,
) -> NDArray[np.float64]:
    """Predictions at the rows `asked` by each model of a backward path with given penalties, (n_asked, n_steps).

    The same path as :func:`backward_path`, but on the normal equations, which is much cheaper where
    no leave-one-out error is needed.
    """
    sloped = np.flatnonzero(np.arange(matrix.shape[1]) != constant)
    has_constant = constant >= 0
    shift = matrix[:, sloped].mean(axis=0) if has_constant else np.zeros(len(sloped))
    level = y.mean() if has_constant else 0.0
    centred, asked = matrix[:, sloped] - shift, asked[:, sloped] - shift
    gram, moment = centred.T @ centred, centred.T @ (y - level)
    used = np.arange(len(sloped))
    predictions = np.full((len(asked), len(penalties)), level)
    for step, penalty in enumerate(penalties):
        if not used.size:
            break
        eigenvalues, vectors = np.linalg.eigh(gram[np.ix_(used, used)])
        largest = max(eigenvalues[-1], 0.0)
        sure = eigenvalues > len(used) * np.finfo(float).eps * largest
        eigenvalues, vectors = eigenvalues[sure], vectors[:, sure]
        damped = eigenvalues + penalty * largest
        slope = vectors @ (vectors.T @ moment[used] / damped)
        predictions[:, step] += asked[:, used] @ slope
        spread = np.sqrt((vectors**2 * (eigenvalues / damped**2)).sum(axis=1))
        used = np.delete(used, int(np.argmin(np.abs(slope) / np.where(spread > 0.0, spread, np.inf))))
    return predictions


def noise_level(residuals: NDArray[np.float64], free: float) -> float:
    """Standard deviation of the noise from residuals of a fit that leaves `free` degrees of freedom; NaN if none."""
    return float(np.sqrt(np.sum(residuals**2) / free)) if free > 1e-6 else np.nan


def _standard_error(residuals: NDArray[np.float64]) -> float:
    """Standard error of the mean square of the residuals; infinite if a residual is."""
    squares = residuals**2
    return float(squares.std(ddof=1) / np.sqrt(len(squares))) if np.isfinite(squares).all() else np.inf

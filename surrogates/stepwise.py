"""Forward selection: terms enter one at a time, also where there are more candidates than runs."""

import numpy as np
from numpy.typing import NDArray

from .fits import Fit
from .paths import adaptive_lasso_order, lars_order
from .selection import constant_column, folds, penalised_fit, supported

PATHS = ("forward", "lars", "adaptive_lasso")
HEREDITIES = ("none", "weak", "strong")

Entered = tuple[list[int], NDArray[np.float64]]
"""Columns in the order in which they enter, and what each model on the way predicts, (n_asked, n_steps + 1)."""

FULLEST = 0.6
"""At most so many terms a run: what follows explains the runs without predicting any other."""

INDEPENDENT = 1e-10
"""A candidate counts as new if more than this part of its square is left beside the terms chosen."""


def forward_fit(
    matrix: NDArray[np.float64],
    y: NDArray[np.float64],
    exponents: NDArray[np.int64],
    heredity: str = "none",
    floor: float = 0.0,
    path: str = "forward",
) -> Fit:
    """The smallest model on a path of terms entering that predicts as well as the best one.

    On the forward path the term that lowers the residual most enters next; others are in :mod:`.paths`. If a model on
    the path predicts its runs, each left out, to `floor`, the smallest such is taken. Otherwise the number of terms is
    chosen by cross-validation of the whole path, the choice of terms included, by the one-standard-error rule.

    Parameters
    ----------
    matrix : ndarray, shape (n_runs, n_terms)
        Model matrix; may have more columns than rows.
    y : ndarray, shape (n_runs,)
    exponents : ndarray of int, shape (n_terms, n_factors)
        Of the terms, for heredity.
    heredity : str
        ``"none"``; ``"weak"``: a term above degree one needs one of the terms that it is a factor times;
        ``"strong"``: all of them.
    floor : float
        Leave-one-out error that counts as none.
    path : str
        One of :data:`PATHS`; heredity is kept by the forward one only.

    Notes
    -----
    Orthogonal matching pursuit: Pati, Rezaiifar and Krishnaprasad (1993), 27th Asilomar Conference, 40–44.
    Heredity: Chipman (1996), "Bayesian variable selection with related predictors", Canadian J. Statistics 24,
    17–36. Cross-validating the path and not its end keeps the estimate honest where candidates outnumber runs
    (Hastie, Tibshirani and Friedman, 2009, The Elements of Statistical Learning, 2nd ed., section 7.10.2).
    """
    parents = parents_of(exponents)
    constant = constant_column(matrix)
    start = 1 if constant >= 0 else 0

    def entering(rows: NDArray[np.float64], values: NDArray[np.float64], asked: NDArray[np.float64]) -> Entered:
        if path == "forward":
            return forward_path(rows, values, asked, parents, heredity, constant)
        order_by = lars_order if path == "lars" else adaptive_lasso_order
        return _in_order(rows, values, asked, order_by(rows, values, max(1, int(FULLEST * len(values)))))

    order, _ = entering(matrix, y, matrix[:0])
    steps = [
        penalised_fit(matrix, y, np.sort(order[:k]).astype(np.int64), (0.0,), floor)
        for k in range(start, len(order) + 1)
    ]
    explained = [fit for fit in steps if fit.loo_rmse <= floor]
    if explained:
        return explained[0]
    errors = np.zeros((len(y), len(steps)))
    for out in folds(len(y)):
        _, predicted = entering(matrix[~out], y[~out], matrix[out])
        errors[out] = y[out, None] - as_long(predicted[:, start:], len(steps))
    return steps[int(np.flatnonzero(supported(errors, floor))[0])]


def as_long(predicted: NDArray[np.float64], steps: int) -> NDArray[np.float64]:
    """Predictions of a path, the last model standing for those that a shorter path does not have."""
    return predicted[:, np.minimum(np.arange(steps), predicted.shape[1] - 1)]


def forward_path(
    matrix: NDArray[np.float64],
    y: NDArray[np.float64],
    asked: NDArray[np.float64],
    parents: list[list[int]],
    heredity: str,
    constant: int,
) -> tuple[list[int], NDArray[np.float64]]:
    """Columns in the order in which they enter, and what each model on the way predicts at the rows `asked`.

    Columns are made orthogonal as they enter (modified Gram–Schmidt), rows asked being transformed alike.

    Parameters
    ----------
    matrix, y, asked : ndarray, shape (n_rows, n_terms), (n_rows,) and (n_asked, n_terms)
    parents, heredity
        See :func:`parents_of`.
    constant : int
        The column that enters first; −1 for none.

    Returns
    -------
    list of int, length n_steps
    ndarray, shape (n_asked, n_steps + 1)
    """
    rest, there, residual = matrix.copy(), asked.copy(), y.astype(np.float64)
    sizes = (matrix**2).sum(axis=0)
    order: list[int] = []
    predictions: list[NDArray[np.float64]] = [np.zeros(len(asked))]
    entering = constant
    while True:
        if entering < 0:
            left = (rest**2).sum(axis=0)
            may = (left > INDEPENDENT * sizes) & _eligible(order, parents, heredity, len(sizes))
            may[order] = False
            if len(order) >= max(1, int(FULLEST * len(y))) or not may.any() or not residual.any():
                return order, np.column_stack(predictions)
            gain = np.where(may, (rest.T @ residual) ** 2 / np.where(left > 0.0, left, 1.0), -1.0)
            entering = int(np.argmax(gain))
        length = float(np.linalg.norm(rest[:, entering]))
        direction: NDArray[np.float64] = rest[:, entering] / length
        shadow: NDArray[np.float64] = there[:, entering] / length
        along, share = direction @ rest, float(direction @ residual)
        rest = rest - np.outer(direction, along)
        there = there - np.outer(shadow, along)
        residual = residual - direction * share
        predictions.append(np.asarray(predictions[-1] + shadow * share, dtype=np.float64))
        order.append(entering)
        entering = -1


def _in_order(
    matrix: NDArray[np.float64], y: NDArray[np.float64], asked: NDArray[np.float64], order: list[int]
) -> Entered:
    """As :func:`forward_path` returns, for columns that enter in a given order; dependent ones are left out."""
    _, triangle = np.linalg.qr(matrix[:, order])
    new = np.abs(np.diag(triangle)) > np.sqrt(INDEPENDENT) * np.linalg.norm(matrix[:, order[: len(triangle)]], axis=0)
    order = [column for column, is_new in zip(order, new, strict=False) if is_new]
    directions, triangle = np.linalg.qr(matrix[:, order])
    shadows = np.linalg.solve(triangle.T, asked[:, order].T).T * (directions.T @ y)
    predictions = np.hstack([np.zeros((len(asked), 1)), np.cumsum(shadows, axis=1)])
    return order, predictions


def parents_of(exponents: NDArray[np.int64]) -> list[list[int]]:
    """For each term, the candidates that it is a factor times; the constant is nobody's parent."""
    position = {tuple(row): i for i, row in enumerate(exponents.tolist())}
    found = []
    for row in exponents.tolist():
        lowered = [tuple(e - (k == j) for k, e in enumerate(row)) for j in range(len(row)) if row[j] > 0]
        found.append([position[parent] for parent in lowered if any(parent) and parent in position])
    return found


def _eligible(order: list[int], parents: list[list[int]], heredity: str, p: int) -> NDArray[np.bool_]:
    if heredity == "none":
        return np.ones(p, dtype=bool)
    present = set(order)
    enough = all if heredity == "strong" else any
    return np.array([not own or enough(parent in present for parent in own) for own in parents])

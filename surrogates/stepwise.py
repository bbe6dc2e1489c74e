"""Forward selection: terms enter one at a time, also where there are more candidates than runs."""

import numpy as np
from numpy.typing import NDArray

from .selection import Fit, constant_column, folds, penalised_fit, supported

SELECTIONS = ("backward", "forward")
HEREDITIES = ("none", "weak", "strong")

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
) -> Fit:
    """The smallest model on the forward path that predicts as well as the best one.

    The term that lowers the residual most enters next. If a model on the path predicts its runs, each left
    out, to `floor`, the smallest such is taken. Otherwise the number of terms is chosen by cross-validation
    of the whole path, the choice of terms included, by the one-standard-error rule.

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

    Notes
    -----
    Orthogonal matching pursuit: Pati, Rezaiifar and Krishnaprasad (1993), 27th Asilomar Conference, 40–44.
    Heredity: Chipman (1996), "Bayesian variable selection with related predictors", Canadian J. Statistics 24,
    17–36. Cross-validating the path and not its end keeps the estimate honest where candidates outnumber runs
    (Hastie, Tibshirani and Friedman, 2009, The Elements of Statistical Learning, 2nd ed., section 7.10.2).
    """
    parents = parents_of(exponents)
    order = entry_order(matrix, y, parents, heredity)
    start = 1 if constant_column(matrix) >= 0 else 0
    path = [penalised_fit(matrix, y, np.sort(order[:k]), (0.0,), floor) for k in range(start, len(order) + 1)]
    explained = [fit for fit in path if fit.loo_rmse <= floor]
    if explained:
        return explained[0]
    errors = np.full((len(y), len(path)), np.nan)
    for out in folds(len(y)):
        met = entry_order(matrix[~out], y[~out], parents, heredity)
        for step in range(len(path)):
            # A shorter path of the fold ends early; its last model stands for the longer ones.
            used = met[: start + step]
            slope = np.linalg.lstsq(matrix[~out][:, used], y[~out], rcond=None)[0] if used else np.zeros(0)
            errors[out, step] = y[out] - matrix[out][:, used] @ slope
    allowed = supported(errors, floor)
    return path[int(np.flatnonzero(allowed)[0])]


def entry_order(
    matrix: NDArray[np.float64], y: NDArray[np.float64], parents: list[list[int]], heredity: str
) -> list[int]:
    """Columns in the order in which they enter, the constant first if there is one."""
    n, p = matrix.shape
    rest, residual, order = matrix.copy(), y.astype(np.float64), []
    sizes = (matrix**2).sum(axis=0)
    entering = constant_column(matrix)
    while True:
        if entering < 0:
            left = (rest**2).sum(axis=0)
            may = (left > INDEPENDENT * sizes) & _eligible(order, parents, heredity, p)
            may[order] = False
            if len(order) >= max(1, int(FULLEST * n)) or not may.any() or not residual.any():
                return order
            gain = np.where(may, (rest.T @ residual) ** 2 / np.where(left > 0.0, left, 1.0), -1.0)
            entering = int(np.argmax(gain))
        direction = rest[:, entering] / np.linalg.norm(rest[:, entering])
        rest = rest - np.outer(direction, direction @ rest)
        residual = residual - direction * (direction @ residual)
        order.append(entering)
        entering = -1


def parents_of(exponents: NDArray[np.int64]) -> list[list[int]]:
    """For each term, the candidates that it is a factor times; the constant is nobody's parent."""
    position = {tuple(row): i for i, row in enumerate(exponents.tolist())}
    found = []
    for row in exponents.tolist():
        lowered = [tuple(e - (k == j) for k, e in enumerate(row)) for j in range(len(row)) if row[j] > 0]
        found.append([position[parent] for parent in lowered if any(parent) and parent in position])
    return found


def check_selection(selection: object, heredity: object) -> None:
    """``ValueError`` if there is no such selection or heredity, or they do not go together."""
    if selection not in SELECTIONS:
        raise ValueError(f"selection must be one of {', '.join(SELECTIONS)}, got {selection!r}")
    if heredity not in HEREDITIES:
        raise ValueError(f"heredity must be one of {', '.join(HEREDITIES)}, got {heredity!r}")
    if selection == "backward" and heredity != "none":
        raise ValueError(f"heredity {heredity!r} needs selection 'forward'")


def _eligible(order: list[int], parents: list[list[int]], heredity: str, p: int) -> NDArray[np.bool_]:
    if heredity == "none":
        return np.ones(p, dtype=bool)
    present = set(order)
    enough = all if heredity == "strong" else any
    return np.array([not own or enough(parent in present for parent in own) for own in parents])

"""Other orders in which terms may enter: least-angle regression and the adaptive lasso.

Both only say in which order; coefficients are those of least squares on the terms that have entered, and their number
is chosen as for the forward path.
"""

import numpy as np
from numpy.typing import NDArray

from .selection import PENALTIES, constant_column, penalised_fit

Floats = NDArray[np.float64]

ADAPTED = 1.0
"""Power of the first estimate by which the adaptive lasso lowers its penalty (γ of Zou, 2006)."""


def lars_order(matrix: Floats, y: Floats, most: int) -> list[int]:
    """Columns in the order of least-angle regression, the constant first.

    Parameters
    ----------
    matrix, y : ndarray, shape (n_runs, n_terms) and (n_runs,)
    most : int
        So many columns at most.

    Notes
    -----
    Efron, Hastie, Johnstone and Tibshirani (2004), "Least angle regression", Annals of Statistics 32, 407–499; their
    section 7 for least squares on the terms entered.
    """
    return _lasso_order(matrix, y, most, "lar", np.ones(matrix.shape[1]))


def adaptive_lasso_order(matrix: Floats, y: Floats, most: int) -> list[int]:
    """Columns in the order in which the adaptive lasso first takes them, the constant first.

    Parameters
    ----------
    matrix, y, most
        As for :func:`lars_order`.

    Notes
    -----
    Zou (2006), "The adaptive lasso and its oracle properties", J. American Statistical Association 101, 1418–1429,
    section 3; the first estimate is the ridge of least leave-one-out error, which exists where terms outnumber runs.
    """
    first = penalised_fit(matrix, y, np.arange(matrix.shape[1]), PENALTIES)
    sizes = np.abs(first.coefficients) * matrix.std(axis=0)
    return _lasso_order(matrix, y, most, "lasso", sizes**ADAPTED)


def _lasso_order(matrix: Floats, y: Floats, most: int, method: str, weights: Floats) -> list[int]:
    from sklearn.linear_model import lars_path

    constant = constant_column(matrix)
    start = [constant] if constant >= 0 else []
    centred = matrix - matrix.mean(axis=0) if start else matrix
    spread = np.sqrt((centred**2).mean(axis=0))
    usable = np.flatnonzero((spread > 1e-10 * np.abs(matrix).max(axis=0, initial=1.0)) & (weights > 0.0))
    usable = usable[usable != constant]
    target = y - y.mean() if start else y
    if not usable.size or not target.any():
        return start
    scaled = centred[:, usable] / spread[usable] * weights[usable]
    # A step of the lasso may also drop a term: more steps than terms.
    _, _, coefficients = lars_path(scaled, target / np.abs(target).max(), method=method, max_iter=2 * most)
    first = np.argmax(coefficients != 0.0, axis=1)
    entered = (coefficients != 0.0).any(axis=1)
    order = [int(usable[i]) for i in np.argsort(first, kind="stable") if entered[i]]
    return (start + order)[:most]

"""Cross-validation: errors of the whole procedure of fitting, on the runs it was fitted to."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from experiments.runs import Response

from .validation import ResponseError, compare


def cross_validate(
    regressor: Any, X: ArrayLike, y: ArrayLike, folds: int = 10, seed: int = 0, jacobian: ArrayLike | None = None
) -> tuple[ResponseError, ...]:
    """Errors at runs that were left out, a fold at a time, while all else was fitted anew: terms, penalty, everything.

    What the whole procedure does to runs it has not seen, without paying for fresh ones; of models fitted to fewer
    runs by a fold, so a little larger than those of the final one. Choosing terms on all runs and leaving out only
    the fit would be too kind (Hastie, Tibshirani & Friedman 2009, *The Elements of Statistical Learning*, 2nd ed.,
    section 7.10.2). ``q2`` is then the cross-validated Q², with PRESS as its sum of squared errors (Allen 1974,
    Technometrics 16, 125–127).

    Parameters
    ----------
    regressor : scikit-learn regressor
        Cloned for every fold, never fitted itself. Its `responses` and `resolution`, if it has them, give names
        and what does not move, as in :func:`.compare`.
    X : array_like, shape (n_runs, n_factors)
        Settings in the factors' units.
    y : array_like, shape (n_runs,) or (n_runs, n_responses)
        Responses, SI.
    folds : int
        From 2 to n_runs, drawn at random and of sizes that differ by one at most; n_runs leaves out one at a time.
    seed : int
        Of the draw.
    jacobian : array_like, shape (n_runs, n_responses, n_factors), optional
        d response / d factor at each run; a run that is left out takes its derivatives along.

    Returns
    -------
    tuple of ResponseError
        One per response; `worst_run` is a row of `X`. No intervals: those need the residuals of one model.

    Raises
    ------
    ValueError
        If the numbers of rows differ or `folds` does not fit; or whatever the regressor refuses.
    """
    X, table = np.asarray(X, dtype=np.float64), np.asarray(y, dtype=np.float64)
    slopes = None if jacobian is None else np.asarray(jacobian, dtype=np.float64)
    if any(len(part) != len(X) for part in (table, slopes) if part is not None):
        raise ValueError(f"X, y and jacobian need one row per run; got {len(X)} in X and {len(table)} in y")
    if isinstance(folds, bool) or not isinstance(folds, (int, np.integer)) or not 2 <= folds <= len(X):
        raise ValueError(f"folds must be a whole number from 2 to the {len(X)} runs, got {folds!r}")
    predicted = np.empty_like(table)
    for out in np.array_split(np.random.default_rng(seed).permutation(len(X)), folds):
        predicted[out] = _predicted_without(regressor, X, table, slopes, out)
    columns = table.reshape(len(X), -1)
    responses = _responses(getattr(regressor, "responses", None), columns.shape[1])
    resolution = float(getattr(regressor, "resolution", 0.0))
    return compare(responses, columns, predicted.reshape(columns.shape), resolution, X)


def leave_one_out(
    regressor: Any, X: ArrayLike, y: ArrayLike, jacobian: ArrayLike | None = None
) -> tuple[ResponseError, ...]:
    """As :func:`cross_validate` with every run its own fold: as many fits as runs, and nothing left to chance."""
    return cross_validate(regressor, X, y, len(np.asarray(X)), jacobian=jacobian)


def _predicted_without(
    regressor: Any,
    X: NDArray[np.float64],
    y: NDArray[np.float64],
    jacobian: NDArray[np.float64] | None,
    out: NDArray[np.int64],
) -> NDArray[np.float64]:
    """Predictions at the rows `out` of a fit to all other rows."""
    from sklearn.base import clone  # here, so that a model loads and predicts without scikit-learn

    stay = np.setdiff1d(np.arange(len(X)), out)
    taught = () if jacobian is None else (jacobian[stay],)
    fitted: Any = clone(regressor)
    return np.reshape(fitted.fit(X[stay], y[stay], *taught).predict(X[out]), y[out].shape)


def _responses(given: Sequence[Response] | None, count: int) -> tuple[Response, ...]:
    return tuple(given) if given is not None else tuple(Response(f"y{j + 1}", "1") for j in range(count))

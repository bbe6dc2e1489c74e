"""Peers of scikit-learn: polynomial features with the lasso and with ridge regression."""

import math
from typing import Any

import numpy as np

from .functions import Floats
from .methods import Method, Predict, each_response

MOST_RIDGE, MOST_LASSO = 500, 300
"""Candidates: the highest degree has no more terms. Coordinate descent on correlated monomials takes long."""


def candidate_degrees(n_inputs: int, most: int) -> list[int]:
    """Total degrees from 1 to 8 whose full polynomial has at most `most` terms."""
    return [degree for degree in range(1, 9) if math.comb(n_inputs + degree, degree) <= most]


def folds() -> Any:
    """The same ten folds for every degree, so that their errors compare."""
    from sklearn.model_selection import KFold

    return KFold(10, shuffle=True, random_state=0)


def _lasso(X: Floats, y: Floats, slopes: Floats) -> Predict:
    from sklearn.linear_model import LassoCV

    # The default path ends at 1e-3 of its first penalty: too soon for maps that are polynomials but for little.
    def make() -> LassoCV:
        return LassoCV(cv=folds(), eps=1e-4, max_iter=10000)

    return _best(X, y, MOST_LASSO, make, lambda model: model.mse_path_.mean(axis=-1).min())


def _ridge(X: Floats, y: Floats, slopes: Floats) -> Predict:
    from sklearn.linear_model import RidgeCV

    return _best(
        X, y, MOST_RIDGE, lambda: RidgeCV(alphas=np.logspace(-10, 3, 40)), lambda model: -float(model.best_score_)
    )


def _best(X: Floats, y: Floats, most: int, make: Any, error: Any) -> Predict:
    """The degree whose own cross-validated mean square is least."""
    from sklearn.pipeline import make_pipeline
    from sklearn.preprocessing import PolynomialFeatures, StandardScaler

    found: list[tuple[float, Any]] = []
    for degree in candidate_degrees(X.shape[1], most):
        model = make()
        pipeline = make_pipeline(PolynomialFeatures(degree, include_bias=False), StandardScaler(), model).fit(X, y)
        found.append((float(error(model)), pipeline))
    return min(found, key=lambda one: one[0])[1].predict


METHODS = (
    Method(
        "scikit-learn LassoCV",
        "PolynomialFeatures, StandardScaler, LassoCV with 10 folds, eps = 1e-4, 10 000 sweeps; "
        f"degrees 1 to 8 with at most {MOST_LASSO} candidates, chosen by cross-validation",
        ("sklearn", "sklearn.linear_model", "sklearn.preprocessing"),
        False,
        each_response(_lasso),
    ),
    Method(
        "scikit-learn RidgeCV",
        "PolynomialFeatures, StandardScaler, RidgeCV with 40 penalties from 1e-10 to 1e3, leave-one-out; "
        f"degrees 1 to 8 with at most {MOST_RIDGE} candidates, chosen by leave-one-out",
        ("sklearn", "sklearn.linear_model", "sklearn.preprocessing"),
        False,
        each_response(_ridge),
    ),
)

"""Verification of cross-validation: the exact leave-one-out of least squares, and procedures that choose anew."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from sklearn.base import BaseEstimator, RegressorMixin
from sklearn.feature_selection import SelectKBest, f_regression
from sklearn.linear_model import LinearRegression
from sklearn.pipeline import make_pipeline

from experiments import Response
from surrogates import PolynomialRegressor
from surrogates.cross_validation import cross_validate, leave_one_out


def linear_data(n=40, seed=0):
    rng = np.random.default_rng(seed)
    X = rng.uniform(-1.0, 1.0, (n, 3))
    return X, X @ np.array([[1.0, 0.0], [2.0, -1.0], [0.0, 3.0]]) + 0.1 * rng.normal(size=(n, 2))


def test_leave_one_out_of_least_squares_is_the_residual_over_one_minus_leverage():
    """Golub, Heath & Wahba (1979), Technometrics 21, 215–223."""
    X, Y = linear_data()
    matrix = np.column_stack([np.ones(len(X)), X])
    hat = matrix @ np.linalg.pinv(matrix)
    left_out = (Y - hat @ Y) / (1.0 - np.diag(hat))[:, None]
    found = leave_one_out(LinearRegression(), X, Y)
    assert [e.response for e in found] == ["y1", "y2"]
    assert_allclose([e.rmse for e in found], np.sqrt((left_out**2).mean(axis=0)), rtol=1e-10)
    assert_allclose([e.max_abs for e in found], np.abs(left_out).max(axis=0), rtol=1e-10)
    variance = ((Y - Y.mean(axis=0)) ** 2).sum(axis=0)
    assert_allclose([e.q2 for e in found], 1.0 - (left_out**2).sum(axis=0) / variance, rtol=1e-10)
    worst = np.abs(left_out).argmax(axis=0)
    assert [e.worst_run for e in found] == worst.tolist()
    assert [e.worst_point for e in found] == [tuple(row) for row in X[worst].tolist()]
    assert all(e.intervals == () for e in found)


class Recorder(RegressorMixin, BaseEstimator):
    """Predicts the mean; notes the rows it was given, to which `y` and the Jacobian must belong."""

    def fit(self, X, y, jacobian=None):
        SEEN.append((X[:, 0].astype(int).tolist(), y, jacobian))
        self.mean_ = y.mean(axis=0)
        return self

    def predict(self, X):
        SEEN[-1] += (X[:, 0].astype(int).tolist(),)
        return np.broadcast_to(self.mean_, (len(X), *np.shape(self.mean_)))


SEEN: list[tuple] = []


@pytest.mark.parametrize(("folds", "sizes"), [(10, {2, 3}), (2, {12, 13}), (25, {1})])
@pytest.mark.parametrize("columns", [None, 1, 2])
def test_every_run_is_predicted_once_by_a_fit_to_all_others(folds, sizes, columns):
    SEEN.clear()
    index = np.arange(25.0)
    y = index if columns is None else np.column_stack([index] * columns)
    jacobian = np.broadcast_to(index[:, None, None], (25, columns or 1, 2)).copy()
    found = cross_validate(Recorder(), np.column_stack([index, index]), y, folds, jacobian=jacobian)
    assert len(SEEN) == folds
    assert sorted(row for *_, out in SEEN for row in out) == list(range(25))
    for stay, seen, slopes, out in SEEN:
        assert sorted(stay + out) == list(range(25))
        assert len(out) in sizes
        assert np.reshape(seen, (len(stay), -1))[:, 0].tolist() == stay
        assert slopes[:, 0, 0].tolist() == stay
    assert len(found) == (columns or 1)


def test_the_mean_alone_has_the_q2_of_leaving_one_out():
    """A mean without run i misses it by n/(n − 1) times its deviation: Q² = 1 − (n/(n − 1))²."""
    y = np.random.default_rng(1).normal(size=20)
    (error,) = leave_one_out(Recorder(), np.arange(20.0)[:, None], y)
    assert error.q2 == pytest.approx(1.0 - (20.0 / 19.0) ** 2, rel=1e-12)


def test_terms_that_were_chosen_on_noise_are_seen_through():
    """Hastie, Tibshirani & Friedman (2009), section 7.10.2: the choice belongs inside the folds."""
    rng = np.random.default_rng(2)
    X, y = rng.normal(size=(50, 2000)), rng.normal(size=50)
    procedure = make_pipeline(SelectKBest(f_regression, k=10), LinearRegression())
    fitted = procedure.fit(X, y)
    assert fitted.score(X, y) > 0.7  # what the same runs say
    chosen = fitted[0].get_support()
    assert cross_validate(LinearRegression(), X[:, chosen], y)[0].q2 > 0.4  # the choice outside of the folds
    for errors in (cross_validate(procedure, X, y), leave_one_out(procedure, X, y)):
        assert errors[0].q2 < 0.0


def test_of_a_polynomial_that_is_exact():
    rng = np.random.default_rng(3)
    X = rng.uniform(-1.0, 1.0, (30, 2))
    Y = np.column_stack([1.0 + X[:, 0] * X[:, 1], X[:, 0] - X[:, 1] ** 2])
    regressor = PolynomialRegressor(degree=2, responses=(Response("u", "m"), Response("v", "rad")))
    for found in (cross_validate(regressor, X, Y), leave_one_out(regressor, X, Y)):
        assert [e.response for e in found] == ["u", "v"]
        assert max(e.max_relative for e in found) < 1e-9
        assert min(e.q2 or 0.0 for e in found) > 1.0 - 1e-12
    assert not hasattr(regressor, "surrogate_"), "the given regressor was fitted"


def test_the_seed_draws_the_folds():
    X, Y = linear_data()
    assert cross_validate(LinearRegression(), X, Y) == cross_validate(LinearRegression(), X, Y, seed=0)
    assert cross_validate(LinearRegression(), X, Y) != cross_validate(LinearRegression(), X, Y, seed=1)


@pytest.mark.parametrize("folds", [1, 41, 0, -3, 2.0, True])
def test_folds_that_cannot_be_are_refused(folds):
    with pytest.raises(ValueError, match=f"folds must be a whole number from 2 to the 40 runs, got {folds!r}"):
        cross_validate(LinearRegression(), *linear_data(), folds)


def test_rows_that_disagree_are_refused():
    X, Y = linear_data()
    with pytest.raises(ValueError, match="need one row per run; got 40 in X and 39 in y"):
        cross_validate(LinearRegression(), X, Y[1:])
    with pytest.raises(ValueError, match="X, y and jacobian need one row per run"):
        cross_validate(LinearRegression(), X, Y, jacobian=np.zeros((39, 2, 3)))

"""The estimator keeps scikit-learn's contract and gives every response its own terms."""

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from sklearn.base import clone
from sklearn.exceptions import NotFittedError
from sklearn.model_selection import GridSearchCV, cross_val_score
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler
from sklearn.utils.estimator_checks import parametrize_with_checks

from experiments import Response
from surrogates import PolynomialRegressor, Surrogate
from tests.surrogates.cases import box, points, surrogate, unit_box


@parametrize_with_checks(
    [
        PolynomialRegressor(),
        PolynomialRegressor(degree=1, penalty=0.0),
        PolynomialRegressor(degree=2, selection="evidence"),
        PolynomialRegressor(degree=3, interactions=False, trim=False),
    ]
)
def test_scikit_learn_contract(estimator, check):
    check(estimator)


def three_responses():
    """Settings in physical units with one linear, one quadratic and one constant response."""
    space = box(("force", 0.0, 10.0), ("length", 0.1, 0.2), ("width", 1e-3, 3e-3))
    terms = ["1", "force", "length", "width", "force:length", "width^2"]
    model = surrogate(space, terms, [[0, 2, 0, -1, 0, 0], [1, 0, 3, 0, 0.5, 0.2], [4, 0, 0, 0, 0, 0]])
    X = points(model, 40)
    return model, X, model.predict(X)


def test_every_response_has_its_own_terms():
    model, X, y = three_responses()
    fitted = PolynomialRegressor(space=model.factors, responses=model.responses).fit(X, y)
    assert [set(t) for t in fitted.terms_] == [{"force", "width"}, {"1", "length", "force:length", "width^2"}, {"1"}]
    assert isinstance(fitted.surrogate_, Surrogate)
    assert set(fitted.surrogate_.terms.labels) == {"1", "force", "length", "width", "force:length", "width^2"}
    assert fitted.surrogate_.factors == model.factors
    assert fitted.surrogate_.responses == model.responses
    fresh = points(model, 100, seed=1)
    assert_allclose(fitted.predict(fresh), model.predict(fresh), rtol=1e-10, atol=1e-10)
    assert_array_equal(fitted.predict(fresh), fitted.surrogate_.predict(fresh))
    for j in range(3):
        assert set(fitted.surrogate_.terms_of(j)) == set(fitted.terms_[j])


def test_coefficients_are_in_coded_units_of_the_space():
    model, X, y = three_responses()
    fitted = PolynomialRegressor(space=model.factors).fit(X, y)
    found = dict(zip(fitted.surrogate_.terms.labels, fitted.coef_[:, 1], strict=True))
    expected = {"1": 1.0, "length": 3.0, "force:length": 0.5, "width^2": 0.2, "force": 0.0, "width": 0.0}
    assert found == pytest.approx(expected, abs=1e-10)
    assert fitted.penalty_.shape == fitted.loo_rmse_.shape == (3,)


def test_one_response_may_be_a_vector():
    model, X, y = three_responses()
    vector, table = (PolynomialRegressor(space=model.factors).fit(X, t) for t in (y[:, 1], y[:, 1:2]))
    assert vector.predict(X).shape == (40,)
    assert table.predict(X).shape == (40, 1)
    assert_array_equal(vector.predict(X), table.predict(X)[:, 0])
    assert vector.score(X, y[:, 1]) == pytest.approx(1.0)


def test_names_come_from_a_data_frame():
    model, X, y = three_responses()
    frame = pd.DataFrame(X, columns=list(model.factors.names))
    fitted = PolynomialRegressor().fit(frame, y)
    assert fitted.surrogate_.factors.names == ("force", "length", "width")
    assert_array_equal(fitted.feature_names_in_, ["force", "length", "width"])
    assert_allclose(fitted.predict(frame), y, atol=1e-9)
    with pytest.raises(ValueError, match="feature names should match"):
        fitted.predict(frame[["width", "force", "length"]])


def test_names_that_cannot_be_factors_are_replaced():
    _, X, y = three_responses()
    fitted = PolynomialRegressor().fit(pd.DataFrame(X, columns=["force [N]", "l", "w"]), y)
    assert fitted.surrogate_.factors.names == ("x1", "x2", "x3")
    assert [r.name for r in fitted.surrogate_.responses] == ["y1", "y2", "y3"]


def test_without_a_space_the_data_s_own_range_is_the_domain():
    _, X, y = three_responses()
    factors = PolynomialRegressor().fit(X, y).surrogate_.factors
    assert_array_equal([f.low for f in factors], X.min(axis=0))
    assert_allclose([f.high for f in factors], X.max(axis=0), rtol=1e-15)


def test_a_setting_that_was_never_varied_does_no_harm():
    X = np.column_stack([np.linspace(-1.0, 1.0, 12), np.full(12, 3.0)])
    fitted = PolynomialRegressor().fit(X, 2.0 * X[:, 0])
    assert fitted.terms_ == (("x1",),)
    assert_allclose(fitted.predict(X), 2.0 * X[:, 0], atol=1e-12)


def test_untrimmed_keeps_every_candidate():
    model, X, y = three_responses()
    fitted = PolynomialRegressor(space=model.factors, trim=False, degree=3).fit(X, y)
    assert all(len(t) == 20 for t in fitted.terms_)
    plain = PolynomialRegressor(space=model.factors, trim=False, interactions=False).fit(X, y)
    assert plain.terms_[0] == ("1", "force", "length", "width", "force^2", "length^2", "width^2")


def test_resolution_decides_what_counts_as_no_error():
    X = np.linspace(-1.0, 1.0, 20)[:, None]
    y = X[:, 0] + 1e-4 * X[:, 0] ** 2
    labels = [PolynomialRegressor(resolution=r).fit(X, y).terms_[0] for r in (1e-12, 1e-2)]
    assert labels[0] == ("x1", "x1^2")
    assert labels[1] == ("x1",)


def test_fitting_does_not_touch_the_settings():
    model, X, y = three_responses()
    estimator = PolynomialRegressor(space=model.factors, responses=model.responses, degree=2)
    before = estimator.get_params()
    estimator.fit(X, y)
    assert estimator.get_params() == before
    copy = clone(estimator)
    assert not hasattr(copy, "surrogate_")
    assert copy.get_params() == before
    assert_array_equal(copy.fit(X, y).coef_, estimator.coef_)


def test_works_in_a_grid_search_over_several_responses():
    model, X, y = three_responses()
    search = GridSearchCV(PolynomialRegressor(space=model.factors), {"degree": [1, 2], "trim": [True, False]}, cv=4)
    search.fit(X, y[:, :2])
    assert search.best_params_["degree"] == 2
    assert search.best_score_ == pytest.approx(1.0, abs=1e-9)
    assert_allclose(search.predict(X), y[:, :2], atol=1e-9)


def test_works_in_a_pipeline():
    _, X, y = three_responses()
    pipeline = make_pipeline(StandardScaler(), PolynomialRegressor())
    assert cross_val_score(pipeline, X, y[:, 1], cv=4).min() == pytest.approx(1.0, abs=1e-9)
    pipeline.set_params(polynomialregressor__degree=1).fit(X, y[:, 1])
    assert all("^" not in t and ":" not in t for t in pipeline[-1].terms_[0])


def test_an_unfitted_estimator_does_not_predict():
    with pytest.raises(NotFittedError):
        PolynomialRegressor().predict([[1.0]])


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"degree": 0}, "degree must be a whole number from 1 to 12 or 'auto', got 0"),
        ({"degree": 1.5}, "degree must be a whole number"),
        ({"degree": True}, "degree must be a whole number"),
        ({"degree": "2"}, "degree must be a whole number"),
        ({"degree": None}, "degree must be a whole number"),
        ({"penalty": -1.0}, "penalty must be None, 0 or a positive number, got -1.0"),
        ({"penalty": np.nan}, "penalty must be"),
        ({"penalty": np.inf}, "penalty must be"),
        ({"penalty": "auto"}, "penalty must be"),
        ({"resolution": -1e-9}, "resolution must be 0 or a positive number"),
        ({"resolution": np.nan}, "resolution must be"),
        ({"resolution": None}, "resolution must be"),
        ({"responses": [Response("a", "m")]}, "need one Response for each of 3 columns of y, got 1"),
        ({"space": unit_box(2)}, r"must have shape \(n, 2\)"),
    ],
)
def test_a_bad_setting_is_refused_in_fit(settings, message):
    _, X, y = three_responses()
    estimator = PolynomialRegressor(**settings)
    with pytest.raises(ValueError, match=message):
        estimator.fit(X, y)


@pytest.mark.parametrize(
    ("X", "y", "message"),
    [
        ([[1.0], [np.nan], [2.0]], [1.0, 2.0, 3.0], "NaN"),
        ([[1.0], [2.0], [3.0]], [1.0, np.inf, 3.0], "infinity"),
        ([[1.0], [2.0]], [1.0, 2.0, 3.0], "inconsistent numbers of samples"),
        ([[1.0]], [1.0], "minimum of 2 is required"),
        ([1.0, 2.0], [1.0, 2.0], "Expected 2D array"),
    ],
)
def test_bad_data_are_refused(X, y, message):
    with pytest.raises(ValueError, match=message):
        PolynomialRegressor().fit(X, y)


def test_predicting_with_other_columns_is_refused():
    model, X, y = three_responses()
    fitted = PolynomialRegressor(space=model.factors).fit(X, y)
    with pytest.raises(ValueError, match="X has 2 features, but PolynomialRegressor is expecting 3"):
        fitted.predict(X[:, :2])

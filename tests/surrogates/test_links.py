"""Logarithms of responses: the border to the polynomials, the fit, the inverse, the file; and standard errors."""

import json
from dataclasses import replace
from fractions import Fraction
from math import factorial

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from experiments import Response
from surrogates import InversionStatus, PolynomialRegressor, affine_inverse, affine_map, certify, dumps, loads, obstacle
from surrogates.commanding import commanding
from surrogates.links import NotPositive, box_of_responses, to_link_units, to_responses, unit_of
from tests.surrogates.cases import box, overdetermined, points, square_quadratic, surrogate, unit_box


def logged():
    """Affine in the logarithms: y0 = e^0.5 e^a e^(−b/2) and y1 = 1e-6 e^(a/5 + b), on the unit box."""
    model = surrogate(unit_box(2), ["1", "f0", "f1"], [[0.5, 1.0, -0.5], [np.log(1e-6), 0.2, 1.0]], ["m", "1"])
    return replace(model, links=("log", "log"))


def mixed():
    """Three curved responses of three factors, the second by its logarithm."""
    model = square_quadratic()
    table = model.coefficients.copy()
    table[:, 1] *= 100.0
    return replace(model, coefficients=table, links=("identity", "log", "identity"))


def product_data(n=40, seed=0):
    """x1² x2 / x3 and its gradient; settings in a box far from zero."""
    space = box(("x1", 1.0, 3.0), ("x2", 2.0, 5.0), ("x3", 0.5, 1.5), unit="1")
    X = space.decode(np.random.default_rng(seed).uniform(-1.0, 1.0, (n, 3)))
    y = X[:, 0] ** 2 * X[:, 1] / X[:, 2]
    return space, X, y, y[:, None] * np.array([2.0, 1.0, -1.0]) / X


# --- verification: the border -----------------------------------------------------------------------------------------


def test_predictions_are_exponentials_of_the_polynomial():
    X = points(logged(), 50)
    a, b = X.T
    expected = np.column_stack([np.exp(0.5 + a - 0.5 * b), 1e-6 * np.exp(0.2 * a + b)])
    assert_allclose(logged().predict(X), expected, rtol=1e-14)
    assert_allclose(logged().jacobian(X)[:, 1], expected[:, 1:] * [0.2, 1.0], rtol=1e-14)


def test_the_jacobian_is_the_slope_of_the_predictions():
    model, step = mixed(), 1e-6
    X = points(model, 30)
    slopes = model.jacobian(X)
    for k, half in enumerate(model.factors.half_range):
        shift = step * half * np.eye(3)[k]
        differences = (model.predict(X + shift) - model.predict(X - shift)) / (2.0 * step * half)
        assert_allclose(slopes[:, :, k], differences, rtol=1e-6, atol=1e-8 * np.abs(slopes[:, :, k]).max())


def test_links_do_not_touch_what_is_given_as_it_is():
    model, plain = mixed(), replace(mixed(), links=())
    X = points(model, 20)
    assert plain.links == ("identity",) * 3
    assert_array_equal(model.predict(X)[:, [0, 2]], plain.predict(X)[:, [0, 2]])
    assert_array_equal(model.jacobian(X)[:, [0, 2]], plain.jacobian(X)[:, [0, 2]])
    assert_array_equal(model.predict_coded(model.factors.code(X)), plain.predict(X))


def test_what_has_no_logarithm_is_minus_infinity():
    links = ("identity", "log")
    assert_array_equal(to_link_units(links, [[-1.0, -1.0], [0.0, 0.0]]), [[-1.0, -np.inf], [0.0, -np.inf]])
    assert_allclose(to_responses(links, to_link_units(links, [[-2.0, 3e-9]])), [[-2.0, 3e-9]], rtol=1e-14)


def test_units_are_written_out():
    assert [unit_of("identity", "x", "m"), unit_of("log", "x", "m"), unit_of("log", "n", "1")] == [
        "m", "ln(x / m)", "ln n",
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("links", "message"),
    [
        (("log",), "links must be one of identity, log for each of 2 responses; got"),
        (("log", "sqrt"), "links must be one of identity, log"),
        (("log",) * 3, "for each of 2 responses"),
    ],
)
def test_links_that_do_not_fit_are_refused(links, message):
    with pytest.raises(ValueError, match=message):
        replace(logged(), links=links)


# --- verification: the inverse ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("make", [logged, mixed])
def test_the_inverse_takes_and_gives_responses(make):
    model = make()
    X = points(model, 30, reach=0.9)
    answer = model.invert(model.predict(X))
    assert answer.ok.all()
    assert_allclose(model.factors.code(answer.settings), model.factors.code(X), atol=1e-9)
    assert_allclose(answer.nearest, model.predict(X), rtol=1e-8)


def test_a_target_that_is_not_positive_is_refused_with_what_is_nearest():
    model = logged()
    answer = model.invert([[0.0, 1e-6], [-3.0, 1e-6], [1.0, -1.0]])
    assert answer.status == (InversionStatus.OUTSIDE,) * 3
    assert np.isnan(answer.settings).all()
    assert np.isinf(answer.distance).all()
    assert (answer.nearest > 0.0).all()
    # As small as it gets: a = −1 and b = 1 for the first response, both −1 for the second.
    assert_allclose(answer.nearest_settings, [[-1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0]], atol=1e-9)
    found = model.preimages([-1.0, 1e-6])
    assert (len(found), found.complete) == (0, True)
    assert "positive everywhere" in found.reason


def test_nearest_is_by_logarithms():
    """One factor, y = e^x beside a straight line: the least squares of (ln y, line), not of y."""
    model = surrogate(unit_box(1), ["1", "f0"], [[0.0, 1.0], [0.0, 1.0]])
    answer = replace(model, links=("log", "identity")).invert([[np.exp(0.8), 0.0]])
    assert not answer.ok[0]
    assert_allclose(answer.nearest_settings, [[0.4]], atol=1e-9)
    assert_allclose(answer.nearest, [[np.exp(0.4), 0.4]], rtol=1e-9)
    assert_allclose(answer.distance, [0.4 * np.sqrt(2.0)], rtol=1e-9)


def test_all_settings_for_a_target_of_a_curved_logarithm():
    """ln y = x²: e^0.25 has two settings, which the search proves to be all."""
    model = replace(surrogate(unit_box(1), ["1", "f0^2"], [[0.0, 1.0]]), links=("log",))
    found = model.preimages([np.exp(0.25)])
    assert found.complete
    assert_allclose(np.sort(found.settings[:, 0]), [-0.5, 0.5], atol=1e-9)


def test_there_is_no_matrix_of_a_map_with_logarithms():
    model = logged()
    assert model.is_affine
    assert not model.is_affine_map
    for closed_form in (affine_map, affine_inverse):
        with pytest.raises(ValueError, match=r"gives the logarithm of r0 and r1; use model\.invert"):
            closed_form(model)
    many = replace(overdetermined(), links=("log", "identity", "identity"))
    assert obstacle(overdetermined()) == ""
    assert "3 responses follow from 2 factors" in obstacle(many)


# --- verification: the certificate ------------------------------------------------------------------------------------


@pytest.mark.parametrize("make", [logged, mixed])
def test_the_certificate_is_that_of_the_polynomials_and_its_box_is_of_responses(make):
    model = make()
    ours, theirs = certify(model), certify(replace(model, links=()))
    assert ours.verdict == theirs.verdict == "certified"
    assert ours.condition == theirs.condition
    for link, (low, high), (below, above) in zip(model.links, ours.response_box, theirs.response_box, strict=True):
        if link == "identity":
            assert (low, high) == (below, above)
        else:  # inwards, by no more than rounding: how it is rounded is tried below
            assert np.exp(below) < low < high < np.exp(above)
            assert_allclose(np.log([low, high]), [below, above], rtol=1e-12)
    corners = np.array(np.meshgrid(*ours.response_box)).reshape(len(model.responses), -1).T
    assert model.invert(corners).ok.all()


@pytest.mark.parametrize(("low", "high"), [(-1.0, 1.0), (-13.8, -13.7), (0.1, 0.1 + 1e-12), (300.0, 301.0)])
def test_the_ends_of_a_box_are_rounded_inwards(low, high):
    """Against exp by a series in rationals."""
    (below, above), = box_of_responses(("log",), [(low, high)])  # fmt: skip
    assert _exp(low) < Fraction(below)
    assert Fraction(above) < _exp(high)
    assert_allclose([below, above], np.exp([low, high]), rtol=1e-14)


@pytest.mark.parametrize(("low", "high"), [(0.1, 0.1 + 1e-16), (-2000.0, -1000.0), (800.0, 900.0)])
def test_a_box_that_floats_cannot_hold_is_none(low, high):
    assert box_of_responses(("log",), [(low, high)]) is None


def _exp(x: float) -> Fraction:
    """By its series, to far more digits than a float's; whole powers of e are cut to 900 bits."""
    whole = round(x)
    small = Fraction(x) - whole
    series = sum((small**k / factorial(k) for k in range(30)), Fraction(0))
    e = sum((Fraction(1, factorial(k)) for k in range(200)), Fraction(0))
    return Fraction(round(e * 2**900), 2**900) ** whole * series


# --- verification: the fit --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("selection", ["backward", "forward", "evidence"])
def test_the_exponential_of_an_affine_function_is_recovered_exactly(selection):
    truth = logged()
    X = points(truth, 25, seed=3)
    fit = PolynomialRegressor(degree=2, selection=selection, response_transform="log", space=truth.factors)
    fit.fit(X, truth.predict(X))
    assert fit.surrogate_.links == ("log", "log")
    assert fit.terms_ == (("1", "f0", "f1"),) * 2
    assert_allclose(fit.coef_, truth.coefficients, rtol=1e-10, atol=1e-10)
    fresh = points(truth, 50, seed=4)
    assert_allclose(fit.predict(fresh), truth.predict(fresh), rtol=1e-10)
    assert np.abs(fit.log_bias_).max() < 1e-10


def test_residuals_are_those_of_runs_left_out_one_by_one_on_the_original_scale():
    space, X, y, _ = product_data(14)
    settings = {"degree": 1, "trim": False, "penalty": 0.0, "space": space, "response_transform": "log"}
    fit = PolynomialRegressor(**settings).fit(X, y)
    out = [
        PolynomialRegressor(**settings).fit(np.delete(X, i, 0), np.delete(y, i)).predict(X[i : i + 1])[0]
        for i in range(14)
    ]
    assert_allclose(fit.loo_rmse_, np.sqrt(np.mean((y - out) ** 2)), rtol=1e-9)
    assert_allclose(fit.log_bias_, np.mean(y / out) - 1.0, rtol=1e-6)


def test_auto_takes_the_logarithm_of_a_product_and_not_of_a_sum():
    space, X, y, _ = product_data()
    both = np.column_stack([y, X @ [3.0, 1.0, 2.0] + X[:, 0] * X[:, 1], y - y.mean(), 1.0 + 0.01 * y])
    fit = PolynomialRegressor(degree=2, response_transform="auto", space=space).fit(X, both)
    # The third has no logarithm, the fourth hardly varies.
    assert fit.surrogate_.links == ("log", "identity", "identity", "identity")
    assert_array_equal(fit.log_bias_[1:], 0.0)
    fresh, truth = product_data(500, seed=9)[1:3]
    plain = PolynomialRegressor(degree=2, space=space).fit(X, both)
    errors = [np.abs(f.predict(fresh)[:, 0] - truth).max() for f in (fit, plain)]
    assert errors[0] < 0.5 * errors[1]
    assert fit.loo_rmse_[0] < plain.loo_rmse_[0]
    assert_array_equal(fit.predict(fresh)[:, 1:], plain.predict(fresh)[:, 1:])


@pytest.mark.parametrize("selection", ["forward", "evidence"])
def test_gradients_teach_the_logarithm(selection):
    space, X, y, slopes = product_data(12)
    settings = {"degree": 3, "selection": selection, "response_transform": "log", "space": space}
    taught = PolynomialRegressor(**settings).fit(X, y, slopes[:, None])
    alone = PolynomialRegressor(**settings).fit(X, y)
    fresh, truth = product_data(300, seed=5)[1:3]
    errors = [np.abs(f.predict(fresh) / truth - 1.0).max() for f in (taught, alone)]
    assert errors[0] < 0.5 * errors[1]


@pytest.mark.parametrize("selection", ["backward", "evidence"])
def test_the_unit_of_a_response_shifts_the_constant_alone(selection):
    space, X, y, _ = product_data()
    fits = [
        PolynomialRegressor(selection=selection, response_transform="log", space=space).fit(X, factor * y)
        for factor in (1.0, 1e-6)
    ]
    assert fits[0].terms_ == fits[1].terms_
    shift = fits[1].coef_ - fits[0].coef_
    assert_allclose(shift[0], np.log(1e-6), rtol=1e-5)
    assert_allclose(shift[1:], 0.0, atol=1e-5)


def test_multiplicative_noise_is_seen_in_the_bias_and_not_corrected():
    """Miller (1984): the mean is exp(s²/2) times the median; predictions stay the median."""
    rng, s = np.random.default_rng(1), 0.4
    X = rng.uniform(-1.0, 1.0, (4000, 1))
    y = np.exp(1.0 + X[:, 0] + s * rng.normal(size=4000))
    fit = PolynomialRegressor(degree=1, response_transform="log", space=unit_box(1)).fit(X, y)
    assert_allclose(1.0 + fit.log_bias_, np.exp(s**2 / 2.0), rtol=0.02)
    assert_allclose(fit.predict([[0.0]]), np.exp(1.0), rtol=0.02)


def test_transforms_that_cannot_be_are_refused():
    space, X, y, _ = product_data()
    named = [Response("life", "s"), Response("x", "m")]
    settings = {"space": space, "responses": named}
    with pytest.raises(NotPositive, match=r"positive in every run: the smallest value of 'x' is -0\.5; 'auto' takes"):
        PolynomialRegressor(response_transform="log", **settings).fit(
            X, np.column_stack([y, np.linspace(-0.5, 1.0, 40)])
        )
    with pytest.raises(NotPositive, match="the smallest value of 'x' is 0;"):
        PolynomialRegressor(response_transform="log", **settings).fit(
            X, np.column_stack([y, np.linspace(0.0, 1.0, 40)])
        )
    with pytest.raises(ValueError, match="response_transform must be one of none, log, auto, got 'sqrt'"):
        PolynomialRegressor(response_transform="sqrt", **settings).fit(X, np.column_stack([y, y]))


# --- verification: the file -------------------------------------------------------------------------------------------


@pytest.mark.parametrize("make", [logged, mixed])
def test_a_model_with_logarithms_is_of_a_schema_that_older_readers_refuse(make):
    model = replace(make(), certificate=certify(make()))
    document = json.loads(dumps(model))
    assert document["schema"] == "flexdoce-model/2"
    assert document["links"] == {r.name: link for r, link in zip(model.responses, model.links, strict=True)}
    assert document["affine"] is None
    again = loads(dumps(model))
    assert again.links == model.links
    assert dumps(again) == dumps(model)
    assert_array_equal(again.predict(points(model, 5)), model.predict(points(model, 5)))


def test_a_model_without_logarithms_is_of_the_first_schema():
    document = json.loads(dumps(square_quadratic()))
    assert document["schema"] == "flexdoce-model/1"
    assert not {"links", "standard_errors"} & set(document)
    assert loads(dumps(square_quadratic())).standard_errors is None


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"schema": "flexdoce-model/1"}, "links need schema 'flexdoce-model/2', found 'flexdoce-model/1'"),
        ({"links": {"r0": "log"}}, "links must be given for r0, r1; got"),
        ({"links": ["log", "log"]}, "links must be given for r0, r1; got"),
        ({"links": {"r0": "log", "r1": "sqrt"}}, "links must be one of identity, log"),
        ({"links": {"r0": "log", "r1": ["log"]}}, "links must be one of identity, log"),
        ({"standard_errors": {"r0": [0.0, 0.0, 0.0]}}, "standard errors must be given for r0, r1"),
        ({"standard_errors": {"r0": [0.0], "r1": [0.0]}}, "every response needs one standard error per term"),
        ({"standard_errors": {"r0": [0.0, 0.0, -1.0], "r1": [0.0] * 3}}, "standard_errors must be 0 or positive"),
        ({"standard_errors": {"r0": "x", "r1": [0.0] * 3}}, "r0 must be a list, got 'x'"),
        ({"standard_errors": [1.0]}, "missing or of the wrong kind|standard errors must be given"),
    ],
)
def test_a_file_that_contradicts_itself_is_refused(change, message):
    document = json.loads(dumps(logged())) | change
    with pytest.raises(ValueError, match=message):
        loads(json.dumps(document))


def test_a_file_of_the_second_schema_needs_links():
    document = json.loads(dumps(logged()))
    del document["links"]
    with pytest.raises(ValueError, match="missing or of the wrong kind: 'links'"):
        loads(json.dumps(document))


# --- verification: standard errors ------------------------------------------------------------------------------------


def test_the_surrogate_keeps_the_standard_errors_of_its_fit():
    """Of ordinary least squares, by the textbook: s² (AᵀA)⁻¹; kept by the file and by an embedding."""
    rng, space = np.random.default_rng(0), unit_box(2)
    X = rng.uniform(-1.0, 1.0, (30, 2))
    y = 1.0 + X @ [2.0, -1.0] + 0.1 * rng.normal(size=30)
    model = PolynomialRegressor(degree=1, trim=False, penalty=0.0, space=space).fit(X, y).surrogate_
    A = np.column_stack([np.ones(30), X])
    s2 = np.sum((y - A @ np.linalg.lstsq(A, y)[0]) ** 2) / 27.0
    assert_allclose(model.standard_errors[:, 0], np.sqrt(s2 * np.diag(np.linalg.inv(A.T @ A))), rtol=1e-9)
    again = loads(dumps(model))
    assert_array_equal(again.standard_errors, model.standard_errors)
    assert_array_equal(model.embed(unit_box(3)).standard_errors, model.standard_errors)
    with pytest.raises(ValueError, match="read-only"):
        model.standard_errors[0, 0] = 1.0


def test_unknown_standard_errors_are_null_in_the_file():
    model = replace(logged(), standard_errors=[[np.nan, 0.1], [0.2, 0.0], [0.3, 0.4]])
    assert json.loads(dumps(model))["standard_errors"] == {"r0": [None, 0.2, 0.3], "r1": [0.1, 0.0, 0.4]}
    assert_array_equal(loads(dumps(model)).standard_errors, model.standard_errors)


@pytest.mark.parametrize(
    ("errors", "message"),
    [
        (np.zeros((2, 3)), r"standard_errors must have shape \(3, 2\) \(terms, responses\); got \(2, 3\)"),
        (np.full((3, 2), -1.0), "must be 0 or positive, or NaN"),
        (np.full((3, 2), np.inf), "must be 0 or positive, or NaN"),
    ],
)
def test_standard_errors_that_cannot_be_are_refused(errors, message):
    with pytest.raises(ValueError, match=message):
        replace(logged(), standard_errors=errors)


def test_a_square_model_takes_links_and_standard_errors_along():
    model = replace(mixed(), standard_errors=np.arange(24.0).reshape(8, 3))
    square = commanding(model, ["r1", "r0"], ["c"])
    assert square.links == ("log", "identity", "identity")
    assert_array_equal(square.standard_errors[:8], np.column_stack([model.standard_errors[:, [1, 0]], np.zeros(8)]))
    X = points(model, 5)
    assert_allclose(square.predict(X), np.column_stack([model.predict(X)[:, [1, 0]], X[:, 2]]), rtol=1e-13)

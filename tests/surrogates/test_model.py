"""The frozen surrogate: predict, Jacobian, scale, and what it refuses."""

from dataclasses import FrozenInstanceError, replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from experiments import Factor, FactorSpace, Response, Terms
from surrogates import Surrogate, Verdict, certify
from surrogates.validation import compare
from tests.surrogates.cases import ALL, box, constant, points, square_quadratic, surrogate, unit_box


def model_with(coefficients, terms=("1", "a"), names=("a", "b")) -> Surrogate:
    space = box(*((n, 0.0, 2.0) for n in ("a", "b")))
    return Surrogate(space, (Response("r", "m"),), Terms.parse(terms, names), coefficients)


def test_predict_is_the_written_formula():
    space = box(("a", 1.0, 5.0), ("b", -0.2, 0.2))
    model = surrogate(space, ["1", "a", "a:b", "b^3", "a^2:b"], [[7.0, 2.0, -3.0, 4.0, 0.5], [0.0, 0.0, 1.0, 0.0, 0.0]])
    X = points(model, 50)
    A, B = (X[:, 0] - 3.0) / 2.0, X[:, 1] / 0.2
    expected = np.column_stack([7.0 + 2.0 * A - 3.0 * A * B + 4.0 * B**3 + 0.5 * A**2 * B, A * B])
    assert_allclose(model.predict(X), expected, rtol=1e-14, atol=1e-14)
    assert_allclose(model.predict_coded(np.column_stack([A, B])), expected, rtol=1e-14, atol=1e-14)


def test_jacobian_is_the_written_derivative():
    space = box(("a", 1.0, 5.0), ("b", -0.2, 0.2))
    model = surrogate(space, ["1", "a", "a:b", "b^3", "a^2:b"], [[7.0, 2.0, -3.0, 4.0, 0.5]])
    X = points(model, 50)
    A, B = (X[:, 0] - 3.0) / 2.0, X[:, 1] / 0.2
    by_a, by_b = (2.0 - 3.0 * B + A * B) / 2.0, (-3.0 * A + 12.0 * B**2 + 0.5 * A**2) / 0.2
    assert_allclose(model.jacobian(X)[:, 0], np.column_stack([by_a, by_b]), rtol=1e-13, atol=1e-13)


@pytest.mark.parametrize("name", ALL)
def test_jacobian_agrees_with_central_differences(name):
    model = ALL[name]()
    coded = np.random.default_rng(0).uniform(-1.0, 1.0, (20, len(model.factors)))
    step = 6e-6  # near the cube root of eps, where truncation and rounding balance
    jacobian = model.jacobian_coded(coded) / model.scale[:, None]
    for j in range(len(model.factors)):
        shift = step * np.eye(len(model.factors))[j]
        slope = (model.predict_coded(coded + shift) - model.predict_coded(coded - shift)) / (2.0 * step) / model.scale
        noise = 1e-15 * np.abs(model.predict_coded(coded) / model.scale).max() / step
        assert_allclose(jacobian[:, :, j], slope, rtol=0.0, atol=1e-9 + noise)


def test_jacobian_is_in_physical_units():
    model = surrogate(box(("a", 0.0, 10.0), ("b", 0.0, 1e-3)), ["a", "b"], [[5.0, 2.0]])
    assert_allclose(model.jacobian([[1.0, 1e-4]]), [[[1.0, 4000.0]]], rtol=1e-15)


def test_scale_bounds_the_change_and_is_one_where_nothing_changes():
    model = surrogate(unit_box(2), ["1", "f0", "f1", "f0:f1"], [[100.0, 1.0, -2.0, 0.5], [4.0, 0.0, 0.0, 0.0]])
    assert_array_equal(model.scale, [3.5, 1.0])
    X = points(model, 1000)
    assert (np.abs(model.predict(X)[:, 0] - 100.0) <= 3.5).all()
    assert_array_equal(constant().scale, [1.0, 1.0])


@pytest.mark.parametrize(
    ("terms", "affine"),
    [(["1"], True), (["f0"], True), (["1", "f0", "f1"], True), (["f0:f1"], False), (["f0^2"], False)],
)
def test_is_affine(terms, affine):
    assert surrogate(unit_box(2), terms, [np.ones(len(terms))]).is_affine is affine


def test_contains_is_the_box():
    model = surrogate(box(("a", 0.0, 2.0), ("b", 5.0, 6.0)), ["a"], [[1.0]])
    inside = model.contains([[0.0, 5.0], [2.0, 6.0], [1.0, 5.5], [2.0 + 1e-6, 5.5], [1.0, 4.9], [np.nan, 5.5]])
    assert_array_equal(inside, [True, True, True, False, False, False])


def test_terms_of_a_response_are_those_it_uses():
    model = surrogate(unit_box(2), ["1", "f0", "f1^2"], [[1.0, 0.0, 2.0], [0.0, 0.0, 0.0]])
    assert model.terms_of(0) == ("1", "f1^2")
    assert model.terms_of(1) == ()


def test_no_points_give_no_answers():
    model = surrogate(unit_box(2), ["1", "f0"], [[1.0, 2.0]] * 3)
    assert model.predict(np.empty((0, 2))).shape == (0, 3)
    assert model.jacobian(np.empty((0, 2))).shape == (0, 3, 2)


def test_a_surrogate_cannot_be_changed():
    given = np.array([[1.0], [2.0]])
    model = model_with(given)
    with pytest.raises(FrozenInstanceError):
        model.terms = None
    with pytest.raises(ValueError, match="read-only"):
        model.coefficients[0, 0] = 5.0
    given[0, 0] = 99.0
    assert model.coefficients[0, 0] == 1.0


@pytest.mark.parametrize(
    ("coefficients", "message"),
    [
        ([[1.0], [np.nan]], "coefficients must be finite"),
        ([[1.0], [np.inf]], "coefficients must be finite"),
        ([[1.0]], r"coefficients must have shape \(2, 1\) \(terms, responses\); got \(1, 1\)"),
        ([1.0, 2.0], r"coefficients must have shape \(2, 1\)"),
        ([[1.0, 2.0], [3.0, 4.0]], r"coefficients must have shape \(2, 1\)"),
    ],
)
def test_refuses_bad_coefficients(coefficients, message):
    with pytest.raises(ValueError, match=message):
        model_with(coefficients)


def test_refuses_terms_of_other_factors():
    with pytest.raises(ValueError, match=r"the terms use the factors \('b', 'a'\), the model has \('a', 'b'\)"):
        model_with([[1.0], [2.0]], names=("b", "a"))


@pytest.mark.parametrize("X", [[1.0, 2.0], [[1.0]], [[1.0, 2.0, 3.0]]])
def test_refuses_points_of_the_wrong_shape(X):
    model = model_with([[1.0], [2.0]])
    for method in (model.predict, model.jacobian, model.contains):
        with pytest.raises(ValueError, match=r"must have shape \(n, 2\), one column per factor \(a, b\)"):
            method(X)
    assert isinstance(model.factors, FactorSpace)


def test_embedding_adds_factors_that_do_nothing():
    model = square_quadratic()
    space = FactorSpace((Factor("z", "K", 0.0, 9.0), *reversed(model.factors.factors)))
    wide = model.embed(space)
    settings = points(model, 20, seed=3)
    widened = np.column_stack([np.linspace(0.0, 9.0, 20), settings[:, ::-1]])
    assert_allclose(wide.predict(widened), model.predict(settings), rtol=1e-14)
    assert (wide.jacobian(widened)[:, :, 0] == 0.0).all()


def test_embedding_keeps_the_errors_and_forgets_where_the_largest_lay():
    model = square_quadratic()
    errors = compare(model.responses, np.zeros((1, 3)), np.ones((1, 3)), settings=[[1.0, 0.0, 1e-3]])
    wide = replace(model, validation=errors).embed(FactorSpace((Factor("z", "K", 0.0, 9.0), *model.factors)))
    assert wide.validation == tuple(replace(e, worst_point=()) for e in errors)
    assert errors[0].worst_point == (1.0, 0.0, 1e-3)


def test_embedding_drops_a_certificate_that_no_longer_holds():
    """Many settings of a factor that does not act give one response."""
    model = square_quadratic()
    model = replace(model, certificate=certify(model))
    assert model.certificate.verdict is Verdict.CERTIFIED
    assert model.embed(model.factors).certificate == model.certificate
    wide = model.embed(FactorSpace((*model.factors, Factor("z", "K", 0.0, 9.0))))
    assert wide.certificate is None
    assert certify(wide).verdict is Verdict.REFUTED


def test_embedding_refuses_another_range():
    model = square_quadratic()
    first, *others = model.factors
    with pytest.raises(ValueError, match="factor 'a' has another unit or range in the larger space"):
        model.embed(FactorSpace((replace(first, high=2.5), *others)))

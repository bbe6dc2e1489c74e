"""Fits taught by gradients: exact where the truth is a polynomial, better than values alone, honest with wrong ones."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from experiments import Factor, FactorSpace, Terms, model_matrix
from experiments.terms import model_matrix_gradient
from surrogates import PolynomialRegressor
from surrogates.gradient_fit import _fit, gradient_fit

NAMES = tuple(f"f{i}" for i in range(6))


def points(n: int, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).uniform(-1.0, 1.0, (n, 6))


def otl(x):
    """Mid-point voltage of the OTL push-pull circuit: Ben-Ari and Steinberg (2007), Quality Engineering 19, 327–338."""
    r_b1, r_b2, r_f, r_c1, r_c2, beta = x
    v_b1 = 12.0 * r_b2 / (r_b1 + r_b2)
    gain = beta * (r_c2 + 9.0)
    return (v_b1 + 0.74) * gain / (gain + r_f) + 11.35 * r_f / (gain + r_f) + 0.74 * r_f * gain / ((gain + r_f) * r_c1)


OTL = FactorSpace(
    tuple(
        Factor(name, unit, low, high)
        for name, unit, low, high in (
            ("R_b1", "kΩ", 50.0, 150.0),
            ("R_b2", "kΩ", 25.0, 70.0),
            ("R_f", "kΩ", 0.5, 3.0),
            ("R_c1", "kΩ", 1.2, 2.5),
            ("R_c2", "kΩ", 0.25, 1.2),
            ("beta", "1", 50.0, 300.0),
        )
    )
)


def slopes_of(function, X):
    """Exact derivatives by complex steps, shape (n, 6)."""
    return np.stack([np.imag(function((X + 1e-30j * unit).T)) / 1e-30 for unit in np.eye(6)], axis=-1)


@pytest.mark.parametrize("seed", range(3))
def test_a_full_cubic_map_is_found_to_rounding_from_thirty_runs(seed):
    """84 terms act, 30 runs: values alone cannot know them, with six derivatives each they can."""
    terms = Terms.polynomial(NAMES, 3)
    rng = np.random.default_rng(seed)
    truth = rng.normal(size=len(terms)) * np.where(terms.degrees > 1, 0.1, 1.0)
    coded, fresh = points(30, seed), points(500, seed + 50)
    matrix, gradient = model_matrix(terms, coded), model_matrix_gradient(terms, coded)
    fit = gradient_fit(
        matrix,
        matrix @ truth,
        gradient,
        np.einsum("npk,p->nk", gradient, truth),
        np.array(terms.exponents),
        floor=1e-11,
    )
    there = model_matrix(terms, fresh)
    assert_allclose(there[:, fit.columns] @ fit.coefficients, there @ truth, rtol=0.0, atol=1e-10)


@pytest.mark.parametrize("seed", range(3))
def test_gradients_lower_the_error_of_the_otl_circuit(seed):
    """Our aim at 30 runs: a normalised error of 0.0119."""
    X, fresh = OTL.decode(points(30, seed)), OTL.decode(points(2000, seed + 50))
    settings = {"degree": 4, "selection": "forward", "space": OTL}
    taught = PolynomialRegressor(**settings).fit(X, otl(X.T), slopes_of(otl, X)[:, None, :])
    plain = PolynomialRegressor(**settings).fit(X, otl(X.T))
    errors = [np.sqrt(np.mean((m.predict(fresh) - otl(fresh.T)) ** 2)) / otl(fresh.T).std() for m in (taught, plain)]
    assert errors[0] <= 0.0119
    assert errors[0] < 0.5 * errors[1]


def test_residuals_of_points_left_out_are_those_of_fitting_without_them():
    terms = Terms.polynomial(NAMES, 1)
    coded = points(12)
    matrix, gradient = model_matrix(terms, coded), model_matrix_gradient(terms, coded)
    rows = np.concatenate([matrix[:, None], 0.3 * gradient.transpose(0, 2, 1)], axis=1)
    wanted = np.random.default_rng(0).normal(size=(12, 7))
    fit = _fit(rows, wanted, np.arange(7))
    for out in range(12):
        kept = np.arange(12) != out
        slope = np.linalg.lstsq(rows[kept].reshape(-1, 7), wanted[kept].ravel(), rcond=None)[0]
        assert fit.loo[out] == pytest.approx(wanted[out, 0] - matrix[out] @ slope, rel=1e-9)


def test_gradients_that_lie_get_little_weight():
    """Random slopes beside exact values: the fit must still follow the values."""
    coded = points(60)
    terms = Terms.polynomial(NAMES, 2)
    matrix, gradient = model_matrix(terms, coded), model_matrix_gradient(terms, coded)
    y = 2.0 * coded[:, 0] - coded[:, 1]
    lies = np.random.default_rng(0).normal(size=(60, 6))
    fit = gradient_fit(matrix, y, gradient, lies, np.array(terms.exponents))
    fresh = points(500, 1)
    predicted = model_matrix(terms, fresh)[:, fit.columns] @ fit.coefficients
    assert np.sqrt(np.mean((predicted - 2.0 * fresh[:, 0] + fresh[:, 1]) ** 2)) < 0.05


def test_units_of_the_jacobian_are_those_of_the_settings():
    X = OTL.decode(points(40))
    fitted = PolynomialRegressor(degree=2, selection="forward", space=OTL).fit(
        X, 3.0 * X[:, 0] + X[:, 5], np.tile([3.0, 0, 0, 0, 0, 1.0], (40, 1, 1))
    )
    assert_allclose(fitted.surrogate_.jacobian(X[:1])[0, 0], [3.0, 0, 0, 0, 0, 1.0], rtol=1e-9, atol=1e-9)
    assert set(fitted.terms_[0]) == {"1", "R_b1", "beta"}


@pytest.mark.parametrize(
    ("settings", "shape", "message"),
    [
        ({"selection": "forward"}, (40, 6), r"shape \(40, 1, 6\) \(runs, responses, factors\); got \(40, 6\)"),
        ({"selection": "backward"}, (40, 1, 6), "set selection to .* 'evidence', and trim=True"),
        ({"selection": "forward", "trim": False}, (40, 1, 6), "set selection to .* 'evidence', and trim=True"),
    ],
)
def test_refuses_a_jacobian_that_does_not_fit(settings, shape, message):
    X = OTL.decode(points(40))
    with pytest.raises(ValueError, match=message):
        PolynomialRegressor(space=OTL, **settings).fit(X, X[:, 0], np.zeros(shape))

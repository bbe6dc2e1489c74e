"""Maximum evidence: its density and gradient against direct formulas, exact on polynomials, modest on noise."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.stats import multivariate_normal, qmc

from experiments import Terms
from surrogates import PolynomialRegressor
from surrogates.basis import basis_gradient, basis_matrix
from surrogates.evidence import Rows, _by_rows, _by_terms, learned_scales
from surrogates.evidence_fit import evidence_fit

from .cases import unit_box

NAMES = ("a", "b", "c")
CUBIC = Terms.polynomial(NAMES, 3)
EXPONENTS = np.array(CUBIC.exponents)


def points(n: int, seed: int = 0, k: int = 3) -> np.ndarray:
    return 2.0 * qmc.LatinHypercube(k, rng=np.random.default_rng(seed)).random(n) - 1.0


def ishigami(x):
    """Ishigami and Homma (1990), a = 7, b = 0.1, on [−π, π]³ coded to [−1, 1]³."""
    a, b, c = np.pi * x.T
    return np.sin(a) + 7.0 * np.sin(b) ** 2 + 0.1 * c**4 * np.sin(a)


def rows_of(n: int, taught: bool) -> Rows:
    coded = points(n)
    rng = np.random.default_rng(4)
    if not taught:
        return Rows.of(basis_matrix("legendre", CUBIC, coded), rng.normal(size=n))
    gradient = basis_gradient("legendre", CUBIC, coded)
    return Rows.of(basis_matrix("legendre", CUBIC, coded), rng.normal(size=n), gradient, rng.normal(size=(n, 3)))


@pytest.mark.parametrize(("n", "taught"), [(9, False), (40, False), (4, True), (20, True)])
def test_verification_the_evidence_is_the_normal_density_of_the_rows(n, taught):
    """With the common scale s² profiled out: log N(y; 0, s² K) at its best s², less its constant −n/2 (1 + log 2π)."""
    rows = rows_of(n, taught)
    rng = np.random.default_rng(1)
    variance, noise = np.exp(rng.normal(size=len(CUBIC))), np.exp(rng.normal(size=int(rows.kind.max()) + 1) - 2.0)
    covariance = rows.matrix @ np.diag(variance) @ rows.matrix.T + np.diag(noise[rows.kind])
    m = len(rows.target)
    common = rows.target @ np.linalg.solve(covariance, rows.target) / m
    density = multivariate_normal(np.zeros(m), common * covariance).logpdf(rows.target)
    for found in (_by_rows, _by_terms):
        assert_allclose(found(rows, variance, noise)[0], density + 0.5 * m * (1.0 + np.log(2.0 * np.pi)), rtol=1e-9)


@pytest.mark.parametrize(("n", "taught"), [(9, False), (20, True)])
@pytest.mark.parametrize("evidence", [_by_rows, _by_terms])
def test_verification_its_gradient_is_that_of_differences(evidence, n, taught):
    rows = rows_of(n, taught)
    rng = np.random.default_rng(2)
    variance, noise = np.exp(rng.normal(size=len(CUBIC))), np.exp(rng.normal(size=int(rows.kind.max()) + 1) - 2.0)
    _, by_variance, by_noise = evidence(rows, variance, noise)
    h = 1e-5
    for i in range(len(CUBIC)):
        step = np.exp(h * np.eye(len(CUBIC))[i])
        difference = evidence(rows, variance * step, noise)[0] - evidence(rows, variance / step, noise)[0]
        assert_allclose(by_variance[i], difference / (2.0 * h), rtol=1e-4, atol=1e-6)
    for i in range(len(noise)):
        step = np.exp(h * np.eye(len(noise))[i])
        difference = evidence(rows, variance, noise * step)[0] - evidence(rows, variance, noise / step)[0]
        assert_allclose(by_noise[i], difference / (2.0 * h), rtol=1e-4, atol=1e-6)


def test_factors_that_act_more_get_larger_scales():
    coded = points(40)
    y = np.exp(coded[:, 0]) + 0.01 * coded[:, 1]
    rows = Rows.of(basis_matrix("legendre", CUBIC, coded), (y - y.mean()) / y.std())
    variance = dict(zip(CUBIC.labels, learned_scales(rows, EXPONENTS).variance, strict=True))
    assert variance["a"] > 100.0 * variance["b"]
    assert variance["b"] > variance["c"]


@pytest.mark.parametrize("seed", range(3))
def test_verification_a_sparse_cubic_is_found_to_rounding(seed):
    """Among 84 candidates, from 60 runs: the terms and no others."""
    names = tuple(f"f{i}" for i in range(6))
    coded = points(60, seed, 6)
    y = 0.5 + 2.0 * coded[:, 0] - coded[:, 1] + 0.4 * coded[:, 0] * coded[:, 2] + 0.2 * coded[:, 3] ** 3
    found = PolynomialRegressor(degree=3, selection="evidence", space=unit_box(6)).fit(coded, y)
    model = found.surrogate_
    kept = {
        label: c
        for label, c in zip(model.terms.labels, model.coefficients[:, 0], strict=True)
        if abs(c) > 1e-9  # Legendre's third polynomial brings its linear part along
    }
    expected = {"1": 0.5, names[0]: 2.0, names[1]: -1.0, "f0:f2": 0.4, "f3^3": 0.2}
    assert kept.keys() == expected.keys()
    assert_allclose([kept[label] for label in expected], list(expected.values()), rtol=1e-9)


def test_verification_a_full_cubic_is_exact_from_hardly_more_runs_than_terms():
    coded, fresh = points(24), points(200, 9)
    truth = np.random.default_rng(3).normal(size=len(CUBIC))
    y = basis_matrix("monomial", CUBIC, coded) @ truth
    found = PolynomialRegressor(degree="auto", selection="evidence", space=unit_box(3)).fit(coded, y)
    assert_allclose(found.predict(fresh), basis_matrix("monomial", CUBIC, fresh) @ truth, rtol=0.0, atol=1e-10)
    assert found.surrogate_.terms.degrees.max() == 3


def test_leave_one_out_residuals_are_those_of_fitting_without_each_run():
    """At the scales found, of what is kept of the fit: against refitting by the textbook's formula."""
    coded = points(25)
    matrix = basis_matrix("legendre", CUBIC, coded)
    y = np.exp(coded[:, 0] + 0.3 * coded[:, 1] * coded[:, 2])
    fit, scales = evidence_fit(matrix, y, EXPONENTS)
    assert scales is not None
    level = y.mean()  # what the prior of the constant is about
    for out in range(0, 25, 6):
        stay = np.arange(25) != out
        kernel = matrix * scales.variance @ matrix.T
        weights = np.linalg.solve(kernel[np.ix_(stay, stay)] + scales.noise[0] * np.eye(24), y[stay] - level)
        coefficients = scales.variance * (matrix[stay].T @ weights)
        expected = y[out] - level - matrix[out, fit.columns] @ coefficients[fit.columns]
        assert_allclose(fit.loo[out], expected, rtol=1e-4, atol=1e-7)


def test_of_pure_noise_hardly_anything_is_kept():
    """84 candidates on 60 runs, ten times."""
    terms = Terms.polynomial(tuple(f"f{i}" for i in range(6)), 3)
    kept, size = [], []
    for seed in range(10):
        matrix = basis_matrix("legendre", terms, points(60, seed, 6))
        y = np.random.default_rng(100 + seed).normal(size=60)
        fit, _ = evidence_fit(matrix, y, np.array(terms.exponents))
        kept.append(len(fit.columns))
        size.append(np.sqrt((fit.coefficients[fit.columns > 0] ** 2).sum()))
    assert np.median(kept) <= 3
    # What is kept moves the response by little: a full fit of noise would move it by about its own size.
    assert np.median(size) <= 0.3


def test_noise_does_not_hide_a_linear_map():
    coded = points(40, 1)
    y = 1.0 + 2.0 * coded[:, 0] - coded[:, 1] + 0.02 * np.random.default_rng(5).normal(size=40)
    found = PolynomialRegressor(degree=3, selection="evidence", space=unit_box(3)).fit(coded, y)
    slope = dict(zip(found.surrogate_.terms.labels, found.coef_[:, 0], strict=True))
    errors = dict(zip(found.surrogate_.terms.labels, found.standard_errors_[:, 0], strict=True))
    for label, true in (("f0", 2.0), ("f1", -1.0)):
        assert abs(slope[label] - true) <= 4.0 * errors[label]
        assert 0.0005 < errors[label] < 0.05


@pytest.mark.parametrize("seed", range(2))
def test_validation_the_degree_is_raised_where_that_pays(seed):
    """Ishigami's function needs degree 8 and more: a quintic leaves half of the standard deviation."""
    coded, fresh = points(100, seed), points(2000, 50)
    settings = {"selection": "evidence", "space": unit_box(3)}
    low = PolynomialRegressor(degree=5, **settings).fit(coded, ishigami(coded))
    high = PolynomialRegressor(degree="auto", highest_degree=12, **settings).fit(coded, ishigami(coded))
    truth = ishigami(fresh)
    errors = [np.sqrt(np.mean((m.predict(fresh) - truth) ** 2)) / truth.std() for m in (low, high)]
    assert errors[0] > 0.3
    assert errors[1] < 0.005


def test_powers_beyond_what_the_levels_show_are_left_out():
    coded = np.random.default_rng(0).choice([-1.0, 0.0, 1.0], (60, 3))
    found = PolynomialRegressor(degree="auto", selection="evidence", space=unit_box(3))
    found.fit(coded, np.exp(coded[:, 0]) * (1.0 + coded[:, 1] * coded[:, 2]))
    assert max(e for row in found.surrogate_.terms.exponents for e in row) <= 2


def test_the_same_runs_give_the_same_model_bit_for_bit():
    coded = points(30)
    fits = [
        PolynomialRegressor(degree="auto", selection="evidence", space=unit_box(3)).fit(coded, ishigami(coded))
        for _ in range(2)
    ]
    assert fits[0].coef_.tobytes() == fits[1].coef_.tobytes()


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"selection": "evidence", "basis": "monomial"}, "selection 'evidence' needs basis 'legendre', got 'monomial'"),
        ({"selection": "evidence", "penalty": 0.1}, "selection 'evidence' takes no penalty, got 0.1"),
        ({"selection": "lars", "heredity": "weak"}, "heredity 'weak' needs selection 'forward'"),
        ({"degree": 13}, "degree must be a whole number from 1 to 12 or 'auto', got 13"),
        ({"degree": "auto", "highest_degree": 0}, "highest_degree must be a whole number from 1 to 12, got 0"),
        ({"degree": "two"}, "degree must be a whole number from 1 to 12 or 'auto', got 'two'"),
    ],
)
def test_settings_that_do_not_go_together_are_refused(settings, message):
    coded = points(20)
    with pytest.raises(ValueError, match=message):
        PolynomialRegressor(space=unit_box(3), **settings).fit(coded, ishigami(coded))


class TestDegenerateRuns:
    """What a fit must survive, at any scale."""

    def fit(self, X, y, **settings):
        return PolynomialRegressor(selection="evidence", space=unit_box(X.shape[1]), **settings).fit(X, y)

    def test_a_response_that_does_not_move_is_its_value_or_nothing(self):
        coded = points(20)
        assert self.fit(coded, np.full(20, 3.0)).terms_ == (("1",),)
        assert self.fit(coded, np.zeros(20)).terms_ == ((),)

    @pytest.mark.parametrize("size", [1e-200, 1e-9, 1e9, 1e200])
    def test_size_makes_no_difference(self, size):
        coded = points(20)
        found = self.fit(coded, size * (coded[:, 0] + coded[:, 1] ** 2), degree="auto")
        kept = dict(zip(found.surrogate_.terms.labels, found.coef_[:, 0] / size, strict=True))
        assert_allclose([kept["f0"], kept["f1^2"]], [1.0, 1.0], rtol=1e-9)

    def test_an_offset_a_million_times_the_movement(self):
        coded = points(20)
        found = self.fit(coded, 1e6 + coded[:, 0] + 0.3 * coded[:, 1] ** 2, degree=2)
        assert_allclose(found.coef_[:, 0], [1e6, 1.0, 0.3], rtol=1e-7)

    def test_two_levels_show_no_square(self):
        coded = np.sign(points(20))
        found = self.fit(coded, coded[:, 0] * coded[:, 1], degree=2)
        assert found.terms_ == (("f0:f1",),)

    def test_hardly_any_runs(self):
        for n in (2, 3):
            found = self.fit(points(n), np.arange(n) + 1.0, degree="auto")
            assert np.isfinite(found.predict(points(50))).all()

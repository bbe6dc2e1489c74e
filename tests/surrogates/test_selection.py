"""Selection: the leave-one-out errors are exact, and terms that the data do not support leave."""

from functools import cache

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from experiments import Terms, model_matrix
from experiments.designs import LatinHypercube, Uniform
from surrogates.selection import PENALTIES, penalised_fit, trimmed_fit
from tests.surrogates.cases import unit_box


@cache
def quadratic(n_factors, n_runs, seed=0):
    """Terms and model matrix of a full quadratic on a uniform design."""
    space = unit_box(n_factors)
    terms = Terms.polynomial(space.names, 2)
    coded = Uniform(n_runs=n_runs, levels=6, budget=200).generate(space, seed).coded
    return terms, model_matrix(terms, coded)


def linear_map(rng, terms, n_factors, constant=True):
    """Coefficients of a random linear map with some factors dead, and the columns it uses."""
    truth = np.zeros(len(terms))
    truth[1 : n_factors + 1] = rng.choice([-1.0, 1.0], n_factors) * rng.uniform(0.2, 2.0, n_factors)
    truth[1 : n_factors + 1] *= np.where(rng.uniform(size=n_factors) < 0.3, 0.0, 1.0)
    truth[int(rng.integers(1, n_factors + 1))] = 1.0
    truth[0] = rng.choice([-1.0, 1.0]) * rng.uniform(0.2, 3.0) if constant else 0.0
    return truth, np.flatnonzero(truth)


def refit(X, y, penalty, penalised):
    """Ridge by an ordinary least-squares solve of the augmented system."""
    rows = np.sqrt(penalty) * np.eye(X.shape[1])[penalised]
    return np.linalg.lstsq(np.vstack([X, rows]), np.concatenate([y, np.zeros(len(rows))]))[0]


# --- leave-one-out ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("penalty", [0.0, 1e-8, 1e-4, 1e-2, 1.0, 30.0])
@pytest.mark.parametrize("constant", [True, False])
@pytest.mark.parametrize("seed", range(3))
def test_leave_one_out_residuals_are_those_of_refitting_without_each_run(penalty, constant, seed):
    rng = np.random.default_rng(seed)
    n, p = 14, 6
    matrix = np.column_stack([np.ones(n), rng.normal(size=(n, p - 1)) + 0.5])
    y = rng.normal(size=n) + 3.0
    columns = np.arange(0 if constant else 1, p)
    fit = penalised_fit(matrix, y, columns, (penalty,))

    X, sloped = matrix[:, columns], columns > 0
    centred = X[:, sloped] - (X[:, sloped].mean(axis=0) if constant else 0.0)
    absolute = penalty * np.linalg.norm(centred, 2) ** 2  # the penalty is relative, and fixed while runs are left out
    assert_allclose(fit.coefficients, refit(X, y, absolute, sloped), rtol=1e-9, atol=1e-11)
    for i in range(n):
        kept = np.arange(n) != i
        coefficients = refit(X[kept], y[kept], absolute, sloped)
        assert fit.loo[i] == pytest.approx(y[i] - X[i] @ coefficients, rel=1e-8, abs=1e-11)
    assert fit.loo_rmse == pytest.approx(np.sqrt(np.mean(fit.loo**2)))


def test_the_penalty_of_least_leave_one_out_error_is_taken():
    terms, matrix = quadratic(4, 18)
    rng = np.random.default_rng(1)
    y = matrix @ rng.normal(size=len(terms)) + rng.normal(size=len(matrix))
    columns = np.arange(len(terms))
    fit = penalised_fit(matrix, y, columns)
    each = [penalised_fit(matrix, y, columns, (penalty,)).loo_rmse for penalty in PENALTIES]
    assert fit.loo_rmse == pytest.approx(min(each), rel=1e-12)
    assert fit.penalty == PENALTIES[int(np.argmin(each))]


def test_more_columns_than_runs_need_a_penalty():
    terms, matrix = quadratic(5, 12)
    y = matrix[:, 1] + 0.1 * np.random.default_rng(0).normal(size=12)
    fit = penalised_fit(matrix, y, np.arange(len(terms)))
    assert fit.penalty > 0.0
    assert np.isfinite(fit.loo_rmse)
    assert not np.isfinite(penalised_fit(matrix, y, np.arange(len(terms)), (0.0,)).loo_rmse)


def test_a_strong_penalty_leaves_the_mean():
    _, matrix = quadratic(2, 12)
    y = np.random.default_rng(0).normal(size=12) + 5.0
    fit = penalised_fit(matrix, y, np.arange(3), (1e12,))
    assert_allclose(matrix[:, :3] @ fit.coefficients, y.mean(), rtol=1e-9)


# --- trimming ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("n_factors", "n_runs"), [(1, 6), (2, 12), (3, 18), (4, 24), (6, 30), (6, 60)])
@pytest.mark.parametrize("constant", [True, False])
def test_exact_linear_data_end_in_exactly_the_linear_terms(n_factors, n_runs, constant):
    for seed in range(6):
        terms, matrix = quadratic(n_factors, n_runs, seed % 3)
        truth, used = linear_map(np.random.default_rng(seed), terms, n_factors, constant)
        y = matrix @ truth
        fit = trimmed_fit(matrix, y, floor=1e-12 * np.abs(y).max())
        assert_array_equal(np.sort(fit.columns), used, err_msg=f"seed {seed}")
        assert_allclose(fit.coefficients, truth[fit.columns], rtol=1e-10)


@pytest.mark.parametrize(("n_factors", "n_runs"), [(3, 18), (6, 30)])
@pytest.mark.parametrize("noise", [1e-9, 1e-2])
def test_noise_on_linear_data_seldom_buys_a_term_above_degree_one(n_factors, n_runs, noise):
    """A model that need not be quadratic must not be: an affine one has a certified inverse.

    Chance alone may keep a term now and then; a rule that keeps one in more than a quarter of noisy
    linear experiments does not select.
    """
    count, spurious, lost = 24, 0, 0
    for seed in range(count):
        terms, matrix = quadratic(n_factors, n_runs, seed % 5)
        rng = np.random.default_rng(seed)
        truth, used = linear_map(rng, terms, n_factors)
        y = matrix @ truth + noise * np.abs(truth[1:]).sum() * rng.normal(size=n_runs)
        columns = trimmed_fit(matrix, y, floor=1e-12 * np.abs(y).max()).columns
        spurious += bool((terms.degrees[columns] > 1).any())
        lost += bool(set(used) - set(columns.tolist()))
    assert lost <= count // 10, f"a linear term was lost in {lost} of {count} experiments"
    assert spurious <= count // 4, f"a term above degree one was kept in {spurious} of {count} linear experiments"


@pytest.mark.parametrize("noise", [0.0, 1e-6, 1e-3])
@pytest.mark.parametrize("which", ["f1^2", "f0:f3"])
def test_a_term_above_degree_one_that_is_there_is_kept(noise, which):
    for seed in range(10):
        terms, matrix = quadratic(4, 24, seed % 3)
        rng = np.random.default_rng(seed)
        truth, _ = linear_map(rng, terms, 4)
        column = terms.labels.index(which)
        truth[column] = 0.1 * np.abs(truth[1:5]).sum()
        y = matrix @ truth + noise * np.abs(truth[1:]).sum() * rng.normal(size=24)
        fit = trimmed_fit(matrix, y, floor=1e-12 * np.abs(y).max())
        assert column in fit.columns
        assert fit.coefficients[list(fit.columns).index(column)] == pytest.approx(truth[column], rel=0.2)


def test_the_trimmed_model_predicts_no_worse_than_the_whole():
    rng = np.random.default_rng(4)
    space = unit_box(3)
    terms = Terms.polynomial(space.names, 2)
    fresh = model_matrix(terms, rng.uniform(-1.0, 1.0, (500, 3)))
    ratio = []
    for seed in range(20):
        _, matrix = quadratic(3, 18, seed % 5)
        truth, _ = linear_map(rng, terms, 3)
        y = matrix @ truth + 0.05 * rng.normal(size=18)
        whole, trimmed = penalised_fit(matrix, y, np.arange(len(terms)), (0.0,)), trimmed_fit(matrix, y)
        error = [np.std(fresh[:, f.columns] @ f.coefficients - fresh @ truth) for f in (whole, trimmed)]
        ratio.append(error[1] / error[0])
    assert np.median(ratio) < 1.0


@pytest.mark.parametrize("noise", [0.0, 1e-3])
def test_a_constant_goes_when_absent_and_stays_when_present(noise):
    kept = {0.0: 0, 1.0: 0}
    for seed in range(20):
        terms, matrix = quadratic(2, 18, seed % 5)
        rng = np.random.default_rng(seed)
        for level in kept:
            y = level + matrix[:, 1] - 2.0 * matrix[:, 2] + noise * rng.normal(size=18)
            columns = trimmed_fit(matrix, y, floor=1e-12 * np.abs(y).max()).columns
            kept[level] += "1" in terms.select(columns).labels
    assert kept[1.0] == 20
    assert kept[0.0] <= (0 if noise == 0.0 else 5)


def test_a_constant_response_keeps_only_the_constant():
    terms, matrix = quadratic(3, 18)
    fit = trimmed_fit(matrix, np.full(18, 7.0), floor=7e-12)
    assert terms.select(fit.columns).labels == ("1",)
    assert fit.coefficients[0] == pytest.approx(7.0)


def test_a_response_that_is_zero_keeps_nothing():
    _, matrix = quadratic(3, 18)
    fit = trimmed_fit(matrix, np.zeros(18), floor=np.finfo(float).tiny)
    assert not fit.columns.size
    assert fit.loo_rmse == 0.0


def test_the_order_of_runs_does_not_matter():
    rng = np.random.default_rng(5)
    space = unit_box(3)
    terms = Terms.polynomial(space.names, 2)
    matrix = model_matrix(terms, LatinHypercube(n_runs=20).generate(space, 0).coded)
    y = matrix @ rng.normal(size=len(terms)) + 0.01 * rng.normal(size=20)
    shuffled = rng.permutation(20)
    first, second = trimmed_fit(matrix, y), trimmed_fit(matrix[shuffled], y[shuffled])
    assert_array_equal(first.columns, second.columns)
    assert_allclose(first.coefficients, second.coefficients, rtol=1e-9)


def test_the_scale_of_the_response_does_not_matter():
    rng = np.random.default_rng(6)
    terms, matrix = quadratic(3, 18)
    y = matrix @ rng.normal(size=len(terms)) + 0.01 * rng.normal(size=18)
    first, second = trimmed_fit(matrix, y, floor=1e-12), trimmed_fit(matrix, 1e-9 * y, floor=1e-21)
    assert_array_equal(first.columns, second.columns)
    assert_allclose(1e-9 * first.coefficients, second.coefficients, rtol=1e-9)


def test_a_square_on_two_levels_does_not_double_the_constant():
    # Every square is a second column of ones there, which nothing can tell from the constant.
    space = unit_box(2)
    corners = np.array([[a, b] for a in (-1.0, 1.0) for b in (-1.0, 1.0)] * 3)
    y = 5.0 + 2.0 * corners[:, 0]
    terms = Terms.polynomial(space.names, 2)
    matrix = model_matrix(terms, corners)
    for fit in (trimmed_fit(matrix, y, floor=1e-12), penalised_fit(matrix, y, np.arange(len(terms)))):
        np.testing.assert_allclose(matrix[:, fit.columns] @ fit.coefficients, y, rtol=0.0, atol=1e-12)
    assert [terms.labels[c] for c in trimmed_fit(matrix, y, floor=1e-12).columns] == ["1", "f0"]

"""Forward selection: finds sparse truths from fewer runs than candidates, keeps nothing of noise, respects heredity."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from experiments import Factor, FactorSpace, Terms, model_matrix
from surrogates import PolynomialRegressor
from surrogates.selection import penalised_fit
from surrogates.stepwise import FULLEST, forward_fit, forward_path, parents_of

NAMES = tuple(f"f{i}" for i in range(6))
CUBIC = Terms.polynomial(NAMES, 3)
EXPONENTS = np.array(CUBIC.exponents)


def points(n: int, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).uniform(-1.0, 1.0, (n, 6))


def entry_order(matrix, y, parents, heredity):
    return forward_path(matrix, y, matrix[:0], parents, heredity, 0)[0]


def truth(labels: dict[str, float], coded: np.ndarray) -> np.ndarray:
    return model_matrix(Terms.parse(list(labels), NAMES), coded) @ np.array(list(labels.values()))


SPARSE = {"1": 0.5, "f0": 2.0, "f1": -1.0, "f0:f2": 0.4, "f3^2": 0.3, "f0:f1:f4": 0.2}


@pytest.mark.parametrize("seed", range(5))
def test_a_sparse_cubic_is_found_exactly_from_fewer_runs_than_candidates(seed):
    coded = points(40, seed)
    assert len(CUBIC) > len(coded)
    fit = forward_fit(model_matrix(CUBIC, coded), truth(SPARSE, coded), EXPONENTS, floor=1e-10)
    assert {CUBIC.labels[c] for c in fit.columns} == set(SPARSE)
    assert_allclose(
        [fit.coefficients[list(fit.columns).index(CUBIC.labels.index(k))] for k in SPARSE], list(SPARSE.values())
    )


def test_of_pure_noise_hardly_anything_is_kept():
    """84 candidates on 60 runs of noise, 20 times: an unguarded choice would keep some 36 terms each time."""
    kept = []
    for seed in range(20):
        y = np.random.default_rng(100 + seed).normal(size=60)
        kept.append(len(forward_fit(model_matrix(CUBIC, points(60, seed)), y, EXPONENTS).columns))
    assert np.median(kept) <= 1
    assert max(kept) <= 8


def test_noise_does_not_hide_a_linear_map_and_adds_little():
    lost, extra = 0, 0
    linear = {"1": 1.0, "f0": 1.0, "f2": -2.0, "f5": 0.5}
    for seed in range(10):
        coded = points(60, seed)
        y = truth(linear, coded) + 0.01 * np.random.default_rng(seed).normal(size=60)
        found = {CUBIC.labels[c] for c in forward_fit(model_matrix(CUBIC, coded), y, EXPONENTS).columns}
        lost += len(set(linear) - found)
        extra += len(found - set(linear))
    assert lost == 0
    assert extra <= 5


def test_each_step_enters_what_lowers_the_residual_most():
    """Against trying every candidate by least squares."""
    coded = points(30)
    terms = Terms.polynomial(NAMES, 2)
    matrix, y = model_matrix(terms, coded), truth({"f0": 1.0, "f1:f2": 0.7, "f3^2": 0.4, "f4": 0.1}, coded)
    y = y + 0.01 * np.random.default_rng(0).normal(size=30)
    order = entry_order(matrix, y, parents_of(np.array(terms.exponents)), "none")
    assert len(order) == len(set(order)) == int(FULLEST * 30)
    for k in range(1, 6):
        left = []
        for candidate in range(len(terms)):
            used = [*order[:k], candidate]
            left.append(np.linalg.norm(y - matrix[:, used] @ np.linalg.lstsq(matrix[:, used], y, rcond=None)[0]))
        assert order[k] == int(np.argmin(left))


def test_predictions_along_the_path_are_those_of_least_squares():
    coded, asked = points(40), points(9, seed=1)
    matrix, there = model_matrix(CUBIC, coded), model_matrix(CUBIC, asked)
    y = np.exp(coded[:, 0]) + coded[:, 1] * coded[:, 2]
    order, predicted = forward_path(matrix, y, there, parents_of(EXPONENTS), "none", 0)
    for k in (1, 3, 10, len(order)):
        slope = np.linalg.lstsq(matrix[:, order[:k]], y, rcond=None)[0]
        assert_allclose(predicted[:, k], there[:, order[:k]] @ slope, rtol=1e-8, atol=1e-8)


@pytest.mark.parametrize(("heredity", "enough"), [("weak", any), ("strong", all)])
def test_heredity_holds_at_every_step(heredity, enough):
    coded = points(60)
    parents = parents_of(EXPONENTS)
    y = truth({"f0:f1": 1.0, "f2": 0.5, "f2^2": 0.3, "f3:f4:f5": 0.5}, coded)
    order = entry_order(model_matrix(CUBIC, coded), y, parents, heredity)
    for k, term in enumerate(order):
        assert not parents[term] or enough(parent in order[:k] for parent in parents[term])


def test_parents_are_the_terms_with_one_power_less():
    labels = CUBIC.labels
    parents = parents_of(EXPONENTS)
    assert {labels[p] for p in parents[labels.index("f0^2:f1")]} == {"f0:f1", "f0^2"}
    assert parents[labels.index("f0")] == []
    assert parents[labels.index("1")] == []


def test_no_more_terms_than_the_runs_can_carry():
    coded = points(20)
    y = np.exp(coded.sum(axis=1))
    assert len(entry_order(model_matrix(CUBIC, coded), y, parents_of(EXPONENTS), "none")) == int(FULLEST * 20)


def test_a_constant_response_keeps_no_slope():
    coded = points(20)
    fit = forward_fit(model_matrix(CUBIC, coded), np.full(20, 3.0), EXPONENTS, floor=1e-12)
    assert_array_equal(fit.columns, [0])
    assert_allclose(fit.coefficients, [3.0])


def test_the_fit_is_that_of_least_squares_on_the_terms_kept():
    coded = points(50)
    matrix = model_matrix(CUBIC, coded)
    y = np.sin(coded[:, 0]) + coded[:, 1] * coded[:, 2]
    fit = forward_fit(matrix, y, EXPONENTS)
    assert_allclose(fit.coefficients, penalised_fit(matrix, y, fit.columns, (0.0,)).coefficients, rtol=1e-12)


def test_the_regressor_selects_forward_and_refuses_what_does_not_fit():
    space = FactorSpace(tuple(Factor(name, "1", -1.0, 1.0) for name in NAMES))
    coded = points(40)
    fitted = PolynomialRegressor(degree=3, selection="forward", space=space).fit(coded, truth(SPARSE, coded))
    assert set(fitted.terms_[0]) == set(SPARSE)
    for settings, message in (
        ({"selection": "both"}, "selection must be one of backward, .*, evidence, got 'both'"),
        ({"selection": "forward", "heredity": "some"}, "heredity must be one of none, weak, strong, got 'some'"),
        ({"heredity": "weak"}, "heredity 'weak' needs selection 'forward'"),
        ({"selection": "forward", "penalty": 0.1}, "selection 'forward' takes no penalty, got 0.1"),
    ):
        with pytest.raises(ValueError, match=message):
            PolynomialRegressor(space=space, **settings).fit(coded, coded)

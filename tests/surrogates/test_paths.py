"""Least-angle and adaptive-lasso paths: the order of scikit-learn's own, the truth found, candidates beyond runs."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from sklearn.linear_model import lars_path

from experiments import Terms, model_matrix
from surrogates import PolynomialRegressor
from surrogates.paths import adaptive_lasso_order, lars_order

from .cases import unit_box

NAMES = tuple(f"f{i}" for i in range(6))
CUBIC = Terms.polynomial(NAMES, 3)


def points(n: int, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).uniform(-1.0, 1.0, (n, 6))


def sparse(coded: np.ndarray) -> np.ndarray:
    return 0.5 + 2.0 * coded[:, 0] - coded[:, 1] + 0.8 * coded[:, 0] * coded[:, 2] + 0.6 * coded[:, 3] ** 2


def test_the_order_is_that_in_which_coefficients_leave_zero():
    coded = points(60)
    terms = Terms.polynomial(NAMES, 2)
    matrix, y = model_matrix(terms, coded), sparse(coded)
    scaled = (matrix[:, 1:] - matrix[:, 1:].mean(axis=0)) / matrix[:, 1:].std(axis=0)
    _, active, _ = lars_path(scaled, y - y.mean(), method="lar", max_iter=8)
    assert lars_order(matrix, y, 9) == [0, *(int(i) + 1 for i in active)]


@pytest.mark.parametrize("order", [lars_order, adaptive_lasso_order])
def test_true_terms_enter_among_the_first(order):
    coded = points(50)
    found = order(model_matrix(CUBIC, coded), sparse(coded), 20)
    wanted = {CUBIC.labels.index(label) for label in ("1", "f0", "f1", "f0:f2", "f3^2")}
    assert found[0] == 0
    assert wanted <= set(found[:12])


@pytest.mark.parametrize("selection", ["lars", "adaptive_lasso"])
@pytest.mark.parametrize("seed", range(3))
def test_verification_a_sparse_truth_is_found_from_fewer_runs_than_candidates(selection, seed):
    coded, fresh = points(50, seed), points(200, 90)
    found = PolynomialRegressor(degree=3, selection=selection, space=unit_box(6)).fit(coded, sparse(coded))
    assert len(CUBIC) > len(coded)
    assert_allclose(found.predict(fresh), sparse(fresh), atol=1e-9)


@pytest.mark.parametrize("order", [lars_order, adaptive_lasso_order])
def test_a_constant_response_takes_the_constant_alone(order):
    assert order(model_matrix(CUBIC, points(20)), np.full(20, 3.0), 10) == [0]

"""Corrections of a cheap model against laws with known coefficients."""

import re
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

from experiments import Terms
from surrogates import PolynomialRegressor, Surrogate, dumps, loads
from surrogates.discrepancy import KINDS, correct
from tests.surrogates.cases import box, surrogate

SPACE = box(("a", -1.0, 3.0), ("b", 0.0, 5.0))
CHEAP = surrogate(SPACE, ["1", "a", "b", "a:b", "b^2"], [[0.5, 2.0, -1.0, 0.7, 0.3], [0.0, 1.0, 0.0, -0.4, 0.0]])


def settings(n, seed=0):
    return SPACE.decode(np.random.default_rng(seed).uniform(-1, 1, (n, 2)))


def same_map(one, other):
    fresh = settings(50, seed=9)
    assert_allclose(one.predict(fresh), other(fresh), rtol=1e-8, atol=1e-9)


def bump(X):
    a, b = SPACE.code(X).T
    return np.column_stack([0.1 - 0.2 * a + 0.05 * b, 0.3 * b])


def test_an_additive_discrepancy_is_found():
    X = settings(10)
    found = correct(CHEAP, X, CHEAP.predict(X) + bump(X), "additive", 1)
    same_map(found.surrogate, lambda Z: CHEAP.predict(Z) + bump(Z))
    assert_allclose(found.scale, 1.0)
    assert found.loo_rmse.max() < 1e-8


def test_a_constant_ratio_is_found_from_three_runs():
    X = settings(3)
    ratio = np.array([0.95, 1.2])
    found = correct(CHEAP, X, ratio * CHEAP.predict(X), "scaled", 1)
    same_map(found.surrogate, lambda Z: ratio * CHEAP.predict(Z))
    assert_allclose(found.scale, ratio, rtol=1e-12)


def test_a_ratio_that_varies_is_found_through_zeros_of_the_cheap_model():
    X = settings(8)
    assert (np.sign(CHEAP.predict(X)[:, 1]).min(), np.sign(CHEAP.predict(X)[:, 1]).max()) == (-1, 1)

    def ratio(Z):
        a, b = SPACE.code(Z).T
        return np.column_stack([1.0 + 0.1 * a - 0.3 * b, 0.8 - 0.2 * a])

    found = correct(CHEAP, X, ratio(X) * CHEAP.predict(X), "multiplicative", 1)
    same_map(found.surrogate, lambda Z: ratio(Z) * CHEAP.predict(Z))
    assert_allclose(found.scale, [1.0, 0.8], rtol=1e-9)
    assert found.surrogate.terms.degrees.max() == 3


def test_leave_one_out_of_a_ratio_is_that_of_refitting():
    X = settings(9)
    y = CHEAP.predict(X) * 1.1 + np.random.default_rng(3).normal(size=(9, 2))
    left = []
    for i in range(9):
        rest = np.arange(9) != i
        left.append(correct(CHEAP, X[rest], y[rest], "multiplicative", 1).surrogate.predict(X[[i]])[0] - y[i])
    found = correct(CHEAP, X, y, "multiplicative", 1)
    assert_allclose(found.loo_rmse, np.sqrt(np.mean(np.square(left), axis=0)), rtol=1e-9)


@pytest.mark.parametrize("kind", KINDS)
def test_a_correction_that_is_not_needed_changes_nothing(kind):
    X = settings(7)
    same_map(correct(CHEAP, X, CHEAP.predict(X), kind, 1).surrogate, CHEAP.predict)


@pytest.mark.parametrize("kind", KINDS)
def test_the_corrected_model_is_a_model_like_any_other(kind):
    X = settings(12)
    found = correct(CHEAP, X, CHEAP.predict(X) + bump(X), kind, 1).surrogate
    assert isinstance(found, Surrogate)
    fresh = settings(5, seed=4)
    assert_allclose(loads(dumps(found)).predict(fresh), found.predict(fresh), rtol=1e-14)
    assert (found.certificate, found.validation, found.standard_errors) == (None, (), None)


def test_few_dear_runs_do_better_with_the_cheap_model_than_without():
    """What the method is for: a curved response, its dear version 5 % lower and a little tilted, 8 runs."""

    def dear(Z):
        return 0.95 * CHEAP.predict(Z) + 0.1 * bump(Z)

    X, fresh = settings(8), settings(200, seed=8)
    corrected = correct(CHEAP, X, dear(X), "scaled", 1).surrogate.predict(fresh) - dear(fresh)
    alone = PolynomialRegressor(degree=1, selection="evidence", space=SPACE).fit(X, dear(X)).predict(fresh) - dear(
        fresh
    )
    assert np.abs(corrected).max() < 0.1 * np.abs(alone).max()


def test_a_cheap_model_that_does_not_move():
    flat = Surrogate(SPACE, CHEAP.responses, Terms.parse(["1"], SPACE.names), np.array([[2.0, 0.0]]))
    X = settings(8)
    found = correct(flat, X, bump(X), "scaled", 1)
    same_map(found.surrogate, bump)
    assert_allclose(found.scale, 1.0)


@pytest.mark.parametrize(
    ("kind", "degree", "n", "said"),
    [
        ("ratio", 1, 9, "kind must be one of additive, scaled, multiplicative, got 'ratio'"),
        ("additive", 0, 9, "the degree of a correction 'additive' must be a whole number from 1, got 0"),
        ("multiplicative", -1, 9, "must be a whole number from 0, got -1"),
        ("scaled", 1.5, 9, "must be a whole number from 1, got 1.5"),
        ("scaled", True, 9, "must be a whole number from 1, got True"),
        ("multiplicative", 1, 3, "correction 'multiplicative' of degree 1 needs 4 runs or more, got 3"),
        ("additive", 2, 2, "correction 'additive' of degree 2 needs 3 runs or more, got 2"),
    ],
)
def test_bad_requests(kind, degree, n, said):
    X = settings(n)
    with pytest.raises(ValueError, match=said):
        correct(CHEAP, X, CHEAP.predict(X), kind, degree)


def test_bad_tables():
    X = settings(6)
    y = CHEAP.predict(X)
    with pytest.raises(ValueError, match=r"2 factors and 2 responses; got shapes \(6, 2\) and \(5, 2\)"):
        correct(CHEAP, X, y[:5])
    y[2, 1] = np.nan
    with pytest.raises(ValueError, match="X and y must be finite: leave out runs that failed"):
        correct(CHEAP, X, y)


def test_the_example_of_the_page_runs():
    """And corrects: the cheap map is 10 % off, the corrected one is exact, as both are linear."""
    page = (Path(__file__).parents[2] / "docs" / "calculix.md").read_text(encoding="utf-8")
    (code,) = (c for c in re.findall(r"```python\n(.*?)```", page, re.DOTALL) if "correct(" in c)
    code, n_designs = re.subn(r"Uniform\((.*?)\)", r"Uniform(\1, budget=200)", code)  # any will do
    assert n_designs == 2
    names = {}
    exec(compile(code, "docs/calculix.md", "exec"), names)
    force = [[0.1, -0.4, 0.9, 0.3, 0.2, -0.8]]
    truth = names["dear"].evaluate(np.array(force)).values
    assert np.abs(names["cheap"].predict(force) / truth - 1.0).max() > 0.05
    assert_allclose(names["corrected"].surrogate.predict(force), truth, rtol=1e-6)

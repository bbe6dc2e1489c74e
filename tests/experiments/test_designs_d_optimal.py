"""D-optimal designs: exhaustive search where it is possible, published efficiencies, and bounds elsewhere."""

from itertools import combinations, combinations_with_replacement, product

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from experiments import Factor, FactorSpace
from experiments.designs import Design, DOptimal, PlackettBurman, properties
from experiments.designs.d_optimal import model_terms
from experiments.designs.exchange import Exchange, _gain
from experiments.terms import model_matrix

GRID = np.array(list(product((-1.0, 0.0, 1.0), repeat=2)))


def space(k: int) -> FactorSpace:
    return FactorSpace(tuple(Factor("ABCDEFGHIJKLMNOP"[i], "1", 0, 1) for i in range(k)))


def determinant(coded: np.ndarray, model: str) -> float:
    matrix = model_matrix(model_terms(model, space(coded.shape[1])), coded)
    return float(np.linalg.det(matrix.T @ matrix))


@pytest.mark.parametrize("n_runs", [6, 7, 8, 9])
@pytest.mark.parametrize("replicates", [True, False])
def test_no_choice_of_grid_points_is_better(n_runs, replicates):
    """All 9-choose-n subsets, or multisets, of the 3 × 3 grid under the quadratic model."""
    choose = combinations_with_replacement if replicates else combinations
    rows = model_matrix(model_terms("quadratic", space(2)), GRID)[list(choose(range(9), n_runs))]
    best = np.linalg.det(rows.transpose(0, 2, 1) @ rows).max()
    design = DOptimal(n_runs, replicates=replicates).generate(space(2))
    assert determinant(design.coded, "quadratic") == pytest.approx(best, rel=1e-9)


@pytest.mark.parametrize(("n_runs", "published"), [(6, 0.8849), (7, 0.9454), (8, 0.9572), (9, 0.9740)])
def test_published_efficiencies(n_runs, published):
    """Atkinson and Donev (1992), *Optimum Experimental Designs*, Table 11.1: second order, two factors, 3 × 3 grid.

    Relative to the continuous optimum, |M| = 1.1429e-2 (Box and Draper 1971, Technometrics 13, 731–742).
    """
    found = properties(DOptimal(n_runs).generate(space(2)), "quadratic").d_efficiency
    assert found / 1.1429e-2 ** (1 / 6) == pytest.approx(published, abs=1.5e-4)


@pytest.mark.parametrize(("n_runs", "k"), [(4, 3), (8, 7), (12, 6), (16, 4)])
def test_first_order_reaches_hadamards_bound(n_runs, k):
    """Hadamard (1893): det XᵀX ≤ n^p, reached by orthogonal two-level columns only."""
    design = DOptimal(n_runs, "linear").generate(space(k))
    assert properties(design).d_efficiency == pytest.approx(1.0, abs=1e-12)
    assert_array_equal(np.abs(design.coded), np.ones((n_runs, k)))


@pytest.mark.parametrize(("n_runs", "counts"), [(6, [2, 2, 2]), (9, [3, 3, 3])])
def test_parabola_puts_equal_weight_on_ends_and_middle(n_runs, counts):
    """Guest (1958), Ann. Math. Statist. 29, 294–299."""
    coded = DOptimal(n_runs, levels=5).generate(space(1)).coded
    assert_array_equal(np.unique(coded, return_counts=True)[0], [-1.0, 0.0, 1.0])
    assert_array_equal(np.unique(coded, return_counts=True)[1], counts)


def test_gain_is_the_ratio_of_determinants():
    rng = np.random.default_rng(0)
    rows, new = rng.normal(size=(9, 4)), rng.normal(size=(3, 4))
    before = np.linalg.det(rows.T @ rows)
    gain = _gain(np.linalg.inv(rows.T @ rows), rows[2], new)
    for i in range(3):
        after = np.vstack([np.delete(rows, 2, axis=0), new[i]])
        assert gain[i] == pytest.approx(np.linalg.det(after.T @ after) / before, rel=1e-9)


@pytest.mark.parametrize(("k", "n_runs"), [(2, 9), (3, 20), (8, 60)])
def test_replicates_can_be_forbidden(k, n_runs):
    """Eight factors on three levels are more points than are listed, so coordinates are exchanged."""
    method = DOptimal(n_runs, replicates=False, starts=1)
    coded = method.generate(space(k), rng=1).coded
    assert len(np.unique(coded, axis=0)) == n_runs
    assert properties(Design(space(k), coded, "mine"), "quadratic").estimable


def test_with_replicates_some_runs_repeat():
    coded = DOptimal(14).generate(space(2)).coded
    assert len(np.unique(coded, axis=0)) <= 9


def test_large_grids_are_searched_by_coordinates_and_gain():
    exchange = Exchange(8, 3, lambda x: model_matrix(model_terms("linear", space(8)), x), np.empty((0, 8)), True)
    assert exchange.grid is None
    start = exchange.start(12, np.random.default_rng(0))
    end = exchange.improve(start)
    assert exchange.log_determinant(end) > exchange.log_determinant(start) + 1.0
    assert exchange.log_determinant(end) <= 9 * np.log(12.0) + 1e-9


def test_more_starts_are_never_worse():
    values = [properties(DOptimal(15, starts=s).generate(space(4), 3), "quadratic").d_efficiency for s in (1, 4, 12)]
    assert values[0] <= values[1] <= values[2]
    assert values[0] < values[2]


def test_augmentation_keeps_what_was_paid_for():
    """Twelve two-level runs cannot see curvature; with twenty more the quadratic model is estimable."""
    paid = PlackettBurman(12).generate(space(6))
    method = DOptimal(20, replicates=False, starts=3)
    design = method.augment(paid, rng=2)
    assert len(design) == 32
    assert design.method == "d_optimal"
    assert_array_equal(design.coded[:12], paid.coded)
    assert len(np.unique(design.coded, axis=0)) == 32
    assert not properties(paid, "quadratic").estimable
    found = properties(design, "quadratic").d_efficiency
    free = properties(DOptimal(32, replicates=False, starts=3).generate(space(6), 2), "quadratic").d_efficiency
    assert 0.8 * free < found
    assert_array_equal(method.augment(paid, rng=2).coded, design.coded)


def test_augmentation_counts_runs_off_the_grid():
    paid = Design(space(1), [[-0.9], [0.1], [1.0]], "mine")
    design = DOptimal(2, replicates=False).augment(paid)
    assert set(design.coded[3:, 0]) == {-1.0, 0.0}
    with pytest.raises(ValueError, match="3 different runs were asked for, but 3 levels of 1 factors leave 2 points"):
        DOptimal(3, replicates=False).augment(paid)
    assert len(DOptimal().augment(paid)) == 3 + 4


@pytest.mark.parametrize(
    ("model", "labels"),
    [
        ("linear", "1 A B"),
        ("interactions", "1 A B A:B"),
        ("quadratic", "1 A B A^2 A:B B^2"),
        (" 1, A:B , A^3", "1 A:B A^3"),
    ],
)
def test_models(model, labels):
    assert DOptimal(model=model).terms(space(2)).labels == tuple(labels.split())


def test_default_has_four_spare_runs():
    assert len(DOptimal().generate(space(2))) == 10
    assert len(DOptimal(replicates=False).generate(space(2))) == 9
    assert len(DOptimal(replicates=False).generate(space(3))) == 14


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"n_runs": 5}, "5 runs cannot determine 6 terms; use n_runs = 6 or more"),
        ({"n_runs": 10, "replicates": False}, "10 different runs were asked for, but 3 levels of 2 factors leave 9"),
        ({"model": "1, A^3", "levels": 1001}, "levels of a D-optimal design must be at most 101"),
        ({"model": "1, A, A^3"}, "no 7 runs on 3 levels tell the 3 terms of the model apart; use more levels"),
        ({"levels": 2}, "no 10 runs on 2 levels tell the 6 terms of the model apart; use more levels"),
        ({"model": "1, Z"}, "term 'Z' names an unknown factor 'Z'; known are A, B"),
        ({"model": "quadratics"}, "unknown factor 'quadratics'"),
    ],
)
def test_refuses(settings, message):
    with pytest.raises(ValueError, match=message):
        DOptimal(**settings).generate(space(2))

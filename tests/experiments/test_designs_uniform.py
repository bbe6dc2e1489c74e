"""Uniform designs: balance, discrepancy, and the price of an exchange."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from experiments import Factor, FactorSpace
from experiments.designs import Uniform, centred_discrepancy_squared, level_discrepancy_squared, uniform
from experiments.designs.discrepancy import unit_levels
from experiments.designs.uniform import _State, anneal


def space(k: int) -> FactorSpace:
    return FactorSpace(tuple(Factor(f"f{i}", "1", 0, 1) for i in range(k)))


def balanced(n: int, levels: int, k: int, seed: int = 0) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return np.column_stack([rng.permutation(np.tile(np.arange(levels), n // levels)) for _ in range(k)])


def discrepancy(design: np.ndarray, levels: int) -> float:
    return centred_discrepancy_squared(unit_levels(levels)[design])


@pytest.mark.parametrize(("n", "levels", "k"), [(30, 6, 6), (12, 12, 3), (8, 2, 5), (6, 3, 1), (2, 2, 1), (2, 2, 2)])
def test_every_level_equally_often(n, levels, k):
    design = Uniform(n, levels, budget=50).generate(space(k), rng=1)
    for column in design.coded.T:
        found, count = np.unique(column, return_counts=True)
        assert_allclose(found, np.linspace(-1.0, 1.0, levels), rtol=0.0, atol=1e-15)
        assert_array_equal(count, [n // levels] * levels)
        assert column.min() == -1.0
        assert column.max() == 1.0


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_default_is_about_as_even_as_the_published_design(seed):
    """Goal of the project: CD₂² ≤ 0.0295; the thesis's own U30(6^6), Table 2.4, has 0.02794006."""
    design = Uniform().generate(space(6), rng=seed)
    assert design.coded.shape == (30, 6)
    assert level_discrepancy_squared(design.coded) <= 0.0295


@pytest.mark.parametrize(("n", "levels", "k"), [(12, 4, 3), (10, 5, 6), (8, 8, 1), (6, 2, 4)])
def test_price_is_the_change_found_by_recomputing(n, levels, k):
    design = balanced(n, levels, k)
    state = _State(design.copy(), levels)
    before = discrepancy(design, levels)
    assert state.value() == pytest.approx(before, rel=1e-12)
    for column in range(k):
        change, first, second = state.price(column)
        assert len(change) == n * (n - 1) // 2
        for price, i, j in zip(change, first, second, strict=True):
            if design[i, column] == design[j, column]:
                assert price == np.inf
                continue
            moved = design.copy()
            moved[[i, j], column] = moved[[j, i], column]
            assert price == pytest.approx(discrepancy(moved, levels) - before, rel=0.0, abs=1e-14 * (1 + before))


def test_products_stay_true_over_many_exchanges():
    design = balanced(12, 4, 3)
    state, rng = _State(design.copy(), 4), np.random.default_rng(1)
    value = state.value()
    for step in range(300):
        change, first, second = state.price(step % 3)
        pick = rng.choice(np.flatnonzero(np.isfinite(change)))
        value += change[pick]
        state.exchange(step % 3, first[pick], second[pick])
    fresh = _State(state.design.copy(), 4)
    assert not np.array_equal(state.design, design)
    assert_allclose(state.once, fresh.once, rtol=1e-12)
    assert_allclose(state.twice, fresh.twice, rtol=1e-12)
    assert value == pytest.approx(discrepancy(state.design, 4), rel=1e-11)


def test_annealing_never_ends_above_its_start():
    for seed in range(5):
        start = balanced(12, 3, 4, seed)
        best = anneal(start, 3, 40, np.random.default_rng(seed))
        assert discrepancy(best, 3) < discrepancy(start, 3)


def test_annealing_keeps_the_best_it_met(monkeypatch):
    """At one temperature, and a hot one, a longer walk begins as the shorter one did."""
    monkeypatch.setattr(uniform, "HOTTEST", 1e3)
    monkeypatch.setattr(uniform, "COLDEST", 1e3)
    start = balanced(12, 4, 3)
    values = [discrepancy(anneal(start, 4, b, np.random.default_rng(0)), 4) for b in range(0, 200, 5)]
    assert (np.diff(values) <= 0.0).all()
    assert values[-1] < values[1] < values[0]


def test_annealing_does_not_touch_its_start():
    start = balanced(8, 4, 2)
    kept = start.copy()
    anneal(start, 4, 20, np.random.default_rng(0))
    assert_array_equal(start, kept)


def test_a_budget_lowers_the_discrepancy():
    values = [level_discrepancy_squared(Uniform(12, 4, b).generate(space(4), 3).coded) for b in (0, 400)]
    assert values[1] < 0.9 * values[0]


def test_one_factor_has_nothing_to_gain():
    coded = Uniform(6, 6, 100).generate(space(1)).coded
    assert level_discrepancy_squared(coded) == pytest.approx(1.0 / (12.0 * 36.0), rel=1e-9)


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ((31, 6, 1), "31 runs and 6 levels do not fit; use n_runs = 30 or 36"),
        ((5, 6, 1), "use n_runs = 6$"),
        ((30, 1, 1), "levels of a uniform design must be a whole number of at least 2, got 1"),
        ((30, 6.0, 1), "levels of a uniform design must be a whole number of at least 2, got 6.0"),
        ((0, 6, 1), "n_runs of a uniform design must be a whole number of at least 2, got 0"),
        ((30, 6, -1), "budget of a uniform design must be a whole number of at least 0, got -1"),
    ],
)
def test_refuses(settings, message):
    with pytest.raises(ValueError, match=message):
        Uniform(*settings)

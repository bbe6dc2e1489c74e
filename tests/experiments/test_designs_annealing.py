"""Exchange annealing: the price of an exchange, rounding over long walks, and what it may move."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from experiments.designs import annealing
from experiments.designs.annealing import anneal, legs, prices
from experiments.designs.discrepancy import CRITERIA


def balanced(n: int, levels: int, k: int, seed: int = 0) -> np.ndarray:
    """A random U-type design, from the centre of the cube."""
    rng = np.random.default_rng(seed)
    ranks = np.column_stack([rng.permutation(np.tile(np.arange(levels), n // levels)) for _ in range(k)])
    return (ranks + 0.5) / levels - 0.5


def rng(seed: int = 0) -> np.random.Generator:
    return np.random.default_rng(seed)


@pytest.mark.parametrize("criterion", CRITERIA.values(), ids=lambda c: c.name)
@pytest.mark.parametrize(("n", "levels", "k"), [(12, 4, 3), (10, 5, 6), (9, 9, 1), (6, 2, 4)])
def test_price_is_the_change_found_by_recomputing(criterion, n, levels, k):
    design, rows = balanced(n, levels, k), np.arange(n)
    before = criterion.value(design + 0.5)
    once, twice = criterion.products(design)
    for column in range(k):
        level = design[:, column]
        rest = twice / criterion.pair(level[:, None], level[None, :])
        off, lone = rest * (1.0 - np.eye(n)), once / criterion.single(level)
        for r in range(n):
            partner = (r - rows) % n
            found = prices(criterion, level, partner, off, np.diag(rest), lone, np.ones(n))
            for i, j in enumerate(partner):
                moved = design.copy()
                moved[[i, j], column] = moved[[j, i], column]
                change = criterion.value(moved + 0.5) - before
                # A row that is its own partner stays, and its price is nothing.
                assert found[i] == pytest.approx(change, rel=0.0, abs=1e-13 * (1.0 + abs(before)))


def test_every_pair_meets_in_some_round():
    met = {frozenset((i, (r - i) % 7)) for r in range(7) for i in range(7)}
    assert len(met) == 7 * 6 // 2 + 7


@pytest.mark.parametrize("criterion", CRITERIA.values(), ids=lambda c: c.name)
def test_value_carried_along_is_the_value_recomputed(criterion, monkeypatch):
    """Compiled walk of 400 visits against a fresh sum: rounding stays small, and so does the best value."""
    seen = []
    true_value = type(criterion).value

    def recorded(self, points):
        seen.append(true_value(self, points))
        return seen[-1]

    state = annealing._State(balanced(12, 4, 3), criterion, 12)
    visits, rounds = 400, 6
    pairing = rng().integers(12, size=(visits, rounds))
    noise = rng(1).standard_exponential((visits, rounds, 12))
    carried = {}
    compiled = annealing._compiled(criterion)

    def watched(_):
        def call(*args):
            end = compiled(*args)
            carried.update(value=float(end[3]), lowest=float(end[5]))
            return end

        return call

    monkeypatch.setattr(annealing, "_compiled", watched)
    state.walk(0, np.full(visits, 1e-3), pairing, noise)
    assert carried["value"] == pytest.approx(criterion.value(state.design + 0.5), rel=1e-10)
    assert carried["lowest"] == pytest.approx(criterion.value(state.best + 0.5), rel=1e-10)
    assert carried["lowest"] <= carried["value"]


@pytest.mark.parametrize("movable", [12, 7, 2])
def test_only_the_last_rows_move_and_columns_keep_their_levels(movable):
    start = balanced(12, 4, 3)
    best = anneal(start, CRITERIA["centred"], 3000, rng(), movable=movable)
    fixed = 12 - movable
    assert_array_equal(best[:fixed], start[:fixed])
    assert_allclose(np.sort(best, axis=0), np.sort(start, axis=0), rtol=0.0, atol=0.0)


def test_never_ends_above_its_start_and_does_not_touch_it():
    for seed in range(5):
        start = balanced(12, 3, 4, seed)
        kept = start.copy()
        best = anneal(start, CRITERIA["centred"], 2000, rng(seed))
        assert CRITERIA["centred"].value(best + 0.5) < CRITERIA["centred"].value(start + 0.5)
        assert_array_equal(start, kept)


@pytest.mark.parametrize(("budget", "movable"), [(0, 12), (1000, 1)])
def test_nothing_to_do_leaves_the_start(budget, movable):
    start = balanced(12, 3, 2)
    assert_array_equal(anneal(start, CRITERIA["centred"], budget, rng(), movable=movable), start)


def test_same_generator_same_bits_whatever_the_chunks_before():
    start = balanced(12, 6, 3)
    first, second = (anneal(start, CRITERIA["mixture"], 5000, rng(3)) for _ in range(2))
    assert_array_equal(first, second)


def test_the_best_met_is_kept_when_the_walk_is_hot(monkeypatch):
    """So hot that every exchange is made: the last design is as good as random, the best one is not."""
    monkeypatch.setattr(annealing, "HOTTEST", 1e6)
    monkeypatch.setattr(annealing, "COLDEST", 1e6)
    criterion = CRITERIA["centred"]
    starts = [balanced(12, 4, 3, seed) for seed in range(20)]
    best = anneal(starts[0], criterion, 20_000, rng())
    assert criterion.value(best + 0.5) < min(criterion.value(start + 0.5) for start in starts)


@pytest.mark.parametrize(("budget", "movable"), [(0, 30), (10, 1), (4_000_000, 30), (600_000_000, 16)])
def test_legs_spend_the_budget_exactly(budget, movable):
    shares = legs(budget, movable)
    assert sum(shares) == budget
    assert (len(shares) > 1) == (budget > 6e6)


def test_global_precision_is_left_alone():
    import jax

    before = jax.config.read("jax_enable_x64")
    anneal(balanced(12, 4, 3), CRITERIA["centred"], 100, rng())
    assert jax.config.read("jax_enable_x64") == before

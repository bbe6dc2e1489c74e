"""Exchange annealing: the price of an exchange, rounding over long walks, and what it may move."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from experiments.designs import annealing
from experiments.designs.annealing import Start, anneal, changes, tried
from experiments.designs.discrepancy import CRITERIA
from experiments.designs.exchanges import walk
from experiments.designs.search import mirrored

CENTRED = CRITERIA["centred"]
each_criterion = pytest.mark.parametrize("criterion", CRITERIA.values(), ids=lambda c: c.name)


def rng(seed: int = 0) -> np.random.Generator:
    return np.random.default_rng(seed)


def balanced(n: int, levels: int, k: int, seed: int = 0, still: int = 0) -> Start:
    """A random U-type design."""
    ranks = np.column_stack([rng([seed, i]).permutation(np.arange(n) % levels) for i in range(k)])
    return Start(ranks, levels, still=still)


def with_images(n: int, levels: int, k: int, seed: int = 0) -> Start:
    """A random mirrored U-type design."""
    return Start(mirrored(levels, n, k, rng(seed)), levels, mirrored=True)


@each_criterion
@pytest.mark.parametrize(("n", "levels", "k"), [(12, 4, 3), (10, 5, 6), (9, 9, 1), (6, 2, 4)])
def test_price_is_the_change_found_by_recomputing(criterion, n, levels, k):
    start = balanced(n, levels, k)
    before = start.value(criterion)
    walker = annealing._walker(start, start, criterion)
    for column in range(k):
        found = changes(walker, column)
        for i in range(n):
            for j in range(i):
                moved = start.runs.copy()
                moved[[i, j], column] = moved[[j, i], column]
                change = start.with_runs(moved).value(criterion) - before
                assert found[i, j] == found[j, i] == pytest.approx(change, rel=0.0, abs=1e-13 * (1.0 + abs(before)))


@each_criterion
@pytest.mark.parametrize("temperature", [0.0, 1e-3, 1e6])
@pytest.mark.parametrize("start", [balanced(12, 4, 3), balanced(9, 9, 4), with_images(12, 4, 3), with_images(18, 3, 4)])
def test_value_carried_along_is_the_value_recomputed(criterion, temperature, start):
    """300 visits whose accepted prices are summed, against a fresh sum: of what was walked to and of the best."""
    walker = annealing._walker(start, start, criterion)
    walk(walker, 0, np.full(300, temperature), 1, rng())
    now, best = (start.with_runs(columns.T).value(criterion) for columns in (walker.columns, walker.best))
    assert_allclose(walker.values, [now, best], rtol=1e-10)
    assert best <= min(now, start.value(criterion)) * (1.0 + 1e-12)
    once, twice = annealing._walker(start.with_runs(walker.columns.T), start, criterion)[2:4]
    assert_allclose(walker.once, once, rtol=1e-12)
    assert_allclose(walker.twice, twice, rtol=1e-12)


@pytest.mark.parametrize("still", [0, 5, 10])
def test_only_the_last_rows_move_and_columns_keep_their_levels(still):
    start = balanced(12, 4, 3, still=still)
    best = anneal(start, CENTRED, 3000, rng()).runs
    assert_array_equal(best[:still], start.runs[:still])
    assert_array_equal(np.sort(best, axis=0), np.sort(start.runs, axis=0))


@pytest.mark.parametrize(("n", "levels"), [(12, 4), (12, 3), (16, 16)])
def test_a_mirrored_design_stays_one(n, levels):
    best = anneal(with_images(n, levels, 3), CENTRED, 50_000, rng())
    assert_array_equal(best.design[n // 2 :], levels - 1 - best.design[: n // 2])
    for column in best.design.T:
        assert_array_equal(np.bincount(column), [n // levels] * levels)


def test_never_ends_above_its_start_and_does_not_touch_it():
    for seed in range(5):
        start = balanced(12, 3, 4, seed)
        kept = start.runs.copy()
        best = anneal(start, CENTRED, 2000, rng(seed))
        assert best.value(CENTRED) < start.value(CENTRED)
        assert_array_equal(start.runs, kept)


@pytest.mark.parametrize("start", [balanced(12, 4, 4), with_images(12, 4, 4)])
def test_ends_where_no_exchange_lowers_it(start):
    """The walk ends straight down, so a long one ends in a dip, whatever met on the way was lower."""
    best = anneal(start, CENTRED, 100_000, rng(), heat=0.0)
    walker = annealing._walker(best, best, CENTRED)
    if not start.mirrored:
        assert all(changes(walker, k).min() > -1e-12 for k in range(4))
    assert_array_equal(anneal(best, CENTRED, 10_000, rng(1), heat=0.0).runs, best.runs)


@pytest.mark.parametrize(("budget", "still"), [(0, 0), (1000, 11), (1000, 12)])
def test_nothing_to_do_leaves_the_start(budget, still):
    start = balanced(12, 3, 2, still=still)
    assert_array_equal(anneal(start, CENTRED, budget, rng()).runs, start.runs)


def test_same_generator_same_bits():
    start = balanced(12, 6, 3)
    first, second = (anneal(start, CRITERIA["mixture"], 50_000, rng(3)).runs for _ in range(2))
    assert_array_equal(first, second)
    assert (anneal(start, CRITERIA["mixture"], 50_000, rng(4)).runs != first).any()


def test_the_best_met_is_kept_when_the_walk_is_hot():
    """So hot that the walk leads nowhere: the last design is as good as random, the best one is not."""
    starts = [balanced(12, 4, 3, seed) for seed in range(20)]
    walker = annealing._walker(starts[0], starts[0], CENTRED)
    walk(walker, 0, np.full(300, 1e-2), 1, rng())
    assert walker.values[1] < min(start.value(CENTRED) for start in starts)


@pytest.mark.parametrize("start", [balanced(7, 7, 1), with_images(8, 8, 1)])
def test_exchanges_tried_are_those_of_one_sweep(start):
    """Counted on runs that all differ: each pair once, and in mirrored designs across and each run with its image."""
    h = len(start.runs)
    pairs = [(i, j) for i in range(h) for j in range(i, h)]
    within, across = [(i, j) for i, j in pairs if i != j], pairs if start.mirrored else []
    assert tried(h, start.mirrored) == len(within) + len(across)

"""Full factorials: every combination once, mixed levels, and the split of a number of runs."""

from itertools import product

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from experiments import Factor, FactorSpace
from experiments.designs import FullFactorial


def space(k: int) -> FactorSpace:
    return FactorSpace(tuple(Factor(f"f{i}", "1", 0, 1) for i in range(k)))


def counts(design) -> list[int]:
    return [len(np.unique(column)) for column in design.coded.T]


def test_standard_order():
    """Yates (1937): the first factor changes fastest."""
    wanted = [[-1, -1, -1], [1, -1, -1], [-1, 1, -1], [1, 1, -1], [-1, -1, 1], [1, -1, 1], [-1, 1, 1], [1, 1, 1]]
    assert_array_equal(FullFactorial().generate(space(3)).coded, wanted)


@pytest.mark.parametrize("levels", ["2, 3, 3", "5,1,2", "4, 4, 4"])
def test_every_combination_once(levels):
    design = FullFactorial(levels).generate(space(3))
    numbers = [int(word) for word in levels.split(",")]
    axes = [np.linspace(-1, 1, q) if q > 1 else [0.0] for q in numbers]
    assert sorted(map(tuple, design.coded)) == sorted(product(*axes))


@pytest.mark.parametrize("levels", [3, "3", "3,3"])
def test_one_number_is_for_all(levels):
    assert counts(FullFactorial(levels).generate(space(2))) == [3, 3]


@pytest.mark.parametrize(
    ("n_runs", "k", "split"),
    [
        (12, 1, [12]),
        (12, 2, [4, 3]),
        (12, 3, [3, 2, 2]),
        (30, 3, [5, 3, 2]),
        (64, 6, [2] * 6),
        (7, 1, [7]),
        (36, 3, [4, 3, 3]),
    ],
)
def test_runs_are_split_evenly(n_runs, k, split):
    design = FullFactorial(n_runs=n_runs).generate(space(k))
    assert len(design) == n_runs
    assert counts(design) == split


@pytest.mark.parametrize(
    ("settings", "k", "message"),
    [
        ({"n_runs": 12}, 4, "12 runs cannot be split .* of 4 factors .*; use n_runs = 16"),
        ({"n_runs": 7}, 2, "7 runs cannot be split .* of 2 factors .*; use n_runs = 4"),
        ({"n_runs": 1}, 1, "1 runs cannot be split"),
        ({"levels": "2, 3"}, 3, r"levels '2, 3' .* are for 2 factors, the space has 3 \(f0, f1, f2\)"),
        ({"levels": 2}, 20, "has 1048576 runs, at most 1000000 are allowed"),
    ],
)
def test_refuses_what_does_not_fit_the_factors(settings, k, message):
    with pytest.raises(ValueError, match=message):
        FullFactorial(**settings).generate(space(k))


@pytest.mark.parametrize("levels", ["", "2,", "a", "-2", "2.0", 0, True, "2;3"])
def test_refuses_what_is_no_number_of_levels(levels):
    with pytest.raises(ValueError, match="levels of a full factorial must be whole numbers of at least 1, got"):
        FullFactorial(levels)


def test_refuses_two_ways_at_once():
    with pytest.raises(ValueError, match="takes its runs from levels or from n_runs, got both"):
        FullFactorial(2, 8)

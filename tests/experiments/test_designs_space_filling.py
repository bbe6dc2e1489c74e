"""Latin hypercubes and random designs."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from experiments import Factor, FactorSpace
from experiments.designs import LatinHypercube, Random, centred_discrepancy_squared


def space(k: int) -> FactorSpace:
    return FactorSpace(tuple(Factor(f"f{i}", "1", 0, 1) for i in range(k)))


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("k", [1, 2, 5])
@pytest.mark.parametrize("n", [1, 2, 3, 10])
def test_latin_hypercube_has_one_run_in_every_slice(n, k):
    coded = LatinHypercube(n).generate(space(k), rng=2).coded
    slices = np.floor((coded + 1.0) / 2.0 * n).astype(int)
    assert_array_equal(np.sort(slices, axis=0), np.arange(n)[:, None] * np.ones((1, k), dtype=int))


def test_latin_hypercube_fills_better_than_random():
    def discrepancy(method, seed):
        return centred_discrepancy_squared(0.5 + 0.5 * method.generate(space(4), seed).coded)

    for seed in range(5):
        assert discrepancy(LatinHypercube(20), seed) < 0.5 * discrepancy(Random(20), seed)


def test_random_settings_are_uniform():
    coded = Random(20_000).generate(space(3), rng=0).coded
    error = 1.0 / np.sqrt(20_000)
    assert np.abs(coded.mean(axis=0)).max() < 4 * error * np.sqrt(1 / 3)
    assert np.abs((coded**2).mean(axis=0) - 1 / 3).max() < 4 * error * np.sqrt(4 / 45)
    correlation = np.corrcoef(coded.T)[np.triu_indices(3, 1)]
    assert np.abs(correlation).max() < 4 * error
    assert coded.min() < -0.999
    assert coded.max() > 0.999


@pytest.mark.parametrize("method", [LatinHypercube, Random])
@pytest.mark.parametrize("n_runs", [0, -3, 2.0, "5", True, None])
def test_refuses_what_is_no_number_of_runs(method, n_runs):
    with pytest.raises(ValueError, match="must be a whole number of at least 1"):
        method(n_runs)

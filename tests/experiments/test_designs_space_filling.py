"""Latin hypercubes and random designs."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from experiments import Factor, FactorSpace
from experiments.designs import Halton, LatinHypercube, Random, Sobol, centred_discrepancy_squared


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


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("n", [1, 2, 16, 64])
def test_sobol_points_have_one_run_in_every_slice_at_powers_of_two(n):
    """Sobol' (1967): any 2^m first points are a net in base 2, scrambled or not."""
    coded = Sobol(n).generate(space(5), rng=3).coded
    slices = np.floor((coded + 1.0) / 2.0 * n).astype(int)
    assert_array_equal(np.sort(slices, axis=0), np.arange(n)[:, None] * np.ones((1, 5), dtype=int))


@pytest.mark.filterwarnings("error")
def test_other_numbers_of_sobol_points_are_a_beginning_of_the_next_power():
    whole = Sobol(32).generate(space(3), rng=1).coded
    for n in (17, 20, 31):
        assert_array_equal(Sobol(n).generate(space(3), rng=1).coded, whole[:n])


@pytest.mark.parametrize("n", [9, 27])
def test_halton_points_have_one_run_in_every_slice_of_each_base(n):
    """Halton (1960): the second factor's base is 3, so 3^m points fill 3^m slices."""
    coded = Halton(n).generate(space(2), rng=4).coded
    assert_array_equal(np.sort(np.floor((coded[:, 1] + 1.0) / 2.0 * n)), np.arange(n))


@pytest.mark.parametrize("method", [Sobol, Halton])
def test_sequences_fill_better_than_random(method):
    for seed in range(3):
        coded, other = (m.generate(space(4), seed).coded for m in (method(64), Random(64)))
        found, random = (centred_discrepancy_squared(0.5 + 0.5 * points) for points in (coded, other))
        assert found < 0.5 * random


@pytest.mark.parametrize("method", [LatinHypercube, Random, Sobol, Halton])
@pytest.mark.parametrize("n_runs", [0, -3, 2.0, "5", True, None])
def test_refuses_what_is_no_number_of_runs(method, n_runs):
    with pytest.raises(ValueError, match="must be a whole number of at least 1"):
        method(n_runs)

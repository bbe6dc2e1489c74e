"""Verification of prediction intervals: exact ranks, and coverage against the law it has for any distribution.

The k-th smallest of n uniform variables has the law Beta(k, n + 1 − k), so of m other runs the number inside is
beta-binomial, whatever the distribution of the residuals, if it has no ties (David & Nagaraja 2003, *Order Statistics*,
3rd ed., section 2.3 and 7.3: tolerance intervals). Bounds below are its quantiles.
"""

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_array_equal
from scipy import stats

from experiments import Runs, Status
from experiments.designs import Design
from surrogates import errors
from surrogates.intervals import LEVELS, Interval, calibrated, conformal_half_width, fewest_runs
from tests.surrogates.cases import box, surrogate

DISTRIBUTIONS = {
    "normal": lambda rng, n: rng.normal(size=n),
    "Cauchy": lambda rng, n: rng.standard_cauchy(size=n),
    "one-sided and shifted": lambda rng, n: 1e-9 * (3.0 + rng.exponential(size=n)),
}


@pytest.mark.parametrize(
    ("n", "level", "rank"),
    [(9, 0.9, 9), (10, 0.9, 10), (19, 0.9, 18), (19, 0.95, 19), (99, 0.9, 90), (99, 0.99, 99), (250, 0.95, 239),
     (500, 0.99, 496), (3, 0.5, 2)],
)  # fmt: skip
def test_the_rank_is_the_next_whole_number_of_n_plus_1_times_the_level(n, level, rank):
    residuals = np.arange(1.0, n + 1.0) * np.resize([1.0, -1.0], n)
    residuals = np.random.default_rng(n).permutation(residuals)
    assert conformal_half_width(residuals, level) == rank


@pytest.mark.parametrize("level", LEVELS)
def test_too_few_runs_bound_nothing(level):
    half = {0.9: 9, 0.95: 19, 0.99: 99}[level]
    assert fewest_runs(level) == 2 * half - 1
    assert conformal_half_width(np.ones(half), level) == 1.0
    assert conformal_half_width(np.ones(half - 1), level) == math.inf
    assert [i.level for i in calibrated(np.ones(2 * half - 1), (level,))] == [level]
    assert calibrated(np.ones(2 * half - 2), (level,)) == ()


@pytest.mark.parametrize("n", [0, 1, 2, 16])
def test_few_runs_offer_no_level(n):
    assert calibrated(np.ones(n)) == ()


def test_a_residual_that_is_not_a_number_is_larger_than_any():
    assert conformal_half_width([np.nan] * 10, 0.9) == math.inf
    residuals = np.ones(200)
    residuals[::2] = np.nan
    assert calibrated(residuals) == ()
    residuals = np.ones(2000)
    residuals[::100] = np.nan  # one in a hundred: inside a level of 0.9, outside every interval
    (interval,) = calibrated(residuals, (0.9,))
    assert interval.half_width == 1.0
    assert interval.coverage < 1.0


def test_one_half_sets_the_width_and_the_other_tries_it():
    residuals = np.arange(1.0, 1001.0)
    (interval,) = calibrated(residuals, (0.9,))
    assert (interval.n_calibration, interval.n_check) == (500, 500)
    below = int(np.sum(residuals <= interval.half_width))  # both halves
    inside_given = math.ceil(501 * 0.9)  # ranks up to its own, by definition
    assert interval.coverage == (below - inside_given) / 500


def law(n_runs: int, level: float):
    """Of the number of runs inside, of those that try the interval: beta-binomial."""
    m = n_runs // 2
    rank = math.ceil((n_runs - m + 1) * level - 1e-9)
    return stats.betabinom(m, rank, n_runs - m + 1 - rank)


@pytest.mark.parametrize("name", DISTRIBUTIONS)
@pytest.mark.parametrize(("n_runs", "repeats"), [(38, 2000), (400, 500)])
def test_coverage_has_its_law_whatever_the_distribution(name, n_runs, repeats):
    rng = np.random.default_rng(n_runs)
    for level in (0.9, 0.95):
        found = [calibrated(DISTRIBUTIONS[name](rng, n_runs), (level,))[0] for _ in range(repeats)]
        inside = np.array([i.coverage * i.n_check for i in found])
        expected = law(n_runs, level)
        # All repeats inside these with probability 1 − 2e-9·repeats; their mean with one of 1 − 6e-7 (normal limit).
        assert expected.ppf(1e-9) <= inside.min()
        assert inside.max() <= expected.isf(1e-9)
        assert abs(inside.mean() - expected.mean()) < 5.0 * expected.std() / math.sqrt(repeats)
        promised = expected.mean() / (n_runs // 2)
        assert level <= promised <= level + 1.0 / (n_runs - n_runs // 2 + 1)


def test_the_half_width_of_uniform_residuals_has_the_law_of_its_order_statistic():
    """The half-width is then the true coverage itself: Beta(190, 10), for 199 of 398 runs and level 0.95."""
    rng = np.random.default_rng(1)
    widths = [calibrated(rng.uniform(-1.0, 1.0, 398), (0.95,))[0].half_width for _ in range(1000)]
    assert stats.kstest(widths, stats.beta(190, 10).cdf).pvalue > 1e-6


def test_ties_cover_more_and_never_less():
    rng = np.random.default_rng(2)
    found = [calibrated(rng.choice([-1.0, 0.0, 1.0], 38, p=[0.03, 0.94, 0.03]), (0.9,))[0] for _ in range(2000)]
    coverage = np.array([i.coverage for i in found])
    # Standard error by the sample: the law of ties is not needed for a bound from below.
    assert coverage.mean() > 0.9 - 5.0 * coverage.std() / math.sqrt(2000)


def test_runs_in_an_order_of_their_own_are_tried_as_fairly():
    """Sorted by size: by the first half, an interval would cover none of the second."""
    residuals = np.sort(np.abs(np.random.default_rng(3).normal(size=1000)))
    for interval in calibrated(residuals):
        expected = law(1000, interval.level)
        assert expected.ppf(1e-9) <= 1000 // 2 * interval.coverage <= expected.isf(1e-9)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ((1.0, 1.0, 9, 0.9, 9), "level of an interval must lie between 0 and 1, got 1.0"),
        ((0.9, -1.0, 9, 0.9, 9), "half_width must be finite and at least 0, got -1.0"),
        ((0.9, math.inf, 9, 0.9, 9), "half_width must be finite and at least 0, got inf"),
        ((0.9, 1.0, 9, 1.1, 9), r"coverage must be from 0 to 1, got 1\.1"),
        ((0.9, 1.0, 0, 0.9, 9), "an interval needs runs, got 0 to calibrate and 9 to check"),
    ],
)
def test_an_interval_that_is_none_is_refused(given, message):
    with pytest.raises(ValueError, match=message):
        Interval(*given)


# --- validation: a model that is wrong in a known way ---------------------------------------------------------------


def validated(n_runs, seed=0):
    """A model of y = a + b, and of z = a, where the oracle answers a + b + 0.01·a³ and a."""
    model = surrogate(box(("a", -1.0, 1.0), ("b", 0.0, 4.0)), ["1", "a", "b"], [[2.0, 1.0, 2.0], [0.0, 1.0, 0.0]])
    design = Design(model.factors, np.random.default_rng(seed).uniform(-1.0, 1.0, (n_runs, 2)), "random")
    a, b = design.physical.T
    values = np.column_stack([a + b + 0.01 * a**3, a])
    runs = Runs(design, model.responses, values, (Status.OK,) * n_runs, ("",) * n_runs)
    return replace(model, validation=errors(model, runs)), runs


def test_an_interval_is_the_prediction_and_the_half_width():
    model, _ = validated(1000)
    X = model.factors.decode([[0.0, 0.0], [0.5, -1.0]])
    for level in LEVELS:
        low, high = model.interval(X, level)
        widths = [next(i.half_width for i in e.intervals if i.level == level) for e in model.validation]
        assert_array_equal(low, model.predict(X) - widths)
        assert_array_equal(high, model.predict(X) + widths)
        # |a|³ is uniform³: its quantile is level³, and the rank's law is that of a Beta variable, cubed.
        uniform = stats.beta(math.ceil(501 * level), 501 - math.ceil(501 * level))
        assert 0.01 * uniform.ppf(1e-9) ** 3 <= widths[0] <= 0.01 * uniform.isf(1e-9) ** 3
        assert widths[1] < 1e-15  # exact up to rounding
    assert_array_equal(model.interval(X)[0], model.interval(X, 0.95)[0])


def test_third_runs_lie_inside_as_often_as_promised():
    model, _ = validated(1000)
    _, third = validated(20000, seed=7)
    low, high = model.interval(third.design.physical, 0.95)
    inside = int(np.sum((low[:, 0] <= third.values[:, 0]) & (third.values[:, 0] <= high[:, 0])))
    expected = stats.betabinom(20000, math.ceil(501 * 0.95), 501 - math.ceil(501 * 0.95))
    assert expected.ppf(1e-9) <= inside <= expected.isf(1e-9)


def test_outside_the_domain_there_is_no_interval():
    model, _ = validated(1000)
    X = [[0.0, 2.0], [1.5, 2.0]]
    low, high = model.interval(X, outside="nan")
    assert np.isfinite(low[0]).all()
    assert np.isnan([low[1], high[1]]).all()
    with pytest.raises(ValueError, match=r"1 of 2 settings lie outside the domain: row 2: a = 1.5 N"):
        model.interval(X)


@pytest.mark.parametrize(
    ("n_runs", "level", "message"),
    [
        (100, 0.99, "response 'r0' has no interval of level 0.99: that takes 197 validation runs or more, "
                    "this model had 100; levels there are: 0.9, 0.95"),
        (10, 0.9, "that takes 17 validation runs or more, this model had 10; levels there are: none"),
        (1000, 0.8, "response 'r0' has no interval of level 0.8; levels there are: 0.9, 0.95, 0.99"),
        (1000, 95, "no interval of level 95; levels there are"),
        (1000, math.nan, "no interval of level nan; levels there are"),
    ],
)  # fmt: skip
def test_a_level_that_was_not_calibrated_is_refused(n_runs, level, message):
    model, _ = validated(n_runs)
    with pytest.raises(ValueError, match=message):
        model.interval([[0.0, 2.0]], level)


def test_a_model_without_validation_is_refused():
    model = surrogate(box(("a", -1.0, 1.0)), ["a"], [[1.0]])
    with pytest.raises(ValueError, match="this model was not validated, so nothing is known of its residuals"):
        model.interval([[0.0]])

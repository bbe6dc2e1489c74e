"""Verification of the discrepancies: by hand, against scipy, and against published designs."""

from itertools import product

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.stats import qmc

from experiments.designs import centred_discrepancy_squared, level_discrepancy_squared
from experiments.designs.discrepancy import (
    CRITERIA,
    criterion_named,
    mixture_discrepancy_squared,
    unit_levels,
    wraparound_discrepancy_squared,
)
from tests.reference import hexflex_table, published_discrepancies

FORCES = ("T1D1_N", "T1D2_N", "T2D1_N", "T2D2_N", "T3D1_N", "T3D2_N")


@pytest.mark.parametrize("s", [1, 2, 6])
def test_one_point_at_the_centre(s):
    """Hickernell (1998): both sums are 1 there, so CD₂² = (13/12)^s − 2 + 1."""
    assert centred_discrepancy_squared(np.full((1, s), 0.5)) == pytest.approx((13 / 12) ** s - 1, rel=1e-13)


def test_two_points_on_a_line_by_hand():
    """Points 1/4 and 3/4: 13/12 − 2·(1 + 1/8 − 1/32) + (2·(1 + 1/4) + 2·(1 + 1/4 − 1/4))/4 = 1/48."""
    assert centred_discrepancy_squared([[0.25], [0.75]]) == pytest.approx(1 / 48, rel=1e-12)


@pytest.mark.parametrize(("n", "s"), [(1, 1), (2, 5), (17, 3), (40, 8)])
def test_agrees_with_scipy(n, s):
    points = np.random.default_rng(n).random((n, s))
    assert centred_discrepancy_squared(points) == pytest.approx(qmc.discrepancy(points, method="CD"), rel=1e-11)


@pytest.mark.parametrize("s", [1, 2, 6])
def test_one_point_at_the_centre_mixture(s):
    """Zhou, Fang and Ning (2013): at the centre the one-point product is (5/3)^s, the two-point product (15/8)^s."""
    by_hand = (19 / 12) ** s - 2 * (5 / 3) ** s + (15 / 8) ** s
    assert mixture_discrepancy_squared(np.full((1, s), 0.5)) == pytest.approx(by_hand, rel=1e-11)


@pytest.mark.parametrize("s", [1, 2, 6])
def test_one_point_anywhere_wraparound(s):
    """Hickernell (1998): the torus has no centre, WD₂² = (3/2)^s − (4/3)^s for every single point."""
    for point in (np.full((1, s), 0.5), np.random.default_rng(s).random((1, s))):
        assert wraparound_discrepancy_squared(point) == pytest.approx(1.5**s - (4 / 3) ** s, rel=1e-11)


@pytest.mark.parametrize("n", [1, 2, 3, 10, 40])
def test_equal_steps_on_a_line(n):
    """In one dimension n cell centres are best: CD₂² = 1/(12 n²) and WD₂² = 1/(6 n²), from the kernels' integrals."""
    points = unit_levels(n)[:, None]
    assert centred_discrepancy_squared(points) == pytest.approx(1 / (12 * n**2), rel=1e-9)
    assert wraparound_discrepancy_squared(points) == pytest.approx(1 / (6 * n**2), rel=1e-9)


@pytest.mark.parametrize(("name", "peer"), [("centred", "CD"), ("mixture", "MD"), ("wraparound", "WD")])
@pytest.mark.parametrize(("n", "s"), [(1, 1), (2, 5), (17, 3), (40, 8)])
def test_every_criterion_agrees_with_scipy(name, peer, n, s):
    points = np.random.default_rng(n).random((n, s))
    assert CRITERIA[name].value(points) == pytest.approx(qmc.discrepancy(points, method=peer), rel=1e-11)


@pytest.mark.parametrize("name", CRITERIA)
def test_does_not_change_by_reflection_or_reordering(name):
    rng = np.random.default_rng(0)
    points = rng.random((9, 4))
    expected = CRITERIA[name].value(points)
    turned = np.where([True, False, True, False], 1 - points, points)[rng.permutation(9)][:, ::-1]
    assert CRITERIA[name].value(turned) == pytest.approx(expected, rel=1e-12)


def test_wraparound_does_not_change_by_a_shift_round_the_torus():
    points = np.random.default_rng(0).random((9, 3))
    shifted = (points + np.array([0.3, 0.9, 0.0])) % 1.0
    expected = wraparound_discrepancy_squared(points)
    assert wraparound_discrepancy_squared(shifted) == pytest.approx(expected, rel=1e-12)
    assert abs(centred_discrepancy_squared(shifted) / centred_discrepancy_squared(points) - 1.0) > 1e-3


def test_unknown_criterion_suggests_the_nearest():
    with pytest.raises(ValueError, match="unknown discrepancy 'mixtures'; did you mean 'mixture'"):
        criterion_named("mixtures")
    with pytest.raises(ValueError, match="unknown discrepancy 3; known are centred, mixture, wraparound"):
        level_discrepancy_squared([[-1.0], [1.0]], criterion=3)


@pytest.mark.parametrize("points", [[[0.5, 1.01]], [[-0.01, 0.5]], [[0.5, np.nan]], [0.5, 0.5], 0.5, [[]]], ids=str)
def test_refuses_points_outside_the_cube(points):
    for value in (centred_discrepancy_squared, mixture_discrepancy_squared, wraparound_discrepancy_squared):
        with pytest.raises(ValueError, match="inside the unit cube"):
            value(points)


def test_levels_sit_in_the_middle_of_their_cells():
    assert_array_equal(unit_levels(2), [0.25, 0.75])
    assert_allclose(unit_levels(5), [0.1, 0.3, 0.5, 0.7, 0.9])


def test_levels_count_by_rank():
    design = np.array([[-1.0, 1.0], [0.0, -1.0], [1.0, 0.0]])
    expected = centred_discrepancy_squared([[1 / 6, 5 / 6], [1 / 2, 1 / 6], [5 / 6, 1 / 2]])
    assert level_discrepancy_squared(design) == pytest.approx(expected, rel=1e-13)
    assert level_discrepancy_squared(40.0 + 7.0 * design) == pytest.approx(expected, rel=1e-13)
    expected = qmc.discrepancy([[1 / 6, 5 / 6], [1 / 2, 1 / 6], [5 / 6, 1 / 2]], method="WD")
    assert level_discrepancy_squared(design, "wraparound") == pytest.approx(expected, rel=1e-11)


def test_rounding_does_not_split_a_level():
    design = np.array([[-1.0], [0.1 + 0.2], [0.3], [1.0]])
    assert level_discrepancy_squared(design) == pytest.approx(level_discrepancy_squared(np.round(design, 6)), rel=1e-13)


def test_published_uniform_design():
    """The thesis, Table 2.4: U30(6^6) of the public tables, CD₂² = 0.02794006, each level five times a column."""
    table = hexflex_table("table_2_4")
    design = np.column_stack([table[name] for name in FORCES])
    assert design.shape == (30, 6)
    for column in design.T:
        levels, count = np.unique(column, return_counts=True)
        assert_allclose(levels, [-1.0, -0.6, -0.2, 0.2, 0.6, 1.0])
        assert_array_equal(count, [5] * 6)
    assert level_discrepancy_squared(design) == pytest.approx(0.02794006, abs=5e-9)
    assert np.sqrt(level_discrepancy_squared(design)) == pytest.approx(0.167153, abs=5e-7)


def test_full_factorial_is_the_published_optimum():
    """The public uniform-design tables, U27(3^3), whose optimum is the full factorial."""
    (published,) = (
        row["best_published_cd2_squared"]
        for row in published_discrepancies()
        if (row["n_runs"], row["n_factors"], row["n_levels"]) == (27, 3, 3)
    )
    assert level_discrepancy_squared(list(product([-1, 0, 1], repeat=3))) == pytest.approx(published, rel=1e-11)

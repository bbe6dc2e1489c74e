"""Plackett–Burman designs: orthogonality, sizes, and the published 12-run design."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal
from pyDOE3 import pbdesign

from experiments import Factor, FactorSpace
from experiments.designs import PlackettBurman
from experiments.designs.plackett_burman import MAX_RUNS, MIN_DUMMIES, constructible
from tests.reference import hexflex_table, lenth_case, lenth_columns

SIZES = list(range(4, 129, 4))
BY_PYDOE3 = [4, 8, 12, 16, 20, 24, 32, 40, 48, 64, 80, 96, 128, 160, 192, 256, 320, 384, 512, 640]
FORCES = ("T1D1_N", "T1D2_N", "T2D1_N", "T2D2_N", "T3D1_N", "T3D2_N")


def space(k: int) -> FactorSpace:
    return FactorSpace(tuple(Factor(f"f{i}", "1", 0, 1) for i in range(k)))


def same_design(design: np.ndarray, columns: np.ndarray) -> list[int] | None:
    """Which of `columns`, in which order, are `design` with its rows reordered; ``None`` if no choice is."""

    def rows(matrix):
        return sorted(map(tuple, matrix))

    def extend(chosen):
        if len(chosen) == design.shape[1]:
            return chosen
        wanted = rows(design[:, : len(chosen) + 1])
        for j in range(columns.shape[1]):
            if j not in chosen and rows(columns[:, [*chosen, j]]) == wanted:
                found = extend([*chosen, j])
                if found:
                    return found
        return None

    return extend([])


def test_constructible_sizes():
    assert [n for n in range(1, 129) if constructible(n)] == SIZES


@pytest.mark.parametrize("n_runs", SIZES)
def test_orthogonal_and_balanced(n_runs):
    design = PlackettBurman(n_runs).generate(space(2))
    columns = np.hstack([design.coded, design.dummies])
    assert columns.shape == (n_runs, n_runs - 1)
    assert_array_equal(np.abs(columns), np.ones_like(columns))
    assert_array_equal(columns.sum(axis=0), np.zeros(n_runs - 1))
    assert_array_equal(columns.T @ columns, n_runs * np.eye(n_runs - 1))


@pytest.mark.parametrize("k", [*range(1, 40), 123, 124, 635])
def test_default_is_the_smallest_that_leaves_four_dummies(k):
    design = PlackettBurman().generate(space(k))
    n_runs = len(design)
    assert design.dummies.shape == (n_runs, n_runs - 1 - k)
    assert design.dummies.shape[1] >= MIN_DUMMIES == 4
    assert not any(constructible(n) and n - 1 - k >= 4 for n in range(4, n_runs))


@pytest.mark.parametrize("n_runs", BY_PYDOE3)
def test_sizes_that_pydoe3_has_are_its_own_bit_for_bit(n_runs):
    design = PlackettBurman(n_runs).generate(space(3))
    assert_array_equal(np.hstack([design.coded, design.dummies]), np.asarray(pbdesign(n_runs - 1), dtype=np.float64))


@pytest.mark.parametrize("n_runs", [28, 36, 44, 52, 56, 60, 68, 72, 76, 84, 88, 92, 100])
def test_sizes_that_pydoe3_lacks(n_runs):
    with pytest.raises(AssertionError, match="Invalid inputs"):
        pbdesign(n_runs - 1)
    assert len(PlackettBurman().generate(space(n_runs - 5))) == n_runs


@pytest.mark.parametrize("n_runs", [12, 28])
def test_foldover_clears_main_effects_of_interactions(n_runs):
    """Box and Wilson (1951): odd columns of a folded design are orthogonal to all products of two."""
    design = PlackettBurman(n_runs, foldover=True).generate(space(6))
    assert design.coded.shape == (2 * n_runs, 6)
    assert_array_equal(design.coded[n_runs:], -design.coded[:n_runs])
    assert_array_equal(design.coded[:n_runs], PlackettBurman(n_runs).generate(space(6)).coded)
    columns = np.hstack([design.coded, design.dummies])
    assert_array_equal(columns.T @ columns, 2 * n_runs * np.eye(2 * n_runs - 1))
    assert_array_equal(columns.sum(axis=0), np.zeros(2 * n_runs - 1))
    products = np.column_stack([design.coded[:, i] * design.coded[:, j] for i in range(6) for j in range(i)])
    odd = n_runs - 6
    assert_array_equal(columns[:, : 6 + odd].T @ products, np.zeros((n_runs, 15)))
    even = design.dummies[:, odd:]
    assert even.shape == (2 * n_runs, n_runs - 1)
    assert np.sum((even.T @ products / (2 * n_runs)) ** 2, axis=0) == pytest.approx(np.ones(15))


def test_without_foldover_interactions_touch_main_effects():
    design = PlackettBurman(12).generate(space(6))
    assert np.abs(design.coded[:, 0] @ (design.coded[:, 1] * design.coded[:, 2])) == 4.0


@pytest.mark.parametrize("foldover", [False, True])
def test_centre_runs_come_last_and_weigh_nothing(foldover):
    plain = PlackettBurman(12, foldover).generate(space(6))
    design = PlackettBurman(12, foldover, n_centre=2).generate(space(6))
    assert len(design) == len(plain) + 2
    for name in ("coded", "dummies"):
        assert_array_equal(getattr(design, name)[:-2], getattr(plain, name))
        assert_array_equal(getattr(design, name)[-2:], 0.0)
    assert_array_equal(design.physical[-1], design.space.centre)
    columns = np.hstack([design.coded, design.dummies])
    assert_array_equal(columns.T @ columns, len(plain) * np.eye(len(plain) - 1))


def test_refuses_what_is_no_addition():
    with pytest.raises(ValueError, match="foldover of a Plackett-Burman design must be true or false, got 'yes'"):
        PlackettBurman(12, foldover="yes")
    with pytest.raises(ValueError, match=r"n_centre of a Plackett-Burman design .* at least 0, got 1\.0"):
        PlackettBurman(12, n_centre=1.0)


def test_six_factors_get_twelve_runs():
    assert len(PlackettBurman().generate(space(6))) == 12


def test_saturated_design_has_no_dummies():
    assert PlackettBurman(12).generate(space(11)).dummies.shape == (12, 0)


@pytest.mark.parametrize(
    ("n_runs", "nearest"),
    [(13, "8, 12, 16"), (30, "24, 28, 32"), (156, "148, 152, 160"), (11, "8, 12, 16"), (1024, "632, 636, 640")],
)
def test_refusal_names_the_nearest_sizes(n_runs, nearest):
    with pytest.raises(ValueError, match=f"no Plackett-Burman design with {n_runs} runs .*nearest sizes: .*{nearest}"):
        PlackettBurman(n_runs)


@pytest.mark.parametrize("n_runs", [3, 0, -12, 12.0, "12", True])
def test_refuses_what_is_no_number_of_runs(n_runs):
    with pytest.raises(ValueError, match="n_runs of a Plackett-Burman design must be a whole number of at least 4"):
        PlackettBurman(n_runs)


def test_too_many_factors():
    with pytest.raises(ValueError, match="12 runs has 11 columns, too few for 12 factors; use n_runs = 20"):
        PlackettBurman(12).generate(space(12))
    with pytest.raises(ValueError, match=f"no Plackett-Burman design for {MAX_RUNS} factors: at most 635"):
        PlackettBurman().generate(space(MAX_RUNS))


def test_published_design_is_our_first_six_columns_with_all_signs_turned():
    """The thesis, Table 2.2, against Plackett and Burman (1946), 12 runs; rows in another order."""
    table = hexflex_table("table_2_2")
    published = np.column_stack([table[name] for name in FORCES])
    ours = PlackettBurman(12).generate(space(11)).coded
    assert same_design(-published, ours) == [0, 1, 2, 3, 4, 5]
    assert same_design(published, ours) is None


def test_published_cast_fatigue_design_is_seven_columns_of_ours_with_all_signs_turned():
    """Hunter, Hodi and Eager (1982), 12-run Plackett–Burman design; columns in another order."""
    _, published = lenth_columns(lenth_case("hunter_hodi_eager_cast_fatigue_pb12"))
    ours = PlackettBurman(12).generate(space(11)).coded
    assert same_design(-published, ours)


def test_the_search_tells_designs_apart():
    ours = PlackettBurman(12).generate(space(11)).coded
    other = ours[:, :6].copy()
    other[[0, 1], 0] = other[[1, 0], 0] = -other[0, 0]
    assert same_design(ours[::-1, [7, 2, 9, 0, 4, 5]], ours)
    assert same_design(other, ours) is None

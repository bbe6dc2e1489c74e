"""Plackett–Burman designs: orthogonality, sizes, and the published 12-run design."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from experiments import Factor, FactorSpace
from experiments.designs import PlackettBurman
from experiments.designs.plackett_burman import MAX_RUNS, MIN_DUMMIES, constructible
from tests.reference import hexflex_table, lenth_case, lenth_columns

SIZES = [4, 8, 12, 16, 20, 24, 32, 40, 48, 64, 80, 96, 128]
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


def test_six_factors_get_twelve_runs():
    assert len(PlackettBurman().generate(space(6))) == 12


def test_saturated_design_has_no_dummies():
    assert PlackettBurman(12).generate(space(11)).dummies.shape == (12, 0)


@pytest.mark.parametrize(
    ("n_runs", "nearest"),
    [(13, "8, 12, 16"), (28, "24, 32"), (36, "32, 40"), (100, "96, 128"), (11, "8, 12, 16"), (1024, "640")],
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

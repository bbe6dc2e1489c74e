"""Contrasts of any orthogonal two-level design: centre points, completion, names of dummies, refusals."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from experiments import Runs, Status
from experiments.designs import Design, LatinHypercube
from experiments.screening import alias_matrix, contrast_columns, count_contrasts, effects, screen
from tests.reference import lenth_case

from .screening_cases import answered, full_factorial, plackett_burman, space


class TestCentrePoints:
    def test_are_left_out_of_contrasts_and_kept_for_curvature(self):
        plain, centred = plackett_burman(12, 4), plackett_burman(12, 4, n_centre=3)
        y = np.random.default_rng(0).normal(size=12)
        found = effects(answered(centred, np.r_[y, 5.0, 5.5, 6.0]))
        assert_allclose(found.values, effects(answered(plain, y)).values, atol=1e-14)
        assert found.n_runs == 12
        assert found.centre.n_runs == 3
        assert found.centre.curvature[0] == pytest.approx(y.mean() - 5.5, rel=1e-12)
        assert found.centre.pure_error[0] == pytest.approx(0.5, rel=1e-12)
        assert effects(answered(plain, y)).centre is None

    def test_curvature_is_the_sum_of_the_squares(self):
        """Box and Draper (1987): the difference of the means estimates β₁₁ + β₂₂ + …; opposite signs cancel."""
        a, b, c, _ = (design := plackett_burman(12, 4, n_centre=1)).coded.T
        found = effects(answered(design, 1 + a + 2 * a**2 + 3 * b**2, a + c**2 - b**2))
        assert_allclose(found.centre.curvature, [5.0, 0.0], atol=1e-14)
        assert np.isnan(found.centre.pure_error).all()

    def test_columns_stay_aligned_with_the_runs(self):
        columns = contrast_columns(plackett_burman(12, 4, n_centre=2))
        assert columns.shape == (14, 11)
        assert not columns[12:].any()

    def test_survive_physical_units(self):
        design = plackett_burman(8, 3, n_centre=2)
        again = Design.from_physical(design.space, design.physical)
        assert effects(answered(again, design.coded[:, 0])).centre.n_runs == 2

    def test_where_all_of_them_failed_there_is_nothing_to_compare(self):
        design = plackett_burman(8, 3, n_centre=1)
        values, status = np.ones((9, 1)), (Status.OK,) * 8 + (Status.CRASHED,)
        responses = answered(design, np.ones(9)).responses
        found = effects(Runs(design, responses, values, status, ("",) * 8 + ("out of memory",)))
        assert found.centre is None
        assert found.holes.lost_centres == (9,)


class TestCompletion:
    @pytest.mark.parametrize("case", ["montgomery_filtration", "montgomery_runger_plasma_etch"])
    def test_a_full_factorial_has_all_its_interactions(self, case):
        """Montgomery, Example 6.2; Montgomery and Runger, ch. 14: 15 effects as printed or recomputed."""
        expected = lenth_case(case)["recomputed"]["effects"]
        found = effects(answered(full_factorial(4), np.array(lenth_case(case)["response"])))
        assert set(found.names) == set(expected)
        assert_allclose(found.values[:, 0], [expected[n] for n in found.names], rtol=1e-12, atol=1e-12)

    def test_the_whole_variance_is_in_the_contrasts(self):
        y = np.random.default_rng(2).normal(size=16)
        found = effects(answered(full_factorial(4), y))
        assert 0.25 * (found.values**2).sum() == pytest.approx(y.var(), rel=1e-12)
        assert found.spread[0] == pytest.approx(y.std(), rel=1e-12)

    def test_replicates_do_not_add_contrasts(self):
        base = full_factorial(3)
        twice = Design(base.space, np.vstack([base.coded, base.coded]), "twice")
        assert len(effects(answered(twice, np.arange(16.0))).names) == 7

    def test_a_design_that_has_all_its_columns_gets_no_more(self):
        assert len(effects(answered(plackett_burman(12, 4), np.arange(12.0))).names) == 11

    def test_a_folded_design_keeps_main_effects_clear_of_interactions(self):
        """Box and Wilson (1951): foldover of a design of resolution III gives one of resolution IV."""
        design = plackett_burman(12, 6, folded=True)
        found = effects(answered(design, np.arange(24.0)))
        assert len(found.names) == 23
        assert not np.abs(alias_matrix(found.columns, 6)[:6]).any()


class TestNames:
    def test_a_dummy_is_named_after_the_interaction_it_is(self):
        """Eight runs, three factors: all columns are products, which may come with any sign."""
        base = full_factorial(3)
        a, b, c = base.coded.T
        design = Design(base.space, base.coded, "mine", np.column_stack([b * c, -a * b * c, -a * b, a * c]))
        found = effects(answered(design, a * b, a * c, b * c, a * b * c))
        assert found.names[3:] == ("B:C", "A:B:C", "A:B", "A:C")
        for j, name in enumerate(("A:B", "A:C", "B:C", "A:B:C")):
            assert_allclose(found.values[:, j], 2.0 * (np.array(found.names) == name), atol=1e-14)

    def test_main_effects_list_their_aliases(self):
        """2^(7−4): each main effect carries three interactions; Box and Hunter (1961)."""
        design = plackett_burman(8, 7)
        a, b, c = design.coded[:, :3].T
        aliases = effects(answered(design, a)).aliases
        assert all(text.count(":") == 3 for text in aliases)
        sign = " - " if (a * b * c).sum() < 0 else ""
        assert [f"{sign.strip()}B:C" in aliases[0], "D:E" in aliases[0] or "D:F" in aliases[0]] == [True, True]

    def test_partial_aliases_leave_the_name(self):
        found = effects(answered(plackett_burman(12, 4), np.arange(12.0)))
        assert found.names[4:] == tuple(f"dummy{i}" for i in range(1, 8))
        assert found.aliases == ("",) * 11

    def test_alias_matrix_of_twelve_runs(self):
        """Plackett and Burman (1946): each interaction is ±1/3 of every column but its own two."""
        design = plackett_burman(12, 5)
        matrix = np.abs(alias_matrix(contrast_columns(design), 5))
        assert matrix.shape == (11, 10)
        assert_allclose(matrix.sum(axis=0), 9 / 3.0)
        assert_allclose(np.unique(np.round(matrix, 12)), [0.0, np.round(1 / 3, 12)])

    def test_a_flagged_dummy_says_which_factors_interact(self):
        a, b, c, _ = (design := full_factorial(4)).coded.T
        noise = 1e-3 * np.random.default_rng(3).normal(size=16)
        assert screen(answered(design, a + b * c + noise)).flagged_dummies == {"y1": ("B:C",)}


class TestRefusals:
    def test_a_setting_between_the_levels_is_shown_with_advice(self):
        coded = plackett_burman(8, 3).coded.copy()
        coded[4, 1] = 0.25
        with pytest.raises(ValueError, match=r"run 5 has 0\.25; take a two-level design such as 'plackett_burman'"):
            contrast_columns(Design(space(3), coded, "mine"))

    def test_one_zero_in_a_run_is_no_centre_point(self):
        coded = np.array([[1, 1], [1, -1], [-1, 1], [-1, 0]])
        with pytest.raises(ValueError, match=r"every coded setting must be -1 or \+1, or a whole run 0"):
            contrast_columns(Design(space(2), coded, "mine"))

    def test_only_centre_points(self):
        with pytest.raises(ValueError, match="all runs are centre points"):
            contrast_columns(Design(space(2), np.zeros((3, 2)), "mine"))

    def test_correlated_columns_are_named(self):
        coded = np.array([[1, 1, 1], [1, 1, -1], [-1, -1, 1], [-1, -1, -1]])
        with pytest.raises(ValueError, match=r"columns are correlated \(A with B by 1\): take a whole orthogonal"):
            contrast_columns(Design(space(3), coded, "mine"))

    def test_an_unbalanced_column_is_correlated_with_the_mean(self):
        coded = np.array([[1, 1], [1, -1], [1, 1], [-1, -1]])
        with pytest.raises(ValueError, match=r"\(the mean with A by 0\.5\).*or fit a model to these runs"):
            contrast_columns(Design(space(2), coded, "mine"))

    def test_a_space_filling_design(self):
        with pytest.raises(ValueError, match="effects need a two-level design"):
            effects(answered(LatinHypercube(9).generate(space(3)), np.arange(9.0)))


def test_signs_of_columns_do_not_change_the_verdict():
    base = plackett_burman(12, 4)
    turned = Design(base.space, -base.coded, "turned", -base.dummies)
    y = np.random.default_rng(5).normal(size=12) + 9 * base.coded[:, 1]
    one, other = screen(answered(base, y)), screen(answered(turned, y))
    assert_array_equal(one.active, other.active)
    assert_allclose(one.effects.values, -other.effects.values)


def test_contrasts_of_a_full_factorial_count_the_products():
    """Two factors at two levels: two main effects and their product, just enough for Lenth's method."""
    assert count_contrasts(full_factorial(2)) == 3
    assert count_contrasts(plackett_burman(12, 2)) == 11

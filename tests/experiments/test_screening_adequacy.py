"""Crowded contrasts, noise floors, and whether a screening suffices: what it names as the next design."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from experiments import Factor, FactorSpace, Response, Runs, Status
from experiments.designs import Design
from experiments.screening import AdequacyStatus, NextDesign, effect_error, lenth, line_noise, replicate_error, screen
from tests.reference import recorded

from .screening_cases import answered, full_factorial, plackett_burman

EXACT = 1e-12


def noise(n: int, seed: int = 0, size: float = 0.05) -> np.ndarray:
    return size * np.random.default_rng(seed).normal(size=n)


class TestCrowded:
    def test_dummies_judge_where_most_contrasts_act(self):
        """Eight of eleven act: Lenth's median sits among them and finds nothing, the three dummies find all."""
        design = plackett_burman(12, 8)
        y = design.coded @ (1.0 + 0.05 * np.arange(8)) + noise(12, 1)
        (result,) = screen(answered(design, y)).lenth
        blind = lenth(result.contrasts, result.names)
        assert not blind.active.any()
        assert blind.crowded
        assert (result.error_from, result.advice) == ("dummies", "")
        assert result.active_names == design.space.names

    def test_the_error_of_the_dummies_has_their_degrees_of_freedom(self):
        """t(0.975; 3) = 3.1824 on the root mean square of three dummies."""
        contrasts = [9.0, 9.1, -9.2, 9.3, 0.3, -0.3, 0.3]
        result = lenth(contrasts, dummies=[False] * 4 + [True] * 3)
        assert result.pse == pytest.approx(0.3, rel=1e-12)
        assert result.me == pytest.approx(0.3 * 3.18244630528371, rel=1e-9)

    def test_without_dummies_it_advises(self):
        """The thesis, Table 2.3, θz: three of six act."""
        result = lenth([-6.20369, 0.0, 6.20359, 0.0, -6.20362, 0.0], noise_floor=1e-5)
        assert result.crowded
        assert not result.active.any()
        assert "take a larger design" in result.advice

    def test_none_of_a_saturated_design_is_small(self):
        result = lenth(2.0 - 0.1 * np.arange(11), noise_floor=1e-9)
        assert result.crowded
        assert "half or more of the contrasts act" in result.advice

    def test_silent_dummies_of_a_deterministic_simulator_leave_the_floor(self):
        """Six of eleven act and five are zero to rounding: the dummies judge, and their error is the floor."""
        design = plackett_burman(12, 6)
        (result,) = screen(answered(design, design.coded @ np.ones(6)), resolution=EXACT).lenth
        assert result.crowded
        assert (result.error_from, result.floored) == ("floor", True)
        assert result.active_names == design.space.names

    def test_noise_alone_seldom_looks_crowded(self):
        rng = np.random.default_rng(4)
        crowded = [lenth(c).crowded for c in rng.normal(size=(1000, 11))]
        assert np.mean(crowded) < 0.03

    def test_the_method_itself_still_works_on_sparse_effects(self):
        assert not lenth([21.6, 3.1, 9.9, 14.6, 0.1, -18.1, 16.6, 2.4, -0.4, -1.1, 1.9, 4.1, -1.6, -2.6, 1.4]).crowded

    def test_refuses_dummies_of_another_length(self):
        with pytest.raises(ValueError, match=r"one truth value for each of 3 contrasts, got \(2,\)"):
            lenth([1.0, 2.0, 3.0], dummies=[True, False])


class TestNoise:
    def test_a_declared_noise_sets_the_floor(self):
        """The standard error of an effect is 2σ/√n."""
        design = plackett_burman(12, 5)
        (result,) = screen(answered(design, design.coded[:, 0]), noise=[0.3]).lenth
        assert result.noise_floor == pytest.approx(0.6 / np.sqrt(12))
        assert result.error_from == "floor"
        assert effect_error(3.0, 36) == 1.0

    def test_refuses_a_noise_for_another_number_of_responses(self):
        design = plackett_burman(12, 5)
        with pytest.raises(ValueError, match="noise needs a number of 0 or more for each of 1 responses"):
            screen(answered(design, design.coded[:, 0]), noise=[0.1, 0.1])

    def test_repeated_runs_estimate_it(self):
        design = plackett_burman(12, 5, n_centre=4)
        y = np.r_[design.coded[:12, 0], 1.0, 2.0, 3.0, 2.0]
        error, freedom = replicate_error(answered(design, y))
        assert freedom == 3
        assert_allclose(error, [np.sqrt(2.0 / 3.0)], rtol=1e-12)

    def test_refuses_where_nothing_was_repeated(self):
        design = plackett_burman(12, 5)
        with pytest.raises(ValueError, match="no setting was run twice"):
            replicate_error(answered(design, np.ones(12)))

    @pytest.mark.parametrize("size", [1e-3, 1e-6, 1e-9])
    def test_a_line_of_runs_finds_noise_below_the_physics(self, size):
        """A few runs give the order of magnitude, and that is what a floor needs (Moré and Wild, 2011)."""
        t = 1e-3 * np.arange(15)
        found = [line_noise(np.exp(t) + np.sin(3 * t) + noise(15, seed, size)) for seed in range(20)]
        assert 0.7 * size < np.median(found) < 1.4 * size
        assert 0.2 * size < min(found) <= max(found) < 3.0 * size

    def test_rounding_is_found_as_noise(self):
        """Printing to four digits is uniform noise of 1/√12 of the last digit."""
        t = np.linspace(0.0, 0.3, 25)
        assert line_noise(np.round(np.sin(t) + t, 4)) == pytest.approx(1e-4 / np.sqrt(12), rel=0.5)

    def test_a_polynomial_has_none_above_rounding(self):
        assert line_noise((np.arange(9.0) - 4.0) ** 2) == 0.0

    def test_refuses_short_lines(self):
        with pytest.raises(ValueError, match=r"at least 7 finite values in a row, got shape \(6,\)"):
            line_noise(np.arange(6.0))


class TestAdequacy:
    def test_a_plane_is_adequate(self):
        design = plackett_burman(12, 6, n_centre=1)
        result = screen(answered(design, design.coded @ np.arange(6.0)), resolution=EXACT).adequacy()
        assert (result.status, result.adequate, result.next_design) == (AdequacyStatus.ADEQUATE, True, NextDesign.NONE)
        assert result.reasons == ()
        assert result.advice == ""
        assert result.keep == tuple("BCDEF")

    def test_noise_is_adequate_too(self):
        design = plackett_burman(12, 5, n_centre=3)
        result = screen(answered(design, 3.0 * design.coded[:, 0] + noise(15))).adequacy()
        assert result.adequate
        assert result.keep == ("A",)

    def test_the_linear_part_of_the_nonlinear_hexflex_is_not(self):
        """Recorded: dummy columns of all responses but θx carry 1 to 21 %, the squares cancel at the centre."""
        case = recorded("hexflex/screening_nonlinear")
        space = FactorSpace(tuple(Factor(n, "N", -1.0, 1.0) for n in case["factors"]))
        responses = tuple(Response(n, "rad" if n.startswith("theta") else "m") for n in case["responses"])
        design = Design(space, np.array(case["coded"]), "plackett_burman", np.array(case["dummies"]))
        runs = Runs(design, responses, np.array(case["values"]), (Status.OK,) * 13, ("",) * 13)
        screening = screen(runs, resolution=case["resolution"])
        result = screening.adequacy()
        assert result.status is AdequacyStatus.INADEQUATE
        assert result.next_design is NextDesign.QUADRATIC_FILL
        assert result.keep == space.names
        assert [r.response for r in result.responses if r.loud_dummies] == ["x", "y", "z", "theta_y", "theta_z"]
        hidden = {r.response: r.hidden for r in result.responses}
        assert 0.15 < hidden["x"] < 0.25
        assert 0.15 < hidden["y"] < 0.25
        assert hidden["theta_x"] < 0.01
        assert not any(r.curved for r in result.responses)
        assert result.reasons[0].startswith("x: main effects leave 17.7% of the standard deviation, dummy columns")
        # Lenth's margin alone is inflated by what hides, so that it flags nothing.
        assert screening.flagged_dummies == {}

    def test_interactions_without_curvature_ask_for_a_foldover(self):
        a, b, c, *_ = (design := plackett_burman(12, 6, n_centre=1)).coded.T
        result = screen(answered(design, 3 * a - 2 * b + a * c), resolution=EXACT).adequacy()
        assert (result.status, result.next_design) == (AdequacyStatus.INADEQUATE, NextDesign.FOLDOVER)
        assert result.keep == design.space.names
        assert "add the foldover" in result.advice

    def test_interactions_without_centre_points_ask_for_definitive_screening(self):
        a, b, c, *_ = (design := plackett_burman(12, 6)).coded.T
        result = screen(answered(design, 3 * a - 2 * b + a * c), resolution=EXACT).adequacy()
        assert result.next_design is NextDesign.DEFINITIVE_SCREENING

    def test_a_folded_design_with_loud_dummies_is_filled(self):
        a, b, c, *_ = (design := plackett_burman(12, 6, folded=True)).coded.T
        result = screen(answered(design, 3 * a - 2 * b + a * c), resolution=EXACT).adequacy()
        assert result.next_design is NextDesign.QUADRATIC_FILL

    def test_a_named_dummy_tells_which_factors_to_keep(self):
        a, b, c, _ = (design := full_factorial(4)).coded.T
        result = screen(answered(design, 3 * a - 2 * b + a * c), resolution=EXACT).adequacy()
        assert result.next_design is NextDesign.QUADRATIC_FILL
        assert result.keep == ("A", "B", "C")
        assert "(A:C)" in result.reasons[0]

    def test_many_factors_with_clear_main_effects_keep_those_that_act(self):
        a, b, *_ = (design := plackett_burman(12, 10, folded=True)).coded.T
        result = screen(answered(design, 3 * a - 2 * b + a * b), resolution=EXACT).adequacy()
        assert result.keep == ("A", "B")
        assert result.next_design is NextDesign.QUADRATIC_FILL

    def test_curvature_asks_for_a_fill_or_a_definitive_screening(self):
        for k, expected in ((6, NextDesign.QUADRATIC_FILL), (10, NextDesign.DEFINITIVE_SCREENING)):
            a, b, *_ = (design := plackett_burman(12, k, n_centre=1)).coded.T
            result = screen(answered(design, a + b + 0.3 * a**2), resolution=EXACT).adequacy()
            assert result.responses[0].curved
            assert result.responses[0].curvature == pytest.approx(0.3 / np.sqrt(2.0), rel=1e-9)
            assert result.next_design is expected
            assert result.keep == design.space.names

    def test_curvature_is_judged_against_repeated_centre_points(self):
        a, *_ = (design := plackett_burman(12, 5, n_centre=4)).coded.T
        quiet = answered(design, a + noise(16, 1))
        bent = answered(design, a + 0.5 * a**2 + noise(16, 1))
        assert not screen(quiet).adequacy().responses[0].curved
        assert screen(bent).adequacy().responses[0].curved

    def test_a_square_alone_shows_only_at_the_centre(self):
        a, *_ = (design := plackett_burman(12, 5, n_centre=1)).coded.T
        result = screen(answered(design, 0.1 + a**2, np.full(13, 0.1))).adequacy()
        assert [r.curved for r in result.responses] == [True, False]
        assert [r.status for r in result.responses] == ["inadequate", "adequate"]
        assert np.isinf(result.responses[0].curvature)
        assert result.reasons == ("y1: the centre lies by more than noise off the mean of the other runs",)

    def test_little_is_let_pass(self):
        a, b, *_ = (design := plackett_burman(12, 6)).coded.T
        screening = screen(answered(design, a + b + 1e-3 * a * b), resolution=EXACT)
        assert screening.adequacy().adequate
        assert not screening.adequacy(tolerance=1e-5).adequate

    def test_a_factor_aliased_with_two_that_act_asks_for_a_foldover(self):
        design = plackett_burman(8, 6)
        aliases = [k for k in range(6) if set(_terms(design, k)) & {"A:B"}]
        y = design.coded[:, 0] + 0.9 * design.coded[:, 1] + 0.8 * design.coded[:, 0] * design.coded[:, 1]
        result = screen(answered(design, y), resolution=EXACT).adequacy()
        assert aliases
        assert (result.status, result.next_design) == (AdequacyStatus.ALIASED, NextDesign.FOLDOVER)
        assert "cannot be told apart" in result.reasons[0]

    def test_a_saturated_design_cannot_tell(self):
        design = plackett_burman(12, 11)
        result = screen(answered(design, 5 * design.coded[:, 0] + noise(12))).adequacy()
        assert (result.status, result.next_design) == (AdequacyStatus.UNKNOWN, NextDesign.CENTRE_POINTS)

    def test_a_crowded_saturated_design_asks_for_a_larger_one(self):
        design = plackett_burman(12, 11)
        result = screen(answered(design, design.coded @ (2.0 - 0.1 * np.arange(11))), resolution=EXACT).adequacy()
        assert (result.status, result.next_design) == (AdequacyStatus.UNDECIDED, NextDesign.LARGER_SCREENING)
        assert result.keep == design.space.names

    def test_the_worst_response_decides(self):
        a, b, c, *_ = (design := plackett_burman(12, 6)).coded.T
        result = screen(answered(design, a, b + a * c, np.full(12, 3.0)), resolution=EXACT).adequacy()
        assert [r.status for r in result.responses] == ["adequate", "inadequate", "adequate"]
        assert result.status is AdequacyStatus.INADEQUATE
        assert all(reason.startswith("y2: ") for reason in result.reasons)

    def test_refuses_a_negative_tolerance(self):
        design = plackett_burman(12, 5)
        with pytest.raises(ValueError, match=r"tolerance must be 0 or a positive number, got -0\.1"):
            screen(answered(design, design.coded[:, 0])).adequacy(-0.1)


def _terms(design: Design, column: int) -> list[str]:
    a, b = design.coded[:, :2].T
    return ["A:B"] if abs(design.coded[:, column] @ (a * b)) == len(design) else []

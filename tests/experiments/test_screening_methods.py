"""Zahn, Dong, Daniel, Box and Meyer, and simulated critical values, against published and hand-made numbers."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.stats import norm
from scipy.stats import t as student_t

from experiments.screening import (
    box_meyer,
    dong,
    factor_posterior,
    half_normal_fit,
    lenth,
    reference_distribution,
    zahn,
)
from tests.reference import lenth_case, lenth_columns, recorded

from .screening_cases import full_factorial, plackett_burman

PILOT = lenth_case("bhh_pilot_plant_unrepx")
POSTERIORS = recorded("posteriors")


def contrasts_of(case: str, response=None) -> tuple[np.ndarray, list[str]]:
    found = lenth_case(case)
    names, columns = lenth_columns(found)
    y = np.array(found["response"] if response is None else response)
    return 2.0 / len(y) * columns.T @ y, names


class TestZahn:
    def judged(self):
        printed = PILOT["recomputed"]["effects"]
        return zahn(list(printed.values()), list(printed))

    def test_published_standard_error(self):
        """Box, Hunter and Hunter, 2nd ed., p. 177; R package unrepx, vignette: PSE_Zahn = 4.011005."""
        assert self.judged().pse == pytest.approx(PILOT["published"]["PSE_Zahn"], abs=5e-7)

    def test_published_ratios_and_p_values(self):
        """unrepx, ``eff.test``: ratios to three digits, p-values from 5715 simulated experiments.

        The tolerance is four standard errors of their simulation.
        """
        result = self.judged()
        for name, (ratio, p, simultaneous) in PILOT["published"]["eff_test_Zahn"].items():
            i = result.names.index(name.replace("TK", "T:K"))
            assert result.ratios[i] == pytest.approx(ratio, abs=5.1e-4)
            assert result.p_values[i] == pytest.approx(p, abs=4 * np.sqrt(p / 40_000))
            assert result.simultaneous_p[i] == pytest.approx(simultaneous, abs=4 * np.sqrt(simultaneous / 5715))

    def test_published_verdict(self):
        assert self.judged().active_names == tuple(PILOT["published"]["active"])

    def test_the_slope_of_a_perfect_line(self):
        quantiles = norm.ppf(0.5 + 0.5 * (np.arange(1, 12) - 0.375) / 11.25)
        assert zahn(3.0 * quantiles).pse == pytest.approx(3.0, rel=1e-12)

    def test_the_floor_replaces_a_slope_below_it(self):
        result = zahn([0, 0, 0, 0, 9.0, 0, 0], noise_floor=0.1)
        assert (result.pse, result.floored, result.error_from) == (0.1, True, "floor")
        assert result.active_names == ("c5",)


class TestDong:
    def test_by_hand(self):
        """Median 2, limit 7.5: 8 is set aside; 1, 1, 4, 9 average 3.75 over four degrees of freedom."""
        result = dong([1, -1, 2, 3, -8])
        assert result.pse == pytest.approx(np.sqrt(3.75), rel=1e-14)
        assert result.me == pytest.approx(np.sqrt(3.75) * student_t.ppf(0.975, 4), rel=1e-12)
        assert result.sme == pytest.approx(np.sqrt(3.75) * student_t.ppf((1 + 0.95**0.2) / 2, 4), rel=1e-12)

    def test_a_contrast_at_the_limit_counts(self):
        assert dong([1, 1, 2, 3, 7.5]).pse == pytest.approx(np.sqrt((1 + 1 + 4 + 9 + 56.25) / 5), rel=1e-14)

    @pytest.mark.parametrize("case", ["boxmeyer86_log_drill_advance", "boxmeyer86_shrinkage"])
    def test_published_verdicts(self, case):
        """BsMD vignette: x2, x4, x8 of the drill advance; x4, x12, x13 of the shrinkage; by Dong's margin."""
        result = dong(*contrasts_of(case), alpha=0.02)
        surely = {n for n, acts in zip(result.names, result.surely_active, strict=True) if acts}
        assert surely == set(lenth_case(case)["published"]["active"])

    def test_simulated_margins_differ_from_t(self):
        contrasts, names = contrasts_of("boxmeyer86_shrinkage")
        t, simulated = dong(contrasts, names), dong(contrasts, names, critical="simulated")
        assert t.pse == simulated.pse
        assert 0.7 < simulated.me / t.me < 1.3


class TestDaniel:
    def test_line_of_the_pilot_plant(self):
        """Five of seven contrasts are on the line; the largest, T, lies three times above it."""
        fit = half_normal_fit(list(PILOT["recomputed"]["effects"].values()), list(PILOT["recomputed"]["effects"]))
        assert fit.slope == pytest.approx(PILOT["published"]["PSE_Zahn"], abs=5e-7)
        assert (fit.n_line, fit.reading, fit.names[-1]) == (5, 5.0, "T")
        assert fit.above[-1] == pytest.approx(23.0 / (fit.slope * fit.quantiles[-1]))
        assert_array_equal(fit.sizes, [0, 0.5, 1.5, 1.5, 5, 10, 23])

    def test_nothing_is_above_a_line_without_slope(self):
        assert np.isnan(half_normal_fit([0.0, 0, 0, 0, 0, 0, 7]).above).all()

    def test_refuses_too_few(self):
        with pytest.raises(ValueError, match="Daniel's method needs at least 3 contrasts"):
            half_normal_fit([1.0, 2.0])


class TestSimulated:
    def test_r_margins_of_the_pilot_plant(self):
        """unrepx ``ME(method = "Lenth")``, seed 1, 5715 experiments: 5.096 and 10.605.

        Simulations of that length scatter by 0.056 and 0.254 (one standard deviation); the tolerance is four.
        """
        printed = PILOT["recomputed"]["R_unrepx_simulated_ME_SME_Lenth_seed1"]
        result = lenth(list(PILOT["recomputed"]["effects"].values()), critical="simulated")
        assert result.me == pytest.approx(printed[0], abs=4 * 0.056)
        assert result.sme == pytest.approx(printed[1], abs=4 * 0.254)

    @pytest.mark.parametrize("estimator", ["lenth", "dong", "zahn", "daniel"])
    @pytest.mark.parametrize("m", [7, 15])
    def test_keeps_the_error_rate(self, estimator, m):
        """5 % of inert contrasts, and 5 % of inert experiments, in an independent simulation."""
        other = reference_distribution(estimator, m, seed=99)
        one, any_of_them = reference_distribution(estimator, m).critical(0.05)
        assert np.mean(other.ratios > one) == pytest.approx(0.05, abs=0.001)
        assert np.mean(other.largest > any_of_them) == pytest.approx(0.05, abs=0.004)

    def test_is_tighter_than_t_and_needs_less_for_one_than_for_all(self):
        """Ye and Hamada (2000): t on m/3 degrees of freedom is too wide for single contrasts."""
        t, simulated = (lenth(np.arange(1.0, 16.0), critical=c) for c in ("t", "simulated"))
        assert simulated.me < 0.9 * t.me
        assert simulated.me < simulated.sme

    def test_is_reproducible(self):
        reference_distribution.cache_clear()
        first = reference_distribution("lenth", 7).critical(0.05)
        reference_distribution.cache_clear()
        assert reference_distribution("lenth", 7).critical(0.05) == first

    @pytest.mark.parametrize("critical", ["t", "simulated"])
    @pytest.mark.parametrize("alpha", [0.01, 0.05, 0.2])
    def test_p_values_and_margins_say_the_same(self, critical, alpha):
        contrasts = np.r_[np.random.default_rng(7).normal(size=12), 2.0, 4.0, 8.0]
        result = lenth(contrasts, alpha=alpha, critical=critical)
        assert_array_equal(result.p_values < alpha, result.active)
        assert_array_equal(result.simultaneous_p < alpha, result.surely_active)
        assert (result.p_values <= result.simultaneous_p).all()

    def test_refuses(self):
        with pytest.raises(ValueError, match="critical must be 't' or 'simulated', got 'F'"):
            lenth([1.0, 2.0, 3.0], critical="F")
        with pytest.raises(ValueError, match="unknown estimator 'wild'; known are lenth, dong, zahn, daniel"):
            reference_distribution("wild", 7)


class TestBoxMeyer:
    def test_published_posterior_of_the_drill_advance(self):
        """BsMD vignette, Box and Meyer (1986) example 1: three digits."""
        printed = POSTERIORS["drill_advance"]
        contrasts, names = contrasts_of(printed["case"])
        result = box_meyer(contrasts, names, printed["prior"], np.sqrt(16 * printed["gamma"] ** 2 + 1))
        assert_allclose(result.probabilities, printed["probabilities"], atol=5.1e-4)
        assert result.active_names == ("X2", "X4", "X8")
        for probability, active in printed["models"]:
            assert result.model(active) == pytest.approx(probability, abs=5.1e-4)
        assert result.model([]) == pytest.approx(printed["none"], abs=5.1e-4)

    @pytest.mark.parametrize("i", range(10))
    def test_published_posterior_of_the_isatin(self, i):
        """BsMD vignette, example 4: nothing is sure; 16 probabilities at each of ten inflations, three digits."""
        printed = POSTERIORS["isatin_yield"]
        contrasts, names = contrasts_of(printed["design_of"], printed["response"])
        result = box_meyer(contrasts, names, printed["prior"], np.sqrt(16 * printed["gamma"][i] ** 2 + 1))
        assert_allclose(result.probabilities, [printed["probabilities"][n][i] for n in names], atol=5.1e-4)
        assert result.model([]) == pytest.approx(printed["none"][i], abs=5.1e-4)

    def test_published_margins_of_the_isatin(self):
        """BsMD vignette, ``LenthPlot``: seven digits, no contrast beyond the margin."""
        printed = POSTERIORS["isatin_yield"]
        result = lenth(*contrasts_of(printed["design_of"], printed["response"]))
        expected = [printed["lenth"][k] for k in ("PSE", "ME", "SME")]
        assert_allclose([result.pse, result.me, result.sme], expected, atol=5e-8)
        assert result.active_names == ()

    def test_models_sum_to_one(self):
        result = box_meyer([5.0, 0.3, -0.2], list("ABC"))
        subsets = ["", "A", "B", "C", "AB", "AC", "BC", "ABC"]
        assert sum(result.model(list(s)) for s in subsets) == pytest.approx(1.0, abs=1e-12)
        assert sum(result.model(list(s)) for s in subsets if "A" in s) == pytest.approx(result.probabilities[0])

    def test_ignores_the_unit(self):
        contrasts = np.array([21.6, 3.1, 9.9, 14.6, 0.1, -18.1, 16.6])
        assert_allclose(box_meyer(1e-9 * contrasts).probabilities, box_meyer(contrasts).probabilities, rtol=1e-9)

    def test_exact_zeros_of_a_simulator_are_inert(self):
        """Without any noise the likelihood is still integrable: every contrast but one is surely inert or active."""
        result = box_meyer([7.0, 0.0, 0.0, 0.0, 0.0, 0.0, 3.0])
        assert result.probabilities[0] > 0.99
        assert result.probabilities[1:6].max() < 0.05

    def test_a_noise_floor_silences_what_is_below(self):
        contrasts = [2e-6, -1e-8, 3e-8, 2e-8, 1e-8, -3e-8, 1e-8]
        assert box_meyer(contrasts).probabilities[0] > 0.99
        assert box_meyer(contrasts, noise_floor=2e-6).probabilities.max() < 0.1

    @pytest.mark.parametrize(
        ("settings", "message"),
        [
            ({"prior": 0.0}, "prior must lie between 0 and 1, got 0.0"),
            ({"inflation": 1.0}, "inflation must be a number above 1, got 1.0"),
            ({"noise_floor": -1.0}, "noise_floor must be 0 or a positive number, got -1.0"),
        ],
    )
    def test_refuses(self, settings, message):
        with pytest.raises(ValueError, match=message):
            box_meyer([1.0, 2.0, 3.0], **settings)

    def test_refuses_a_response_that_never_changes(self):
        with pytest.raises(ValueError, match="needs a contrast other than zero"):
            box_meyer(np.zeros(7))

    def test_refuses_an_unknown_contrast(self):
        with pytest.raises(ValueError, match="unknown contrast 'Z'; known are A, B, C"):
            box_meyer([1.0, 2.0, 3.0], list("ABC")).model(["Z"])


class TestFactorPosterior:
    def test_published_verdict_of_the_cast_fatigue(self):
        """Hunter, Hodi and Eager (1982); BsMD vignette, γ = 1.5: "F and G clearly stick out", by their interaction.

        Lenth's method on main effects finds nothing there.
        """
        case = lenth_case("hunter_hodi_eager_cast_fatigue_pb12")
        names, columns = lenth_columns(case)
        result = factor_posterior(columns, case["response"], names, prior=0.25, inflation=1.5)
        assert set(result.active_names) == set(case["published"]["active"])
        assert result.models[0] == ("F", "G")
        assert np.delete(result.probabilities, [5, 6]).max() < 0.15 < 0.95 < result.probabilities[[5, 6]].min()

    def test_is_box_and_meyer_of_1986_without_interactions(self):
        """Columns of a saturated orthogonal design, k² = nγ² + 1."""
        design = plackett_burman(8, 7)
        y = np.random.default_rng(1).normal(size=8) + 2.0 * design.coded[:, 2]
        ours = factor_posterior(design.coded, y, design.space.names, 0.2, 2.0, interactions=1)
        theirs = box_meyer(design.coded.T @ y / 4.0, design.space.names, 0.2, np.sqrt(8 * 4.0 + 1.0))
        assert_allclose(ours.probabilities, theirs.probabilities, atol=1e-9)
        assert ours.weights[0] == pytest.approx(theirs.model(ours.models[0]), abs=1e-9)

    def test_finds_a_factor_that_acts_by_an_interaction_only(self):
        design = full_factorial(4)
        a, b, _, _ = design.coded.T
        y = 3.0 * a + 2.0 * a * b + 0.1 * np.random.default_rng(0).normal(size=16)
        assert factor_posterior(design.coded, y, design.space.names).active_names == ("A", "B")

    @pytest.mark.parametrize(
        ("settings", "message"),
        [
            ({"prior": 1.0}, "prior must lie between 0 and 1, got 1.0"),
            ({"inflation": 0.0}, "inflation must be a positive number, got 0.0"),
            ({"interactions": 0}, "interactions must be 1 or more and most_active 1 to 4; got 0, 4"),
            ({"most_active": 5}, "interactions must be 1 or more and most_active 1 to 4; got 2, 5"),
        ],
    )
    def test_refuses(self, settings, message):
        design = full_factorial(4)
        with pytest.raises(ValueError, match=message):
            factor_posterior(design.coded, np.arange(16.0), design.space.names, **settings)

    def test_refuses_too_many_models_and_constant_responses(self):
        design = plackett_burman(48, 40)
        with pytest.raises(ValueError, match="models are more than 200000: set most_active lower than 40"):
            factor_posterior(design.coded, np.arange(48.0), design.space.names)
        with pytest.raises(ValueError, match="a response that changes"):
            factor_posterior(design.coded, np.ones(48), design.space.names)
        with pytest.raises(ValueError, match="one response a run and one name a factor"):
            factor_posterior(design.coded, np.ones(47), design.space.names)

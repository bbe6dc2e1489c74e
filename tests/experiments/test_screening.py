"""Effects of two-level designs, and the whole screening step on the published experiment."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from experiments import Factor, FactorSpace, Response, Runs, Status, Terms, model_matrix
from experiments.designs import Design, LatinHypercube, PlackettBurman
from experiments.oracles import PointOracle
from experiments.screening import effects, lenth, screen
from tests.reference import hexflex_map, hexflex_table, lenth_case

SPACE = FactorSpace(tuple(Factor(n, "N", -2.0, 6.0) for n in ("A", "B", "C")))
PB = PlackettBurman(12).generate(SPACE)


def answered(design, *columns, status=None) -> Runs:
    n = len(design)
    responses = tuple(Response(f"y{i + 1}", "m") for i in range(len(columns)))
    status = status or (Status.OK,) * n
    reasons = tuple("" if s is Status.OK else "diverged" for s in status)
    return Runs(design, responses, np.column_stack(columns), status, reasons)


@pytest.fixture(scope="module")
def published() -> Runs:
    """The thesis, Table 2.2, with its design completed orthogonally by five dummy columns."""
    table = hexflex_table("table_2_2")
    forces, poses = list(table)[:6], list(table)[6:]
    space = FactorSpace(tuple(Factor(name.removesuffix("_N"), "N", -1, 1) for name in forces))
    coded = np.column_stack([table[name] for name in forces])
    dummies = lenth_case("seed_hexflex_x")["recomputed"]["dummy_columns"]
    names, units = zip(*(name.rsplit("_", 1) for name in poses), strict=True)
    return Runs(
        Design(space, coded, "published", dummies),
        tuple(Response(n, u) for n, u in zip(names, units, strict=True)),
        np.column_stack([table[name] for name in poses]),
        (Status.OK,) * 12,
        ("",) * 12,
    )


class TestEffects:
    def test_an_effect_is_high_minus_low(self):
        y = np.random.default_rng(0).normal(size=12)
        found = effects(answered(PB, y))
        for i, column in enumerate(np.hstack([PB.coded, PB.dummies]).T):
            assert found.values[i, 0] == pytest.approx(y[column > 0].mean() - y[column < 0].mean(), abs=1e-14)

    def test_an_effect_is_twice_the_coefficient(self):
        y = np.random.default_rng(1).normal(size=(12, 2))
        matrix = model_matrix(Terms.polynomial(SPACE.names, 1), PB.coded)
        coefficients = np.linalg.lstsq(matrix, y, rcond=None)[0]
        assert_allclose(effects(answered(PB, *y.T)).values[:3], 2.0 * coefficients[1:], rtol=1e-12, atol=1e-13)

    def test_a_planted_plane_is_found_and_leaves_no_dummy(self):
        a, b, c = PB.coded.T
        found = effects(answered(PB, 7.0 + 3.0 * a - 0.5 * b + 0.0 * c))
        assert_allclose(found.values[:, 0], [6.0, -1.0, *[0.0] * 9], atol=1e-14)

    def test_names_and_dummies(self):
        found = effects(answered(PB, PB.coded[:, 0]))
        assert found.names == ("A", "B", "C", *(f"dummy{i}" for i in range(1, 9)))
        assert found.n_factors == 3
        assert_array_equal(found.is_dummy, [False] * 3 + [True] * 8)

    def test_names_differ_even_if_a_factor_is_called_dummy1(self):
        space = FactorSpace((Factor("dummy1", "1", 0, 1),))
        try:
            found = effects(answered(PlackettBurman(4).generate(space), np.arange(4.0)))
        except ValueError:
            return
        assert len(set(found.names)) == 3

    def test_magnitude_is_the_largest_response(self):
        y = np.arange(12.0)
        assert_array_equal(effects(answered(PB, y - 20.0, 0.0 * y)).magnitude, [20.0, 0.0])

    def test_no_dummies_needed(self):
        design = Design(SPACE, PB.coded, "bare")
        assert effects(answered(design, PB.coded[:, 1])).names == ("A", "B", "C")

    def test_refuses_where_too_many_runs_failed(self):
        status = (Status.NOT_CONVERGED,) * 9 + (Status.OK,) * 3
        with pytest.raises(ValueError, match=r"without runs 1, 2, .* and 9 .*: 3 two-level runs are left"):
            effects(answered(PB, np.ones(12), status=status))

    def test_refuses_settings_between_the_levels(self):
        design = LatinHypercube(12).generate(SPACE)
        with pytest.raises(ValueError, match=r"two-level design: every coded setting must be -1 or \+1"):
            effects(answered(design, np.ones(12)))

    @pytest.mark.parametrize(
        "coded",
        [
            [[1, 1, -1], [1, -1, 1], [-1, 1, 1], [1, -1, -1]],
            [[1, 1, 1], [1, 1, -1], [-1, -1, 1], [-1, -1, -1]],
            [[1, 1, 1], [1, -1, -1], [1, 1, -1], [1, -1, 1]],
        ],
        ids=["unbalanced", "same column twice", "constant column"],
    )
    def test_refuses_correlated_columns(self, coded):
        with pytest.raises(ValueError, match="orthogonal, balanced design"):
            effects(answered(Design(SPACE, coded, "mine"), np.ones(4)))

    def test_refuses_a_design_that_lost_a_run(self):
        with pytest.raises(ValueError, match="orthogonal, balanced design"):
            effects(answered(PB.take(np.arange(11)), np.ones(11)))

    def test_accepts_a_design_read_back_in_physical_units(self):
        again = Design.from_physical(SPACE, PB.physical)
        assert_allclose(effects(answered(again, PB.coded[:, 2])).values[:, 0], [0, 0, 2.0], atol=1e-14)


class TestScreen:
    def test_finds_what_was_planted(self):
        a, b, c = PB.coded.T
        rng = np.random.default_rng(3)
        result = screen(answered(PB, 5 * a + 1e-3 * rng.normal(size=12), 2 * b - 3 * c + 1e-3 * rng.normal(size=12)))
        assert result.active_on("y1") == ("A",)
        assert result.active_on("y2") == ("B", "C")
        assert result.active_factors == ("A", "B", "C")
        assert result.active.shape == (11, 2)
        assert_array_equal(result.active[:3], [[True, False], [False, True], [False, True]])

    def test_leaves_out_the_factor_that_does_nothing(self):
        a, b, _ = PB.coded.T
        noise = 1e-3 * np.random.default_rng(3).normal(size=12)
        assert screen(answered(PB, a + noise, b - noise)).active_factors == ("A", "B")

    def test_is_lenth_on_every_response(self):
        y = np.random.default_rng(4).normal(size=(2, 12))
        result = screen(answered(PB, *y), alpha=0.1)
        for j in range(2):
            alone = lenth(result.effects.values[:, j], result.effects.names, alpha=0.1)
            assert (result.lenth[j].me, result.lenth[j].sme) == (alone.me, alone.sme)
            assert_array_equal(result.active[:, j], alone.active)

    def test_an_effect_hidden_in_a_dummy_is_reported(self):
        noise = 1e-3 * np.random.default_rng(5).normal(size=12)
        quiet = PB.coded[:, 0] + noise
        loud = quiet + PB.dummies[:, 3]
        result = screen(answered(PB, quiet, loud))
        assert result.flagged_dummies == {"y2": ("dummy4",)}
        assert result.active_on("y2") == ("A",)
        assert result.active_factors == ("A",)

    def test_a_dummy_beyond_the_plain_margin_is_reported(self):
        noise = 1e-3 * np.random.default_rng(5).normal(size=12)
        (plain,) = screen(answered(PB, noise)).lenth
        loud = noise + 0.25 * (plain.me + plain.sme) * PB.dummies[:, 3]
        result = screen(answered(PB, loud))
        assert result.flagged_dummies == {"y1": ("dummy4",)}
        assert not result.lenth[0].surely_active.any()

    def test_a_two_factor_interaction_shows_in_the_dummies(self):
        """In 12 runs AB is aliased by ±1/3 with every column but A and B (Plackett and Burman, 1946)."""
        a, b, _ = PB.coded.T
        found = effects(answered(PB, a * b)).values[:, 0]
        assert_allclose(np.abs(found), [0.0, 0.0] + [2.0 / 3.0] * 9, atol=1e-14)

    def test_resolution_silences_rounding(self):
        a, b, _ = PB.coded.T
        runs = answered(PB, 1000.0 + a + 1e-6 * b)
        assert screen(runs, resolution=1e-7).active_on("y1") == ("A",)
        assert screen(runs, resolution=1e-10).active_on("y1") == ("A", "B")
        assert screen(runs, resolution=1e-7).lenth[0].noise_floor == pytest.approx(1001.0 * 1e-7, rel=1e-6)

    def test_a_constant_response_has_no_active_factor(self):
        result = screen(answered(PB, np.zeros(12), PB.coded[:, 0]), resolution=1e-9)
        assert result.active_on("y1") == ()
        assert result.active_factors == ("A",)

    def test_unknown_response(self):
        with pytest.raises(ValueError, match="unknown response 'y3'; known are y1, y2"):
            screen(answered(PB, np.ones(12), np.ones(12)), resolution=1e-9).active_on("y3")


class TestPublishedHexFlex:
    """The thesis, Table 2.2, screened with a noise floor at the last printed digit."""

    PRINT_STEP = (1e-3, 1e-4, 1e-3, 0.1, 0.1, 0.01)

    def judge(self, runs: Runs):
        found = effects(runs)
        return [lenth(found.values[:, j], found.names, noise_floor=step) for j, step in enumerate(self.PRINT_STEP)]

    @pytest.mark.parametrize(
        ("response", "active"),
        [
            ("x", ("T1D1", "T2D1", "T3D1")),
            ("y", ("T2D1", "T3D1")),
            ("z", ("T1D2", "T2D2", "T3D2")),
            ("thx", ("T1D2", "T2D2", "T3D2")),
            ("thz", ("T1D1", "T2D1", "T3D1")),
        ],
    )
    def test_active_forces_are_those_of_the_thesis(self, published, response, active):
        names = [r.name for r in published.responses]
        result = self.judge(published)[names.index(response)]
        assert result.active_names == active
        assert_array_equal(result.active, result.surely_active)

    def test_theta_y_has_one_active_force_more_than_the_thesis(self, published):
        """Eq. 2.6 prints 0 for θy←T1D2; Table 2.2 itself gives −26.9 µrad/N, 500 times its last digit."""
        result = self.judge(published)[4]
        assert result.active_names == ("T1D2", "T2D2", "T3D2")
        assert result.contrasts[1] == pytest.approx(2 * -26.9, abs=0.05)
        without = np.abs(result.contrasts) > 100.0
        assert tuple(np.array(result.names)[without]) == ("T2D2", "T3D2")

    def test_screen_agrees_and_flags_no_dummy(self, published):
        """The print of Table 2.2 resolves at best 1 part in 115 000 of every response."""
        result = screen(published, resolution=1.0 / 115_056)
        assert result.flagged_dummies == {}
        assert result.active_on("x") == result.active_on("thz") == ("T1D1", "T2D1", "T3D1")
        assert result.active_on("y") == ("T2D1", "T3D1")
        assert result.active_on("z") == result.active_on("thx") == ("T1D2", "T2D2", "T3D2")
        assert result.active_factors == published.design.space.names

    def test_half_effects_are_the_published_map(self, published):
        """Eq. 2.6 is Table 2.2 rounded to 0.1, but for row θy."""
        rows, factors, entries = hexflex_map()
        found = effects(published)
        assert list(found.names[:6]) == factors
        assert [f"{r.name}_{r.unit}" for r in published.responses] == rows
        ours = 0.5 * found.values[:6].T
        assert np.abs(ours - entries)[[0, 1, 2, 3, 5]].max() <= 0.051
        assert_allclose(ours[4], [0, -26.9, 0, -34032.7, 0, 34059.7], atol=0.06)


class Product(PointOracle):
    """A product of powers over wide ranges: interactions as large as the main effects fill the dummies."""

    name = "product"
    resolution = 1e-12

    @property
    def factors(self):
        return FactorSpace(tuple(Factor(n, "1", 0.0, 3.0) for n in "abcd"))

    @property
    def responses(self):
        return (Response("y", "1"), Response("still", "1"))

    def respond(self, point):
        return [point.prod() ** 3, 7.0]


def test_a_response_that_moves_while_no_factor_stands_out_is_undecided():
    oracle = Product()
    screening = screen(oracle(PlackettBurman(12).generate(oracle.factors)), resolution=oracle.resolution)
    assert screening.active_on("y") == ()
    assert screening.undecided == ("y",)

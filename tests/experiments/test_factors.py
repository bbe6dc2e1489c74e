"""Factors and the border between physical and coded units."""

from dataclasses import FrozenInstanceError

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from experiments import Factor, FactorSpace
from experiments.designs import Design

FORCE = Factor("force", "N", -2.0, 4.0)
LENGTH = Factor("length", "m", 0.1, 0.3, source="drawing 7")
MASS = Factor("mass", "kg", 1, 2)
SPACE = FactorSpace((FORCE, LENGTH, MASS))


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"name": ""}, "factor name '' is not allowed"),
        ({"name": "2nd"}, "factor name '2nd' is not allowed: use letters, digits and underscores"),
        ({"name": "a:b"}, "factor name 'a:b' is not allowed"),
        ({"name": "a b"}, "factor name 'a b' is not allowed"),
        ({"name": "θx"}, "factor name 'θx' is not allowed"),
        ({"name": "force\n"}, "is not allowed"),
        ({"name": 3}, "factor name 3 is not allowed"),
        ({"unit": ""}, "unit '' of 'force' is not allowed: give a unit such as 'N'"),
        ({"unit": " N"}, "unit ' N' of 'force' is not allowed"),
        ({"unit": "N]"}, "unit 'N]' of 'force' is not allowed"),
        ({"unit": "N,m"}, "unit 'N,m' of 'force' is not allowed"),
        ({"unit": 'N"'}, "of 'force' is not allowed"),
        ({"unit": "N\x00"}, "of 'force' is not allowed"),
        ({"unit": None}, "unit None of 'force' is not allowed"),
        ({"low": np.nan}, "low and high must be finite numbers, got nan"),
        ({"high": np.inf}, "low and high must be finite numbers, got inf"),
        ({"low": "0"}, "low and high must be finite numbers, got '0'"),
        ({"high": True}, "low and high must be finite numbers, got True"),
        ({"low": None}, "low and high must be finite numbers, got None"),
        ({"low": 1.0, "high": 1.0}, "low must be below high, got low = 1.0, high = 1.0"),
        ({"low": 2.0, "high": 1.0}, "low must be below high, got low = 2.0, high = 1.0"),
        ({"low": -1.7e308, "high": 1.7e308}, "is too wide or too narrow for float64"),
    ],
)
def test_a_factor_refuses(changed, message):
    with pytest.raises(ValueError, match=message):
        Factor(**{"name": "force", "unit": "N", "low": -1.0, "high": 1.0, **changed})


@pytest.mark.parametrize("unit", ["1", "N", "N m", "µm", "m/s^2", "%", "°C", "N·m²"])
def test_a_factor_accepts_units(unit):
    assert Factor("force", unit, 0, 1).label == f"force[{unit}]"


def test_a_factor_is_frozen():
    with pytest.raises(FrozenInstanceError):
        FORCE.low = 0.0


def test_a_space_needs_factors_with_different_names():
    with pytest.raises(ValueError, match="at least one factor"):
        FactorSpace(())
    with pytest.raises(ValueError, match="factor names must differ; repeated: force, mass"):
        FactorSpace((MASS, FORCE, LENGTH, FORCE, MASS))


def test_a_space_lists_its_factors_in_order():
    assert len(SPACE) == 3
    assert tuple(SPACE) == (FORCE, LENGTH, MASS)
    assert SPACE.names == ("force", "length", "mass")
    assert SPACE.labels == ("force[N]", "length[m]", "mass[kg]")
    assert FactorSpace([FORCE, LENGTH, MASS]) == SPACE


def test_centre_and_half_range():
    assert_allclose(SPACE.centre, [1.0, 0.2, 1.5], rtol=1e-15)
    assert_allclose(SPACE.half_range, [3.0, 0.1, 0.5], rtol=1e-15)


def test_ends_are_plus_and_minus_one():
    assert_allclose(SPACE.code([[-2.0, 0.1, 1.0], [4.0, 0.3, 2.0]]), [[-1] * 3, [1] * 3], rtol=1e-15)
    assert_allclose(SPACE.decode([[-1] * 3, [1] * 3]), [[-2.0, 0.1, 1.0], [4.0, 0.3, 2.0]], rtol=1e-15)


def test_code_and_decode_are_inverse_and_go_beyond_the_box():
    coded = np.random.default_rng(0).uniform(-3.0, 3.0, (50, 3))
    assert_allclose(SPACE.code(SPACE.decode(coded)), coded, rtol=0.0, atol=1e-14)
    physical = SPACE.decode(coded)
    assert_allclose(SPACE.decode(SPACE.code(physical)), physical, rtol=0.0, atol=1e-14)


def test_a_wide_range_does_not_overflow():
    wide = FactorSpace((Factor("a", "1", 1.0e308, 1.7e308), Factor("b", "1", -8e307, 8e307)))
    assert_allclose(wide.decode([[1.0, -1.0]]), [[1.7e308, -8e307]], rtol=1e-15)
    assert_allclose(wide.code([[1.0e308, 8e307]]), [[-1.0, 1.0]], rtol=1e-12)


@pytest.mark.parametrize("points", [[0.0, 0.0, 0.0], [[0.0, 0.0]], [[[0.0, 0.0, 0.0]]], 1.0], ids=str)
@pytest.mark.parametrize("direction", ["code", "decode", "contains"])
def test_refuses_points_of_another_shape(points, direction):
    with pytest.raises(ValueError, match=r"points must have shape \(n, 3\), one column per factor \(force, length"):
        getattr(SPACE, direction)(points)


def test_contains():
    points = [[1.0, 0.2, 1.5], [4.0, 0.3, 2.0], [4.001, 0.2, 1.5], [1.0, 0.2, np.nan]]
    assert_array_equal(SPACE.contains(points), [True, True, False, False])
    assert_array_equal(SPACE.contains(points, tolerance=0.01), [True, True, True, False])


def test_index_suggests_the_nearest():
    assert SPACE.index("length") == 1
    with pytest.raises(ValueError, match="unknown factor 'lenght'; did you mean 'length'"):
        SPACE.index("lenght")
    with pytest.raises(ValueError, match="unknown factor 'zz'; known are force, length, mass"):
        SPACE.index("zz")


def test_select_keeps_this_order():
    assert SPACE.select(["mass", "force", "mass"]) == FactorSpace((FORCE, MASS))
    with pytest.raises(ValueError, match="unknown factor 'mas'"):
        SPACE.select(["mas"])


def test_with_ranges():
    changed = SPACE.with_ranges({"length": (0.2, 0.21)})
    assert changed.factors[1] == Factor("length", "m", 0.2, 0.21, "set by the user")
    assert changed.factors[::2] == (FORCE, MASS)
    assert SPACE.factors[1] == LENGTH
    with pytest.raises(ValueError, match="did you mean 'length'"):
        SPACE.with_ranges({"lengths": (0, 1)})
    with pytest.raises(ValueError, match="factor 'mass': low must be below high"):
        SPACE.with_ranges({"mass": (2.0, 1.0)})


class TestDesign:
    def test_keeps_a_copy(self):
        coded = np.zeros((2, 3))
        design = Design(SPACE, coded, "mine")
        coded[:] = 1.0
        assert_array_equal(design.coded, np.zeros((2, 3)))

    @pytest.mark.parametrize(
        ("coded", "dummies", "message"),
        [
            (np.zeros((2, 2)), None, r"a design of 3 factors needs shape \(n_runs, 3\); got \(2, 2\)"),
            (np.zeros(3), None, r"needs shape \(n_runs, 3\); got \(3,\)"),
            ([[0, 0, np.inf]], None, "not finite"),
            ([[0, np.nan, 0]], None, "not finite"),
            (np.zeros((2, 3)), np.ones((3, 1)), r"dummy columns need 2 rows, one per run; got shape \(3, 1\)"),
            (np.zeros((2, 3)), np.ones(2), r"dummy columns need 2 rows, one per run; got shape \(2,\)"),
        ],
    )
    def test_refuses(self, coded, dummies, message):
        with pytest.raises(ValueError, match=message):
            Design(SPACE, coded, "mine", *([] if dummies is None else [dummies]))

    def test_from_physical(self):
        design = Design.from_physical(SPACE, [[4.0, 0.2, 1.0]])
        assert_allclose(design.coded, [[1.0, 0.0, -1.0]], atol=1e-14)
        assert design.method == "given"

    def test_take_keeps_dummies(self):
        dummies = np.array([[1.0, -1.0], [-1.0, 1.0], [1.0, 1.0]])
        taken = Design(SPACE, np.arange(9.0).reshape(3, 3), "mine", dummies).take([2, 0])
        assert_array_equal(taken.coded, [[6, 7, 8], [0, 1, 2]])
        assert_array_equal(taken.dummies, dummies[[2, 0]])
        assert taken.method == "mine"

    def test_embed_puts_added_factors_at_their_centre(self):
        small = FactorSpace((MASS, FORCE))
        embedded = Design(small, [[1.0, -1.0], [0.5, 0.0]], "mine").embed(SPACE)
        assert embedded.space == SPACE
        assert_array_equal(embedded.coded, [[-1.0, 0.0, 1.0], [0.0, 0.0, 0.5]])
        assert_allclose(embedded.physical, [[-2.0, 0.2, 2.0], [1.0, 0.2, 1.75]])

    def test_embed_refuses_a_space_without_its_factors(self):
        with pytest.raises(ValueError, match="unknown factor 'mass'"):
            Design(SPACE.select(["mass"]), [[1.0]], "mine").embed(SPACE.select(["force", "length"]))

    def test_embed_refuses_another_unit(self):
        grams = FactorSpace((FORCE, Factor("mass", "g", 1000, 2000)))
        with pytest.raises(ValueError, match="mass"):
            Design(SPACE.select(["mass"]), [[1.0]], "mine").embed(grams)

    def test_embed_never_moves_a_setting(self):
        narrow = SPACE.select(["mass"]).with_ranges({"mass": (1.4, 1.6)})
        design = Design(narrow, [[1.0]], "mine")
        try:
            embedded = design.embed(SPACE)
        except ValueError:
            return
        assert_allclose(embedded.physical[:, 2], design.physical[:, 0])

"""The contract of every design method: inherit :class:`DesignContract`, and give the method a case here."""

from dataclasses import FrozenInstanceError, dataclass, fields
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from experiments import Factor, FactorSpace
from experiments.designs import METHODS, Design, DesignMethod, get


@dataclass(frozen=True)
class DesignCase:
    """What the contract must know of a method.

    `settings` gives `n_runs` runs on up to six factors; `refused` pairs wrong settings with the
    message they earn.
    """

    settings: dict[str, Any]
    n_runs: int
    random: bool
    refused: tuple[tuple[dict[str, Any], str], ...]


CASES = {
    "plackett_burman": DesignCase(
        {"n_runs": 12},
        12,
        False,
        (
            ({"n_runs": 13}, "nearest sizes: .*12.*16"),
            ({"n_runs": 2}, "at least 4, got 2"),
            ({"n_runs": 12.5}, "n_runs must be a whole number, got 12.5"),
            ({"n_runs": True}, "n_runs must be a whole number, got True"),
            ({"n_centre": -1}, "n_centre of a Plackett-Burman design must be a whole number of at least 0, got -1"),
            ({"foldover": "yes"}, "foldover must be true or false, got 'yes'"),
        ),
    ),
    "uniform": DesignCase(
        {"n_runs": 12, "levels": 4, "budget": 60},
        12,
        True,
        (
            ({"n_runs": 13, "levels": 4}, "use n_runs = 12 or 16"),
            ({"n_runs": 3, "levels": 4}, "use n_runs = 4"),
            ({"levels": 1}, "levels of a uniform design must be a whole number of at least 2, got 1"),
            ({"budget": -1}, "budget of a uniform design must be a whole number of at least 0, got -1"),
            ({"n_runs": "30"}, "n_runs must be a whole number, got '30'"),
        ),
    ),
    "latin_hypercube": DesignCase(
        {"n_runs": 9},
        9,
        True,
        (
            ({"n_runs": 0}, "at least 1, got 0"),
            ({"n_runs": None}, "n_runs must be a whole number, got None"),
        ),
    ),
    "full_factorial": DesignCase(
        {"n_runs": 64},
        64,
        False,
        (
            ({"n_runs": 0}, "n_runs of a full factorial must be a whole number of at least 1, got 0"),
            ({"levels": "2, x"}, "levels of a full factorial must be whole numbers of at least 1, got '2, x'"),
            ({"levels": 0}, "must be whole numbers of at least 1, got 0"),
            ({"levels": 3, "n_runs": 9}, "from levels or from n_runs, got both"),
            ({"levels": True}, "levels must be a whole number or a text, got True"),
        ),
    ),
    "fractional_factorial": DesignCase(
        {"n_runs": 16},
        16,
        False,
        (
            ({"n_runs": 12}, "a power of two of runs, got 12; use n_runs = 8 or 16"),
            ({"n_runs": 1}, "n_runs of a fractional factorial must be a whole number of at least 2, got 1"),
            ({"resolution": 2}, "resolution of a fractional factorial must be a whole number of at least 3, got 2"),
            ({"n_centre": -1}, "n_centre of a fractional factorial must be a whole number of at least 0, got -1"),
            ({"foldover": 1}, "foldover must be true or false, got 1"),
        ),
    ),
    "definitive_screening": DesignCase(
        {"n_runs": 13},
        13,
        False,
        (
            ({"n_runs": 14}, "no definitive screening design with 14 runs .* nearest sizes: 9, 13, 17"),
            ({"n_runs": 45}, "no definitive screening design with 45 runs .* nearest sizes: 37, 41, 49"),
            ({"n_runs": 5}, "n_runs of a definitive screening design must be a whole number of at least 9, got 5"),
            ({"fake_factors": -1}, "fake_factors of a definitive screening design must be .* at least 0, got -1"),
            ({"extra_centre": -1}, "extra_centre of a definitive screening design must be .* at least 0, got -1"),
        ),
    ),
    "d_optimal": DesignCase(
        {"n_runs": 12, "model": "linear", "starts": 2},
        12,
        True,
        (
            ({"n_runs": 0}, "n_runs of a D-optimal design must be a whole number of at least 1, got 0"),
            ({"levels": 1}, "levels of a D-optimal design must be a whole number of at least 2, got 1"),
            ({"starts": 0}, "starts of a D-optimal design must be a whole number of at least 1, got 0"),
            ({"model": " "}, "model of a D-optimal design must be 'linear', .* got ' '"),
            ({"replicates": 0}, "replicates must be true or false, got 0"),
        ),
    ),
    "sobol": DesignCase(
        {"n_runs": 9},
        9,
        True,
        (
            ({"n_runs": 0}, "n_runs of Sobol' points must be a whole number of at least 1, got 0"),
            ({"n_runs": None}, "n_runs must be a whole number, got None"),
        ),
    ),
    "halton": DesignCase(
        {"n_runs": 9},
        9,
        True,
        (
            ({"n_runs": 0}, "n_runs of Halton points must be a whole number of at least 1, got 0"),
            ({"n_runs": "9"}, "n_runs must be a whole number, got '9'"),
        ),
    ),
    "random": DesignCase(
        {"n_runs": 7},
        7,
        True,
        (
            ({"n_runs": 0}, "at least 1, got 0"),
            ({"n_runs": float("nan")}, "n_runs must be a whole number, got nan"),
        ),
    ),
}

SPACE = FactorSpace(
    (
        Factor("force", "N", -1.0, 1.0),
        Factor("length", "m", 0.045, 0.055),
        Factor("temperature", "K", 293.0, 303.0),
        Factor("young", "Pa", 70e9, 72e9),
        Factor("angle", "rad", -0.3, -0.1),
        Factor("ratio", "1", 0, 10),
    )
)


class DesignContract:
    """Every test takes `name`, a key of ``designs.METHODS``."""

    @pytest.fixture
    def case(self, name: str) -> DesignCase:
        if name not in CASES:
            pytest.fail(f"the design {name!r} has no case in tests/contracts/design_contract.py")
        return CASES[name]

    @pytest.fixture(params=[1, 2, 6], ids=lambda k: f"{k}-factors")
    def space(self, request: pytest.FixtureRequest) -> FactorSpace:
        return FactorSpace(SPACE.factors[: request.param])

    @pytest.fixture
    def method(self, name: str, case: DesignCase) -> DesignMethod:
        return get(name, case.settings)

    def test_is_listed_under_its_own_name(self, name, method):
        assert METHODS[name].method == name
        assert type(method) is METHODS[name]
        assert METHODS[name].summary

    def test_keeps_the_protocol(self, method):
        assert isinstance(method, DesignMethod)

    def test_settings_are_frozen(self, method, case):
        with pytest.raises(FrozenInstanceError):
            setattr(method, next(iter(case.settings)), 99)

    def test_every_setting_says_its_unit_and_purpose(self, name):
        for setting in fields(METHODS[name]):
            assert setting.metadata["unit"]
            assert setting.metadata["about"]

    def test_shape_and_names(self, name, method, case, space):
        design = method.generate(space)
        assert isinstance(design, Design)
        assert design.coded.shape == (case.n_runs, len(space))
        assert len(design) == case.n_runs
        assert design.space == space
        assert design.method == name
        assert design.dummies.shape[0] == case.n_runs

    def test_settings_lie_in_the_coded_cube(self, method, space):
        assert np.abs(method.generate(space, rng=3).coded).max() <= 1.0

    def test_same_seed_same_bits(self, name, case, space):
        first, second = (get(name, case.settings).generate(space, rng=11) for _ in range(2))
        assert_array_equal(first.coded, second.coded)
        assert_array_equal(first.dummies, second.dummies)

    @pytest.mark.parametrize("kind", [np.random.SeedSequence, np.random.default_rng])
    def test_seed_and_its_generator_agree(self, method, space, kind):
        assert_array_equal(method.generate(space, rng=5).coded, method.generate(space, rng=kind(5)).coded)

    def test_other_seeds_differ_where_random(self, method, case, space):
        first, second = (method.generate(space, rng=seed).coded for seed in (0, 1))
        assert np.array_equal(first, second) != case.random

    def test_does_not_touch_the_global_generator(self, method, space):
        np.random.seed(0)  # noqa: NPY002
        before = np.random.get_state()[1].copy()  # noqa: NPY002
        method.generate(space)
        assert_array_equal(np.random.get_state()[1], before)  # noqa: NPY002

    def test_coded_settings_do_not_depend_on_units(self, method, space):
        other = space.with_ranges({n: (5.0, 9.0) for n in space.names})
        assert_array_equal(method.generate(space, rng=2).coded, method.generate(other, rng=2).coded)

    def test_arrays_are_read_only(self, method, space):
        design = method.generate(space)
        for array in (design.coded, design.dummies):
            assert not array.flags.writeable
        with pytest.raises(ValueError, match="read-only"):
            design.coded[0, 0] = 0.0

    def test_physical_settings_code_back(self, method, space):
        design = method.generate(space, rng=4)
        assert space.contains(design.physical).all()
        assert_allclose(space.code(design.physical), design.coded, rtol=0.0, atol=1e-13)
        again = Design.from_physical(space, design.physical)
        assert_allclose(again.physical, design.physical, rtol=1e-14)

    def test_refuses_wrong_settings(self, name, case):
        assert case.refused
        for settings, message in case.refused:
            with pytest.raises(ValueError, match=message):
                get(name, settings)

    @pytest.mark.parametrize("at_least", [5, 9.5, 13])
    def test_can_be_asked_for_at_least_so_many_runs(self, name, at_least):
        method = get(name, at_least=at_least)
        assert at_least <= method.n_runs < 2 * at_least
        assert len(method.generate(SPACE.select(["force"]))) == method.n_runs

    def test_given_runs_come_before_at_least(self, name, case):
        assert get(name, case.settings, at_least=1000).n_runs == case.n_runs

    def test_unknown_setting_suggests_the_nearest(self, name):
        with pytest.raises(ValueError, match=rf"design '{name}' has no setting 'n_run'; did you mean 'n_runs'"):
            get(name, {"n_run": 12})

    def test_unknown_method_suggests_the_nearest(self, name):
        with pytest.raises(ValueError, match=rf"unknown design '{name}s'; did you mean '{name}'"):
            get(f"{name}s")

"""Settings from mappings, and the names and labels they share."""

from dataclasses import FrozenInstanceError, dataclass

import pytest

from experiments.naming import check_name, check_unit, column_label, parse_column_label, suggestion
from experiments.settings import build, describe, parameter


@dataclass(frozen=True)
class Spring:
    stiffness: float
    coils: int = parameter(5, "coils", "number of coils")
    free: bool = parameter(False, "", "whether its end is free")
    maker: str | None = parameter(None, "", "who made it")
    preload: float | None = parameter(None, "N", "force at rest")

    def __post_init__(self) -> None:
        if self.stiffness <= 0:
            raise ValueError("stiffness must be positive")


def test_build():
    spring = build("spring", Spring, {"stiffness": 2.5, "coils": 7, "free": True, "maker": "us", "preload": 1.0})
    assert spring == Spring(2.5, 7, True, "us", 1.0)
    with pytest.raises(FrozenInstanceError):
        spring.coils = 3


def test_whole_numbers_become_floats_where_declared():
    spring = build("spring", Spring, {"stiffness": 2, "preload": 3})
    assert type(spring.stiffness) is float
    assert type(spring.preload) is float
    assert type(spring.coils) is int


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({}, "spring needs the setting 'stiffness'"),
        ({"stiffness": 1.0, "coil": 3}, "spring has no setting 'coil'; did you mean 'coils'"),
        ({"stiffness": 1.0, "zzz": 3}, "spring has no setting 'zzz'; known are stiffness, coils, free, maker, preload"),
        ({"stiffness": "1"}, "spring: stiffness must be a number, got '1'"),
        ({"stiffness": True}, "spring: stiffness must be a number, got True"),
        ({"stiffness": None}, "spring: stiffness must be a number, got None"),
        ({"stiffness": [1.0]}, "spring: stiffness must be a number"),
        ({"stiffness": float("nan")}, "spring: stiffness must be finite, got nan"),
        ({"stiffness": float("-inf")}, "spring: stiffness must be finite, got -inf"),
        ({"stiffness": 1.0, "coils": 2.5}, "spring: coils must be a whole number, got 2.5"),
        ({"stiffness": 1.0, "coils": False}, "spring: coils must be a whole number, got False"),
        ({"stiffness": 1.0, "free": 1}, "spring: free must be true or false, got 1"),
        ({"stiffness": 1.0, "maker": 4}, "spring: maker must be a text, got 4"),
        ({"stiffness": 1.0, "preload": "x"}, "spring: preload must be a number, got 'x'"),
        ({"stiffness": -1.0}, "stiffness must be positive"),
    ],
)
def test_build_refuses(given, message):
    with pytest.raises(ValueError, match=message):
        build("spring", Spring, given)


def test_build_accepts_none_where_declared():
    assert build("spring", Spring, {"stiffness": 1.0, "maker": None, "preload": None}) == Spring(1.0)


def test_describe():
    rows = describe(Spring)
    assert rows[0] == {"name": "stiffness", "default": "required", "unit": "", "about": ""}
    assert rows[1] == {"name": "coils", "default": "5", "unit": "coils", "about": "number of coils"}
    assert [row["name"] for row in rows] == ["stiffness", "coils", "free", "maker", "preload"]


@pytest.mark.parametrize("name", ["a", "T1D1", "theta_x", "A_"])
def test_names_that_are_allowed(name):
    check_name("factor", name)


@pytest.mark.parametrize("name", ["_a", "1a", "a-b", "a.b", "a^2", "é", "a ", "", None])
def test_names_that_are_not(name):
    with pytest.raises(ValueError, match=r"wheel name .* is not allowed: use letters, digits and underscores"):
        check_name("wheel", name)


@pytest.mark.parametrize("unit", ["", " ", "a[b", "a\\b", "a'b", "a\tb", "a\nb", "a\u2028b", 5])
def test_units_that_are_not_allowed(unit):
    with pytest.raises(ValueError, match="of 'u' is not allowed"):
        check_unit("u", unit)


@pytest.mark.parametrize(("name", "unit"), [("T1D1", "N"), ("theta_x", "µrad"), ("k", "N m/rad"), ("ratio", "1")])
def test_column_labels_parse_back(name, unit):
    check_unit(name, unit)
    assert parse_column_label(column_label(name, unit)) == (name, unit)


@pytest.mark.parametrize(
    ("label", "parsed"),
    [
        ("T1D1", ("T1D1", None)),
        (" T1D1 [N] ", ("T1D1", "N")),
        ("T1D1[]", ("T1D1", "")),
        ("T1D1[N", ("T1D1[N", None)),
        ("T1D1]N[", ("T1D1]N[", None)),
    ],
)
def test_column_labels_written_by_people(label, parsed):
    assert parse_column_label(label) == parsed


def test_suggestion():
    assert suggestion("unifrom", ["uniform", "random"]) == "; did you mean 'uniform'?"
    assert suggestion("zzz", iter(["uniform", "random"])) == "; known are uniform, random"
    assert suggestion("zzz", []) == ""

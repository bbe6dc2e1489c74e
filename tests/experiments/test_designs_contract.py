"""Every design method keeps the contract; one without a case there fails."""

import pytest

from experiments.designs import METHODS, get
from tests.contracts.design_contract import CASES, DesignContract


@pytest.mark.parametrize("name", METHODS)
class TestEveryDesign(DesignContract):
    pass


def test_no_case_without_a_method():
    assert set(CASES) <= set(METHODS)


def test_name_like_no_other_lists_all():
    with pytest.raises(ValueError, match=r"unknown design 'zzz'; known are plackett_burman, .*, random"):
        get("zzz")


@pytest.mark.parametrize(
    ("at_least", "levels", "n_runs"), [(28, 6, 30), (30, 6, 30), (30.5, 6, 36), (7, 4, 8), (1, 4, 4)]
)
def test_at_least_is_rounded_up_to_a_multiple_of_the_levels(at_least, levels, n_runs):
    assert get("uniform", {"levels": levels}, at_least=at_least).n_runs == n_runs
    assert get("uniform", at_least=28).n_runs == 30

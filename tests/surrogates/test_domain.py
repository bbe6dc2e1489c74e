"""Verification: where settings lie, against a box worked by hand; what predict and interval do with those outside."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from surrogates.domain import NEAR, Place, guard, near_ends, outside_sentence
from tests.surrogates.cases import box, hexflex_like, points, surrogate

SPACE = box(("a", 0.0, 2.0), ("b", 10.0, 30.0))


@pytest.mark.parametrize(
    ("setting", "place"),
    [
        ([1.0, 20.0], "inside"),
        ([0.001, 29.99], "inside"),
        ([0.0, 20.0], "edge"),
        ([2.0, 20.0], "edge"),
        ([1.0, 30.0], "edge"),
        ([0.0, 10.0], "edge"),
        ([2.0 + 9e-10, 20.0], "edge"),  # 9e-10 of a half range of 1: rounding
        ([2.0 - 9e-10, 20.0], "edge"),
        ([2.0 - 2e-9, 20.0], "inside"),
        ([2.0 + 2e-9, 20.0], "outside"),
        ([1.0, 30.0 + 2e-8], "outside"),
        ([1.0, 9.0], "outside"),
        ([-1e300, 20.0], "outside"),
        ([1.0, np.nan], "outside"),
        ([1.0, np.inf], "outside"),
    ],
)
def test_guard_by_hand(setting, place):
    assert_array_equal(guard(SPACE, [setting]), [place])


def test_a_wider_edge_grows_inwards_only():
    X = [[1.97, 20.0], [1.99, 20.0], [2.0, 20.0], [2.01, 20.0]]  # coded 0.97, 0.99, 1, 1.01
    assert_array_equal(guard(SPACE, X, margin=0.02), ["inside", "edge", "edge", "outside"])
    assert_array_equal(guard(SPACE, X, margin=0.0), ["inside", "inside", "edge", "outside"])


@pytest.mark.parametrize("margin", [-0.1, 1.0, np.nan])
def test_a_margin_that_is_none_is_refused(margin):
    with pytest.raises(ValueError, match=r"margin must be at least 0 and below 1 \(coded units\), got"):
        guard(SPACE, [[1.0, 20.0]], margin)


def test_what_is_not_outside_is_what_the_model_contains():
    model = hexflex_like()
    X = points(model, 500, reach=1.3)
    X[:100] = np.clip(X[:100], [f.low for f in model.factors], [f.high for f in model.factors])
    found = model.guard(X)
    assert_array_equal(found != Place.OUTSIDE, model.contains(X))
    assert set(found) == {"inside", "edge", "outside"}


def test_no_settings_have_no_place():
    assert guard(SPACE, np.empty((0, 2))).shape == (0,)
    assert outside_sentence(SPACE, np.empty((0, 2))) == ""


def test_a_refusal_names_rows_factors_and_ranges():
    X = [[1.0, 20.0], [3.0, 20.0], [1.0, 20.0], [-1.0, 5.0], [9.0, 20.0], [1.0, np.nan]]
    assert outside_sentence(SPACE, X[:1]) == ""
    assert outside_sentence(SPACE, X) == (
        "4 of 6 settings lie outside the domain: row 2: a = 3 N (allowed: 0 to 2); "
        "row 4: a = -1 N (allowed: 0 to 2), b = 5 N (allowed: 10 to 30); row 5: a = 9 N (allowed: 0 to 2); and 1 more"
    )


def test_near_an_end_is_within_a_share_of_the_range():
    assert NEAR == 0.05
    assert near_ends(SPACE, [0.1, 20.0]) == {"a": "low"}  # 0.1 of 2 is 5 %
    assert near_ends(SPACE, [0.11, 20.0]) == {}
    assert near_ends(SPACE, [1.95, 10.5]) == {"a": "high", "b": "low"}
    assert near_ends(SPACE, [2.5, 20.0]) == {"a": "high"}


# --- prediction -------------------------------------------------------------------------------------------------------


def model_on_space():
    return surrogate(SPACE, ["1", "a", "b^2"], [[1.0, 2.0, 3.0], [0.0, 1.0, 0.0]])


def test_predict_extrapolates_marks_or_refuses():
    model = model_on_space()
    X = np.array([[1.0, 20.0], [2.0, 30.0], [3.0, 20.0]])
    free = model.predict(X)
    assert_array_equal(free[:, 0], [1.0, 6.0, 5.0])  # coded (0, 0), (1, 1), (2, 0)
    assert_array_equal(model.predict(X, "extrapolate"), free)
    marked = model.predict(X, outside="nan")
    assert_array_equal(marked[:2], free[:2])
    assert np.isnan(marked[2]).all()
    assert_array_equal(model.predict(X[:2], outside="refuse"), free[:2])
    with pytest.raises(ValueError, match=r"1 of 3 settings .*: row 3: a = 3 N \(allowed: 0 to 2\); keep to the ranges"):
        model.predict(X, outside="refuse")


def test_another_word_is_refused():
    model = model_on_space()
    with pytest.raises(ValueError, match="outside must be 'extrapolate', 'nan' or 'refuse', got 'flag'"):
        model.predict([[1.0, 20.0]], outside="flag")
    with pytest.raises(ValueError, match="outside must be 'nan' or 'refuse' for an interval, got 'extrapolate'"):
        model.interval([[1.0, 20.0]], outside="extrapolate")

"""How the benchmark of pushed ranges finds the range at which something stops."""

import math

import pytest

from benchmarks.pushing.limits import Limit, furthest, order

RANGES = (1.0, 2.0, 4.0)


@pytest.mark.parametrize("at", [0.3, 1.0, 1.7, 3.99])
def test_a_limit_is_bracketed_as_closely_as_asked(at):
    limit = furthest(lambda reach: reach <= at, RANGES, 0.01)
    assert limit.holds <= at < limit.fails
    assert limit.fails - limit.holds <= 0.01


def test_what_is_never_met_has_no_end():
    limit = furthest(lambda reach: True, RANGES, 0.1)
    assert limit == Limit(4.0, math.inf)
    assert str(limit) == "beyond 4"


def test_the_first_failure_counts_and_no_larger_range_is_tried():
    asked = []

    def holds(reach):
        asked.append(reach)
        return reach < 1.5 or reach > 3.0

    limit = furthest(holds, RANGES, 0.1)
    assert limit.holds < 1.5 <= limit.fails
    assert max(asked) == 2.0


def test_what_never_holds_is_pinned_to_nothing():
    limit = furthest(lambda reach: False, RANGES, 0.1)
    assert limit.holds == 0.0
    assert limit.fails <= 0.1


def test_limits_are_ordered_by_where_they_fail_and_those_never_met_are_left_out():
    limits = {"error": Limit(2.0, 2.1), "certificate": Limit(4.0, math.inf), "stress": Limit(0.4, 0.5)}
    assert order(limits) == ["stress", "error"]


def test_a_precision_that_no_bisection_reaches_is_refused():
    with pytest.raises(ValueError, match="precision must be positive, got 0"):
        furthest(lambda reach: True, RANGES, 0.0)

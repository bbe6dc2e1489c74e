"""Responses and the table of runs."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from experiments import Factor, FactorSpace, Response, Runs, Status
from experiments.designs import Design

SPACE = FactorSpace((Factor("a", "N", 0.0, 1.0),))
RESPONSES = (Response("u", "m", "µm", 1e6), Response("v", "rad"))
OK, CRASHED = Status.OK, Status.CRASHED


def table(status, values=None, reasons=None):
    n = len(status)
    values = np.arange(2.0 * n).reshape(n, 2) if values is None else values
    reasons = ["" if s is OK else f"reason {i + 1}" for i, s in enumerate(status)] if reasons is None else reasons
    return Runs(Design(SPACE, np.linspace(-1, 1, n)[:, None], "mine"), RESPONSES, values, tuple(status), tuple(reasons))


def test_response_labels_and_defaults():
    assert RESPONSES[0].label == "u[m]"
    assert RESPONSES[1].shown_unit == "rad"
    assert RESPONSES[1].shown_scale == 1.0
    assert Response("theta_x", "rad", symbol="θx").symbol == "θx"
    assert Response("theta_x", "rad").symbol == "theta_x"


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"name": "θx"}, "response name 'θx' is not allowed"),
        ({"unit": ""}, "unit '' of 'u' is not allowed"),
        ({"shown_unit": "[mm]"}, "of 'u' is not allowed"),
        ({"shown_scale": 0.0}, "response 'u': shown_scale must be positive, got 0.0"),
        ({"shown_scale": -1.0}, "shown_scale must be positive, got -1.0"),
        ({"shown_scale": np.inf}, "shown_scale must be positive, got inf"),
    ],
)
def test_a_response_refuses(changed, message):
    with pytest.raises(ValueError, match=message):
        Response(**{"name": "u", "unit": "m", **changed})


def test_statuses_are_texts_for_the_files():
    assert [str(s) for s in Status] == ["ok", "not_converged", "crashed", "timed_out", "non_finite", "rejected"]
    assert Status("timed_out") is Status.TIMED_OUT


def test_failed_runs_have_no_numbers():
    runs = table([OK, CRASHED, OK])
    assert_array_equal(runs.values, [[0, 1], [np.nan, np.nan], [4, 5]])
    assert_array_equal(runs.ok, [True, False, True])
    assert len(runs) == 3


def test_values_are_a_read_only_copy():
    values = np.ones((2, 2))
    runs = table([OK, CRASHED], values)
    values[0] = 5.0
    assert_array_equal(runs.values[0], [1.0, 1.0])
    assert_array_equal(values[1], [1.0, 1.0])
    with pytest.raises(ValueError, match="read-only"):
        runs.values[0, 0] = 2.0


@pytest.mark.parametrize(
    ("status", "values", "reasons", "message"),
    [
        ([OK, OK], np.ones((2, 1)), None, r"values must have shape \(2, 2\) \(runs, responses\); got \(2, 1\)"),
        ([OK, OK], np.ones(2), None, r"values must have shape \(2, 2\)"),
        ([OK, OK], np.ones((2, 2)), [""], "one status and one reason for each of 2 runs"),
        ([OK, OK], [[1, 2], [3, np.nan]], None, "status 'ok' has a response that is not finite"),
        ([OK, OK], [[1, 2], [3, -np.inf]], None, "status 'ok' has a response that is not finite"),
    ],
)
def test_refuses(status, values, reasons, message):
    with pytest.raises(ValueError, match=message):
        table(status, values, reasons)


def test_completed_keeps_rows_together():
    design = Design(SPACE, [[-1.0], [0.0], [1.0]], "mine", [[1.0], [-1.0], [1.0]])
    done = Runs(design, RESPONSES, np.arange(6.0).reshape(3, 2), (CRASHED, OK, OK), ("why", "", "")).completed()
    assert_array_equal(done.design.coded, [[0.0], [1.0]])
    assert_array_equal(done.design.dummies, [[-1.0], [1.0]])
    assert_array_equal(done.values, [[2, 3], [4, 5]])
    assert done.status == (OK, OK)
    assert done.reasons == ("", "")
    assert done.responses == RESPONSES


def test_completed_may_be_empty():
    done = table([CRASHED, Status.TIMED_OUT]).completed()
    assert len(done) == 0
    assert done.values.shape == (0, 2)
    assert done.failures() == ""


def test_failures_say_run_status_and_reason():
    assert table([OK, OK]).failures() == ""
    assert table([OK, Status.TIMED_OUT]).failures() == "1 of 2 runs failed: run 2: timed_out (reason 2)"


def test_failures_name_at_most_five():
    assert "more" not in table([CRASHED] * 5).failures()
    sentence = table([CRASHED] * 7).failures()
    assert sentence.startswith("7 of 7 runs failed: run 1: crashed (reason 1); run 2: ")
    assert sentence.endswith("run 5: crashed (reason 5); and 2 more")

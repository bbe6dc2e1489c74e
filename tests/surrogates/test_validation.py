"""Validation errors against numbers worked by hand."""

import math

import numpy as np
import pytest

from experiments import Response, Runs, Status
from experiments.designs import Design
from surrogates import errors
from surrogates.validation import compare
from tests.surrogates.cases import surrogate, unit_box

DISPLACEMENT, ANGLE = Response("x", "m"), Response("theta", "rad")


def test_errors_by_hand():
    # Errors of x: 0, -2, +1, 0 on a range 0 … 10; of theta: 0.5, 0, 0, 0 on a range −1 … 1.
    truth = [[0.0, -1.0], [10.0, 0.0], [4.0, 1.0], [6.0, 0.5]]
    predicted = [[0.0, -0.5], [8.0, 0.0], [5.0, 1.0], [6.0, 0.5]]
    x, theta = compare((DISPLACEMENT, ANGLE), truth, predicted)
    assert (x.response, x.n_runs, x.max_abs, x.range, x.max_relative, x.worst_run) == ("x", 4, 2.0, 10.0, 0.2, 1)
    assert x.rmse == pytest.approx(math.sqrt(5.0 / 4.0), rel=1e-15)
    assert (theta.response, theta.max_abs, theta.range, theta.max_relative) == ("theta", 0.5, 2.0, 0.25)
    assert theta.rmse == pytest.approx(0.25, rel=1e-15)
    assert theta.worst_run == 0


def test_a_constant_response_is_measured_by_its_size():
    exact, off = compare((DISPLACEMENT, ANGLE), [[3.0, -4.0]] * 2, [[3.0, -4.0], [3.0, -3.5]])
    assert (exact.range, exact.max_relative) == (0.0, 0.0)
    assert (off.range, off.max_relative) == (0.0, 0.125)
    assert off.worst_run == 1


def test_an_error_on_a_response_that_is_always_zero_is_infinite():
    exact, off = compare((DISPLACEMENT, ANGLE), [[0.0, 0.0]] * 2, [[0.0, 0.0], [0.0, 1e-9]])
    assert (exact.max_relative, off.max_relative) == (0.0, math.inf)


def test_a_run_the_model_predicts_as_nan_is_not_hidden():
    (error,) = compare((DISPLACEMENT,), [[1.0], [2.0]], [[1.0], [np.nan]])
    assert math.isnan(error.max_abs)
    assert math.isnan(error.rmse)
    assert error.worst_run == 1


def test_failed_runs_are_skipped():
    model = surrogate(unit_box(1), ["1", "f0"], [[1.0, 2.0]])
    design = Design(model.factors, np.array([[-1.0], [0.0], [0.5], [1.0]]), "given")
    values = np.array([[-1.0], [np.nan], [2.25], [3.0]])  # the model is exact but for 0.25 at 0.5
    status = (Status.OK, Status.CRASHED, Status.OK, Status.OK)
    (error,) = errors(model, Runs(design, model.responses, values, status, ("", "segfault", "", "")))
    assert (error.n_runs, error.max_abs, error.range, error.max_relative) == (3, 0.25, 4.0, 0.0625)
    assert error.worst_run == 1  # counted among the completed runs
    assert error.rmse == pytest.approx(0.25 / math.sqrt(3.0))


def test_settings_are_taken_in_physical_units():
    from tests.surrogates.cases import box

    model = surrogate(box(("force", 10.0, 30.0)), ["1", "force"], [[5.0, 2.0]])
    design = Design.from_physical(model.factors, [[10.0], [25.0]])
    runs = Runs(design, model.responses, np.array([[3.0], [6.0]]), (Status.OK,) * 2, ("",) * 2)
    (error,) = errors(model, runs)
    assert error.max_abs == pytest.approx(0.0, abs=1e-15)


def test_no_completed_run_is_an_error():
    model = surrogate(unit_box(1), ["1", "f0"], [[1.0, 2.0]])
    design = Design(model.factors, np.array([[0.5]]), "given")
    runs = Runs(design, model.responses, np.array([[np.nan]]), (Status.TIMED_OUT,), ("60 s",))
    with pytest.raises(ValueError, match="validation needs at least one run"):
        errors(model, runs)


@pytest.mark.parametrize(
    ("truth", "predicted"),
    [([[1.0]], [[1.0, 2.0]]), ([1.0, 2.0], [1.0, 2.0]), ([[1.0]], [[1.0], [2.0]]), ([[1, 2]], [[1, 2]])],
)
def test_shapes_that_disagree_are_an_error(truth, predicted):
    with pytest.raises(ValueError, match="must have one column per response"):
        compare((DISPLACEMENT,), truth, predicted)

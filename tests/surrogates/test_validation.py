"""Validation errors against numbers worked by hand."""

import math

import numpy as np
import pytest

from experiments import Response, Runs, Status
from experiments.designs import Design
from surrogates import errors
from surrogates.validation import compare
from tests.surrogates.cases import box, surrogate, unit_box

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
    # Of x: squares of the errors 5, of the deviations from the mean 5: 25 + 25 + 1 + 1. Of theta: 0.25, and from 0.125:
    # 1.265625 + 0.015625 + 0.765625 + 0.140625.
    assert (x.relative_rmse, theta.relative_rmse) == pytest.approx((math.sqrt(1.25) / 10.0, 0.125), rel=1e-15)
    assert (x.q2, theta.q2) == pytest.approx((1.0 - 5.0 / 52.0, 1.0 - 0.25 / 2.1875), rel=1e-14)
    assert (x.worst_point, x.intervals) == ((), ())


def test_a_constant_response_is_measured_by_its_size():
    exact, off = compare((DISPLACEMENT, ANGLE), [[3.0, -4.0]] * 2, [[3.0, -4.0], [3.0, -3.5]])
    assert (exact.range, exact.max_relative) == (0.0, 0.0)
    assert (off.range, off.max_relative) == (0.0, 0.125)
    assert off.worst_run == 1
    assert (exact.relative_rmse, exact.q2) == (0.0, 1.0)
    # About zero in place of the mean: errors 0 and 0.5 of 4 and 4.
    assert (off.relative_rmse, off.q2) == pytest.approx((math.sqrt(0.125) / 4.0, 1.0 - 0.25 / 32.0), rel=1e-15)


def test_a_response_that_moves_by_rounding_alone_has_no_q2_of_its_rounding():
    truth = 0.1 + np.array([[0.0], [1e-17], [2e-17], [3e-17]])
    truth[0] = np.nextafter(0.1, 1.0)
    (error,) = compare((ANGLE,), truth, np.full((4, 1), 0.1), resolution=1e-12)
    assert error.max_relative < 1e-15
    assert error.q2 == 1.0
    (error,) = compare((ANGLE,), truth, np.full((4, 1), 0.1))  # taken at its word, this is no prediction at all
    assert error.q2 is not None
    assert error.q2 < 0.0


def test_q2_is_zero_for_the_mean_and_below_for_worse():
    truth = np.random.default_rng(0).normal(size=(50, 1))
    mean = np.full_like(truth, truth.mean())
    for predicted, q2 in ((truth, 1.0), (mean, 0.0), (2.0 * mean - truth, -3.0), (0.5 * (truth + mean), 0.75)):
        (error,) = compare((ANGLE,), truth, predicted)
        assert error.q2 == pytest.approx(q2, abs=1e-14)


def test_tiny_and_huge_responses_have_the_q2_of_plain_ones():
    """Squares of 1e-200 are zero in float64."""
    truth = np.random.default_rng(1).normal(size=(50, 1))
    predicted = truth + 0.1
    plain = compare((ANGLE,), truth, predicted)[0].q2
    for scale in (1e-200, 1e150):
        assert compare((ANGLE,), scale * truth, scale * predicted)[0].q2 == pytest.approx(plain, rel=1e-12)


def test_where_the_largest_error_lies():
    settings = [[1.0, 10.0], [2.0, 20.0], [3.0, 30.0]]
    first, last = compare((DISPLACEMENT, ANGLE), [[0.0, 0.0], [1.0, 1.0], [2.0, 2.0]],
                          [[0.5, 0.0], [1.0, 1.0], [2.0, 3.0]], settings=settings)  # fmt: skip
    assert (first.worst_point, last.worst_point) == ((1.0, 10.0), (3.0, 30.0))
    with pytest.raises(ValueError, match=r"settings must have one row for each of 2 runs; got shape \(3, 2\)"):
        compare((DISPLACEMENT,), [[0.0], [1.0]], [[0.0], [1.0]], settings=settings)


def test_an_error_on_a_response_that_is_always_zero_is_infinite():
    exact, off = compare((DISPLACEMENT, ANGLE), [[0.0, 0.0]] * 2, [[0.0, 0.0], [0.0, 1e-9]])
    assert (exact.max_relative, off.max_relative) == (0.0, math.inf)
    assert (exact.relative_rmse, off.relative_rmse) == (0.0, math.inf)
    assert (exact.q2, off.q2) == (1.0, -math.inf)


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
    assert error.worst_point == (0.5,)
    assert error.intervals == ()  # three runs


def test_settings_are_taken_in_physical_units():
    model = surrogate(box(("force", 10.0, 30.0)), ["1", "force"], [[5.0, 2.0]])
    design = Design.from_physical(model.factors, [[10.0], [25.0]])
    runs = Runs(design, model.responses, np.array([[3.0], [6.0]]), (Status.OK,) * 2, ("",) * 2)
    (error,) = errors(model, runs)
    assert error.max_abs == pytest.approx(0.0, abs=1e-15)
    assert error.worst_point in ((10.0,), (25.0,))


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

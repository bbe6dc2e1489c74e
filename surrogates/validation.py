"""Validation: a surrogate's errors on runs it has not seen."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from experiments.runs import Response, Runs

if TYPE_CHECKING:
    from .model import Surrogate


@dataclass(frozen=True)
class ResponseError:
    """Errors of one response over n runs.

    Parameters
    ----------
    response : str
        Its name.
    n_runs : int
        Runs compared.
    max_abs : float
        Largest absolute error (MAXABS, Durango et al. Eq. 2.7), SI.
    range : float
        Largest minus smallest true response over these runs, SI: the denominator of `max_relative`.
    max_relative : float
        ``max_abs / range``, dimensionless. A denominator of the response itself would be
        meaningless near its zero. Where the response does not move, its largest absolute value
        stands in for the range; infinite if that is zero and the error is not.
    rmse : float
        Root mean square error (Eq. 2.8), SI.
    worst_run : int
        Row of the largest error.
    """

    response: str
    n_runs: int
    max_abs: float
    range: float
    max_relative: float
    rmse: float
    worst_run: int


def compare(
    responses: tuple[Response, ...], truth: ArrayLike, predicted: ArrayLike, resolution: float = 0.0
) -> tuple[ResponseError, ...]:
    """Errors of `predicted` against `truth`, both (n_runs, n_responses) in SI, one entry per response.

    A response whose range is below `resolution` times its largest absolute value does not move.

    Raises
    ------
    ValueError
        If there is no run, or the shapes disagree.
    """
    truth, predicted = np.asarray(truth, dtype=np.float64), np.asarray(predicted, dtype=np.float64)
    if truth.shape != predicted.shape or truth.ndim != 2 or truth.shape[1] != len(responses):
        raise ValueError(f"truth {truth.shape} and prediction {predicted.shape} must have one column per response")
    if not len(truth):
        raise ValueError("validation needs at least one run")
    size = np.abs(predicted - truth)
    found = []
    for j, response in enumerate(responses):
        worst = int(np.argmax(size[:, j]))
        spread = float(np.ptp(truth[:, j]))
        largest = float(size[worst, j])
        size_of_truth = float(np.abs(truth[:, j]).max())
        measure = spread if spread > resolution * size_of_truth else size_of_truth
        relative = largest / measure if measure > 0.0 else (0.0 if largest == 0.0 else np.inf)
        rmse = float(np.sqrt(np.mean(size[:, j] ** 2)))
        found.append(ResponseError(response.name, len(truth), largest, spread, float(relative), rmse, worst))
    return tuple(found)


def errors(model: "Surrogate", runs: Runs, resolution: float = 0.0) -> tuple[ResponseError, ...]:
    """Errors of `model` on the runs that have an answer; `worst_run` counts rows of ``runs.completed()``."""
    done = runs.completed()
    return compare(model.responses, done.values, model.predict(done.design.physical), resolution)

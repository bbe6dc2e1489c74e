"""Validation: a surrogate's errors on runs it has not seen."""

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from experiments.runs import Response, Runs

from .intervals import Interval, calibrated

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
    relative_rmse : float, optional
        ``rmse`` over the same denominator; None in models from before it was stored, like the next.
    q2 : float, optional
        Predictivity coefficient Q² = 1 − Σ(error²)/Σ((truth − mean truth)²) over these runs (Marrel, Iooss, Van Dorpe
        & Volkova 2008, Comput. Stat. Data Anal. 52, 4731–4744): 1 is exact, 0 no better than their mean, no bound
        below. Where the response does not move, zero stands in for the mean; −∞ if there the truth is
        zero and the error is not.
    worst_point : tuple of float
        Settings of the run with the largest error, one per factor in its unit; empty if not known.
    intervals : tuple of Interval
        Prediction intervals from the residuals, by level; empty if there are too few runs.
    """

    response: str
    n_runs: int
    max_abs: float
    range: float
    max_relative: float
    rmse: float
    worst_run: int
    relative_rmse: float | None = None
    q2: float | None = None
    worst_point: tuple[float, ...] = ()
    intervals: tuple[Interval, ...] = ()


def compare(
    responses: tuple[Response, ...],
    truth: ArrayLike,
    predicted: ArrayLike,
    resolution: float = 0.0,
    settings: ArrayLike | None = None,
) -> tuple[ResponseError, ...]:
    """Errors of `predicted` against `truth`, both (n_runs, n_responses) in SI, one entry per response.

    A response whose range is below `resolution` times its largest absolute value does not move. `settings`
    (n_runs, n_factors), in the factors' units, say where the largest errors lie.

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
    found = [_compared(r, truth[:, j], predicted[:, j], resolution) for j, r in enumerate(responses)]
    if settings is None:
        return tuple(found)
    points = np.asarray(settings, dtype=np.float64)
    if points.ndim != 2 or len(points) != len(truth):
        raise ValueError(f"settings must have one row for each of {len(truth)} runs; got shape {points.shape}")
    return tuple(replace(e, worst_point=tuple(points[e.worst_run].tolist())) for e in found)


def errors(model: "Surrogate", runs: Runs, resolution: float = 0.0) -> tuple[ResponseError, ...]:
    """Errors of `model` on the runs that have an answer, with prediction intervals where there are runs enough.

    `worst_run` counts rows of ``runs.completed()``. The intervals hold for runs drawn like these, which must not
    have been used in the fit.
    """
    done = runs.completed()
    settings = done.design.physical
    predicted = model.predict(settings)
    found = compare(model.responses, done.values, predicted, resolution, settings)
    return tuple(
        replace(error, intervals=calibrated(residuals))
        for error, residuals in zip(found, (done.values - predicted).T, strict=True)
    )


def _compared(
    response: Response, truth: NDArray[np.float64], predicted: NDArray[np.float64], resolution: float
) -> ResponseError:
    size = np.abs(predicted - truth)
    worst = int(np.argmax(size))
    largest, spread, measure = float(size[worst]), float(np.ptp(truth)), yardstick(truth, resolution)
    moves = spread > resolution * float(np.abs(truth).max())
    rmse = float(np.sqrt(np.mean(size**2)))
    return ResponseError(
        response.name,
        len(truth),
        largest,
        spread,
        ratio(largest, measure),
        rmse,
        worst,
        relative_rmse=ratio(rmse, measure),
        q2=_q2(size, truth - truth.mean() if moves else truth, measure),
    )


def yardstick(truth: NDArray[np.float64], resolution: float = 0.0) -> float:
    """What errors of one response are divided by: its range, or its largest absolute value where it does not move."""
    spread, largest = float(np.ptp(truth)), float(np.abs(truth).max())
    return spread if spread > resolution * largest else largest


def ratio(error: float, measure: float) -> float:
    """Their quotient; infinite, or zero for no error, where the measure is zero."""
    return error / measure if measure > 0.0 else (0.0 if error == 0.0 else np.inf)


def _q2(size: NDArray[np.float64], deviation: NDArray[np.float64], measure: float) -> float:
    """Sums of squares are taken of ratios to `measure`: squares of tiny responses underflow."""
    if not measure > 0.0:
        return 1.0 if not size.any() else -np.inf
    return float(1.0 - np.sum((size / measure) ** 2) / np.sum((deviation / measure) ** 2))

"""The round trip: wanted responses, inverted, and what the oracle answers at the settings found."""

from dataclasses import dataclass

from experiments.runs import Runs

from .inversion import Inversion
from .validation import ResponseError, compare


@dataclass(frozen=True, eq=False)
class RoundTrip:
    """Wanted responses, inverted, and what the oracle answered at the settings found.

    Parameters
    ----------
    targets : Runs
        Validation runs; their responses are the targets, so every one is known to be reachable.
    inversion : Inversion
        One row per target.
    answers : Runs
        The oracle at the settings found; refused targets are left out.
    errors : tuple of ResponseError
        Answers against targets.
    """

    targets: Runs
    inversion: Inversion
    answers: Runs
    errors: tuple[ResponseError, ...]

    @property
    def worst(self) -> float:
        """Largest error of the answers over the response's range, over all responses; NaN if there is no answer."""
        return max((e.max_relative for e in self.errors), default=float("nan"))

    @property
    def n_refused(self) -> int:
        """Targets that the model would not invert."""
        return int((~self.inversion.ok).sum())


def round_trip(targets: Runs, inversion: Inversion, answers: Runs, resolution: float = 0.0) -> RoundTrip:
    """How far the oracle, run at the inverted settings, is from the targets.

    Parameters
    ----------
    targets : Runs
        n_targets completed runs, whose responses were wanted.
    inversion : Inversion
        One row per target.
    answers : Runs
        One run per target that was not refused, in order.
    resolution : float
        See :func:`.compare`.
    """
    wanted, given = targets.values[inversion.ok][answers.ok], answers.completed().values
    found = compare(answers.responses, wanted, given, resolution) if len(given) else ()
    return RoundTrip(targets, inversion, answers, found)

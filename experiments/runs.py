"""Responses, statuses, and the table of runs that an oracle returns."""

from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from .designs.base import Design
from .naming import check_name, check_unit, column_label


class Status(StrEnum):
    """What became of one run; everything but ``OK`` is a failure with a reason beside it."""

    OK = "ok"
    NOT_CONVERGED = "not_converged"
    CRASHED = "crashed"
    TIMED_OUT = "timed_out"
    NON_FINITE = "non_finite"
    REJECTED = "rejected"


@dataclass(frozen=True)
class Response:
    """An output of the oracle.

    Parameters
    ----------
    name : str
        ASCII identifier.
    unit : str
        SI unit of every stored number.
    shown_unit, shown_scale : str, float
        Unit for people and the factor to it: ``shown = stored × shown_scale`` (``"µm"``, 1e6).
    symbol : str
        How reports write it, such as ``"θx"``; the name if empty.

    Raises
    ------
    ValueError
        If the name or a unit is not allowed, or the scale is not a positive number.
    """

    name: str
    unit: str
    shown_unit: str = ""
    shown_scale: float = 1.0
    symbol: str = ""

    def __post_init__(self) -> None:
        check_name("response", self.name)
        check_unit(self.name, self.unit)
        object.__setattr__(self, "shown_unit", self.shown_unit or self.unit)
        object.__setattr__(self, "symbol", self.symbol or self.name)
        check_unit(self.name, self.shown_unit)
        if not (np.isfinite(self.shown_scale) and self.shown_scale > 0):
            raise ValueError(f"response {self.name!r}: shown_scale must be positive, got {self.shown_scale}")

    @property
    def label(self) -> str:
        """Column label, ``name[unit]``."""
        return column_label(self.name, self.unit)


@dataclass(frozen=True, eq=False)
class Runs:
    """A design and what the oracle answered.

    Parameters
    ----------
    design : Design
        n_runs settings.
    responses : tuple of Response
        Length n_responses.
    values : ndarray, shape (n_runs, n_responses)
        Answers in SI units; NaN where the status is not ``OK``.
    status : tuple of Status
        Length n_runs.
    reasons : tuple of str
        Length n_runs; empty where the status is ``OK``.

    Raises
    ------
    ValueError
        If the lengths disagree, or a run called ``OK`` has a value that is not finite.
    """

    design: Design
    responses: tuple[Response, ...]
    values: NDArray[np.float64]
    status: tuple[Status, ...]
    reasons: tuple[str, ...]

    def __post_init__(self) -> None:
        values = np.array(self.values, dtype=np.float64)
        expected = (len(self.design), len(self.responses))
        if values.shape != expected:
            raise ValueError(f"values must have shape {expected} (runs, responses); got {values.shape}")
        if not len(self.status) == len(self.reasons) == expected[0]:
            raise ValueError(f"need one status and one reason for each of {expected[0]} runs")
        if len({r.name for r in self.responses}) < len(self.responses):
            raise ValueError(f"response names must differ; got {', '.join(r.name for r in self.responses)}")
        object.__setattr__(self, "status", tuple(Status(s) for s in self.status))
        ok = self.ok
        if not np.isfinite(values[ok]).all():
            raise ValueError("a run with status 'ok' has a response that is not finite")
        values[~ok] = np.nan
        values.setflags(write=False)
        object.__setattr__(self, "values", values)

    def __len__(self) -> int:
        return len(self.design)

    @property
    def ok(self) -> NDArray[np.bool_]:
        """Which runs have an answer, shape (n_runs,)."""
        return np.array([s is Status.OK for s in self.status], dtype=bool)

    def completed(self) -> "Runs":
        """Only the runs that have an answer."""
        keep = np.flatnonzero(self.ok)
        return Runs(
            self.design.take(keep),
            self.responses,
            self.values[keep],
            tuple(self.status[i] for i in keep),
            tuple(self.reasons[i] for i in keep),
        )

    def failures(self) -> str:
        """The failed runs in one sentence, at most five named; empty if there are none."""
        failed = np.flatnonzero(~self.ok)
        if not failed.size:
            return ""
        named = "; ".join(f"run {i + 1}: {self.status[i]} ({self.reasons[i]})" for i in failed[:5])
        more = f"; and {failed.size - 5} more" if failed.size > 5 else ""
        return f"{failed.size} of {len(self)} runs failed: {named}{more}"

"""Rounds of a study that grows until its requirement holds: the record, its file, and what it says at the end."""

import csv
import io
from collections.abc import Sequence
from dataclasses import astuple, dataclass

import numpy as np

from surrogates.learning_curve import runs_for

from .errors import InputError
from .reading import Table

MET = "requirement met"
TERMS = "wider choice of terms"
RUNS = "more runs"
BUDGET = "all of require.max_runs used"
STALLED = "more runs no longer help"
UNTRUE = "fresh runs do not bear out what leaving out tells"

HEADER = (
    "round", "step", "runs", "degree", "selection", "loo_rmse_relative_to_range", "expected_max_relative_to_range",
    "max_relative_to_range", "then",
)  # fmt: skip


@dataclass(frozen=True)
class Round:
    """One fit on the way.

    Parameters
    ----------
    number : int
        0 is the study as configured.
    step : str
        What made it another than the round before.
    runs : int
        Runs in the filling design, failed ones included.
    degree : int
        Of the model.
    selection : str
        How its terms were chosen.
    loo : float
        Leave-one-out RMSE over the range of the runs, of the response where it is largest.
    expected : float or None
        Largest error over the range that this lets one expect on fresh runs; None before any were looked at.
    error : float or None
        Largest error over the range on fresh runs, of all responses; None if none were looked at.
    then : str
        What followed, or why nothing did.
    """

    number: int
    step: str
    runs: int
    degree: int
    selection: str
    loo: float
    expected: float | None
    error: float | None
    then: str


def rounds_csv(rounds: Sequence[Round]) -> str:
    """One row per round; a cell is empty where a number is not known."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(HEADER)
    writer.writerows(["" if cell is None else cell for cell in astuple(one)] for one in rounds)
    return text.getvalue()


def read_rounds(text: str, origin: str) -> tuple[Round, ...]:
    """What :func:`rounds_csv` wrote.

    Raises
    ------
    InputError
        If a column is missing, a cell is no number, or there is no round.
    """
    table = Table.parse(text, origin)
    counts = table.numbers([HEADER[0], *HEADER[2:4]])
    known = [[None if not cell else _number(cell, origin) for cell in table.column(name)] for name in HEADER[5:8]]
    words = [table.column(name) for name in ("step", "selection", "then")]
    rounds = tuple(
        Round(int(i), step, int(runs), int(degree), selection, np.inf if loo is None else loo, expected, error, then)
        for (i, runs, degree), step, selection, then, loo, expected, error in zip(counts, *words, *known, strict=True)
    )
    if not rounds:
        raise InputError(f"{origin} has no rounds: run the study again")
    return rounds


def ending(rounds: Sequence[Round], most: int, required: float, highest: int) -> str:
    """How far a study came that does not meet its requirement, and what may help: for brackets.

    Parameters
    ----------
    rounds : sequence of Round
    most : int
        ``require.max_runs``.
    required : float
        ``require.max_relative_error``.
    highest : int
        The highest degree that was tried. The error of a model of that degree levels off when its terms are known.
    """
    last = rounds[-1]
    used = f"{last.runs} of at most {most} runs used"
    if last.then == UNTRUE:
        return f"{used}; leaving runs out shows far smaller errors: factors not kept may act, see screening.keep"
    at_the_top = last.degree >= highest
    higher = f"fit.highest_degree = {highest} is reached: a higher one or narrower ranges may help"
    if last.then == STALLED:
        return f"{used}; more no longer helped: " + (higher if at_the_top else "narrower ranges may")
    used = f"all {most} runs of require.max_runs are used"
    if at_the_top:
        return f"{used}; {higher}"
    enough = runs_needed(rounds, required)
    return f"{used}; " + (f"about {enough} would do if the error goes on falling so" if enough else "more may help")


def runs_needed(rounds: Sequence[Round], required: float) -> int | None:
    """About how many runs would do, see :func:`.runs_for`; None where the rounds do not tell."""
    by_size = {one.runs: one.loo for one in rounds}
    if rounds[-1].error is None:
        return None
    return runs_for(list(by_size), list(by_size.values()), rounds[-1].error, required)


def _number(cell: str, origin: str) -> float:
    try:
        return float(cell)
    except ValueError:
        raise InputError(f"{origin} is damaged: {cell[:40]!r} is not a number; run the study again") from None

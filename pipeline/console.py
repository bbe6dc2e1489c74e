"""What a person sees in a terminal: progress bars, tables, the summary at the end."""

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Protocol

import numpy as np
from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, MofNCompleteColumn, Progress, SpinnerColumn, TaskID, TextColumn, TimeElapsedColumn
from rich.table import Table

from experiments.designs import Design
from surrogates.exports.verification import Finding
from surrogates.exports.verification import Outcome as Verified

from .errors import one_line
from .executors import Progress as Told
from .runner import Outcome
from .tally import Tally, failures

console = Console(highlight=False)
_errors = Console(stderr=True, highlight=False)


LINE_EVERY = 30.0
"""Seconds between two lines of a stage, where there is no terminal."""


@contextmanager
def progress_bars() -> Iterator[Told]:
    """One bar per stage on standard error, with failures, rate and time left; plain lines where that is no terminal."""
    if not _errors.is_terminal:
        yield _Lines()
        return
    columns = (SpinnerColumn(finished_text="✓"), TextColumn("{task.description:<12}"), BarColumn(bar_width=32),
               MofNCompleteColumn(), TimeElapsedColumn(), TextColumn("{task.fields[pace]}", markup=False))  # fmt: skip
    with Progress(*columns, console=_errors) as bars:
        yield _Bars(bars)


class _Bars:
    """A bar per stage."""

    def __init__(self, bars: Progress) -> None:
        self._bars = bars
        self._tasks: dict[str, TaskID] = {}

    def __call__(self, stage: str, done: int, total: int) -> None:
        self.tally(Tally(stage, done, total))

    def tally(self, tally: Tally) -> None:
        stage, total = tally.stage, tally.total or None
        if stage not in self._tasks:
            self._tasks[stage] = self._bars.add_task(stage, total=total, pace="")
        self._bars.update(self._tasks[stage], completed=tally.done, total=total, pace=tally.pace)


class _Lines:
    """One line per finished stage and, in a long one, every half minute; says how many runs were known from before."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock, self._last = clock, clock()

    def __call__(self, stage: str, done: int, total: int) -> None:
        self.tally(Tally(stage, done, total))

    def tally(self, tally: Tally) -> None:
        now = self._clock()
        if tally.total and tally.done == tally.total:
            already = f" ({tally.known} known from before)" if tally.known else ""
            failed = f", {failures(tally.failed)}" if tally.n_failed else ""
            one = (
                f"{tally.stage}: {tally.total} runs done{already}{failed}"
                if tally.total > 1
                else f"{tally.stage}: done"
            )
            _errors.print(one, markup=False, soft_wrap=True)
        elif tally.total and now - self._last >= LINE_EVERY:
            pace = f", {tally.pace}" if tally.pace else ""
            _errors.print(f"{tally.stage}: {tally.done} of {tally.total} runs{pace}", markup=False, soft_wrap=True)
        else:
            return
        self._last = now


class Lined(Protocol):
    """What says in lines where something is."""

    def lines(self) -> list[str]:
        """A line each."""
        ...


def print_status(found: Lined, again: bool = False) -> None:
    """Where a run is; `again` clears a terminal first, and puts a line between two texts elsewhere."""
    if again and console.is_terminal:
        console.clear()
    elif again:
        console.print()
    for line in found.lines():
        console.print(line, markup=False, soft_wrap=True)


def design_table(design: Design, title: str, most: int = 40) -> None:
    """A design in physical units; the middle is left out if it is long."""
    table = Table(title=title, title_justify="left", header_style="bold", box=SIMPLE_HEAD)
    table.add_column("run", justify="right")
    for label in design.space.labels:
        # A unit in brackets must not be taken for markup.
        table.add_column(label.replace("[", "\\["), justify="right")
    rows = list(enumerate(design.physical, start=1))
    for i, row in rows if len(rows) <= most else rows[: most // 2] + rows[-most // 2 :]:
        table.add_row(str(i), *(f"{v:.6g}" for v in row))
    console.print(table)


def summary(outcome: Outcome) -> None:
    """The model in one table, and where everything is."""
    model, trip = outcome.model, outcome.round_trip
    table = Table(header_style="bold", title_justify="left", title=_title(outcome), box=SIMPLE_HEAD, padding=(0, 1))
    table.add_column("response", no_wrap=True)
    widest = max(len(name) for name in outcome.study.space.names)
    table.add_column("factors that act", overflow="fold", min_width=min(widest, 24))
    for heading in ("terms", "MAXABS", "of range", "round trip"):
        table.add_column(heading, justify="right", no_wrap=True)
    for j, (response, error) in enumerate(zip(model.responses, model.validation, strict=True)):
        scale = response.shown_scale
        loop = f"{trip.errors[j].max_abs * scale:.2e}" if trip and trip.errors else "–"
        table.add_row(
            escape(one_line(f"{response.symbol} [{response.shown_unit}]")),
            " ".join(outcome.screening.active_on(response.name)) or "none",
            str(len(model.terms_of(j))),
            f"{error.max_abs * scale:.2e}",
            f"{100 * error.max_relative:.2g} %",
            loop,
        )
    console.print(table)
    if len(outcome.rounds) > 1:
        _rounds(outcome)
    _gaps(outcome)
    _adequacy(outcome)
    _inverse(outcome)
    seconds = np.sum(list(outcome.seconds.values()))
    console.print(f"Took {seconds:.1f} s.")
    places = {"Report": "report.html", "Model": "model.json"}
    for what, name in places.items():
        console.print(f"{what + ':':<8}[bold]{escape(str(outcome.path / name))}[/bold]", soft_wrap=True)
    for name, told in outcome.exported.items():
        place = escape(str(outcome.path / "exports" / name))
        told = escape(one_line(f" ({told})")) if told else ""
        console.print(f"{'Code:':<8}[bold]{place}[/bold]{told}", soft_wrap=True)


def print_findings(where: str, findings: Sequence[Finding]) -> None:
    """What the checks of one export found, a line each."""
    colours = {Verified.AGREES: "green", Verified.DIFFERS: "bold red", Verified.NOT_CHECKED: "yellow"}
    console.print(f"[bold]{escape(where)}[/bold]", soft_wrap=True)
    for one in findings:
        detail = f"  [dim]{escape(one_line(one.detail))}[/dim]" if one.detail else ""
        colour = colours[one.outcome]
        console.print(f"  [{colour}]{one.outcome:<11}[/] {escape(one.what)}{detail}", soft_wrap=True)


def _rounds(outcome: Outcome) -> None:
    """How the fit grew, one line per round."""
    table = Table(title="How the fit grew", title_justify="left", header_style="bold", box=SIMPLE_HEAD, padding=(0, 1))
    table.add_column("step", overflow="fold")
    for heading in ("runs", "degree", "left out", "expected", "fresh runs"):
        table.add_column(heading, justify="right", no_wrap=True)
    for one in outcome.rounds:
        errors = ["–" if e is None else f"{100 * e:.2g} %" for e in (one.loo, one.expected, one.error)]
        table.add_row(one.step, str(one.runs), str(one.degree), *errors)
    console.print(table)
    console.print(f"It ended there: {outcome.rounds[-1].then}.")


def _gaps(outcome: Outcome) -> None:
    """What was done without runs that failed."""
    holes, unjudged = outcome.screening.holes, outcome.screening.unjudged
    said = [("screening", sentence) for sentence in (holes.sentences() if holes else ())]
    if holes and unjudged and not holes.blind:
        said.append(("screening", f"kept because the missing runs leave open whether they act: {', '.join(unjudged)}"))
    for stage, sentence in [*said, *outcome.gaps.items()]:
        console.print(f"{stage.capitalize()}: {escape(sentence)}.", style="yellow", soft_wrap=True)


def _adequacy(outcome: Outcome) -> None:
    """Whether main effects tell who acts, and what the screening asks for if not."""
    found = outcome.adequacy
    if found.adequate:
        return
    named = ", ".join(r.response for r in found.responses if r.reasons)
    console.print(f"Main effects do not tell the whole story of {named}: {escape(found.advice)}.", style="yellow")
    console.print(f"Kept for the fit: {', '.join(outcome.kept)}.", style="yellow")


def _inverse(outcome: Outcome) -> None:
    certificate, trip = outcome.model.certificate, outcome.round_trip
    if trip is None:
        console.print(f"Inverse: none; {outcome.obstacle}.")
        return
    if certificate:
        console.print(f"Inverse: {certificate.verdict}; {certificate.reason}.")
    answered = len(trip.targets) - trip.n_refused
    apart = f"; there the oracle is within {100 * trip.worst:.2g} % of the range of what was wanted"
    console.print(f"Round trip: {answered} of {len(trip.targets)} responses inverted{apart if trip.errors else ''}.")


def _title(outcome: Outcome) -> str:
    model = outcome.model
    kind = "linear" if model.is_affine_map else f"degree-{model.terms.degrees.max()}"
    return f"{outcome.study.config.name}: {kind} model, {model.validation[0].n_runs} fresh runs"

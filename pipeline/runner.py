"""The runner: takes a study through its stages and writes each noun down as soon as it is known."""

import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from pathlib import Path

from experiments.designs import Design, Random
from experiments.runs import Runs, Status
from experiments.screening import Adequacy, Screening
from surrogates import RoundTrip, Surrogate, dumps, loads, obstacle
from surrogates.comparison import Comparison
from surrogates.exports.verification import Outcome as Verified

from . import executors, exporting, stages, tables
from .config import load_config
from .errors import FlexdoceError, InputError
from .executors import Executor, Progress, execute, silent
from .growth import Grown, grow, wider
from .monitor import Monitor
from .oracle_file import noted
from .points import PointStore
from .provenance import provenance_json, read_provenance
from .reading import Table, read_runs
from .resolving import ready, resolve, restored
from .rounds import Round, read_rounds, rounds_csv
from .sections import FitTable
from .stages import Fitted
from .store import WORK, RunFolder
from .study import STAGES, Study

ROUNDS = "fit/rounds.csv"


COMMAND = "command.json"
"""The square model of a study that commands some responses, others and some factors being given."""


@dataclass(frozen=True, eq=False)
class Outcome:
    """A finished study: every noun, and where they lie.

    Parameters
    ----------
    path : Path
        The run folder.
    study : Study
    screening_runs, fit_runs, validation_runs : Runs
    screening : Screening
    kept : tuple of str
        Factors that the model was fitted on.
    model : Surrogate
    round_trip : RoundTrip or None
        None if the inversion was left out, for the reason in `obstacle`.
    shortfalls : tuple of str
        Declared requirements that do not hold.
    seconds : dict
        Wall time by stage; empty for a folder that was read back.
    rounds : tuple of Round
        How the fit came about; more than one only where the config has runs to add.
    commanded : Surrogate or None
        The square model that the config asks for, if it does.
    """

    path: Path
    study: Study
    screening_runs: Runs
    screening: Screening
    kept: tuple[str, ...]
    fit_runs: Runs
    model: Surrogate
    validation_runs: Runs
    round_trip: RoundTrip | None
    shortfalls: tuple[str, ...]
    seconds: dict[str, float] = field(default_factory=dict)
    rounds: tuple[Round, ...] = ()
    commanded: Surrogate | None = None
    exported: dict[str, str] = field(default_factory=dict)

    @property
    def adequacy(self) -> Adequacy:
        """Whether main effects tell who acts."""
        return stages.adequacy(self.study, self.screening)

    @property
    def gaps(self) -> dict[str, str]:
        """By stage after the screening, what was done without runs that failed; a stage without failures has none."""
        runs = {"fit": self.fit_runs, "validation": self.validation_runs}
        if self.round_trip is not None:
            runs["inversion"] = self.round_trip.answers
        return {stage: said for stage, one in runs.items() if (said := stages.gap(stage, one))}

    @property
    def fit(self) -> FitTable:
        """How the model was fitted: as configured, or more widely where the fit grew."""
        fit, origin = self.study.config.fit, self.model.provenance
        used = origin.get("fit_degree", fit.degree), origin.get("fit_selection", fit.selection)
        return fit if used == (fit.degree, fit.selection) else wider(fit)

    @property
    def comparisons(self) -> dict[str, Comparison]:
        """Models of other studies beside this one's, by the names that the config gives them."""
        return stages.comparisons(self.study, self.model, self.validation_runs)

    @property
    def obstacle(self) -> str:
        """Why the inversion was left out; empty if it was not."""
        return obstacle(self.model)


def run(
    config: str | Path,
    out: str | Path | None = None,
    overrides: Sequence[str] = (),
    fresh: bool = False,
    progress: Progress = silent,
    cache: str | Path | None = None,
    retry: Sequence[Status] = (),
) -> Outcome:
    """Run or continue the study in a config file.

    Parameters
    ----------
    config : path
    out : path, optional
        Run folder; ``runs/<name>`` if not given.
    overrides : sequence of str
        ``dotted.key=value`` settings that replace the file's.
    fresh : bool
        Start anew in a folder that belongs to a study already.
    progress : callable
        Told the stage, the runs done and the runs in all.
    cache : path, optional
        Folder of points that studies share: what is there is not run again, what is run is added.
    retry : collection of Status
        Failures of earlier runs that are tried again; without it they are answers like others.

    Raises
    ------
    InputError
        If the config, the folder or a store is wrong, or another run is at work there; nothing is touched then.
    TooManyFailures
        If more runs failed than the config tolerates.
    OSError
        If the disk refuses on the way; what is stored is kept.

    Notes
    -----
    A declared requirement that does not hold is no error here: it is in the outcome's ``shortfalls``.
    """
    study = resolve(load_config(config, overrides))
    place = Path(out) if out is not None else Path("runs") / study.config.name
    study = ready(study, place / WORK)
    folder = RunFolder.claim(place, study.config, fresh)
    shared = Path(cache) if cache is not None else None
    with (
        folder,
        folder.points(study.oracle, shared, retry) as points,
        Monitor(folder, study.config.name, progress) as monitor,
        executors.make(study.config, study.oracle, monitor.note) as executor,
    ):
        points.warn = monitor.note
        for sentence in filter(None, (folder.taken_over, *noted(folder, study.oracle, study.code), points.strangers())):
            monitor.note(sentence)
        return _Runner(study, folder, points, monitor, executor).run()


class _Runner:
    """One pass through the stages."""

    def __init__(
        self, study: Study, folder: RunFolder, points: PointStore, monitor: Monitor, executor: Executor
    ) -> None:
        self.study, self.folder, self.points, self.monitor, self.executor = study, folder, points, monitor, executor
        self.seconds: dict[str, float] = {}
        self.fit_runs: Runs | None = None
        self.is_again = study.config.require.max_runs is not None and (folder.path / "model.json").is_file()

    def run(self) -> Outcome:
        study, folder, started = self.study, self.folder, datetime.now(UTC)
        with self._timed("screening"):
            screening_runs = self._executed("screening", study.screening_design)
            screening = stages.screened(study, screening_runs)
            if folded := stages.following(study, screening):
                screening_runs = self._executed("screening", folded)
                screening = stages.screened(study, screening_runs)
            folder.write("screening/effects.csv", tables.effects_csv(screening))
            for sentence in screening.holes.sentences() if screening.holes else ():
                self.monitor.note(f"screening: {sentence}")
            kept = stages.kept_factors(study, screening)
        with self._timed("fill design"):
            fill = stages.fill_design(study, kept)
        grown = self._grown(kept, fill)
        fit_runs, model, validation_runs = grown.fit_runs, grown.model, grown.validation_runs
        trip = None
        if obstacle(model):
            folder.discard("inversion")
        else:
            with self._timed("inversion"):
                trip = self._round_trip(model, validation_runs)
        with self._timed("export"):
            folder.write("model.json", dumps(model))
            commanded = self._commanded(model)
            exported, differing = self._export()
        outcome = Outcome(
            folder.path, study, screening_runs, screening, kept, fit_runs, model, validation_runs, trip,
            (*stages.shortfalls(study, model, grown.rounds), *differing), self.seconds, grown.rounds, commanded,
            exported,
        )  # fmt: skip
        for stage, sentence in outcome.gaps.items():
            self.monitor.note(f"{stage}: {sentence}")
        folder.write("provenance.json", provenance_json(started, datetime.now(UTC), self.seconds))
        with self._timed("report"):
            write_report(folder, outcome)
        folder.write("provenance.json", provenance_json(started, datetime.now(UTC), self.seconds))
        return outcome

    def _executed(self, stage: str, design: Design) -> Runs:
        self.folder.write(f"{stage}/design.csv", tables.design_csv(design))
        runs = self._answered(stage, design)
        self._write_runs(stage, runs)
        return runs

    def _answered(self, stage: str, design: Design) -> Runs:
        return execute(self.study.oracle, design, self.points, stage, self.monitor.tally, self.executor)

    def _write_runs(self, stage: str, runs: Runs) -> None:
        self.folder.write(f"{stage}/design.csv", tables.design_csv(runs.design))
        self.folder.write(f"{stage}/runs.csv", tables.runs_csv(runs))

    def _grown(self, kept: tuple[str, ...], fill: Design) -> Grown:
        """The fit and its validation; more of them, if the config has runs to add."""
        study, folder = self.study, self.folder
        grown = grow(study, kept, fill, self)
        with self._timed("validation"):
            table = tables.errors_csv(grown.model.validation, grown.model.responses, study.space)
            if self.is_again:
                self._write_runs("fit", grown.fit_runs)
                self._write_runs("validation", grown.validation_runs)
                folder.write(ROUNDS, rounds_csv(grown.rounds))
            folder.write("validation/errors.csv", table)
            for name, found in stages.comparisons(study, grown.model, grown.validation_runs).items():
                folder.write(f"validation/compare_{name}.csv", tables.comparison_csv(found))
        with self._timed("fit"):
            model = stages.certified(study, kept, grown.model, grown.fitted.fit)
        return replace(grown, model=model)

    def fit(self, kept: tuple[str, ...], design: Design, choices: Sequence[FitTable]) -> tuple[Runs, Fitted]:
        """For `grow`: run `design`, and fit it in the best of the ways."""
        with self._timed("fit"):
            if self.fit_runs is None or self.fit_runs.design is not design:
                self.fit_runs = self._tried("fit", design)
            return self.fit_runs, stages.fitted(self.study, kept, self.fit_runs, choices)

    def judge(self, model: Surrogate, look: int) -> tuple[Surrogate, Runs]:
        """For `grow`: the model with its errors on fresh runs, and those runs."""
        with self._timed("validation"):
            runs = self._tried("validation", stages.validation_design(self.study, look))
            return stages.validated(self.study, model, runs), runs

    def note(self, rounds: Sequence[Round]) -> None:
        """For `grow`: keep the rounds so far."""
        if not self.is_again:
            self.folder.write(ROUNDS, rounds_csv(rounds))

    def _tried(self, stage: str, design: Design) -> Runs:
        """As `_executed`, but the files of a finished study stay as they are until its last round is there again."""
        if not self.is_again:
            return self._executed(stage, design)
        return self._answered(stage, design)

    def _round_trip(self, model: Surrogate, validation_runs: Runs) -> RoundTrip:
        targets, inversion, design = stages.inversion_design(model, validation_runs)
        table = tables.inversion_csv(targets.values, inversion, model.factors, model.responses)
        self.folder.write("inversion/targets.csv", table)
        trip = stages.confirmed(self.study, targets, inversion, self._executed("inversion", design))
        if trip.errors:
            self.folder.write("inversion/errors.csv", tables.errors_csv(trip.errors, model.responses))
        return trip

    def _commanded(self, model: Surrogate) -> Surrogate | None:
        """The square model that the config asks for, in a file of its own."""
        square = stages.commanded(self.study, model)
        if square is None:
            self.folder.discard(COMMAND)
        else:
            self.folder.write(COMMAND, dumps(square))
        return square

    def _export(self) -> tuple[dict[str, str], list[str]]:
        """Generate every target from ``model.json`` as it lies in the folder; what the checks say, and what differs."""
        text, told, differing = self.folder.read("model.json"), {}, []
        for name in dict.fromkeys(self.study.config.export.targets):
            place = self.folder.inside(f"exports/{name}")
            files, notes = exporting.generate(text, name, self.study.export_prefix, {})
            exporting.write(place, files, force=True)
            if self.study.config.export.verify:
                wrong = [f for f in exporting.verified(place) if f.outcome is Verified.DIFFERS]
                differing += [f"the export {name} is not what the model says ({f.what}: {f.detail})" for f in wrong[:1]]
            told[name] = "; ".join([*filter(None, [exporting.told(place)]), *notes])
        return told, differing

    @contextmanager
    def _timed(self, stage: str) -> Iterator[None]:
        if stage not in STAGES:
            self.monitor.step(stage, done=False)
        begin = time.perf_counter()
        yield
        self.seconds[stage] = self.seconds.get(stage, 0.0) + time.perf_counter() - begin
        if stage not in STAGES:
            self.monitor.step(stage, done=True)


def read_run(path: str | Path, load: bool = False) -> Outcome:
    """A finished run folder, read back for a report or a notebook; runs nothing.

    Parameters
    ----------
    path : path
    load : bool
        Whether an oracle in a file is loaded, which runs that file. Without it the study has an oracle that tells what
        the run noted of it, but cannot be asked or drawn. Others are there in any case.

    Raises
    ------
    InputError
        If the folder is no run folder, a file of it is missing or damaged, or code that is to be loaded is gone or has
        changed.
    """
    folder, config = RunFolder.existing(Path(path))
    study = restored(config, folder.path, load)
    model = _read_model(folder, study)
    is_inverted = not obstacle(model)
    runs = {stage: _read_stage(folder, study, stage) for stage in STAGES if stage != "inversion" or is_inverted}
    try:
        screening = stages.screened(study, runs["screening"])
        trip = _read_round_trip(study, model, runs["validation"], runs["inversion"]) if is_inverted else None
        kept = stages.kept_factors(study, screening)
    except (ValueError, FlexdoceError) as error:
        raise InputError(f"the run folder {folder.path} is damaged: {error}; run the study again") from None
    grows = study.config.require.max_runs is not None
    rounds = read_rounds(folder.read(ROUNDS), str(folder.path / ROUNDS)) if grows else ()
    return Outcome(
        folder.path, study, runs["screening"], screening, kept, runs["fit"], model, runs["validation"], trip,
        tuple(stages.shortfalls(study, model, rounds)), rounds=rounds,
        commanded=stages.commanded(study, model),
        exported={name: exporting.told(folder.path / "exports" / name) for name in config.export.targets},
    )  # fmt: skip


def write_report(folder: RunFolder, outcome: Outcome) -> Path:
    """Write ``report.html`` of a finished study; ``InputError`` if ``provenance.json`` is damaged."""
    from .report import report_html  # matplotlib and jinja2 are not needed before this

    return folder.write("report.html", report_html(outcome, read_provenance(folder.read("provenance.json"))))


def _read_model(folder: RunFolder, study: Study) -> Surrogate:
    where = folder.path / "model.json"
    try:
        model = loads(folder.read("model.json"))
    except ValueError as error:
        raise InputError(f"{where}: {error}") from None
    if model.factors != study.space or model.responses != study.oracle.responses or not model.validation:
        raise InputError(f"{where} is not the model of this study: run the study again")
    return model


def _read_round_trip(study: Study, model: Surrogate, validation_runs: Runs, answers: Runs) -> RoundTrip:
    targets, inversion, design = stages.inversion_design(model, validation_runs)
    if len(design) != len(answers):
        raise ValueError("its inversion does not belong to its validation")
    return stages.confirmed(study, targets, inversion, answers)


def _read_stage(folder: RunFolder, study: Study, stage: str) -> Runs:
    method = {
        "screening": study.config.screening.design.method,
        "fit": study.config.fit.design.method,
        "validation": Random.method,
        "inversion": stages.INVERSE,
    }[stage]
    design, runs = (
        Table.parse(folder.read(f"{stage}/{name}.csv"), str(folder.path / stage / f"{name}.csv"))
        for name in ("design", "runs")
    )
    return read_runs(design, runs, study.space, study.oracle.responses, method)

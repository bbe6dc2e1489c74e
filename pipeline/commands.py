"""What each command does. Each takes the parsed arguments and returns an exit code, or None for 0."""

import sys
import time
from argparse import Namespace
from pathlib import Path
from typing import Any

import numpy as np

from experiments import designs
from experiments.runs import Status
from surrogates import Inversion, Surrogate, exports, load, obstacle
from surrogates.domain import outside_sentence
from surrogates.exports.verification import Finding, Outcome
from surrogates.preimages import Preimages

from . import exporting, listing, tables
from .config import assignments, dump_config, load_config
from .console import console, design_table, print_findings, print_status, progress_bars, summary
from .errors import InputError, RequirementNotMet, TooManyFailures, one_line
from .grid import parse_over
from .oracle_file import code_of, not_loaded
from .points import FAILURES
from .reading import read_points
from .resolving import resolve
from .signals import ended_like_ctrl_c
from .status import Standing, read_status
from .store import RunFolder, SweepFolder
from .sweep_console import Bars, print_plan, sweep_summary
from .sweeping import SweepStanding, planned, read_sweep_status
from .sweeping import sweep as run_sweep

WATCH_EVERY = 2.0
"""Seconds between two looks of ``flexdoce status --watch``."""

MORE_FACTORS = "there are more factors than responses that follow independently, or one acts on none"


def run(arguments: Namespace) -> int | None:
    """``flexdoce run``."""
    from .runner import run as run_study

    _tell_of_sweep(arguments)
    retry = FAILURES if arguments.retry_failed else [Status(kind) for kind in arguments.retry]
    try:
        with ended_like_ctrl_c(), progress_bars() as progress:
            outcome = run_study(
                arguments.config, arguments.out, arguments.overrides, arguments.fresh, progress, arguments.cache, retry
            )
    except TooManyFailures as error:
        raise TooManyFailures(f"{error}; they are kept as answers: --retry-failed runs them again") from None
    summary(outcome)
    if outcome.shortfalls:
        raise RequirementNotMet("required but not met: " + "; ".join(outcome.shortfalls))
    return None


def sweep(arguments: Namespace) -> int | None:
    """``flexdoce sweep``."""
    over = parse_over(arguments.over)
    if arguments.dry_run:
        print_plan(*planned(arguments.config, over, arguments.overrides)[1:])
        return None
    retry = FAILURES if arguments.retry_failed else [Status(kind) for kind in arguments.retry]
    with ended_like_ctrl_c():
        found = run_sweep(
            arguments.config, over, arguments.out, arguments.overrides, arguments.fresh, arguments.cache, retry, Bars()
        )
    sweep_summary(found)
    if found.trouble:
        _warn(found.trouble)
    return found.code


def _tell_of_sweep(arguments: Namespace) -> None:
    """One line where a config has a grid that this command leaves alone."""
    if load_config(arguments.config, arguments.overrides).sweep:
        console.print(
            f"This is the base; [sweep] has a grid: flexdoce sweep {arguments.config}, with --dry-run to see it.",
            markup=False, soft_wrap=True,
        )  # fmt: skip


def check(arguments: Namespace) -> None:
    """``flexdoce check``."""
    config = load_config(arguments.config, arguments.overrides)
    code = code_of(config)
    if code and not arguments.load:
        print(dump_config(config), end="")
        for line in not_loaded(code):
            print(f"# {line}" if line else "")
        return
    study = resolve(config)
    if config.sweep:
        planned(arguments.config, None, arguments.overrides)
    print(dump_config(config), end="")
    if study.oracle.origin:
        print(f"\n# The oracle is from {study.oracle.origin}")
    openly: Any = getattr(study.oracle, "openly", None)
    if openly:  # a program: what would be run, as comments, so that the whole stays a config
        print("\n# Nothing was run. The first point of the screening:")
        for line in openly(study.screening_design.physical[0]):
            print(f"# {line}")


def plan(arguments: Namespace) -> None:
    """``flexdoce plan``."""
    from . import stages

    study = resolve(load_config(arguments.config, arguments.overrides))
    screening, n = study.screening_design, len(study.space)
    design_table(screening, f"Screening: {len(screening)} runs, {screening.method}")
    folded = len(study.folded_screening or screening) - len(screening)
    if folded:
        console.print(f"Foldover, if the screening asks for it: {folded} runs more.")
    fill = stages.fill_design(study, study.space.names)
    terms = study.candidates(n)
    design_table(fill, f"Fit, if all {n} factors act: {len(fill)} runs, {fill.method}, {len(terms)} candidate terms")
    n_validation, looks, most_fit = study.config.validation.n_runs, study.most_looks, len(fill)
    if study.config.require.max_runs is not None:
        most_fit = study.config.require.max_runs
        console.print(
            f"The fit may grow to {most_fit} runs, until require.max_relative_error holds; each time that it may hold "
            f"takes validation runs of its own, up to {looks} times."
        )
    console.print(f"Validation: {n_validation} random runs; inversion: up to {n_validation} more.")
    console.print(f"At most {stages.most_runs(study)} runs in all. Nothing was run.")
    _tell_of_sweep(arguments)


def report(arguments: Namespace) -> None:
    """``flexdoce report``."""
    from .runner import read_run, write_report

    folder, _ = RunFolder.existing(Path(arguments.folder))
    print(write_report(folder, read_run(arguments.folder, arguments.load)))


def status(arguments: Namespace) -> None:
    """``flexdoce status``."""
    path = Path(arguments.folder)
    found = _standing(path)
    print_status(found)
    try:
        while arguments.watch and found.owner:
            time.sleep(WATCH_EVERY)
            found = _standing(path)
            print_status(found, again=True)
    except KeyboardInterrupt:
        pass  # the watching ends, not the run


def _standing(path: Path) -> Standing | SweepStanding:
    if SweepFolder.is_at(path):
        return read_sweep_status(path)
    return read_status(RunFolder.existing(path)[0])


def predict(arguments: Namespace) -> None:
    """``flexdoce predict``."""
    model = _model(arguments.model)
    points = read_points(_text(arguments.table), model.factors, _origin(arguments.table))
    if arguments.outside == "refuse" and (why := outside_sentence(model.factors, points)):
        raise InputError(f"{_origin(arguments.table)}: {why}; with --outside flag they are answered and marked")
    try:
        text = tables.prediction_csv(model, points, arguments.interval)
    except ValueError as error:
        raise InputError(f"{arguments.model}: {error}") from None
    _emit(text, arguments.out)
    outside = int(np.sum(~model.contains(points)))
    if outside:
        _warn(f"{outside} of {len(points)} rows lie outside the model's domain; their status is 'outside'")


def invert(arguments: Namespace) -> None:
    """``flexdoce invert``."""
    model = _model(arguments.model)
    targets = read_points(_text(arguments.table), model.responses, _origin(arguments.table))
    if why := obstacle(model):
        raise InputError(
            f"{arguments.model} has no inverse: {why}; in Python, model.invert(...).nearest_settings come nearest"
        )
    inversion = model.invert(targets)
    if arguments.all:
        found = [model.preimages(target) for target in targets]
        _emit(tables.preimages_csv(targets, inversion, found, model), arguments.out)
        _warn_of_preimages(found)
        return
    _emit(tables.inversion_csv(targets, inversion, model.factors, model.responses), arguments.out)
    _warn_of_inversion(inversion)


def _warn_of_inversion(inversion: Inversion) -> None:
    n = len(inversion.status)
    if several := int((inversion.count > 1).sum()):
        _warn(f"{several} of {n} targets have several preimages; the settings given are one of them, --all lists them")
    if free := int(inversion.continuum.sum()):
        _warn(f"{free} of {n} targets have a continuum of preimages: {MORE_FACTORS}; one is given")
    if refused := int((~inversion.ok).sum()):
        _warn(
            f"{refused} of {n} targets are out of reach and were refused; "
            "the columns nearest_* hold the nearest responses that can be reached"
        )


def _warn_of_preimages(found: list[Preimages]) -> None:
    n = len(found)
    if several := sum(len(one) > 1 for one in found):
        _warn(f"{several} of {n} targets have several preimages, one row each")
    if free := sum(one.continuum for one in found):
        _warn(f"{free} of {n} targets have a continuum of preimages: {MORE_FACTORS}; one is given")
    if doubtful := [one for one in found if not one.complete and not one.continuum]:
        _warn(
            f"{len(doubtful)} of {n} lists of preimages are not proven to be complete; the first: {doubtful[0].reason}"
        )
    if refused := sum(not len(one) for one in found):
        _warn(f"{refused} of {n} targets are out of reach; the columns nearest_* hold responses that can be reached")


def export(arguments: Namespace) -> None:
    """``flexdoce export``: without a model, the list of targets."""
    if arguments.model is None:
        console.print("[bold]flexdoce export MODEL.json --to NAME --out DIR[/bold], NAME one of these, or all:")
        listing.print_known(exports.TARGETS)
        return
    if arguments.to is None or arguments.out is None:
        raise InputError("an export needs --to NAME (flexdoce export lists the names) and --out DIR")
    model = _model(arguments.model)
    names = list(exports.TARGETS) if arguments.to == "all" else list(dict.fromkeys(arguments.to.split(",")))
    for name in names:
        _target(name)
    text = Path(arguments.model).read_text(encoding="utf-8")
    prefix = arguments.prefix or str(model.provenance.get("study", "model"))
    settings = assignments(arguments.overrides)
    if settings and len(names) > 1:
        raise InputError("--set needs a single target: settings belong to one")
    out, refused, differing = Path(arguments.out), [], []
    for name in names:
        try:
            files, notes = exporting.generate(text, name, prefix, settings)
        except InputError as error:
            if len(names) == 1:
                raise
            refused.append(f"{name}: {error}")
            continue
        folder = out if len(names) == 1 else out / name
        for path in exporting.write(folder, files, arguments.force):
            print(path)
        for note in notes:
            _warn(note)
        if arguments.verify:
            differing += _reported(name, exporting.verified(folder))
    if refused:
        raise InputError("not exported: " + "; ".join(refused))
    if differing:
        raise RequirementNotMet("; ".join(differing))


def verify(arguments: Namespace) -> None:
    """``flexdoce verify``."""
    differing = []
    for folder in exporting.folders(Path(arguments.folder)):
        differing += _reported(str(folder), exporting.verified(folder))
    if differing:
        raise RequirementNotMet("; ".join(differing))


def _reported(where: str, findings: list[Finding]) -> list[str]:
    """Print what the checks of one export found; a sentence if it is not what its model says."""
    print_findings(where, findings)
    wrong = [f for f in findings if f.outcome is Outcome.DIFFERS]
    return [f"{where} is not what its model says: {wrong[0].what}: {wrong[0].detail}"] if wrong else []


def _target(name: str) -> None:
    try:
        exports.get(name)
    except ValueError as error:
        raise InputError(str(error)) from None


def list_known(arguments: Namespace) -> None:
    """``flexdoce list``."""
    listing.print_oracles()
    for title, known in (("designs", designs.METHODS), ("exports", exports.TARGETS)):
        console.print(f"\n[bold]{title}[/bold]")
        listing.print_known(known)
    listing.print_parsers()
    console.print("\nFactors and responses of an oracle: flexdoce plan with a config that names it.", style="dim")


def _model(path: str) -> Surrogate:
    try:
        return load(path)
    except ValueError as error:
        raise InputError(str(error)) from None


def _text(path: str) -> str:
    try:
        return sys.stdin.read() if path == "-" else Path(path).read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or "it is not UTF-8 text"
        raise InputError(f"cannot read the table {path}: {reason}") from None


def _origin(path: str) -> str:
    return "standard input" if path == "-" else path


def _emit(text: str, out: str | None) -> None:
    if out is None:
        print(text, end="")
        return
    try:
        Path(out).write_text(text, encoding="utf-8", newline="\n")
    except OSError as error:
        raise InputError(f"cannot write {out}: {error.strerror}") from None


def _warn(sentence: str) -> None:
    print(f"flexdoce: {one_line(sentence)}", file=sys.stderr)

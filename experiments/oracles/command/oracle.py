"""The oracle that runs a program for every point: its own folder, files, one process, and numbers read back."""

import hashlib
import json
import os
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...factors import FactorSpace
from ...runs import Response, Status
from ..base import Answers, Oracle
from . import process
from .checks import STDERR, STDOUT, pattern
from .folder import MOST_READ, Unreadable, WorkFolder
from .parsers import Unparsed, offered
from .process import End
from .settings import FOLDER, PYTHON, Settings, settings_from
from .template import DoesNotFit

LAST_LINES, LONGEST_LINE = 20, 200
"""Lines of output in a reason, and characters of each."""

KIND = "oracle 'command'"

PLACE = "FLEXDOCE_WORK"
"""Environment variable: where working folders are made on this machine, such as a disk of its own."""

_AGAIN = {Status.CRASHED, Status.TIMED_OUT}
_NOT_ANSWERS = ("time_limit", "grace", "retries", "keep", "work_folder", "inherit", "source", "resolution")
"""Settings that change no answer: points that were answered stay good when they change."""


class Verdict(NamedTuple):
    """What became of a point."""

    status: Status
    reason: str = ""
    values: tuple[float, ...] = ()


@dataclass(frozen=True, eq=False)
class CommandOracle(Oracle):
    """Any program as an oracle; ``oracles.get("command", argv=[...], factors={...}, ...)`` makes one of plain data.

    Every point gets a folder of its own, with files made from templates. The program is started there without a shell,
    and ended with all its children at the time limit. Numbers are read from what it leaves.
    Nothing is shared between points, so that they can be answered side by side, in threads or processes.
    Runs on Linux and macOS; children that leave their session are found on Linux only.

    Parameters
    ----------
    settings : Settings
    """

    name: ClassVar[str] = "command"
    summary: ClassVar[str] = "any program: files from templates, an argument list, numbers read from what it leaves"

    settings: Settings = field(metadata={"unit": "", "about": "a table [oracle.command]; see docs/command-oracle.md"})
    _identity: str = field(init=False, repr=False, default="")

    def __post_init__(self) -> None:
        if not isinstance(self.settings, Settings):
            raise ValueError(f"{KIND} is made by oracles.get('command', argv=..., factors=..., responses=...)")
        object.__setattr__(self, "resolution", self.settings.program.resolution)
        object.__setattr__(self, "source", self.settings.program.source or "the program that argv states")
        object.__setattr__(self, "_identity", json.dumps(self.parameters, sort_keys=True))

    @classmethod
    def from_settings(cls, given: Mapping[str, Any]) -> "CommandOracle":
        """Make one of plain data, as in a config's ``[oracle.command]``; ``ValueError`` says what is wrong."""
        return cls(settings_from(KIND, given))

    @property
    def factors(self) -> FactorSpace:
        """As the settings declare them."""
        return self.settings.factors

    @property
    def responses(self) -> tuple[Response, ...]:
        """As the settings declare them."""
        return self.settings.responses

    @property
    def parameters(self) -> dict[str, Any]:
        """What the answers depend on: argv, SHA-256 of every file, environment, and how numbers are read."""
        program = self.settings.program
        ours = {k: v for k, v in vars(program).items() if k not in _NOT_ANSWERS}
        ours |= {"argv": list(program.argv), "exit_codes": list(program.exit_codes)}
        ours |= {"environment": program.environment or {}}
        return {
            **ours,
            "sha256": dict(self.settings.sums),
            "read": {r.response: {**vars(r), "where": r.where or {}} for r in self.settings.readers},
        }

    @property
    def limits(self) -> str:
        """What nobody here knows."""
        return "What the program leaves out is known to those who wrote its input"

    def working_in(self, root: str | Path) -> "CommandOracle":
        """The same oracle with its working folders in `root`, unless its settings name a place already."""
        program = self.settings.program
        if program.work_folder is not None:
            return self
        return replace(
            self, settings=self.settings._replace(program=replace(program, work_folder=str(Path(root).absolute())))
        )

    @property
    def _place(self) -> str | None:
        """Where working folders are made; None for a temporary place."""
        return os.environ.get(PLACE) or self.settings.program.work_folder

    @property
    def missing(self) -> str:
        """Why no point can be run on this machine, with what to do; empty if the program is there."""
        name = sys.executable if self.settings.program.argv[0] == "{{python}}" else self.settings.program.argv[0]
        if process.program([name]):
            return ""
        return f"the program {name!r} was not found on this machine; install it, put it on PATH or mend argv"

    def evaluate(self, points: NDArray[np.float64]) -> Answers:
        """Run the program for every point, shape (n, n_factors), one after the other."""
        values = np.full((len(points), len(self.responses)), np.nan)
        found = [self._answer(tuple(float(v) for v in point)) for point in np.asarray(points, dtype=np.float64)]
        for i, verdict in enumerate(found):
            if verdict.status is Status.OK:
                values[i] = verdict.values
        return Answers(values, [v.status for v in found], [v.reason for v in found])

    def interrupt(self) -> None:
        """End every program that runs in another thread."""
        process.end_all()

    def openly(self, point: Sequence[float]) -> list[str]:
        """What would be run and written at `point`, shape (n_factors,), a line each; nothing is."""
        program, settings = self.settings.program, self.settings
        folder = f"{self._place or '(a temporary place)'}/{self._folder_name(tuple(point))}-1"
        argv = self._argv(point, folder)
        passed = [n for n in (*process.INHERITED, *program.inherit) if n in os.environ]
        lines = [
            f"argv: {json.dumps(argv)}",
            f"program: {json.dumps(process.program(argv)) if process.program(argv) else 'NOT FOUND on this machine'}",
            f"working folder: {json.dumps(folder)}; kept: {program.keep}; time limit: {program.time_limit:g} s",
            f"environment passed on: {', '.join(passed)}; added: {json.dumps(program.environment or {})}",
        ]
        for which, names in (("from a template", settings.templates), ("as it is", settings.files)):
            lines += [f"file {which}: {json.dumps(n)}, SHA-256 {settings.sums[n]}" for n in names]
        known = offered()
        functions = dict.fromkeys(r.function for r in settings.readers if r.function)
        lines += [f"parser function: {name} = {known.get(name, name)}, in this process" for name in functions]
        return lines

    def _folder_name(self, point: tuple[float, ...]) -> str:
        """Hash of the settings and the point."""
        # -0.0 and 0.0 are the same setting.
        text = self._identity + json.dumps([(v + 0.0).hex() for v in point])
        return hashlib.sha256(text.encode()).hexdigest()[:16]

    def _argv(self, point: Sequence[float], folder: str) -> list[str]:
        words = {FOLDER: folder, PYTHON: sys.executable}
        return [template.fill(point, words) for template in self.settings.argv]

    def _answer(self, point: tuple[float, ...]) -> Verdict:
        """The point's answer; of several tries the last."""
        program, verdict = self.settings.program, Verdict(Status.CRASHED)
        for number in range(1, program.retries + 2):
            verdict = self._try(point)
            if verdict.status not in _AGAIN:
                return verdict
            if number > 1:
                verdict = verdict._replace(reason=f"{number} tries failed, the last: {verdict.reason}")
        return verdict

    def _try(self, point: tuple[float, ...]) -> Verdict:
        program = self.settings.program
        try:
            folder = WorkFolder.make(self._place, self._folder_name(point))
        except OSError as error:
            return Verdict(Status.CRASHED, f"no working folder can be made: {error}")
        good = False
        try:
            verdict = self._run(point, folder)
            good = verdict.status is Status.OK
        finally:  # an interrupted run failed, too
            kept = program.keep == "all" or (program.keep == "failed" and not good)
            if not kept:
                folder.remove()
        if kept and not good:
            is_known = self._place is not None and self._place == program.work_folder
            # Without its number: an interrupted try leaves a folder, too, and the reason has to be the same bytes.
            where = f"{self._folder_name(point)}-*" if is_known else folder.path
            verdict = verdict._replace(reason=f"{verdict.reason} (folder {where})")
        return verdict

    def _run(self, point: tuple[float, ...], folder: WorkFolder) -> Verdict:
        program, settings = self.settings.program, self.settings
        try:
            texts = {name: template.fill(point) for name, template in settings.templates.items()}
            argv = self._argv(point, str(folder.path))
        except DoesNotFit as error:
            return Verdict(Status.REJECTED, str(error))
        if self.missing:
            return Verdict(Status.CRASHED, self.missing)
        try:
            for name, text in {**texts, **settings.files}.items():
                folder.write(name, text)
            variables = process.environment(program.environment or {}, program.inherit)
            ended = process.run(
                [process.program(argv) or argv[0], *argv[1:]], folder, variables, program.time_limit, program.grace
            )
        except (OSError, ValueError) as error:
            return Verdict(Status.CRASHED, f"the program could not be started: {error}")
        failure = self._failure(folder, ended)
        return failure if failure else self._read(folder)

    def _failure(self, folder: WorkFolder, ended: process.Ended) -> Verdict | None:
        """Why a run that ended is no answer; None if it may be one."""
        program, said = self.settings.program, _printed(folder)
        if ended.how is End.TIME:
            return Verdict(Status.TIMED_OUT, f"ended at the time limit of {program.time_limit:g} s{_tail(said)}")
        if ended.how is End.PRINTED:
            return Verdict(
                Status.CRASHED, f"it printed more than {process.MOST_PRINTED} bytes and was ended{_tail(said)}"
            )
        for status, wanted in (
            (Status.REJECTED, program.rejected_if),
            (Status.NOT_CONVERGED, program.not_converged_if),
        ):
            if wanted and (match := pattern("", wanted).search(said)):
                return Verdict(status, f"it printed {match.group(0)[:LONGEST_LINE]!r}{_tail(said)}")
        if ended.code not in program.exit_codes:
            how = f"signal {-ended.code}" if ended.code < 0 else f"exit code {ended.code}"
            return Verdict(Status.CRASHED, f"{how}{_tail(said)}")
        return None

    def _read(self, folder: WorkFolder) -> Verdict:
        answers: dict[str, Mapping[str, float]] = {}
        try:
            values = tuple(reader.read(folder, answers) for reader in self.settings.readers)
        except Unparsed as error:
            return Verdict(Status.CRASHED, f"{error}{_tail(_printed(folder))}")
        bad = [r.name for r, value in zip(self.responses, values, strict=True) if not np.isfinite(value)]
        if bad:
            return Verdict(Status.NON_FINITE, f"{', '.join(bad)} not finite{_tail(_printed(folder))}")
        return Verdict(Status.OK, "", values)


def _printed(folder: WorkFolder) -> str:
    """What the program printed: errors last, where they are looked for first."""
    texts = []
    for name in (STDOUT, STDERR):
        try:
            texts.append(folder.read(name))
        except Unreadable:
            texts.append(
                f"[{name} cannot be read: more than {MOST_READ} bytes, or replaced]" if folder.size(name) else ""
            )
    return "\n".join(text for text in texts if text)


def _tail(said: str) -> str:
    """The last lines as half a sentence, in one line that a CSV cell and a terminal can take."""
    lines = [line.strip() for line in said.splitlines() if line.strip()][-LAST_LINES:]
    clean = ["".join(c if c.isprintable() else "?" for c in line[:LONGEST_LINE]) for line in lines]
    return f"; last lines: {' | '.join(clean)}" if clean else "; it printed nothing"

"""Studies of studies: every member of a grid as a run folder of its own, and one comparison of them all."""

from collections.abc import Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pandas as pd

from experiments import oracles, settings
from experiments.runs import Status

from . import stages
from .config import Config, load_config
from .errors import FlexdoceError, InputError, TooManyFailures
from .executors import Progress, silent
from .grid import Axis, Member, axes, members, of_ranges
from .lock import Owner, holder
from .resolving import ready, resolve
from .runner import run
from .status import read_status, stored
from .store import CACHE, PAGE, TABLE, WORK, RunFolder, SweepFolder
from .study import STAGES, Study
from .sweep_rows import Found, Row, frame
from .tables import sweep_csv
from .tally import Tally, Watcher

SHORTFALL = 4
MOST_NAMED = 5
"""Members that the sentence at the end names."""


@dataclass(frozen=True, eq=False)
class Planned:
    """A member that was checked.

    Parameters
    ----------
    member : Member
    overrides : tuple of str
        All that makes it of the config's file.
    study : Study
    most_runs : int
        Runs that it may ask for.
    """

    member: Member
    overrides: tuple[str, ...]
    study: Study
    most_runs: int


@dataclass(frozen=True, eq=False)
class Sweep:
    """A sweep that was run.

    Parameters
    ----------
    path : Path
        Its folder: a run folder for each member by name, ``sweep.toml``, ``sweep.csv``, ``sweep.html``, ``cache``.
    config : Config
        The base, with the whole grid.
    grid : tuple of Axis
    rows : tuple of Row
        In the order of the grid, the last axis fastest.
    units : dict
        Units of swept keys, where they are known.
    """

    path: Path
    config: Config
    grid: tuple[Axis, ...]
    rows: tuple[Row, ...]
    units: dict[str, str] = field(default_factory=dict)

    @property
    def table(self) -> pd.DataFrame:
        """``sweep.csv`` as a frame."""
        return frame(self.rows, self.units)

    @property
    def code(self) -> int:
        """Exit code: the smallest of the members' that is not 0, so that no model (3) outranks a poor one (4)."""
        return min((row.code for row in self.rows if row.code), default=0)

    @property
    def trouble(self) -> str:
        """Which members did not come to a good end, as one sentence; empty if all did."""
        bad = [row for row in self.rows if row.code]
        if not bad:
            return ""
        named = ", ".join(f"{row.member.name} ({row.outcome})" for row in bad[:MOST_NAMED])
        more = f" and {len(bad) - MOST_NAMED} more" if len(bad) > MOST_NAMED else ""
        return f"{len(bad)} of {len(self.rows)} members: {named}{more}; {self.path / TABLE} says why"


class Watch:
    """Who is told how a sweep goes; this one keeps silent."""

    def begin(self, member: Member, number: int, total: int) -> AbstractContextManager[Progress]:
        """A member begins, from 1; gives who is told of its stages."""
        return nullcontext(silent)

    def end(self, row: Row) -> None:
        """A member is done."""


class _Asked:
    """Passes on what a run tells, and counts the runs of the oracle."""

    def __init__(self, progress: Progress) -> None:
        self.progress, self.total, self._last = progress, 0, 0

    def __call__(self, stage: str, done: int, total: int) -> None:
        self.tally(Tally(stage, done, total))

    def tally(self, tally: Tally) -> None:
        fresh = tally.done - tally.known if tally.stage in STAGES else 0
        # A stage that runs the oracle begins with what is known.
        self.total += fresh - self._last if fresh >= self._last else fresh
        self._last = fresh
        if isinstance(self.progress, Watcher):
            self.progress.tally(tally)
        else:
            self.progress(tally.stage, tally.done, tally.total)


def planned(
    config: str | Path, over: Mapping[str, Sequence[Any]] | None = None, overrides: Sequence[str] = ()
) -> tuple[Config, tuple[Axis, ...], tuple[Planned, ...]]:
    """The base with the whole grid, the grid, and every member of it, checked as far as can be without a run.

    Parameters
    ----------
    config : path
    over : mapping of str to sequence, optional
        Values by dotted key; they join those of the config's table ``[sweep]``, or replace them.
    overrides : sequence of str
        ``dotted.key=value`` settings that replace the file's, in all members.

    Raises
    ------
    InputError
        If there is nothing to sweep, or the first member that cannot be run: which, and why.
    """
    base = load_config(config, overrides)
    table = {**(base.sweep or {}), **(over or {})}
    grid = axes(table)
    found = tuple(_planned(config, member, overrides) for member in members(grid))
    listed = {key: list(values) for key, values in table.items()}
    return base.model_copy(update={"sweep": listed}), grid, found


def _planned(config: str | Path, member: Member, overrides: Sequence[str]) -> Planned:
    try:
        chosen = [*overrides, *member.overrides]
        study = resolve(load_config(config, chosen))
        if ranged := member.ranged(study.space):
            chosen += ranged
            study = resolve(load_config(config, chosen))
        return Planned(member, tuple(chosen), study, stages.most_runs(study))
    except InputError as error:
        raise InputError(f"member {member.name}: {error}") from None


def sweep(
    config: str | Path,
    over: Mapping[str, Sequence[Any]] | None = None,
    out: str | Path | None = None,
    overrides: Sequence[str] = (),
    fresh: bool = False,
    cache: str | Path | None = None,
    retry: Sequence[Status] = (),
    watch: Watch | None = None,
) -> Sweep:
    """Run or continue a study for every member of a grid, and compare them.

    Parameters
    ----------
    config : path
        The base; its table ``[sweep]`` is the grid, or a part of it.
    over : mapping of str to sequence, optional
        Values by dotted key, such as ``{"oracle.parameters.thickness": [1e-3, 2e-3], "ranges": [0.5, 1]}``.
    out : path, optional
        The sweep's folder; ``runs/<name>-sweep`` if not given.
    overrides : sequence of str
        ``dotted.key=value`` settings that replace the file's, in all members.
    fresh : bool
        Start every member anew; the cache keeps its answers.
    cache : path, optional
        Folder of points that the members share; ``cache`` in the sweep's folder if not given.
    retry : collection of Status
        Failures of earlier runs that are tried again.
    watch : Watch, optional
        Told how it goes.

    Raises
    ------
    InputError
        If a member cannot be run, or a folder is not to be had; nothing is run then.
    OSError
        If the disk refuses on the way; what is stored is kept.

    Notes
    -----
    A member that fails stops no other: its row says why. A bug of ours stops none either, and is raised at the end.
    """
    base, grid, chosen = planned(config, over, overrides)
    place = Path(out) if out is not None else Path("runs") / f"{base.name}-sweep"
    SweepFolder.check(place, base, fresh)
    for one in chosen:
        ready(one.study, place / one.member.name / WORK)
        RunFolder.check(place / one.member.name, one.study.config, fresh)
    shared = Path(cache) if cache is not None else place / CACHE
    with SweepFolder.claim(place, base, fresh) as folder:
        folder.note(base)
        runner = _Runner(config, folder, shared, fresh, retry, watch or Watch())
        units = _units(chosen)
        is_first = not folder.peek(TABLE)
        for i, one in enumerate(chosen, start=1):
            runner.member(one, i, len(chosen))
            if is_first:  # a table of all members is not replaced by one of some
                folder.write(TABLE, sweep_csv(frame(runner.rows, units)))
        found = Sweep(place, base, grid, tuple(runner.rows), units)
        folder.write(TABLE, sweep_csv(found.table))
        write_page(folder, found)
    if runner.bugs:
        raise runner.bugs[0]
    return found


class _Runner:
    """Runs one member after the other."""

    def __init__(self, config: str | Path, folder: SweepFolder, cache: Path, fresh: bool, retry: Sequence[Status],
                 watch: Watch) -> None:  # fmt: skip
        self.config, self.folder, self.cache, self.fresh, self.retry = config, folder, cache, fresh, retry
        self.watch = watch
        self.rows: list[Row] = []
        self.bugs: list[Exception] = []
        self.seen: set[str] = set()

    def member(self, one: Planned, number: int, total: int) -> None:
        """Run one; whatever becomes of it is a row."""
        place, found, code, reason = self.folder.path / one.member.name, None, 0, ""
        with self.watch.begin(one.member, number, total) as progress:
            asked = _Asked(progress)
            try:
                outcome = run(self.config, place, one.overrides, self.fresh, asked, self.cache, self.retry)
                found = Found.of(outcome)
                if outcome.shortfalls:
                    code, reason = SHORTFALL, "; ".join(outcome.shortfalls)
            except FlexdoceError as error:
                code, reason = error.exit_code, _why(error)
            except OSError:
                raise  # a full disk will be full for the next member, too
            except Exception as error:
                self.bugs.append(error)
                code, reason = 1, f"{type(error).__name__}: {error}"
        keys = stored(place)
        self.rows.append(Row(one.member, code, reason, len(keys), len(keys - self.seen), asked.total, found))
        self.seen |= keys
        self.watch.end(self.rows[-1])


def _why(error: FlexdoceError) -> str:
    kept = "; they are kept as answers: --retry-failed runs them again" if isinstance(error, TooManyFailures) else ""
    return f"{error}{kept}"


def write_page(folder: SweepFolder, found: Sweep) -> Path:
    """Write ``sweep.html``."""
    from .report import sweep_html  # matplotlib and jinja2 are not needed before this

    return folder.write(PAGE, sweep_html(found))


def _units(chosen: Sequence[Planned]) -> dict[str, str]:
    """Units of the swept keys, as far as all members agree on them."""
    found: dict[str, str] = {}
    for key, _ in chosen[0].member.settings:
        units = {_unit(key, one.study) for one in chosen}
        if len(units) == 1 and (unit := units.pop()):
            found[key] = unit
    return found


def _unit(key: str, study: Study) -> str:
    """Unit of an oracle's parameter or a factor's range; empty if there is none."""
    parts = key.split(".")
    if of_ranges(key) or len(parts) != 3:
        return ""
    if parts[0] == "factors" and parts[1] in study.space.names and parts[2] in ("low", "high"):
        return study.space.factors[study.space.index(parts[1])].unit
    name = study.config.oracle.name
    if parts[:2] != ["oracle", "parameters"] or name not in oracles.names():
        return ""
    rows = settings.describe(type(study.oracle))
    unit = next((row["unit"] for row in rows if row["name"] == parts[2]), "")
    return "" if unit == "1" else unit


@dataclass(frozen=True)
class SweepStanding:
    """Where a sweep is; reads like a run's :class:`.Standing`.

    Parameters
    ----------
    path : Path
    owner : Owner or None
        Who is at work in the folder now.
    told : tuple of str
        One line for each member.
    """

    path: Path
    owner: Owner | None
    told: tuple[str, ...]

    def lines(self) -> list[str]:
        """What a person wants to know, a line each."""
        head = f"{self.path.name}: " + (f"running ({self.owner})" if self.owner else "not running")
        page = self.path / PAGE
        return [f"{head}, {len(self.told)} members", *self.told, *([f"Page: {page}"] if page.is_file() else [])]


def read_sweep_status(path: Path) -> SweepStanding:
    """Where each member of a sweep is; changes nothing."""
    owner = holder(path)
    _, config = SweepFolder.existing(path)
    told = []
    for member in members(axes(config.sweep or {})):
        place = path / member.name
        if not (place / RunFolder.config_name).is_file():
            told.append(f"{member.name}: not begun")
            continue
        standing = read_status(RunFolder(place))
        at = f", {standing.state.place}" if standing.owner and standing.state and standing.state.stage else ""
        told.append(f"{standing.headline}{at}")
    return SweepStanding(path, owner, tuple(told))

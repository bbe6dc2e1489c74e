"""``flexdoce status``: where a run is, read from outside of it."""

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

from . import database
from .errors import InputError, one_line
from .lock import Owner, holder
from .log import LOG
from .monitor import FINISHED, STOPPED, State
from .store import CONFIG, POINTS, STATE, RunFolder
from .tally import duration, failures, speed

LONGEST_REASON = 200
QUIET = 60.0
"""Seconds without an answer after which a run that is alive is said to be waiting."""


@dataclass(frozen=True)
class Standing:
    """Where a run is.

    Parameters
    ----------
    folder : Path
    now : float
        When this was read, seconds since 1970.
    state : State or None
        What the run wrote last; None in a folder of an older version, or if it is damaged.
    owner : Owner or None
        Who is at work in the folder now.
    points : mapping of str to (int, str)
        By status: how many points the store holds, and the reason of the last.
    trouble : str
        Why the store could not be read; empty if it could.
    """

    folder: Path
    now: float
    state: State | None
    owner: Owner | None
    points: Mapping[str, tuple[int, str]]
    trouble: str = ""

    def lines(self) -> list[str]:
        """What a person wants to know, a line each."""
        state, told = self.state, [self.headline]
        if state is not None and state.stage:
            told.append(f"Stage: {self._stage(state)}")
        if self.trouble:
            told.append(self.trouble)
        stored, good = sum(n for n, _ in self.points.values()), self.points.get("ok", (0, ""))[0]
        told.append(f"Stored: {stored} points, {good} of them answered")
        for kind, (n, reason) in sorted(self.points.items()):
            if kind != "ok":
                short = " ".join(reason.split())
                short = short if len(short) <= LONGEST_REASON else short[: LONGEST_REASON - 1] + "…"
                told.append(f"Failed: {n} {kind}; the last: {short or 'no reason given'}")
        if not self.owner and not (state and state.ended == FINISHED):
            told.append(f"Go on: flexdoce run {self.folder / CONFIG} --out {self.folder}")
        if (self.folder / LOG).is_file():
            told.append(f"Log: {self.folder / LOG}")
        return [one_line(line) for line in told]

    @property
    def headline(self) -> str:
        """Which run it is, and whether it runs."""
        name, state = self.folder.name, self.state
        if self.owner:
            return f"{name}: running ({self.owner})"
        if state is None:
            return f"{name}: not running"
        ago = f"{duration(max(self.now - state.updated, 0.0))} ago"
        if state.ended == FINISHED:
            return f"{name}: finished {ago}"
        if state.ended == STOPPED:
            return f"{name}: stopped by hand {ago}"
        if state.ended:
            return f"{name}: failed {ago}: {state.reason}"
        return f"{name}: not running; it ended without a word, last heard of {ago}: killed, or the machine went down"

    def _stage(self, state: State) -> str:
        told = [state.place]
        if state.known:
            told.append(f"{state.known} known from before")
        if sum(state.failed.values()):
            told.append(failures(state.failed))
        if self.owner and state.rate and state.done < state.total:
            # The clock of the file may be another machine's.
            silence = max(self.now - state.updated, 0.0)
            told += [speed(state.rate), f"about {duration(max((state.left or 0.0) - silence, 0.0))} left"]
            if silence > max(QUIET, 5.0 / state.rate):
                told.append(f"no answer for {duration(silence)}")
        return ", ".join(told)


def read_status(folder: RunFolder, clock: Callable[[], float] = time.time) -> Standing:
    """Where the run in a folder is; a store that cannot be read is told, not raised."""
    store, points, trouble = folder.path / POINTS, {}, ""
    # The lock is read first: a run that ends in between has then written how.
    owner, state = holder(folder.path), State.parse(folder.peek(STATE))
    if store.is_symlink():
        trouble = f"{store} is a link and is not read"
    elif store.is_file():
        try:
            points = database.counts(store)
        except InputError as error:
            trouble = str(error)
    return Standing(folder.path, clock(), state, owner, points, trouble)


def stored(folder: Path) -> frozenset[str]:
    """Keys of the points that a run folder holds; none where there is no store, or none that can be read."""
    store = folder / POINTS
    try:
        return database.keys(store) if store.is_file() else frozenset()
    except InputError:
        return frozenset()

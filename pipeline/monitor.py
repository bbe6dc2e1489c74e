"""Who is told what while a study runs: the terminal, ``log.txt``, and ``state.json`` for ``flexdoce status``."""

import json
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import asdict, dataclass, field
from types import TracebackType
from typing import Any

from .errors import FlexdoceError
from .lock import Owner
from .log import Log
from .store import STATE, RunFolder
from .tally import Tally, Watcher, duration, failures
from .version import __version__

STATE_EVERY, LOG_EVERY = 1.0, 60.0
"""Seconds between two states, and between two lines of a stage in the log."""

MOST_REASONS = 20
"""Failures of a stage that the log gives one by one; all are in its ``runs.csv``."""

LARGEST = 1e15
"""Numbers of a sound state are smaller: no clock, count or speed has more digits."""

FINISHED, STOPPED, FAILED = "finished", "stopped", "failed"


@dataclass
class State:
    """``state.json``: where a run is. Times are seconds since 1970.

    Parameters
    ----------
    study : str
    pid, host : int, str
        Of the run that wrote it.
    started, updated : float
    stage : str
    done, total, known : int
    failed : dict
        Failed runs of the stage by status.
    rate, left : float or None
        Runs per second and seconds left in the stage.
    ended : str
        How it ended; empty while it runs, and for ever if it was killed.
    reason : str
        Why, if it failed.
    """

    study: str
    pid: int
    host: str
    started: float
    updated: float
    stage: str = ""
    done: int = 0
    total: int = 0
    known: int = 0
    failed: dict[str, int] = field(default_factory=dict)
    rate: float | None = None
    left: float | None = None
    ended: str = ""
    reason: str = ""

    @classmethod
    def parse(cls, text: str) -> "State | None":
        """What a run wrote; None if it is damaged or of another version."""
        try:
            state = cls(**json.loads(text))
        except (ValueError, TypeError, RecursionError):
            return None
        numbers = [state.pid, state.started, state.updated, state.done, state.total, state.known]
        numbers += [n for n in (state.rate, state.left) if n is not None]
        texts = (state.study, state.host, state.stage, state.ended, state.reason)
        is_sound = all(isinstance(n, int | float) and abs(n) < LARGEST for n in numbers)
        is_sound &= all(isinstance(t, str) for t in texts) and isinstance(state.failed, dict)
        return state if is_sound and all(isinstance(n, int) for n in state.failed.values()) else None

    @property
    def place(self) -> str:
        """Such as ``fit, 12 of 30 runs``."""
        return f"{self.stage}, {self.done} of {self.total} runs" if self.total > 1 else self.stage


class Monitor:
    """Tells everybody; a context that notes how the run ended.

    Parameters
    ----------
    folder : RunFolder
        Claimed by this process.
    study : str
        Name of the study.
    progress : callable
        Told the stage, the runs done and the runs in all; or the whole :class:`.Tally`, if it has a method for it.
    clock : callable
        Seconds since 1970.
    """

    def __init__(
        self, folder: RunFolder, study: str, progress: Callable[..., None], clock: Callable[[], float] = time.time
    ) -> None:
        self.folder, self.progress, self.clock = folder, progress, clock
        me, now = Owner.me(), clock()
        self.state = State(study, me.pid, me.host, now, now)
        self.log = Log(folder.path)
        self._written = self._logged = self._begun = now
        self._reasons: dict[str, int] = {}

    def __enter__(self) -> "Monitor":
        before = State.parse(self.folder.peek(STATE))
        told = f"flexdoce {__version__}, study {self.state.study}, process {self.state.pid} on {self.state.host}"
        self.note(f"{told}: {'continues' if before else 'begins'}")
        if before and not before.ended:
            at = time.strftime("%Y-%m-%d %H:%M:%S", time.localtime(before.updated))
            self.note(f"the run before (process {before.pid} on {before.host}) ended without a word after {at}, "
                      f"in {before.place or 'its first steps'}; what it stored is kept")  # fmt: skip
        self._write_state()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        where = self.state.place or "its first steps"
        if error is None:
            self.state.ended = FINISHED
            self.note(f"finished after {duration(self.clock() - self.state.started)}")
        elif isinstance(error, KeyboardInterrupt):
            self.state.ended = STOPPED
            self.note(f"stopped by hand in {where}; run the same command to continue, no answer that came in is lost")
        else:
            told = isinstance(error, FlexdoceError | OSError)
            self.state.ended, self.state.reason = FAILED, str(error) if told else f"{type(error).__name__}: {error}"
            self.note(f"failed in {where}: {self.state.reason}")
        self._write_state()
        self.log.close()

    def note(self, sentence: str) -> None:
        """A line in the log."""
        self.log.write(sentence)

    def step(self, stage: str, done: bool) -> None:
        """A stage that runs no oracle begins, or is done."""
        self.tally(Tally(stage, 1, 1) if done else Tally(stage, 0, 0))

    def tally(self, tally: Tally) -> None:
        """A stage begins, is further, or is done."""
        now = self.clock()
        before = self.state
        is_longer = bool(before.total) and tally.total != before.total
        is_new = tally.stage != before.stage or tally.done < before.done or is_longer
        if isinstance(self.progress, Watcher):
            self.progress.tally(tally)
        else:
            self.progress(tally.stage, tally.done, tally.total)
        self._log(tally, is_new, now)
        state = self.state
        state.stage, state.done, state.total, state.known = tally.stage, tally.done, tally.total, tally.known
        state.failed, state.rate, state.left = dict(tally.failed), tally.rate, tally.left
        if is_new or tally.done == tally.total or now - self._written >= STATE_EVERY:
            self._write_state()

    def _log(self, tally: Tally, is_new: bool, now: float) -> None:
        for sentence in tally.news:
            told = self._reasons[tally.stage] = self._reasons.get(tally.stage, 0) + 1
            if told <= MOST_REASONS:
                more = f"; further failures are in {tally.stage}/runs.csv" if told == MOST_REASONS else ""
                self.note(f"{tally.stage}: {sentence}{more}")
        is_done = 0 < tally.total == tally.done
        if is_new:
            self._begun = now
        if tally.total > 1 and is_done:
            fresh, took = tally.done - tally.known, duration(tally.seconds)
            failed = f", {failures(tally.failed)}" if tally.n_failed else ""
            self.note(f"{tally.stage}: {tally.total} runs done{failed}; {fresh} new in {took}, {tally.known} known")
        elif is_done:
            self.note(f"{tally.stage}: done in {duration(now - self._begun)}")
        elif is_new and tally.total:
            self.note(f"{tally.stage}: {tally.total} runs, {tally.known} of them known from before")
        elif tally.total and now - self._logged >= LOG_EVERY:
            self.note(f"{tally.stage}: {tally.done} of {tally.total} runs, {tally.pace}")
        else:
            return
        self._logged = now

    def _write_state(self) -> None:
        self.state.updated = self._written = self.clock()
        # A full disk is told by what matters more.
        with suppress(OSError):
            self.folder.write(STATE, state_json(self.state), durable=False)


def state_json(state: State) -> str:
    """``state.json``."""
    document: dict[str, Any] = asdict(state)
    return json.dumps(document, indent=2) + "\n"

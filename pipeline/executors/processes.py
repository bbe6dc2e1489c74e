"""Worker processes on this machine. One that is killed costs what it had, and is replaced."""

import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, CancelledError, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from itertools import islice
from multiprocessing import connection
from multiprocessing.context import SpawnContext, SpawnProcess
from typing import Any

from ..errors import InputError
from ..signals import unheard
from . import worker
from .base import MOST_LOSSES, Answered, Batch, Elsewhere
from .worker import SharedOracle

AHEAD = 2
"""Batches that a worker has: the one it answers, and the next, so that it never waits for the disk."""

ENDED = (BrokenProcessPool, SystemExit)
"""What a future says whose worker was killed, or told to end."""


class Processes(Elsewhere):
    """A pool of worker processes, begun when the first point asks for it.

    Parameters
    ----------
    shared, batch, note
        As :class:`.Elsewhere` has them.
    workers : int
    """

    def __init__(self, shared: SharedOracle, batch: int | None, note: Callable[[str], None], workers: int) -> None:
        super().__init__(shared, batch, note)
        self.workers = workers
        self._slots: list[_Slot] = []
        self._found: list[Answered] = []

    def run(self, batches: Iterable[Batch]) -> Iterator[Sequence[Answered]]:
        """Keep every worker busy; what is given was answered in the order of its coming in."""
        self._backlog = self._waiting(batches)
        while True:
            self._fill()
            going = [future for slot in self._slots for future, _ in slot.given]
            if going:
                wait(going, return_when=FIRST_COMPLETED)
            self._collect()
            self._fill()  # before the answers are stored: workers are not to wait for the disk
            if found := self.arrived():
                yield found
            elif not going:
                return
            for slot in self._slots:  # now that what the others answered is stored
                slot.check()

    def arrived(self) -> Sequence[Answered]:
        """Take what is done from every worker."""
        self._collect()
        found, self._found = self._found, []
        return found

    def close(self, in_haste: bool) -> None:
        """End all workers; `in_haste`, with what they do."""
        slots, self._slots = self._slots, []
        with unheard():  # a second Ctrl-C is no news, and must not leave workers and their programs behind
            for slot in slots:
                slot.end(in_haste)
            until = time.monotonic() + worker.GRACE
            for slot in slots:
                connection.wait([slot.process.sentinel], max(0.0, until - time.monotonic()))
            for slot in slots:
                slot.kill()

    def _collect(self) -> None:
        """Note what is done; workers that ended are replaced."""
        for i, slot in enumerate(self._slots):
            slot.done(self._found)
            if not slot.is_broken:
                continue
            slot.kill()
            if slot.name != "?":
                self._backlog.lost(slot.given.popleft()[1], slot.name)
            elif not slot.was_killed or slot.tries == MOST_LOSSES:
                continue  # no other would do better: `check` says so
            else:
                self.note("a worker was killed before it was ready: another one is started")
            self._backlog.again(batch for _, batch in slot.given)
            self._slots[i] = _Slot(self.shared, slot.tries + 1 if slot.name == "?" else 1)
        self._found += self._backlog.given_up()

    def _fill(self) -> None:
        for depth in range(1, AHEAD + 1):  # everybody has one before anybody has two
            for number in range(self.workers):
                if number < len(self._slots) and len(self._slots[number].given) >= depth:
                    continue
                if (batch := self._backlog.next()) is None:
                    return
                if number == len(self._slots):
                    with worker.uninterrupted():  # or nobody would know of it
                        self._slots.append(_Slot(self.shared))
                self._slots[number].give(batch)


class _Slot:
    """One worker process: a pool of one, so that when it breaks no other does; `tries` counts starts that failed."""

    def __init__(self, shared: SharedOracle, tries: int = 1) -> None:
        self.token, self.tries = shared.token, tries
        context = _OneProcess()
        # Not a fork: it would inherit the folder's lock and the threads of JAX.
        self.pool = ProcessPoolExecutor(1, mp_context=context, initializer=worker.begin)
        with worker.uninterrupted():
            self.ready: Future[str] = self.pool.submit(worker.prepare, shared)
        self.process = context.made
        self.given: deque[tuple[Future, Batch]] = deque()

    @property
    def name(self) -> str:
        """``host:pid``, or a question mark as long as it is not ready."""
        return self.ready.result() if self.ready.done() and not _failure(self.ready) else "?"

    @property
    def is_broken(self) -> bool:
        """Whether its process ended while it had something."""
        return bool(self.given) and self.given[0][0].done() and isinstance(_failure(self.given[0][0]), ENDED)

    @property
    def was_killed(self) -> bool:
        """Whether a signal ended its process, as the system does that is out of memory."""
        return (self.process.exitcode or 0) < 0

    def give(self, batch: Batch) -> None:
        """Put a batch behind those it has."""
        try:
            future = self.pool.submit(worker.answer, self.token, batch.points)
        except BrokenProcessPool as error:
            future = Future()
            future.set_exception(error)
        self.given.append((future, batch))

    def done(self, found: list[Answered]) -> None:
        """Add to `found` what it answered, in order, up to what it is busy with or what went wrong."""
        while self.given and self.given[0][0].done() and _failure(self.given[0][0]) is None:
            future, batch = self.given[0]
            found.append(Answered(batch, *future.result()))
            self.given.popleft()

    def check(self) -> None:
        """Say what went wrong.

        Raises
        ------
        InputError
            If it never became ready.
        """
        for future in (self.ready, *(future for future, _ in islice(self.given, 1))):
            error = _failure(future) if future.done() else None
            if error is None:
                continue
            if self.name == "?" and isinstance(error, ENDED):
                raise InputError(_UNREADY)
            if not isinstance(error, ENDED):
                raise error

    def end(self, in_haste: bool) -> None:
        """Tell it to end; `in_haste`, with what it does."""
        if in_haste:
            self.process.terminate()
        self.pool.shutdown(wait=False, cancel_futures=True)

    def kill(self) -> None:
        """End it for good, if it did not end by itself: the oracle may have left threads that never do."""
        self.process.kill()
        self.pool.shutdown(wait=True, cancel_futures=True)
        connection.wait([self.process.sentinel], worker.GRACE)


class _OneProcess(SpawnContext):
    """Keeps the process that a pool of one makes: it has to be known before it is ready."""

    made: Any = None

    def Process(self, *arguments: Any, **named: Any) -> SpawnProcess:  # pyright: ignore
        """As the pool wants it."""
        self.made = SpawnProcess(*arguments, **named)
        return self.made


_UNREADY = (
    "executor: a worker process ended before it was ready: killed, out of memory, or crashed; in a Python script, what "
    "runs a study with executor.name = 'processes' has to stand below if __name__ == '__main__':"
)


def _failure(future: Future) -> BaseException | None:
    """What a future that is done ended with; one that was cancelled never began."""
    return CancelledError() if future.cancelled() else future.exception()

"""Worker processes on this machine. One that is killed costs what it had, and is replaced."""

import os
import signal
import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, CancelledError, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from multiprocessing import get_context

from ..errors import InputError
from . import worker
from .base import Answered, Batch, Elsewhere
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

    def run(self, batches: Iterable[Batch]) -> Iterator[Sequence[Answered]]:
        """Keep every worker busy; what is given was answered in the order of its coming in."""
        self._backlog = self._waiting(batches)
        while True:
            self._fill()
            going = [future for slot in self._slots for future, _ in slot.given]
            if going:
                wait(going, return_when=FIRST_COMPLETED)
            found = self.arrived()
            self._fill()  # before the answers are stored: workers are not to wait for the disk
            if found:
                yield found
            elif not going:
                return

    def arrived(self) -> Sequence[Answered]:
        """Take what is done from every worker; those that ended are replaced."""
        found: list[Answered] = []
        for i, slot in enumerate(self._slots):
            found += slot.done()
            if slot.is_broken:
                self._backlog.lost(slot.given[0][1], slot.name)
                self._backlog.again(batch for _, batch in list(slot.given)[1:])
                slot.close(in_haste=True)
                self._slots[i] = _Slot(self.shared)
        return [*found, *self._backlog.given_up()]

    def close(self, in_haste: bool) -> None:
        """End all workers; `in_haste`, with what they do."""
        slots, self._slots = self._slots, []
        if in_haste:
            for slot in slots:
                slot.signal(signal.SIGTERM)
            until = time.monotonic() + worker.GRACE
            while time.monotonic() < until and any(slot.is_alive for slot in slots):
                time.sleep(0.02)
        for slot in slots:
            slot.close(in_haste)

    def _fill(self) -> None:
        for depth in range(1, AHEAD + 1):  # everybody has one before anybody has two
            for number in range(self.workers):
                if number < len(self._slots) and len(self._slots[number].given) >= depth:
                    continue
                if (batch := self._backlog.next()) is None:
                    return
                if number == len(self._slots):
                    self._slots.append(_Slot(self.shared))
                self._slots[number].give(batch)


class _Slot:
    """One worker process: a pool of one, so that when it breaks no other does."""

    def __init__(self, shared: SharedOracle) -> None:
        self.token = shared.token
        # Not a fork: it would inherit the folder's lock and the threads of JAX.
        self.pool = ProcessPoolExecutor(1, mp_context=get_context("spawn"), initializer=worker.begin)
        with worker.uninterrupted():
            self.ready: Future[str] = self.pool.submit(worker.prepare, shared)
        self.given: deque[tuple[Future, Batch]] = deque()

    @property
    def name(self) -> str:
        """``host:pid``, or a question mark as long as it is not ready."""
        return self.ready.result() if self.ready.done() and not _failure(self.ready) else "?"

    @property
    def pid(self) -> int | None:
        """Its process, once it is ready."""
        return None if self.name == "?" else int(self.name.rpartition(":")[2])

    @property
    def is_broken(self) -> bool:
        """Whether its process ended while it had something."""
        return bool(self.given) and self.given[0][0].done() and isinstance(_failure(self.given[0][0]), ENDED)

    @property
    def is_alive(self) -> bool:
        """Whether its process is known, and there."""
        return self.signal(0)

    def give(self, batch: Batch) -> None:
        """Put a batch behind those it has."""
        try:
            future = self.pool.submit(worker.answer, self.token, batch.points)
        except BrokenProcessPool as error:
            future = Future()
            future.set_exception(error)
        self.given.append((future, batch))

    def done(self) -> list[Answered]:
        """What it answered, in order, up to what it is busy with or what ended it.

        Raises
        ------
        InputError
            If it never became ready.
        """
        self._check()
        found = []
        while self.given and self.given[0][0].done() and not self.is_broken:
            future, batch = self.given.popleft()
            found.append(Answered(batch, *future.result()))
        return found

    def _check(self) -> None:
        error = _failure(self.ready) if self.ready.done() else None
        if isinstance(error, ENDED):
            raise InputError(
                "executor: a worker process ended before it was ready; in a Python script, what runs a study with "
                "executor.name = 'processes' has to stand below if __name__ == '__main__':"
            )
        if error is not None:
            raise error

    def signal(self, number: int) -> bool:
        """Send its process a signal; whether there is one."""
        if self.pid is None:
            return False
        try:
            os.kill(self.pid, number)
        except ProcessLookupError:
            return False
        return True

    def close(self, in_haste: bool) -> None:
        """End it."""
        if in_haste:
            self.signal(getattr(signal, "SIGKILL", signal.SIGTERM))
        self.pool.shutdown(wait=True, cancel_futures=True)


def _failure(future: Future) -> BaseException | None:
    """What a future that is done ended with; one that was cancelled never began."""
    return CancelledError() if future.cancelled() else future.exception()

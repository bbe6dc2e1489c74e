"""What an executor is: it takes batches of points and gives answers as they come."""

import os
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from itertools import islice
from types import TracebackType
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from experiments.oracles import Answers
from experiments.runs import Status

from .worker import SharedOracle

MOST_LOSSES = 3
"""Workers that a point may lose before it is taken to be what ends them."""


class Batch(NamedTuple):
    """Points that are answered together.

    Parameters
    ----------
    rows : tuple of int, length n
        What the caller knows the points by.
    points : ndarray, shape (n, n_factors)
        In the factors' units.
    losses : int
        How many workers ended while they had it.
    """

    rows: tuple[int, ...]
    points: NDArray[np.float64]
    losses: int = 0


class Answered(NamedTuple):
    """A batch with its answers; wall time per point [s]; ``host:pid`` of who answered."""

    batch: Batch
    answers: Answers
    seconds: float
    worker: str


class Executor(ABC):
    """A context that answers batches of points; outside of it nothing is left running.

    The law: every batch is answered once, in any order, and an answer does not depend on where it was found. What
    a worker had when it was killed goes to another; a point that ends :data:`MOST_LOSSES` workers is a failed point.
    """

    def __enter__(self) -> "Executor":
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self.close(in_haste=error is not None)

    @abstractmethod
    def size(self, batch: int) -> int:
        """Points to put into a batch, for an oracle that answers `batch` points together."""

    @abstractmethod
    def run(self, batches: Iterable[Batch]) -> Iterator[Sequence[Answered]]:
        """Answer batches; gives what came in since it was last asked, at least one each time.

        Raises
        ------
        InputError
            If workers cannot be started, or cannot make the oracle.
        OSError
            If they are out of reach.
        """
        ...

    def arrived(self) -> Sequence[Answered]:
        """What has come in and was not given yet, for somebody who was interrupted; nothing is waited for."""
        return ()

    def close(self, in_haste: bool) -> None:  # noqa: B027 - in the same process there is nothing to close
        """End what was started; `in_haste`, without waiting for answers."""


class Elsewhere(Executor):
    """An executor whose workers are other processes.

    Parameters
    ----------
    shared : SharedOracle
    batch : int or None
        Points per batch; as many as the oracle answers together, if None.
    note : callable
        Told in a sentence what is worth a line in the log.
    """

    def __init__(self, shared: SharedOracle, batch: int | None, note: Callable[[str], None]) -> None:
        self.shared, self.batch, self.note = shared, batch, note
        self._backlog = self._waiting(())

    def size(self, batch: int) -> int:
        """As set, or as the oracle has it."""
        return self.batch or batch

    def _waiting(self, batches: Iterable[Batch]) -> "Backlog":
        return Backlog(batches, self.shared.n_responses, self.note)


class Backlog:
    """Batches that wait: those that a worker lost come before new ones.

    Parameters
    ----------
    batches : iterable of Batch
    n_responses : int
    note : callable
        Told in a sentence when a worker is lost.
    """

    def __init__(self, batches: Iterable[Batch], n_responses: int, note: Callable[[str], None]) -> None:
        self._source, self._lost = iter(batches), deque[Batch]()
        self._n_responses, self._note = n_responses, note
        self._given_up: list[Answered] = []

    def __bool__(self) -> bool:
        if not self._lost:
            self._lost.extend(islice(self._source, 1))
        return bool(self._lost)

    def next(self) -> Batch | None:
        """The next one; None if there is none at the moment."""
        return self._lost.popleft() if self._lost else next(self._source, None)

    def again(self, batches: Iterable[Batch]) -> None:
        """These were not begun."""
        self._lost.extend(batches)

    def lost(self, batch: Batch, worker: str) -> None:
        """`worker` ended while it had this batch: it goes to others, point by point to find the one that did it."""
        losses, n = batch.losses + 1, len(batch.rows)
        ending = "they are run again" if losses < MOST_LOSSES else "not run again"
        self._note(f"the worker {worker} ended while it had {n} point{'s' * (n > 1)}: {ending}")
        for i, row in enumerate(batch.rows):
            single = Batch((row,), batch.points[i : i + 1], losses)
            if losses < MOST_LOSSES:
                self._lost.append(single)
            else:
                self._given_up.append(Answered(single, self._fatal(losses), 0.0, worker))

    def given_up(self) -> list[Answered]:
        """Points that are not tried again, each told once."""
        told, self._given_up = self._given_up, []
        return told

    def _fatal(self, losses: int) -> Answers:
        reason = f"{losses} workers ended while they had this point: killed, out of memory, or crashed"
        return Answers(np.full((1, self._n_responses), np.nan), [Status.CRASHED], [reason])


def cores() -> int:
    """CPU cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1

"""How a design is run: what is known is read back, the rest is answered, and stored as it comes."""

import time
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from typing import Protocol

import numpy as np

from experiments.designs import Design
from experiments.oracles import Oracle
from experiments.runs import Runs, Status

from ..points import Answer, Evaluated, PointStore
from ..tally import Tally
from .base import Answered, Batch, Executor
from .in_process import InProcess


class Progress(Protocol):
    """What a run tells while it goes: a stage, how many are done, and of how many.

    Who wants to know of failures, rate and time left has a method ``tally``, see :class:`.Watcher`.
    """

    def __call__(self, stage: str, done: int, total: int) -> None:
        """Called after every batch, from the thread that runs the study."""
        ...


def silent(stage: str, done: int, total: int) -> None:
    """Tell nothing."""


def untold(tally: Tally) -> None:
    """Tell nothing."""


def execute(
    oracle: Oracle,
    design: Design,
    store: PointStore,
    stage: str,
    tell: Callable[[Tally], None] = untold,
    executor: Executor | None = None,
) -> Runs:
    """Run `design`, in this process if no executor is given.

    A point that was answered before by the same oracle, in this folder or in the cache, is not run again.
    What is used is what was stored, so that a run that is continued cannot differ.
    """
    points = design.physical
    keys = store.keys(points)
    answers = store.known(keys)
    # A design may hold the same settings twice; they are paid for once.
    first = {key: i for i, key in reversed(list(enumerate(keys)))}
    missing = sorted(i for key, i in first.items() if key not in answers)
    count = _Count(stage, Counter(keys), answers)
    tell(count.tally())

    def keep(arrived: Sequence[Answered]) -> None:
        added = store.add_all([_evaluated(found, keys) for found in arrived])
        answers.update(added)
        count.add(added)
        rows = sorted(row for found in arrived for row in found.batch.rows)
        failed = [(i, answers[keys[i]]) for i in rows if answers[keys[i]].status is not Status.OK]
        tell(count.tally([f"run {i + 1} failed: {a.status} ({a.reason})" for i, a in failed]))

    executor = executor or InProcess(oracle)
    size = executor.size(oracle.batch)
    chunks = (tuple(missing[start : start + size]) for start in range(0, len(missing), size))
    try:
        for arrived in executor.run(Batch(rows, points[list(rows)]) for rows in chunks):
            keep(arrived)
    except BaseException as error:
        # Whatever ended it. Only who was interrupted may still wait, and be told, that the disk refuses.
        with suppress(*() if isinstance(error, KeyboardInterrupt) else (Exception,)):
            if left := executor.arrived():
                keep(left)
        raise
    ordered = [answers[key] for key in keys]
    return Runs(
        design,
        oracle.responses,
        np.array([a.values for a in ordered], dtype=np.float64).reshape(len(design), len(oracle.responses)),
        tuple(a.status for a in ordered),
        tuple(a.reason for a in ordered),
    )


def _evaluated(found: Answered, keys: Sequence[str]) -> Evaluated:
    batch = found.batch
    return Evaluated([keys[i] for i in batch.rows], batch.points, found.answers, found.seconds, found.worker)


class _Count:
    """How far a stage is; a setting that the design holds twice counts twice."""

    def __init__(self, stage: str, times: Mapping[str, int], known: Mapping[str, Answer]) -> None:
        self.stage, self.times, self.total, self.begun = stage, times, sum(times.values()), time.monotonic()
        self.done, self.failed = 0, Counter[str]()
        self.add(known)
        self.known = self.done

    def add(self, answers: Mapping[str, Answer]) -> None:
        for key, answer in answers.items():
            self.done += self.times[key]
            if answer.status is not Status.OK:
                self.failed[str(answer.status)] += self.times[key]

    def tally(self, news: Sequence[str] = ()) -> Tally:
        seconds = time.monotonic() - self.begun
        return Tally(self.stage, self.done, self.total, self.known, dict(self.failed), seconds, tuple(news))

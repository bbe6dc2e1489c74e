"""How a design is run: what is known is read back, the rest is answered batch by batch and stored at once."""

from collections import Counter
from typing import Protocol

import numpy as np

from experiments.designs import Design
from experiments.oracles import Answers, Oracle
from experiments.runs import Runs

from .store import PointStore


class Progress(Protocol):
    """What a run tells while it goes: a stage, how many are done, and of how many."""

    def __call__(self, stage: str, done: int, total: int) -> None:
        """Called after every batch, from the thread that runs the study."""
        ...


def silent(stage: str, done: int, total: int) -> None:
    """Tell nothing."""


def execute(oracle: Oracle, design: Design, store: PointStore, stage: str, progress: Progress = silent) -> Runs:
    """Run `design` in this process.

    A point that was answered before, in this folder by the same oracle, is not run again.
    """
    points = design.physical
    keys = store.keys(points)
    answers = store.known(keys)
    # A design may hold the same settings twice; they are paid for once.
    first = {key: i for i, key in reversed(list(enumerate(keys)))}
    missing = np.array(sorted(i for key, i in first.items() if key not in answers), dtype=int)
    times = Counter(keys)
    done = sum(times[key] for key in answers)
    progress(stage, done, len(points))
    for start in range(0, len(missing), oracle.batch):
        rows = missing[start : start + oracle.batch]
        runs = oracle(design.take(rows))
        batch = Answers(runs.values, list(runs.status), list(runs.reasons))
        batch_keys = [keys[i] for i in rows]
        store.add(batch_keys, points[rows], batch)
        answers.update(
            zip(batch_keys, zip(batch.values.tolist(), batch.status, batch.reasons, strict=True), strict=True)
        )
        done += sum(times[key] for key in batch_keys)
        progress(stage, done, len(points))
    ordered = [answers[key] for key in keys]
    return Runs(
        design,
        oracle.responses,
        np.array([values for values, _, _ in ordered], dtype=np.float64).reshape(len(design), len(oracle.responses)),
        tuple(status for _, status, _ in ordered),
        tuple(reason for _, _, reason in ordered),
    )

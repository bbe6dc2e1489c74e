"""Fits and scores, two at a time, each peer's result kept in a file."""

import contextlib
import io
import json
import multiprocessing
import os
import sys
import time
import warnings
from collections.abc import Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path
from typing import NamedTuple, TypedDict

from .functions import FUNCTIONS
from .roster import by_label, is_ours
from .scoring import design, fresh_points, score

PROCESSES = 2
SAVE_EVERY = 4  # results


class Task(NamedTuple):
    """One fit."""

    function: str
    n: int
    seed: int
    method: str

    @property
    def key(self) -> str:
        """In the cache."""
        return "/".join(map(str, self))


class Outcome(TypedDict):
    """Of one fit; ``error`` is None where it failed, for the ``reason`` given."""

    error: float | None
    seconds: float | None
    reason: str | None
    stamp: str


def run(
    tasks: Iterable[Task], cache: Path | None, processes: int = PROCESSES, known_only: bool = False
) -> dict[Task, Outcome]:
    """All outcomes, the known ones from `cache`; our own are never taken from there, nor put there.

    With `known_only`, peers are not run: what is not known is missing from the answer.

    Raises
    ------
    ValueError
        If `cache` is a file that is not a table of outcomes.
    """
    known = _read(cache)
    wanted = list(tasks)
    found = {task: known[task.key] for task in wanted if _holds(known.get(task.key), task)}
    todo = [task for task in wanted if task not in found and not (known_only and not is_ours(task.method))]
    fresh: dict[str, Outcome] = {}
    for count, (task, outcome) in enumerate(_in_pool(todo, processes), 1):
        found[task] = outcome
        if not is_ours(task.method):
            fresh[task.key] = outcome
        print(f"{count} of {len(todo)}: {task.key}", file=sys.stderr, flush=True)
        if cache is not None and (len(fresh) >= SAVE_EVERY or (fresh and count == len(todo))):
            _add(cache, fresh)
            fresh = {}
    return found


def attempt(task: Task) -> Outcome:
    """Fit and score, in this process; an exception of the method becomes a reason."""
    method = by_label(task.method)
    function = next(f for f in FUNCTIONS if f.name == task.function)
    X, Z = design(function.n_inputs, task.n, task.seed), fresh_points(function.n_inputs)
    method.load()
    data = X, function.values(X), function.jacobian(X)
    # smt prints the eigenvalues of each matrix that it cannot factorise, and scikit-learn warns of each step.
    with contextlib.redirect_stdout(io.StringIO()), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        begin = time.process_time()
        try:
            predict = method.fit(*data)
            seconds = time.process_time() - begin
            return Outcome(error=score(function, predict(Z), Z), seconds=seconds, reason=None, stamp=method.stamp)
        except Exception as failure:  # whatever a peer raises is a result
            lines = str(failure).strip().splitlines() or [""]
            return Outcome(error=None, seconds=None, reason=f"{type(failure).__name__}: {lines[0]}", stamp=method.stamp)


def _holds(kept: Outcome | None, task: Task) -> bool:
    return kept is not None and not is_ours(task.method) and kept["stamp"] == by_label(task.method).stamp


def _in_pool(tasks: list[Task], processes: int) -> Iterator[tuple[Task, Outcome]]:
    if not tasks:
        return
    os.environ["OMP_NUM_THREADS"] = "1"  # read by the new processes: CPU seconds are then of one core
    with ProcessPoolExecutor(min(processes, PROCESSES), multiprocessing.get_context("spawn")) as pool:
        futures = {pool.submit(attempt, task): task for task in tasks}
        for future in as_completed(futures):
            yield futures[future], future.result()


def _read(cache: Path | None) -> dict[str, Outcome]:
    if cache is None or not cache.exists():
        return {}
    table = json.loads(cache.read_text("utf-8"))
    if not isinstance(table, dict) or not all(isinstance(one, dict) and "stamp" in one for one in table.values()):
        raise ValueError(f"{cache} is not a cache of this benchmark; give another path or remove it")
    return table


def _add(cache: Path, fresh: dict[str, Outcome]) -> None:
    """To what is in the file now: another run may have written meanwhile."""
    cache.parent.mkdir(parents=True, exist_ok=True)
    new = cache.with_suffix(f".{os.getpid()}")
    new.write_text(json.dumps(_read(cache) | fresh, indent=1, ensure_ascii=False), "utf-8")
    new.replace(cache)

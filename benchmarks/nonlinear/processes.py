"""Work in a fresh process: what was compiled, allocated or cached before does not count."""

import multiprocessing
import os
import time
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from typing import Any


def apart(function: Callable[..., Any], *arguments: Any, one_core: bool = True) -> Any:
    """`function(*arguments)` in a new process, tied to one core unless told otherwise; BLAS has one thread."""
    os.environ["OMP_NUM_THREADS"] = "1"
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(1, context, _tie if one_core else None) as pool:
        return pool.submit(function, *arguments).result()


def cpu(function: Callable[[], Any], repeats: int = 5) -> float:
    """Least CPU seconds of several calls."""
    return min(_spent(function, time.process_time) for _ in range(repeats))


def wall(function: Callable[[], Any], repeats: int = 3) -> float:
    """Least wall seconds of several calls."""
    return min(_spent(function, time.perf_counter) for _ in range(repeats))


def _spent(function: Callable[[], Any], clock: Callable[[], float]) -> float:
    begin = clock()
    function()
    return clock() - begin


def _tie() -> None:
    """To the last core, before any thread is started."""
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})

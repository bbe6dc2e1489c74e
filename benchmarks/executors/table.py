"""Executors with the store, and peers without one, on the same points in one run."""

import tempfile
import time
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from importlib.metadata import version
from itertools import repeat
from multiprocessing import get_context
from pathlib import Path
from typing import NamedTuple

import numpy as np

from experiments import oracles
from experiments.designs import Design, Random
from pipeline import executors
from pipeline.config import parse_config
from pipeline.executors import execute
from pipeline.points import PointStore

from . import pausing
from .overheads import PAUSING, overheads

POINTS = {0.0: 500, 0.01: 500, 1.0: 20}
"""Points by pause [s]."""


class Case(NamedTuple):
    """Who answers; how many workers; a function of pause and design that gives start [s] and the rest [s]."""

    name: str
    workers: int
    time: Callable[[float, Design], tuple[float, float]]


def ours(executor: str, pause: float, design: Design) -> tuple[float, float]:
    config = parse_config(f'name = "b"\n[oracle]\nname = "cantilever"\n[executor]\n{executor}')
    oracle = oracles.get(PAUSING, pause=pause)
    few = design.take(np.arange(4))
    rest = design.take(np.arange(4, len(design)))
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        with (
            PointStore(place / "points.sqlite", oracle) as store,
            executors.make(config, oracle, print) as executor_,
        ):
            return timed(lambda d: execute(oracle, d, store, "fit", executor=executor_), few, rest)


def bare_pool(workers: int, pause: float, design: Design) -> tuple[float, float]:
    with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as pool:
        return timed(
            lambda d: list(pool.map(pausing.answered, d.physical, repeat(pause))),
            design.take(np.arange(4)), design.take(np.arange(4, len(design))),
        )  # fmt: skip


def joblib_pool(workers: int, pause: float, design: Design) -> tuple[float, float]:
    from joblib import Parallel, delayed

    with Parallel(workers, batch_size=1) as pool:
        return timed(
            lambda d: pool(delayed(pausing.answered)(row, pause) for row in d.physical),
            design.take(np.arange(4)), design.take(np.arange(4, len(design))),
        )  # fmt: skip


def bare_dask(workers: int, pause: float, design: Design) -> tuple[float, float]:
    from distributed import Client, LocalCluster

    from pipeline.executors.dask_cluster import LOCAL

    with LocalCluster(n_workers=workers, **LOCAL) as cluster, Client(cluster) as client:
        return timed(
            lambda d: client.gather(client.map(pausing.answered, list(d.physical), pause=pause, pure=False)),
            design.take(np.arange(4)), design.take(np.arange(4, len(design))),
        )  # fmt: skip


def timed(run: Callable[[Design], object], few: Design, rest: Design) -> tuple[float, float]:
    """Seconds for a few points, which start the workers, and for the rest."""
    begin = time.perf_counter()
    run(few)
    between = time.perf_counter()
    run(rest)
    return between - begin, time.perf_counter() - between


CASES = (
    Case("in_process", 1, partial(ours, 'name = "in_process"')),
    *(Case("processes", n, partial(ours, f'name = "processes"\nworkers = {n}')) for n in (1, 2)),
    *(Case("dask", n, partial(ours, f'name = "dask"\nworkers = {n}')) for n in (1, 2)),
    Case("ProcessPoolExecutor.map, nothing stored", 2, partial(bare_pool, 2)),
    Case("joblib, nothing stored", 2, partial(joblib_pool, 2)),
    Case("Dask's client.map, nothing stored", 2, partial(bare_dask, 2)),
)


def table() -> str:
    space = oracles.get(PAUSING).factors
    rows, starts = {case: [] for case in CASES}, {}
    for pause, n in POINTS.items():
        design = Random(n_runs=n + 4).generate(space, rng=1)
        for case in CASES:
            start, rest = case.time(pause, design)
            starts.setdefault(case, start)
            rows[case].append(_cell(case, pause, n, rest))
    head = "".join(f" {'no' if not p else f'{p:g} s'} pause, {n} points |" for p, n in POINTS.items())
    body = "".join(f"| {c.name} | {c.workers} | {starts[c]:.1f} |{''.join(cells)}\n" for c, cells in rows.items())
    packages = ", ".join(f"{p} {version(p)}" for p in ("distributed", "joblib"))
    return (
        f"### Executors\n\nA point that only waits; {packages}. Wall time per point, and how much of the workers' time "
        "went into the pauses. Ours store every point durably, the peers nothing.\n\n"
        f"| executor | workers | start, 4 points [s] |{head}\n|---|---|---|{'---|' * len(POINTS)}\n{body}\n"
        + overheads()
    )


def _cell(case: Case, pause: float, n: int, seconds: float) -> str:
    each = f" {1e3 * seconds / n:.2f} ms"
    return f"{each}, {pause * n / (case.workers * seconds):.0%} |" if pause else f"{each} |"

"""What a point costs in this process: keys, folder, program, reading, storing."""

import tempfile
import time
from pathlib import Path
from typing import Any

from experiments import oracles
from experiments.designs import Random
from pipeline.executors import execute
from pipeline.executors.in_process import InProcess
from pipeline.points import PointStore

from . import pausing

PAUSING = f"{pausing.__file__}:Pausing"
"""As any process can find it."""

ECHO: dict[str, Any] = {
    "argv": ["echo", "y = {{a}}"],
    "templates": {"input.txt": {"text": "a = {{a:.6e}}\nb = {{b:.6e}}\nc = {{c:.6e}}\n"}},
    "factors": {name: {"unit": "N", "low": 0.0, "high": 1.0} for name in "abc"},
    "responses": {"y": {"unit": "m", "regex": r"y = (\S+)"}},
}
"""A program that is quicker than anything about it."""


def overheads() -> str:
    """What a point costs beside its answer, in this process."""
    rows = []
    for name, parameters, batch, n in (
        ("no pause, one by one", {"pause": 0.0}, 1, 500),
        ("no pause, 256 together", {"pause": 0.0}, 256, 10_000),
    ):
        oracle = oracles.get(PAUSING, **parameters)
        seconds, again = _stored(oracle, batch, n)
        rows.append(f"| {name} | {n} | {1e3 * seconds:.3f} | {1e3 * again:.3f} |\n")
    command = oracles.get("command", **ECHO)
    seconds, again = _stored(command, 1, 200)
    what = "external program (`echo`): folder, file from a template, regex"
    rows.append(f"| {what} | 200 | {1e3 * seconds:.3f} | {1e3 * again:.3f} |\n")
    return (
        "Wall time per point in this process, stored; and when the same points are asked for again.\n\n"
        f"| oracle | points | new [ms] | known [ms] |\n|---|---|---|---|\n{''.join(rows)}"
    )


def _stored(oracle: Any, batch: int, n: int) -> tuple[float, float]:
    design = Random(n_runs=n).generate(oracle.factors, rng=1)
    with tempfile.TemporaryDirectory() as folder:
        if hasattr(oracle, "working_in"):
            oracle = oracle.working_in(Path(folder) / "work")
        found = []
        for _ in range(2):
            with PointStore(Path(folder) / "points.sqlite", oracle) as store:
                begin = time.perf_counter()
                execute(oracle, design, store, "fit", executor=_Together(oracle, batch))
                found.append((time.perf_counter() - begin) / n)
    return found[0], found[1]


class _Together(InProcess):
    """As many points together as wanted."""

    def __init__(self, oracle: Any, batch: int) -> None:
        super().__init__(oracle)
        self.batch = batch

    def size(self, batch: int) -> int:
        return self.batch

"""A study in processes of its own, to be killed: an oracle that takes a few ms per point and notes what it was asked.

``python -m tests.pipeline.slow_study``, with one line of JSON on standard input per job: imports are paid for once, and
every job is a fork. Line by line it answers with the process id as a job begins, and with its exit status as it ends.
"""

import json
import os
import signal
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

import numpy as np

from experiments import Factor, FactorSpace, Response, oracles
from experiments.oracles import PointOracle

CONFIG = """
name = "slow"
seed = 5
[oracle]
name = "slow"
max_failed_fraction = 0.5
[fit]
design = { method = "sobol", n_runs = 16 }
[validation]
n_runs = 20
[export]
verify = false
"""


HOLD = ".hold"
"""While a file with this ending lies beside the notes, the oracle does not answer."""


@dataclass(frozen=True)
class Slow(PointOracle):
    """Two quadratics in three factors, 3 ms a point; where all factors are large, it fails."""

    name: ClassVar[str] = "slow"
    resolution: ClassVar[float] = 1e-12
    notes: ClassVar[Path] = Path(os.devnull)

    @property
    def factors(self) -> FactorSpace:
        return FactorSpace(tuple(Factor(name, "N", -1.0, 2.0) for name in "abc"))

    @property
    def responses(self) -> tuple[Response, ...]:
        return Response("u", "m"), Response("v", "m"), Response("w", "m")

    def respond(self, point: np.ndarray) -> tuple[float, ...]:
        with self.notes.open("a") as file:
            file.write(json.dumps(point.tolist()) + "\n")
        time.sleep(0.003)
        while self.notes.with_suffix(HOLD).exists():
            time.sleep(0.001)
        a, b, c = point
        if min(a, b, c) > 0.4 and max(a, b, c) < 2.0:
            raise ArithmeticError("the solver gave up")
        return a + 0.1 * a * b, b - 0.05 * c**2, c + 0.02 * a


def job(folder: str, notes: str, arguments: list[str]) -> int:
    """Run the study as the command line does, without the report, which takes longer than the rest."""
    import pipeline.runner
    from pipeline.cli import main

    Slow.notes = Path(notes)
    pipeline.runner.write_report = lambda folder, outcome: folder.path
    config = Path(notes).with_suffix(".toml")
    config.write_text(CONFIG, encoding="utf-8")
    # What it says goes to a file: standard output is for the parent.
    with Path(notes).with_suffix(".err").open("w") as said:
        os.dup2(said.fileno(), 1)
        os.dup2(said.fileno(), 2)
        code = main(["run", str(config), "--out", folder, *arguments])
        sys.stdout.flush()
        sys.stderr.flush()
    return code


def serve() -> None:
    """Fork once per line."""
    # What runs the tests in the background may have told its children to ignore these.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    signal.signal(signal.SIGHUP, signal.SIG_DFL)
    oracles.register(Slow)
    import pipeline.cli
    import pipeline.runner  # noqa: F401
    import surrogates

    _ = surrogates.PolynomialRegressor
    for line in sys.stdin:
        child = os.fork()
        if child == 0:
            try:
                code = job(**json.loads(line))
            except BaseException:
                import traceback

                traceback.print_exc()
                code = 99
            os._exit(code)
        print(child, flush=True)
        print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), flush=True)


if __name__ == "__main__":
    serve()

"""An oracle for worker processes: it notes who was asked what, and ends its worker when it is told to."""

import json
import os
import signal
import threading
import time
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

import numpy as np

from experiments import Factor, FactorSpace, Response
from experiments.oracles import PointOracle
from experiments.settings import parameter

NOTES, KILL_ONCE, POISON, HOLD, SPOILT = "notes", "kill-once", "poison", "hold", "spoilt"
"""Files of its folder: who was asked; the next one asked ends; large points end; nobody answers; it cannot be made."""

STILLBORN, SLOW, LINGER = "stillborn", "slow", "linger"
"""Further ones: the next worker that is made ends; none is ever ready; a thread is left that never ends."""


@dataclass(frozen=True)
class Fragile(PointOracle):
    """Two polynomials of degree two in three factors."""

    name: ClassVar[str] = "fragile"
    resolution: ClassVar[float] = 1e-12
    folder: str = parameter(".", "1", "where its files lie")
    pause: float = parameter(0.0, "s", "how long an answer takes")

    @property
    def factors(self) -> FactorSpace:
        return FactorSpace(tuple(Factor(name, "N", -1.0, 2.0) for name in "abc"))

    @property
    def responses(self) -> tuple[Response, ...]:
        return Response("u", "m"), Response("v", "m")

    def prepare(self) -> None:
        folder = Path(self.folder)
        if os.getpid() == int(os.environ.get("FRAGILE_PARENT", os.getpid())):
            return
        if (folder / SPOILT).exists():
            raise ValueError("no licence on this machine")
        with suppress(FileNotFoundError):
            (folder / STILLBORN).unlink()
            os.kill(os.getpid(), signal.SIGKILL)
        while (folder / SLOW).exists():
            (folder / SLOW).write_text(str(os.getpid()))
            time.sleep(0.05)

    def respond(self, point: np.ndarray) -> tuple[float, ...]:
        folder = Path(self.folder)
        with (folder / NOTES).open("a") as notes:
            notes.write(json.dumps([os.getpid(), point.tolist()]) + "\n")
        if is_fatal(folder, point):
            os.kill(os.getpid(), signal.SIGKILL)
        if (folder / LINGER).exists():
            threading.Thread(target=time.sleep, args=(60.0,)).start()
        time.sleep(self.pause)
        while (folder / HOLD).exists():
            time.sleep(0.005)
        a, b, c = point
        return a + 0.1 * a * b, b - 0.05 * c**2


def is_fatal(folder: Path, point: np.ndarray) -> bool:
    """Whether this is the end of whoever was asked."""
    try:
        (folder / KILL_ONCE).unlink()
    except FileNotFoundError:
        return (folder / POISON).exists() and point[0] > 1.9
    return True


def asked(folder: Path) -> list[tuple[int, tuple[float, ...]]]:
    """Who was asked what, in order."""
    lines = (folder / NOTES).read_text().splitlines() if (folder / NOTES).exists() else []
    return [(pid, tuple(point)) for pid, point in map(json.loads, lines)]

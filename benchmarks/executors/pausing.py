"""An oracle that waits: what is measured is everything but its answer."""

import time
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from experiments import Factor, FactorSpace, Response
from experiments.oracles import PointOracle
from experiments.settings import parameter


@dataclass(frozen=True)
class Pausing(PointOracle):
    """Six factors, six responses, and a pause."""

    name: ClassVar[str] = "pausing"
    pause: float = parameter(0.0, "s", "how long an answer takes")

    @property
    def factors(self) -> FactorSpace:
        """Six forces."""
        return FactorSpace(tuple(Factor(f"f{i}", "N", -1.0, 1.0) for i in range(6)))

    @property
    def responses(self) -> tuple[Response, ...]:
        """Six lengths."""
        return tuple(Response(f"r{i}", "m") for i in range(6))

    def respond(self, point: np.ndarray) -> np.ndarray:
        """Twice the forces, after a while."""
        time.sleep(self.pause)
        return 2.0 * point


def answered(point: np.ndarray, pause: float) -> np.ndarray:
    """The same as a bare function, for the peers."""
    time.sleep(pause)
    return 2.0 * point

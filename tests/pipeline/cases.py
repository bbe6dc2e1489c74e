"""Oracles and configs that the tests of the pipeline share: small, counted, and able to fail on purpose."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from experiments import Factor, FactorSpace, Response, oracles
from experiments.oracles import Oracle, PointOracle

CONFIGS = Path(__file__).parents[2] / "configs"
SMALL = ("fit.design.budget=200", "validation.n_runs=20", "export.verify=false")
"""Overrides for a study whose content does not matter; its code is verified in test_exporting.py."""

A, B, C, D = range(4)


@dataclass(frozen=True)
class Counted(PointOracle):
    """Two polynomials of degree two in three factors; the fourth factor, d, does nothing. Notes every answer."""

    name: ClassVar[str] = "counted"
    resolution: ClassVar[float] = 1e-12
    asked: ClassVar[list[tuple[float, ...]]] = []
    trouble: ClassVar[Callable[[np.ndarray], Any]] = staticmethod(lambda point: None)

    @property
    def factors(self) -> FactorSpace:
        return FactorSpace(
            (
                Factor("a", "N", -1.0, 1.0),
                Factor("b", "mm", 1.0, 3.0),
                Factor("c", "rad", -0.2, 0.1),
                Factor("d", "1", 10.0, 20.0),
            )
        )

    @property
    def responses(self) -> tuple[Response, ...]:
        return Response("u", "m", "µm", 1e6), Response("v", "rad")

    def respond(self, point: np.ndarray) -> tuple[float, ...]:
        self.trouble(point)
        a, b, c, _ = point
        self.asked.append(tuple(float(x) for x in point))
        return 1.0 + 2.0 * a + 3.0 * b + 0.1 * a * b, 20.0 * c - b


@dataclass(frozen=True)
class OneStill(Counted):
    """As :class:`Counted`, but the second response never moves."""

    name: ClassVar[str] = "one_still"

    def respond(self, point: np.ndarray) -> tuple[float, ...]:
        return super().respond(point)[0], 0.1


@dataclass(frozen=True)
class AllStill(Counted):
    """No response ever moves."""

    name: ClassVar[str] = "all_still"

    def respond(self, point: np.ndarray) -> tuple[float, ...]:
        return 0.3, 0.1


@dataclass(frozen=True)
class Unreachable(Counted):
    """Both responses follow one factor along a curve that no line and no inverse can hit."""

    name: ClassVar[str] = "unreachable"

    def respond(self, point: np.ndarray) -> tuple[float, ...]:
        return float(np.exp(point[A])), float(np.exp(-point[A]))


@dataclass(frozen=True)
class Crowded(Counted):
    """Four responses that follow from three factors, one of them along a curve."""

    name: ClassVar[str] = "crowded"

    @property
    def responses(self) -> tuple[Response, ...]:
        return *super().responses, Response("w", "N"), Response("t", "1")

    def respond(self, point: np.ndarray) -> tuple[float, ...]:
        a, b, c, _ = point
        return *super().respond(point), a + c, a * b


OURS: tuple[type[Oracle], ...] = (Counted, OneStill, AllStill, Unreachable, Crowded)


def forget() -> None:
    """Unregister the oracles above and clear their notes."""
    for cls in OURS:
        oracles._REGISTERED.pop(cls.name, None)
    Counted.asked.clear()
    Counted.trouble = staticmethod(lambda point: None)


def config_text(oracle: str = "counted", more: str = "") -> str:
    return f'name = "study"\nseed = 3\n[oracle]\nname = "{oracle}"\n{more}'


def contents(folder: Path) -> dict[str, bytes]:
    """Every file below `folder` with its bytes."""
    return {p.relative_to(folder).as_posix(): p.read_bytes() for p in sorted(folder.rglob("*")) if p.is_file()}


CLOCKED = ("provenance.json", "report.html", "points.sqlite", "log.txt", "state.json")
"""Files that may differ between two runs of one study: the clock, and what shows or stores it."""


def reproducible(folder: Path) -> dict[str, bytes]:
    """The files that two runs of one study must share byte for byte."""
    return {name: data for name, data in contents(folder).items() if name not in CLOCKED}

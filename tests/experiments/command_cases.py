"""Programs that the tests of the command oracle run: short Python scripts, started without a shell."""

import copy
from typing import Any

import numpy as np

from experiments import oracles
from experiments.designs import Design
from experiments.oracles.command import CommandOracle

PYTHON = ["{{python}}", "-I", "-S"]
"""Starts in some milliseconds: no site packages."""

BASE: dict[str, Any] = {
    "argv": [*PYTHON, "program.py", "{{a}}", "{{b}}"],
    "factors": {
        "a": {"unit": "m", "low": 0.0, "high": 2.0},
        "b": {"unit": "N", "low": -1.0, "high": 1.0},
    },
    "responses": {"y": {"unit": "m", "regex": r"y = (\S+)"}},
    "time_limit": 30.0,
    "keep": "all",
}

HEAD = "import os, signal, subprocess, sys, time\na, b = map(float, sys.argv[1:3])\n"
SUM = "print('y =', a + 2.0 * b)\n"


def settings(script: str = SUM, **changes: Any) -> dict[str, Any]:
    """Settings of a program that gets a and b and prints y, with changes."""
    files = {"program.py": {"text": HEAD + script}}
    return {**copy.deepcopy(BASE), "files": files, **changes}


def made(tmp_path: Any = None, script: str = SUM, **changes: Any) -> CommandOracle:
    """The oracle of these settings, with its working folders below `tmp_path`."""
    more = {} if tmp_path is None else {"work_folder": str(tmp_path / "work")}
    oracle = oracles.get("command", **{**settings(script), **more, **changes})
    assert isinstance(oracle, CommandOracle)
    return oracle


def at(oracle: CommandOracle, *points: tuple[float, ...]) -> Design:
    return Design.from_physical(oracle.factors, np.array(points, dtype=float), "given")


def once(oracle: CommandOracle, *point: float) -> tuple[str, str, float]:
    """Status, reason and first response at one point."""
    runs = oracle(at(oracle, point or (1.0, 0.5)))
    return str(runs.status[0]), runs.reasons[0], float(runs.values[0, 0])

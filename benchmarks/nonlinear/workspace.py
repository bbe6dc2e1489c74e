"""Two whole workspaces on all cores: points per second, and whether each point converges."""

import os
from typing import Any

import numpy as np
from numpy.typing import NDArray

from experiments import oracles
from experiments.fea import condense

from . import cases
from .processes import apart, wall

LEVELS = 22
N_HEXFLEX = 10_000


def table() -> str:
    rows = [apart(_timed, method, one_core=False) for method in ("beams", "assur")]
    checks = [apart(_flexures, one_core=False), *(apart(_hexflexes, a, one_core=False) for a in (1.0, 2.0))]
    return (
        f"#### Whole workspaces\n\nThe {LEVELS}³ points of the 3-RRR's workspace, wall time on {os.cpu_count()} cores, "
        "the best of 3, compiled before; and Newton's corrections, those of attempts that were given up included.\n\n"
        f"| 3-RRR by | seconds | points per second |\n|---|---|---|\n{''.join(rows)}\n"
        "| points | converged | corrections: mean | most |\n|---|---|---|---|\n" + "".join(checks)
    )


def workspace() -> NDArray[np.float64]:
    """The grid of crank rotations, without a wrench, (LEVELS³, 6)."""
    levels = np.linspace(-0.195, 0.245, LEVELS)
    grid = np.stack(np.meshgrid(levels, levels, levels, indexing="ij"), -1).reshape(-1, 3)
    return np.hstack([grid, np.zeros_like(grid)])


def _timed(method: str) -> str:
    oracle, points = oracles.get("flexure_3rrr", method=method), workspace()
    oracle.evaluate(points[:1])
    seconds = wall(lambda: oracle.evaluate(points))
    return f"| {method} | {seconds:.2f} | {len(points) / seconds:.0f} |\n"


def _flexures() -> str:
    frame, points = oracles.get("flexure_3rrr").frame, workspace()
    motions = np.zeros((len(points), len(frame.nodes), 6))
    for leg in range(3):
        motions[:, frame.index(f"crank in{leg + 1}"), 5] = points[:, leg]
    return _counted("3-RRR, whole workspace", condense(frame, planar=True, n_steps=4).stream(motions=motions))


def _hexflexes(amplitude: float) -> str:
    case = cases.hexflex(N_HEXFLEX, amplitude)
    found = condense(oracles.get("hexflex").frame, n_steps=8).stream(cases.tab_loads(case.points))
    return _counted(f"HexFlex, {N_HEXFLEX} random points at ±{amplitude:g} N", found)


def _counted(what: str, found: Any) -> str:
    ok, iterations = (np.concatenate(x) for x in zip(*((f.ok, f.iterations) for f in found), strict=True))
    return f"| {what} | {ok.sum()} of {len(ok)} | {iterations.mean():.2f} | {iterations.max()} |\n"

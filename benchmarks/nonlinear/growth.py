"""How time and memory grow with the members of a frame, the steps along them, and the number of points."""

import os
import resource
import time

import jax.numpy as jnp
import numpy as np

from experiments import oracles
from experiments.fea import Frame, Material, Member, condense, rectangle
from experiments.fea.sensitivity import Answer

from . import cases
from .processes import apart, cpu

MEMBERS = (8, 32, 128)
STEPS = (4, 8, 16, 32, 64)
POINTS = (10_000, 100_000, 1_000_000)
LOADS = (0.2, 1.0)
BATCH, FEW = 1024, 256


def table() -> str:
    frames = "".join(apart(_grown, kind, n) for kind in ("chain", "tree") for n in MEMBERS)
    steps = "".join(apart(_stepped, n) for n in STEPS)
    points = "".join(apart(_streamed, n, one_core=False) for n in POINTS)
    return (
        "#### Growth\n\nFrames in space of straight members, clamped at the root, random loads at the tips, 8 steps a "
        f"member, {FEW} points; CPU time on one core, the best of 3.\n\n"
        "| frame | members | load [N] | largest turn of a tip [rad] | µs per point | µs per point and member | "
        "corrections: mean | most | converged | first call [s] |\n"
        f"|---|---|---|---|---|---|---|---|---|---|\n{frames}\n"
        "The HexFlex at ±1 N by steps a leg.\n\n| steps | µs per point | µs per point and step |\n|---|---|---|\n"
        f"{steps}\n"
        f"The 3-RRR in batches of {BATCH} random points in a fresh process, on {os.cpu_count()} cores; wall time "
        "without the first call, and peak resident memory of the process.\n\n"
        f"| points | seconds | points per second | peak memory [MiB] |\n|---|---|---|---|\n{points}"
    )


def _frame(kind: str, n_members: int) -> tuple[Frame, tuple[str, ...]]:
    """A zigzag chain of 1 m or a binary tree in space, and its tips."""
    section, steel = rectangle(0.010, 0.004), Material(210e9, 0.3)
    nodes, members = {"0": np.zeros(3)}, []
    for i in range(1, n_members + 1):
        parent = i - 1 if kind == "chain" else (i - 1) // 2
        side = 1.0 if i % 2 else -1.0
        depth = int(np.log2(i + 1))
        leap = np.array([1.0, 0.3 * side, 0.0]) / n_members
        if kind == "tree":
            leap = 0.3 * 0.75**depth * np.array([1.0, 0.7 * side * (depth % 2), 0.7 * side * ((depth + 1) % 2)])
        nodes[str(i)] = nodes[str(parent)] + leap
        members.append(Member(f"{parent}-{i}", str(parent), str(i), section, steel, up=(0.0, 0.6, 0.8)))
    parents = {member.start for member in members}
    places = {name: (float(x), float(y), float(z)) for name, (x, y, z) in nodes.items()}
    return Frame(places, tuple(members), clamps=("0",)), tuple(name for name in nodes if name not in parents)


def _grown(kind: str, n_members: int) -> str:
    frame, tips = _frame(kind, n_members)
    solver = condense(frame)
    tip, rows = solver.arrays.block[frame.index(tips[-1])], []
    rng, unit = np.random.default_rng(0), np.zeros((FEW, len(frame.nodes), 6))
    for name in tips:
        unit[:, frame.index(name), :3] = rng.uniform(-1.0, 1.0, (FEW, 3)) / len(tips)

    def read(answer: Answer) -> jnp.ndarray:
        return jnp.abs(answer.motion[3:, tip])

    begin = time.perf_counter()
    solver.read(read, LOADS[0] * unit[:1])
    first = time.perf_counter() - begin
    for load in LOADS:
        each = 1e6 * cpu(lambda f=load: solver.read(read, f * unit), 3) / FEW
        turn, found = solver.read(read, load * unit).values.max(), solver.solve(load * unit)
        cells = [
            f"{each:.4g}",
            f"{each / n_members:.3g}",
            f"{found.iterations.mean():.1f}",
            f"{found.iterations.max()}",
        ]
        cells = [kind, str(n_members), f"{load:g}", f"{turn:.2g}", *cells, f"{found.ok.sum()} of {FEW}", f"{first:.1f}"]
        rows.append(f"| {' | '.join(cells)} |\n")
    return "".join(rows)


def _stepped(n_steps: int) -> str:
    case = cases.hexflex(1024)
    oracle = case.ours(n_steps)
    oracle.evaluate(case.points[:1])
    each = 1e6 * cpu(lambda: oracle.evaluate(case.points)) / len(case.points)
    return f"| {n_steps} | {each:.4g} | {each / n_steps:.3g} |\n"


def _streamed(n: int) -> str:
    oracle, rng = oracles.get("flexure_3rrr"), np.random.default_rng(0)
    oracle.evaluate(np.zeros((1, 6)))
    begin = time.perf_counter()
    for start in range(0, n, BATCH):
        points = np.zeros((min(BATCH, n - start), 6))
        points[:, :3] = rng.uniform(-0.195, 0.245, (len(points), 3))
        if not np.isfinite(oracle.evaluate(points).values).all():
            raise RuntimeError(f"a point beyond {start} has no equilibrium")
    seconds = time.perf_counter() - begin
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    return f"| {n} | {seconds:.2f} | {n / seconds:.0f} | {peak:.0f} |\n"

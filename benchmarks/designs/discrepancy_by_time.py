"""CD₂² against time for the sizes of our aims: ``python -m benchmarks.designs.discrepancy_by_time [SECONDS ...]``.

Beside scipy's random-cd and, where they are installed, OpenTURNS' simulated annealing, smt's and pydoe's
optimised Latin hypercubes. The peers make Latin hypercubes only (levels = runs). smt and pydoe cannot lower
a discrepancy: they spread points apart (ESE on φp, maximin). Seconds are processor seconds of one core,
the same for all; what ends early is restarted, and the best counts.
"""

import importlib
import sys
import time
from collections.abc import Callable
from importlib.util import find_spec
from typing import Any

from scipy.stats import qmc

from experiments.designs import centred_discrepancy_squared

from .search import best_in

SIZES = ((16, 4, 16), (30, 6, 6), (30, 6, 30), (100, 10, 100))
SEEDS = (0, 1, 2)


def table(seconds: tuple[float, ...] = (2.0, 10.0)) -> str:
    peers = {name: peer for name, (needs, peer) in PEERS.items() if find_spec(needs)}
    lines = [
        "### Squared centred discrepancy against time\n",
        f"Ours: median of {len(SEEDS)} seeds. The peers make designs with levels = runs only.\n",
        f"| runs, factors, levels | seconds | ours | {' | '.join(peers)} |",
        "|---" * (3 + len(peers)) + "|",
    ]
    for n, s, q in SIZES:
        for allowed in seconds:
            ours = sorted(best_in(n, s, q, allowed, seed)[0] for seed in SEEDS)[len(SEEDS) // 2]
            theirs = [f"{peer(n, s, allowed):.6f}" if n == q else "–" for peer in peers.values()]
            lines.append(f"| {n}, {s}, {q} | {allowed:g} | {ours:.6f} | {' | '.join(theirs)} |")
    return "\n".join(lines) + "\n"


def restarted(make: Callable[[int], Any], seconds: float) -> float:
    """The lowest CD₂² of designs made with seed 0, 1, 2, … until the time is spent; at least one."""
    best, begin, seed = float("inf"), time.process_time(), 0
    while seed == 0 or time.process_time() - begin < seconds:
        best = min(best, centred_discrepancy_squared(make(seed)))
        seed += 1
    return best


def scipy_in(n: int, s: int, seconds: float) -> float:
    def make(seed: int) -> Any:
        return qmc.LatinHypercube(s, scramble=False, optimization="random-cd", rng=seed).random(n)

    return restarted(make, seconds)


def openturns_in(n: int, s: int, seconds: float) -> float:
    """Geometric profiles of growing length until the time is spent; the best counts."""
    ot = importlib.import_module("openturns")
    ot.RandomGenerator.SetSeed(0)
    box = ot.JointDistribution([ot.Uniform(0.0, 1.0)] * s)
    best, begin, length = float("inf"), time.process_time(), 2000
    while time.process_time() - begin < seconds / 2:  # the next profile takes about as long as all before it
        cells = ot.LHSExperiment(box, n, False, False)
        profile = ot.GeometricProfile(1e-2, 1e-4 ** (1.0 / length), length)
        found = ot.SimulatedAnnealingLHS(cells, ot.SpaceFillingC2(), profile).generate()
        best = min(best, centred_discrepancy_squared(found))
        length *= 2
    return best


def smt_in(n: int, s: int, seconds: float) -> float:
    sampling = importlib.import_module("smt.sampling_methods")
    import numpy as np

    limits = np.tile([0.0, 1.0], (s, 1))
    return restarted(lambda seed: sampling.LHS(xlimits=limits, criterion="ese", seed=seed)(n), seconds)


def pydoe_in(n: int, s: int, seconds: float) -> float:
    pydoe = importlib.import_module("pydoe")
    return restarted(lambda seed: pydoe.lhs(s, n, criterion="centermaximin", iterations=1000, seed=seed), seconds)


PEERS = {
    "scipy random-cd": ("scipy", scipy_in),
    "OpenTURNS annealing": ("openturns", openturns_in),
    "smt ESE": ("smt", smt_in),
    "pydoe maximin": ("pydoe", pydoe_in),
}


if __name__ == "__main__":
    print(table(tuple(float(text) for text in sys.argv[1:]) or (2.0, 10.0, 60.0)))

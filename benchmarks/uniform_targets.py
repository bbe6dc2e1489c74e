"""CD₂² against time for the sizes of our targets: ``python -m benchmarks.uniform_targets [SECONDS ...]``.

Beside scipy's random-cd and, where it is installed, the simulated annealing of OpenTURNS. Both make
Latin hypercubes only (levels = runs). Seconds are processor seconds of one core, the same for all.
"""

import importlib
import sys
import time
from importlib.util import find_spec

from scipy.stats import qmc

from experiments.designs import centred_discrepancy_squared

from .uniform_published import best_in

SIZES = ((16, 4, 16), (30, 6, 6), (30, 6, 30), (100, 10, 100))


def scipy_in(n: int, s: int, seconds: float) -> float:
    best, begin, restart = float("inf"), time.process_time(), 0
    while restart == 0 or time.process_time() - begin < seconds:
        sampler = qmc.LatinHypercube(s, scramble=False, optimization="random-cd", rng=restart)
        best = min(best, centred_discrepancy_squared(sampler.random(n)))
        restart += 1
    return best


def openturns_in(n: int, s: int, seconds: float) -> float:
    """Geometric profiles of growing length until the time is spent; the best counts."""
    ot = importlib.import_module("openturns")
    ot.RandomGenerator.SetSeed(0)
    box = ot.JointDistribution([ot.Uniform(0.0, 1.0)] * s)
    best, begin, length = float("inf"), time.process_time(), 2000
    while time.process_time() - begin < seconds / 2:  # the next profile takes about as long as all before it
        cells = ot.LHSExperiment(box, n, False, False)
        profile = ot.GeometricProfile(1e-2, 1e-4 ** (1.0 / length), length)
        best = min(
            best, centred_discrepancy_squared(ot.SimulatedAnnealingLHS(cells, ot.SpaceFillingC2(), profile).generate())
        )
        length *= 2
    return best


def main(seconds: list[float]) -> None:
    peers = {"scipy random-cd": scipy_in}
    if find_spec("openturns"):
        peers["OpenTURNS annealing"] = openturns_in
    print(f"| runs, factors, levels | allowed [s] | ours | ours [s] | exchanges tried | {' | '.join(peers)} |")
    print("|---" * (5 + len(peers)) + "|")
    for n, s, q in SIZES:
        for allowed in seconds:
            ours, spent, budget = best_in(n, s, q, allowed)
            theirs = [f"{peer(n, s, allowed):.6f}" if n == q else "–" for peer in peers.values()]
            print(
                f"| {n}, {s}, {q} | {allowed:g} | {ours:.7f} | {spent:.1f} | {budget} | {' | '.join(theirs)} |",
                flush=True,
            )


if __name__ == "__main__":
    main([float(text) for text in sys.argv[1:]] or [2.0, 10.0, 60.0])

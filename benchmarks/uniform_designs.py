"""Centred discrepancy of our uniform designs beside scipy's optimised Latin hypercubes, same class, same time."""

import csv
import time
from pathlib import Path

from scipy.stats import qmc

from experiments import Factor, FactorSpace
from experiments.designs import Uniform, centred_discrepancy_squared, level_discrepancy_squared

SEEDS = (0, 1, 2)
PUBLISHED = Path(__file__).parents[1] / "tests" / "reference" / "designs" / "published_cd2.csv"


def published() -> list[tuple[int, int, int, float]]:
    """Runs, factors, levels and the best published CD₂²."""
    with PUBLISHED.open(encoding="utf-8") as file:
        return [
            (*(int(row[k]) for k in ("n_runs", "n_factors", "n_levels")), float(row["best_published_cd2_squared"]))
            for row in csv.DictReader(file)
        ]


def table() -> str:
    lines = [
        "### Uniform designs\n",
        "Squared centred discrepancy, median of 3 seeds, default budget (4 million exchanges tried). scipy's Latin "
        "hypercube (random-cd, cell centres) is of the same class where levels = runs; it is restarted until it has "
        "spent our time, the best counts.\n",
        "| runs, factors, levels | best published | ours | ours [s] | scipy, same time |",
        "|---|---|---|---|---|",
    ]
    lines += [_row(*row) for row in published()]
    return "\n".join(lines) + "\n"


def _row(n: int, s: int, q: int, published: float) -> str:
    space = FactorSpace(tuple(Factor(f"x{i}", "1", -1.0, 1.0) for i in range(s)))
    ours, theirs, spent = [], [], []
    for seed in SEEDS:
        begin = time.process_time()
        design = Uniform(n_runs=n, levels=q).generate(space, seed)
        spent.append(time.process_time() - begin)
        ours.append(level_discrepancy_squared(design.coded))
        if q == n:
            theirs.append(_scipy(n, s, seed, spent[-1]))
    peer = f"{sorted(theirs)[1]:.6f}" if theirs else "–"
    return f"| {n}, {s}, {q} | {published:.6f} | {sorted(ours)[1]:.6f} | {sorted(spent)[1]:.2f} | {peer} |"


def _scipy(n: int, s: int, seed: int, seconds: float) -> float:
    best, begin, restart = float("inf"), time.process_time(), 0
    while restart == 0 or time.process_time() - begin < seconds:
        sampler = qmc.LatinHypercube(s, scramble=False, optimization="random-cd", rng=1000 * seed + restart)
        best = min(best, centred_discrepancy_squared(sampler.random(n)))
        restart += 1
    return best

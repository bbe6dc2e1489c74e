"""Uniform designs against the best published ones: ``python -m benchmarks.uniform_published [SECONDS [PART PARTS]]``.

One line a row of ``published_cd2.csv``, then the fraction matched or beaten. Seconds are processor
seconds of one core; the budget is found from a short trial, so that each row spends about what it may.
"""

import sys
import time

from experiments import Factor, FactorSpace
from experiments.designs import Uniform, level_discrepancy_squared

from .uniform_designs import published

TRIAL = 1_000_000
"""Exchanges of the trial that measures the speed, after one that compiles."""

MATCHED = 1e-9
"""Relative difference that rounding explains."""


def best_in(n: int, s: int, q: int, seconds: float, seed: int = 0) -> tuple[float, float, int]:
    """CD₂² reached, processor seconds spent in the search, and the budget that was."""
    space = FactorSpace(tuple(Factor(f"x{i}", "1", -1.0, 1.0) for i in range(s)))
    Uniform(n, q, TRIAL // 10).generate(space, seed)
    begin = time.process_time()
    Uniform(n, q, TRIAL).generate(space, seed)
    budget = int(TRIAL * 0.9 * seconds / (time.process_time() - begin))
    begin = time.process_time()
    design = Uniform(n, q, budget).generate(space, seed)
    return level_discrepancy_squared(design.coded), time.process_time() - begin, budget


def main(seconds: float = 30.0, part: int = 0, parts: int = 1) -> None:
    rows = published()[part::parts]
    reached = 0
    print("| runs, factors, levels | best published | ours | ours / published | seconds | exchanges tried |")
    print("|---|---|---|---|---|---|")
    for n, s, q, best in rows:
        ours, spent, budget = best_in(n, s, q, seconds)
        reached += ours <= best * (1.0 + MATCHED)
        print(f"| {n}, {s}, {q} | {best:.8g} | {ours:.8g} | {ours / best:.5f} | {spent:.1f} | {budget} |", flush=True)
    print(f"\n{reached} of {len(rows)} matched or beaten.")


if __name__ == "__main__":
    main(*(kind(text) for kind, text in zip((float, int, int), sys.argv[1:], strict=False)))

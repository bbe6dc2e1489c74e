"""Our search with a budget that takes a wanted time on this machine."""

import time

from experiments import Factor, FactorSpace
from experiments.designs import Uniform, level_discrepancy_squared

TRIAL = 3_000_000
"""Exchanges of the trial that measures the speed, after one that compiles."""


def space(s: int) -> FactorSpace:
    return FactorSpace(tuple(Factor(f"x{i}", "1", -1.0, 1.0) for i in range(s)))


def best_in(n: int, s: int, q: int, seconds: float, seed: int = 0) -> tuple[float, float, int]:
    """CD₂² reached, processor seconds spent in the search, and the budget that was."""
    Uniform(n, q, TRIAL // 10).generate(space(s), seed)
    budget = TRIAL
    # Twice: a small budget goes straight down, a larger one spends more time on exchanges that are made.
    for share in (0.1, 0.9):
        begin = time.process_time()
        Uniform(n, q, budget).generate(space(s), seed)
        budget = max(TRIAL, int(budget * share * seconds / (time.process_time() - begin)))
    begin = time.process_time()
    design = Uniform(n, q, budget).generate(space(s), seed)
    return level_discrepancy_squared(design.coded), time.process_time() - begin, budget

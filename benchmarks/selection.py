"""How often a term above degree one is kept where the truth is linear, beside the rule that is usual."""

import numpy as np

from experiments import Factor, FactorSpace, Terms, model_matrix
from experiments.designs import Uniform
from surrogates.selection import PENALTIES, Fit, backward_path, trimmed_fit

EXPERIMENTS = 48
NOISE = 1e-2


def table() -> str:
    lines = [
        "### Choice of terms\n",
        f"{EXPERIMENTS} linear maps (three factors act) with noise of {NOISE:g} of their size, fitted from the full "
        "quadratic: experiments in which a term above degree one was kept. The peer judges the backward path by its "
        "own leave-one-out residuals, with the same one-standard-error rule.\n",
        "| factors, runs, candidates | ours | path judged by itself | linear terms lost by ours |",
        "|---|---|---|---|",
    ]
    for n_factors, n_runs in ((4, 24), (6, 30), (6, 60)):
        lines.append(_row(n_factors, n_runs))
    return "\n".join(lines) + "\n"


def _row(n_factors: int, n_runs: int) -> str:
    space = FactorSpace(tuple(Factor(f"x{i}", "1", -1.0, 1.0) for i in range(n_factors)))
    terms = Terms.polynomial(space.names, 2)
    designs = [Uniform(n_runs, 6, budget=500).generate(space, seed) for seed in range(6)]
    ours = theirs = lost = 0
    for seed in range(EXPERIMENTS):
        rng = np.random.default_rng(seed)
        matrix = model_matrix(terms, designs[seed % len(designs)].coded)
        truth = np.zeros(len(terms))
        acting = 1 + rng.choice(n_factors, 3, replace=False)
        truth[acting] = rng.uniform(0.5, 1.0, 3) * rng.choice([-1.0, 1.0], 3)
        y = matrix @ truth + NOISE * np.abs(truth).sum() * rng.normal(size=n_runs)
        kept = trimmed_fit(matrix, y).columns
        ours += bool((terms.degrees[kept] > 1).any())
        theirs += bool((terms.degrees[_judged_by_itself(matrix, y).columns] > 1).any())
        lost += not set(acting) <= set(kept.tolist())
    return f"| {n_factors}, {n_runs}, {len(terms)} | {ours} of {EXPERIMENTS} | {theirs} of {EXPERIMENTS} | {lost} |"


def _judged_by_itself(matrix: np.ndarray, y: np.ndarray) -> Fit:
    path = backward_path(matrix, y, PENALTIES, 0.0)
    squares = [fit.loo**2 for fit in path]
    best = min(squares, key=np.mean)
    allowed = best.mean() + best.std(ddof=1) / np.sqrt(len(y))
    return [fit for fit, square in zip(path, squares, strict=True) if square.mean() <= allowed][-1]

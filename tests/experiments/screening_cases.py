"""Designs and answers that the tests of screening share."""

from itertools import product

import numpy as np

from experiments import Factor, FactorSpace, Response, Runs, Status
from experiments.designs import Design, PlackettBurman

LETTERS = "ABCDEFGHIJKLMNOPQRSTUVWXYZ"


def space(n: int) -> FactorSpace:
    names = LETTERS[:n] if n <= 26 else [f"F{i + 1}" for i in range(n)]
    return FactorSpace(tuple(Factor(name, "N", -2.0, 6.0) for name in names))


def plackett_burman(n_runs: int, n_factors: int, n_centre: int = 0, folded: bool = False) -> Design:
    """A design with its dummies; folded, these are those of the doubled Hadamard matrix."""
    base = PlackettBurman(n_runs).generate(space(n_factors))
    columns = np.hstack([base.coded, base.dummies])
    if folded:
        even = np.vstack([columns, columns])
        sign = np.repeat([[1.0], [-1.0]], len(columns), axis=0)
        columns = np.hstack([even * sign, sign, even])
    columns = np.vstack([columns, np.zeros((n_centre, columns.shape[1]))])
    return Design(base.space, columns[:, :n_factors], "plackett_burman", columns[:, n_factors:])


def full_factorial(n_factors: int) -> Design:
    """Standard order, the first factor fastest, without any dummies."""
    return Design(space(n_factors), np.array(list(product([-1.0, 1.0], repeat=n_factors)))[:, ::-1], "full")


def answered(design: Design, *columns: np.ndarray) -> Runs:
    n = len(design)
    responses = tuple(Response(f"y{i + 1}", "m") for i in range(len(columns)))
    return Runs(design, responses, np.column_stack(columns), (Status.OK,) * n, ("",) * n)

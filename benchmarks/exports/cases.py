"""Models that are timed: dense and sparse certified polynomials of 6 factors to 6 responses, made from a seed."""

from dataclasses import replace
from itertools import combinations_with_replacement

import numpy as np

from experiments import Factor, FactorSpace, Response, Terms
from surrogates import Surrogate, certify

N = 6


def dense(degree: int = 3, curved: float = 0.0045, seed: int = 0) -> Surrogate:
    """All terms up to `degree` (84 for 3); higher ones normal with that deviation, so that it is certified."""
    exponents = _all_terms(degree)
    rng = np.random.default_rng(seed)
    coefficients = curved * rng.normal(size=(len(exponents), N))
    _linear_part(exponents, coefficients, rng)
    return _model(exponents, coefficients)


def sparse(kept: int, seed: int = 0) -> Surrogate:
    """The dense cubic with `kept` higher terms for each response, chosen at random; linear terms all kept."""
    exponents = _all_terms(3)
    rng = np.random.default_rng(seed)
    higher = np.flatnonzero([sum(e) > 1 for e in exponents])
    coefficients = np.zeros((len(exponents), N))
    for j in range(N):
        coefficients[rng.choice(higher, kept, replace=False), j] = 0.0045 * rng.normal(size=kept)
    _linear_part(exponents, coefficients, rng)
    return _model(exponents, coefficients)


def _all_terms(degree: int) -> list[tuple[int, ...]]:
    found = []
    for d in range(degree + 1):
        for chosen in combinations_with_replacement(range(N), d):
            found.append(tuple(chosen.count(k) for k in range(N)))
    return found


def _linear_part(exponents: list[tuple[int, ...]], coefficients: np.ndarray, rng: np.random.Generator) -> None:
    for row, e in enumerate(exponents):
        if sum(e) == 1:
            coefficients[row] = 0.1 * rng.normal(size=N)
            coefficients[row, e.index(1)] += 1.0


def _model(exponents: list[tuple[int, ...]], coefficients: np.ndarray) -> Surrogate:
    names = tuple(f"f{i}" for i in range(N))
    factors = FactorSpace(tuple(Factor(name, "N", -1.0, 1.0) for name in names))
    responses = tuple(Response(f"r{j}", "m") for j in range(N))
    model = Surrogate(factors, responses, Terms(names, tuple(exponents)), coefficients)
    return replace(model, certificate=certify(model))


CASES = {
    "dense 6 → 6 cubic, 84 terms": dense,
    "sparse, 6 + 24 terms a response": lambda: sparse(24),
    "sparse, 6 + 8 terms a response": lambda: sparse(8),
    "linear": lambda: dense(degree=1),
}

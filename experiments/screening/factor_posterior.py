"""Which factors act, interactions counted: Box and Meyer's posterior over models of a confounded design."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import chain, combinations
from math import comb

import numpy as np
from numpy.typing import ArrayLike, NDArray

MOST_MODELS = 200_000
"""More models than this take minutes."""


@dataclass(frozen=True, eq=False)
class FactorPosterior:
    """Posterior of one response over sets of active factors.

    Parameters
    ----------
    names : tuple of str
        Factor names, length n_factors.
    probabilities : ndarray, shape (n_factors,)
        Posterior probability that each factor acts, alone or in an interaction.
    models : tuple of tuple of str
        Sets of active factors, the most probable first.
    weights : ndarray, shape (n_models,)
        Their posterior probabilities.
    """

    names: tuple[str, ...]
    probabilities: NDArray[np.float64]
    models: tuple[tuple[str, ...], ...]
    weights: NDArray[np.float64]

    @property
    def active_names(self) -> tuple[str, ...]:
        """Factors that act more probably than not."""
        return tuple(n for n, p in zip(self.names, self.probabilities, strict=True) if p > 0.5)


def factor_posterior(
    factors: ArrayLike,
    response: ArrayLike,
    names: Sequence[str],
    prior: float = 0.25,
    inflation: float = 2.0,
    interactions: int = 2,
    most_active: int | None = None,
) -> FactorPosterior:
    """Probability that each factor acts, where interactions are confounded with main effects.

    Parameters
    ----------
    factors : array_like, shape (n_runs, n_factors)
        Coded settings; the design need not be orthogonal or two-level.
    response : array_like, shape (n_runs,)
        Answers, in any unit.
    names : sequence of str
        Factor names, length n_factors.
    prior : float
        π, the prior probability that a factor acts.
    inflation : float
        γ, the standard deviation of an active coefficient over that of a run.
    interactions : int
        Highest order of the interactions of active factors; 1 for main effects only.
    most_active : int, optional
        Largest number of active factors tried; all if not given.

    Raises
    ------
    ValueError
        If the shapes disagree, a setting is out of range, the response never changes, or the models are too many.

    Notes
    -----
    Box and Meyer (1993), "Finding the active factors in fractionated screening experiments", J. Quality
    Technology 25, 94–105. With f factors and the model matrix X of t terms beside the constant,
    p ∝ (π/(1 − π))^f γ^(−t) |Γ + X'X|^(−1/2) S^(−(n − 1)/2), where Γ = γ^(−2) I but 0 for the constant and
    S is the residual sum of squares with the penalty β'Γβ.
    """
    x, y = np.array(factors, dtype=float), np.array(response, dtype=float)
    most = x.shape[-1] if most_active is None else most_active
    _check(x, y, names, prior, inflation, interactions, most)
    subsets = [s for size in range(most + 1) for s in combinations(range(x.shape[1]), size)]
    logs = np.array(
        [
            len(s) * np.log(prior / (1.0 - prior)) + _log_evidence(_terms(x, s, interactions), y - y.mean(), inflation)
            for s in subsets
        ]
    )
    weights = np.exp(logs - logs.max())
    weights /= weights.sum()
    acts = np.array([[j in s for j in range(x.shape[1])] for s in subsets])
    order = np.argsort(-weights, kind="stable")
    known = tuple(str(name) for name in names)
    models = tuple(tuple(known[j] for j in subsets[i]) for i in order)
    return FactorPosterior(known, weights @ acts, models, weights[order])


def _terms(x: NDArray[np.float64], subset: tuple[int, ...], interactions: int) -> NDArray[np.float64]:
    """Products of up to `interactions` of the subset's columns, shape (n_runs, n_terms)."""
    orders = range(1, min(interactions, len(subset)) + 1)
    chosen = chain.from_iterable(combinations(subset, order) for order in orders)
    return np.column_stack([np.empty((len(x), 0)), *(x[:, list(c)].prod(axis=1) for c in chosen)])


def _log_evidence(terms: NDArray[np.float64], y: NDArray[np.float64], inflation: float) -> float:
    """Logarithm of γ^(−t) |Γ + X'X|^(−1/2) S^(−(n−1)/2), the constant's share left out as it is common."""
    n, t = terms.shape
    centred = terms - terms.mean(axis=0)
    matrix = centred.T @ centred + np.eye(t) / inflation**2
    moment = centred.T @ y
    left = float(y @ y - moment @ np.linalg.solve(matrix, moment)) if t else float(y @ y)
    log_determinant = float(np.linalg.slogdet(matrix)[1]) if t else 0.0
    return -t * np.log(inflation) - 0.5 * log_determinant - 0.5 * (n - 1) * np.log(max(left, 1e-300))


def _check(x, y, names, prior: float, inflation: float, interactions: int, most: int) -> None:
    if x.ndim != 2 or y.shape != (len(x),) or len(names) != x.shape[1]:
        raise ValueError(f"need one response a run and one name a factor; got {x.shape}, {y.shape}, {len(names)} names")
    if not (np.isfinite(x).all() and np.isfinite(y).all()) or np.ptp(y) == 0.0:
        raise ValueError("the posterior needs finite settings and a response that changes")
    if not 0.0 < prior < 1.0:
        raise ValueError(f"prior must lie between 0 and 1, got {prior}")
    if not (np.isfinite(inflation) and inflation > 0.0):
        raise ValueError(f"inflation must be a positive number, got {inflation}")
    if interactions < 1 or not 1 <= most <= x.shape[1]:
        raise ValueError(
            f"interactions must be 1 or more and most_active 1 to {x.shape[1]}; got {interactions}, {most}"
        )
    models = sum(comb(x.shape[1], size) for size in range(most + 1))
    if models > MOST_MODELS:
        raise ValueError(f"{models} models are more than {MOST_MODELS}: set most_active lower than {most}")

"""Box and Meyer's posterior probability that a contrast acts."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .judgement import checked

NODES = 4001
"""Nodes of the integral over log σ: its integrand is smooth and falls off on both sides."""
DEEP = 60.0
"""Logarithmic drop below the peak beyond which the integrand is left out."""


@dataclass(frozen=True, eq=False)
class ContrastPosterior:
    """Posterior of one response.

    Parameters
    ----------
    names : tuple of str
        Contrast names, length m.
    probabilities : ndarray, shape (m,)
        Posterior probability that each contrast acts.
    prior : float
        Prior probability that a contrast acts.
    inflation : float
        How many times wider active contrasts are spread than inert ones.
    log_sigma, weights : ndarray, shape (n_nodes,)
        Posterior of the logarithm of an inert contrast's standard deviation; the weights sum to one.
    given_sigma : ndarray, shape (n_nodes, m)
        Probability that each contrast acts, given sigma.
    """

    names: tuple[str, ...]
    probabilities: NDArray[np.float64]
    prior: float
    inflation: float
    log_sigma: NDArray[np.float64]
    weights: NDArray[np.float64]
    given_sigma: NDArray[np.float64]

    @property
    def active_names(self) -> tuple[str, ...]:
        """Contrasts that act more probably than not."""
        return tuple(n for n, p in zip(self.names, self.probabilities, strict=True) if p > 0.5)

    def model(self, active: Collection[str]) -> float:
        """Posterior probability that exactly the contrasts named `active` act; of none, if it is empty."""
        unknown = sorted(set(active) - set(self.names))
        if unknown:
            raise ValueError(f"unknown contrast {unknown[0]!r}; known are {', '.join(self.names)}")
        acts = np.array([n in set(active) for n in self.names])
        return float(self.weights @ np.where(acts, self.given_sigma, 1.0 - self.given_sigma).prod(axis=1))


def box_meyer(
    contrasts: ArrayLike,
    names: Sequence[str] | None = None,
    prior: float = 0.2,
    inflation: float = 10.0,
    noise_floor: float = 0.0,
) -> ContrastPosterior:
    """Probability that each contrast acts.

    Parameters
    ----------
    contrasts : array_like, shape (m,)
        Effects of mutually orthogonal columns, the dummies included.
    names : sequence of str, optional
        Length m; ``c1``, ``c2``, … if not given.
    prior : float
        α, the prior probability that a contrast acts; 0.13 to 0.27 in the authors' ten examples.
    inflation : float
        k, the standard deviation of active contrasts over that of inert ones; 2.7 to 27 in the same.
    noise_floor : float
        Smallest believable standard error, in the contrasts' unit.

    Raises
    ------
    ValueError
        If there are fewer than three contrasts, one is not finite, all are zero, or a setting is out of range.

    Notes
    -----
    Box and Meyer (1986), "An analysis for unreplicated fractional factorials", Technometrics 28, 11–18: a contrast
    is N(0, σ²) with probability 1 − α and N(0, k²σ²) with α; log σ is uniform a priori and integrated out
    numerically.
    """
    contrasts, names = checked(contrasts, names, 0.05, noise_floor, "Box and Meyer's")
    if not 0.0 < prior < 1.0:
        raise ValueError(f"prior must lie between 0 and 1, got {prior}")
    if not (np.isfinite(inflation) and inflation > 1.0):
        raise ValueError(f"inflation must be a number above 1, got {inflation}")
    if not contrasts.any():
        raise ValueError("Box and Meyer's method needs a contrast other than zero: the response never changes")
    top = float(np.log(np.abs(contrasts).max()))
    low = np.log(noise_floor) if noise_floor > 0.0 else top - 50.0
    # The first pass finds where the integrand lives, the second resolves it.
    coarse = np.linspace(min(low, top), max(low, top) + 10.0, NODES)
    log_density, _ = _posterior(contrasts, coarse, prior, inflation)
    near = np.flatnonzero(log_density > log_density.max() - DEEP)
    log_sigma = np.linspace(coarse[max(near[0] - 1, 0)], coarse[min(near[-1] + 1, NODES - 1)], NODES)
    log_density, given = _posterior(contrasts, log_sigma, prior, inflation)
    weights = np.exp(log_density - log_density.max())
    weights[[0, -1]] *= 0.5
    weights /= weights.sum()
    return ContrastPosterior(names, weights @ given, prior, inflation, log_sigma, weights, given)


def _posterior(
    contrasts: NDArray[np.float64], log_sigma: NDArray[np.float64], prior: float, inflation: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Log density of log σ, up to a constant, and the probability that each contrast acts at each σ."""
    with np.errstate(over="ignore"):
        square = 0.5 * (contrasts / np.exp(log_sigma)[:, None]) ** 2
    inert = np.log1p(-prior) - square
    acts = np.log(prior / inflation) - square / inflation**2
    either = np.logaddexp(inert, acts)
    return either.sum(axis=1) - len(contrasts) * log_sigma, np.exp(acts - either)

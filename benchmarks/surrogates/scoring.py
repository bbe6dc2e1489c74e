"""The designs all methods share, the test points, and the score."""

import numpy as np
from scipy.stats import qmc

from .functions import Floats, Function

N_TEST, TEST_SEED = 5000, 19931


def design(n_inputs: int, n: int, seed: int) -> Floats:
    """A Latin hypercube in coded units, shape (n, n_inputs)."""
    return 2.0 * qmc.LatinHypercube(n_inputs, rng=seed).random(n) - 1.0


def score(function: Function, predicted: Floats, X: Floats) -> float:
    """RMSE over the standard deviation of the truth; of several responses, the root of the mean square of that.

    Raises
    ------
    ValueError
        If a prediction is missing or not finite.
    """
    truth = function.values(X)
    found = np.asarray(predicted, dtype=np.float64).reshape(len(X), -1)
    if found.shape != truth.shape or not np.isfinite(found).all():
        raise ValueError(f"predictions must be finite and of shape {truth.shape}, got shape {found.shape}")
    return float(np.sqrt(np.mean(np.mean((found - truth) ** 2, axis=0) / np.var(truth, axis=0))))


def fresh_points(n_inputs: int) -> Floats:
    """Uniform random points in coded units, shape (N_TEST, n_inputs)."""
    return np.random.default_rng(TEST_SEED).uniform(-1.0, 1.0, (N_TEST, n_inputs))

"""How noisy a simulator is: estimated from repeated runs, or from runs along a short line."""

from math import comb

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..runs import Runs

AGREEMENT = 4.0
"""Estimates of neighbouring orders within this factor agree."""


def effect_error(run_error: ArrayLike, n_runs: int) -> NDArray[np.float64]:
    """Standard error of an effect from that of one run: 2σ/√n for n two-level runs, in the same unit."""
    return 2.0 * np.asarray(run_error, dtype=float) / np.sqrt(n_runs)


def replicate_error(runs: Runs) -> tuple[NDArray[np.float64], int]:
    """Standard deviation of one run from repeated settings, shape (n_responses,), and its degrees of freedom.

    Centre points count as well. A deterministic simulator repeats itself exactly: then this is zero and
    :func:`line_noise` tells more.

    Raises
    ------
    ValueError
        If no setting was run twice.
    """
    done = runs.completed()
    _, group = np.unique(np.round(done.design.coded, 9), axis=0, return_inverse=True)
    group = group.ravel()
    freedom = len(group) - (int(group.max(initial=-1)) + 1)
    if not freedom:
        raise ValueError("no setting was run twice, so nothing was repeated: add centre points, or use line_noise")
    means = np.stack([done.values[group == g].mean(axis=0) for g in range(group.max() + 1)])
    return np.sqrt(((done.values - means[group]) ** 2).sum(axis=0) / freedom), freedom


def line_noise(values: ArrayLike) -> float:
    """Standard deviation of the noise in runs at equal steps along a short line; 0 if none shows above the physics.

    Parameters
    ----------
    values : array_like, shape (n_runs,)
        One response at seven or more settings in equal, small steps, in any unit.

    Returns
    -------
    float
        In the same unit. Mesh changes, solver tolerances and rounding count as noise, as they do for a fit.

    Raises
    ------
    ValueError
        If there are fewer than seven values, or one is not finite.

    Notes
    -----
    Moré and Wild (2011), "Estimating computational noise", SIAM J. Sci. Comput. 33, 1292–1314: differences of
    order k of a smooth function die out while those of noise grow as √C(2k, k). The first order from which three
    successive estimates agree within a factor of four, and at which the differences change sign, is taken; of the
    three the middle one, as the slope may still show in the first.
    """
    values = np.array(values, dtype=float)
    if values.ndim != 1 or len(values) < 7 or not np.isfinite(values).all():
        raise ValueError(f"line_noise needs at least 7 finite values in a row, got shape {values.shape}")
    estimates, changes = [], []
    differences = values
    for k in range(1, len(values) - 1):
        differences = np.diff(differences)
        estimates.append(float(np.sqrt(np.mean(differences**2) / comb(2 * k, k))))
        changes.append(bool(differences.min() * differences.max() < 0.0))
    for k in range(len(estimates) - 2):
        near = estimates[k : k + 3]
        if changes[k] and max(near) <= AGREEMENT * min(near):
            return sorted(near)[1]
    return 0.0

"""Newton's method from many starts: settings that give a target, as far as they are found. Nothing here is proven."""

from typing import TYPE_CHECKING

import numpy as np

from .enclosures import Floats

if TYPE_CHECKING:
    from .model import Surrogate

STARTS = 16
"""Starts per target: random, and the same for every target, so that an answer does not depend on the others."""

MOST_STEPS = 40

CONVERGED = 1e-9
"""Length of the last step, in coded units: at a fold the method creeps, and rounding keeps its steps above."""

NEAR = 1e-5
"""Settings that differ by less in every coded factor count as one; a double root is found to about 1e-7."""

FEW = 1 << 21
"""Numbers in the largest array of one round: more do not fit the cache."""


def starts(n_factors: int) -> Floats:
    """Coded settings to start from, shape (STARTS, n_factors)."""
    return np.random.default_rng(0).uniform(-1.0, 1.0, (STARTS, n_factors))


def search(model: "Surrogate", targets: Floats, begin: Floats) -> Floats:
    """Where Newton's method ends from every start, for every target.

    Parameters
    ----------
    model : Surrogate
        With at least as many responses as factors.
    targets : ndarray, shape (n, n_responses)
        SI.
    begin : ndarray, shape (n_starts, n_factors)
        Coded.

    Returns
    -------
    ndarray, shape (n, n_starts, n_factors)
        Coded, in the box or not; NaN where the method did not converge.
    """
    n, s = len(targets), len(begin)
    rows = max(1, FEW // (len(model.terms) * len(model.factors) * s))
    ends = np.empty((n, s, begin.shape[1]))
    for at in range(0, n, rows):
        some = np.repeat(targets[at : at + rows], s, axis=0)
        ends[at : at + rows] = newton(model, some, np.tile(begin, (len(some) // s, 1))).reshape(-1, *begin.shape)
    return ends


def newton(model: "Surrogate", targets: Floats, begin: Floats) -> Floats:
    """Where Newton's method ends, one start per target; NaN where it does not converge.

    Parameters
    ----------
    model : Surrogate
        With at least as many responses as factors.
    targets : ndarray, shape (n, n_responses)
        SI.
    begin : ndarray, shape (n, n_factors)
        Coded.

    Returns
    -------
    ndarray, shape (n, n_factors)
    """
    coded, length = begin.copy(), np.full(len(begin), np.inf)
    moving = np.arange(len(begin))
    for _ in range(MOST_STEPS):
        if not moving.size:
            break
        here = coded[moving]
        miss = (targets[moving] - model.predict_coded(here)) / model.scale
        left = inverses(model.jacobian_coded(here) / model.scale[:, None])
        # Far outside the box the polynomial means nothing: keep the search near it.
        coded[moving] = np.clip(here + np.einsum("nkr,nr->nk", left, miss), -2.0, 2.0)
        length[moving] = np.abs(coded[moving] - here).max(axis=1)
        moving = moving[length[moving] > 1e-14]
    return np.where((length <= CONVERGED)[:, None], coded, np.nan)


def inverses(matrices: Floats) -> Floats:
    """Inverses of square matrices (n, m, m), pseudo-inverses of taller ones; zero where there is none."""
    if matrices.shape[1] != matrices.shape[2]:
        return np.asarray(np.linalg.pinv(matrices), dtype=np.float64)
    with np.errstate(all="ignore"):
        regular = np.isfinite(matrices).all(axis=(1, 2)) & (np.linalg.det(matrices) != 0.0)
    found = np.zeros_like(matrices)
    found[regular] = np.linalg.inv(matrices[regular])
    return found


def distinct(coded: Floats) -> Floats:
    """The rows of `coded` (n, n_factors) of which no earlier one is :data:`NEAR`; rows of NaN are left out."""
    kept: list[Floats] = []
    for row in coded[np.isfinite(coded).all(axis=1)]:
        if all(np.abs(row - other).max() >= NEAR for other in kept):
            kept.append(row)
    return np.array(kept).reshape(-1, coded.shape[1])

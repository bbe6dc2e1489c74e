"""Dong's method: the root mean square of the contrasts that are not too large."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from .judgement import Judgement, checked, simulation
from .standard_errors import LIMIT, first_estimate
from .verdicts import verdict


def dong(
    contrasts: ArrayLike,
    names: Sequence[str] | None = None,
    alpha: float = 0.05,
    noise_floor: float = 0.0,
    *,
    critical: str = "t",
    seed: int = 0,
) -> Judgement:
    """Judge the contrasts of one response; a mean is sharper than Lenth's median where few contrasts act.

    Parameters
    ----------
    contrasts : array_like, shape (m,)
        Effects of mutually orthogonal columns, the dummies included.
    names : sequence of str, optional
        Length m; ``c1``, ``c2``, … if not given.
    alpha, noise_floor, critical, seed
        As for :func:`~.lenth.lenth`.

    Raises
    ------
    ValueError
        If there are fewer than three contrasts, one is not finite, or a setting is out of range.

    Notes
    -----
    Dong (1993), "On the identification of active contrasts in unreplicated fractional factorials",
    Statistica Sinica 3, 209–217: s² = mean{c² : |c| ≤ 2.5·s0}, judged by t with as many degrees of freedom as
    contrasts are in that mean; s0 as Lenth's. His own table uses the simultaneous margin at α = 0.02.
    """
    contrasts, names = checked(contrasts, names, alpha, noise_floor, "Dong's")
    sizes = np.sort(np.abs(contrasts))
    freedom = float((sizes <= LIMIT * first_estimate(sizes)).sum())
    return verdict("dong", contrasts, names, alpha, noise_floor, freedom, simulation(critical, "dong"), seed=seed)

"""Lenth's method: which contrasts of an unreplicated experiment are more than noise."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from .judgement import Judgement, checked, simulation
from .verdicts import verdict

LenthResult = Judgement
"""What :func:`lenth` returns."""


def lenth(
    contrasts: ArrayLike,
    names: Sequence[str] | None = None,
    alpha: float = 0.05,
    noise_floor: float = 0.0,
    *,
    critical: str = "t",
    dummies: ArrayLike | None = None,
    seed: int = 0,
) -> LenthResult:
    """Judge the contrasts of one response.

    Parameters
    ----------
    contrasts : array_like, shape (m,)
        Effects of mutually orthogonal columns, the dummies included.
    names : sequence of str, optional
        Length m; ``c1``, ``c2``, … if not given.
    alpha : float
        Error rate, between 0 and 1.
    noise_floor : float
        Smallest believable standard error of an effect, in the contrasts' unit. A deterministic
        simulator leaves exact zeros, on which the pseudo standard error collapses to rounding
        noise; the floor then stands in for it, and ``floored`` says so.
    critical : str
        ``"t"`` for Lenth's t on m/3 degrees of freedom; ``"simulated"`` for critical values that keep
        the error rate (:mod:`.critical`), tighter by a third.
    dummies : array_like of bool, shape (m,), optional
        Columns that no factor was assigned to. Where half or more of the contrasts act, the error is
        taken from them and ``error_from`` says so; without them the result advises.
    seed : int
        Seed of the simulation.

    Raises
    ------
    ValueError
        If there are fewer than three contrasts, one is not finite, or a setting is out of range.

    Notes
    -----
    Lenth (1989), "Quick and easy analysis of unreplicated factorials", Technometrics 31, 469–473:
    s0 = 1.5·median|c|, PSE = 1.5·median{|c| : |c| < 2.5·s0}, ME = t(1 − α/2; m/3)·PSE and
    SME = t(γ; m/3)·PSE with γ = (1 + (1 − α)^(1/m))/2.
    """
    contrasts, names = checked(contrasts, names, alpha, noise_floor, "Lenth's")
    mask = None if dummies is None else np.array(dummies, dtype=bool)
    if mask is not None and mask.shape != contrasts.shape:
        raise ValueError(f"dummies needs one truth value for each of {len(contrasts)} contrasts, got {mask.shape}")
    freedom = len(contrasts) / 3.0
    return verdict("lenth", contrasts, names, alpha, noise_floor, freedom, simulation(critical, "lenth"), mask, seed)

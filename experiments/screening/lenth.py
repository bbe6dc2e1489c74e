"""Lenth's method: which contrasts of an unreplicated experiment are more than noise."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import stdtrit

COLLAPSED = 1e-9
"""A pseudo standard error below this fraction of the largest contrast is rounding, not experimental error."""


@dataclass(frozen=True, eq=False)
class LenthResult:
    """Outcome of Lenth's method for one response, in the unit of its contrasts.

    Parameters
    ----------
    names : tuple of str
        Contrast names, length m.
    contrasts : ndarray, shape (m,)
        The contrasts judged.
    s0 : float
        First estimate, 1.5 × median of the absolute contrasts.
    pse : float
        Pseudo standard error, never below `noise_floor`.
    me, sme : float
        Margin of error, and simultaneous margin of error over all m contrasts.
    alpha : float
        Error rate of both margins.
    noise_floor : float
        Smallest standard error that is believed.
    floored : bool
        Whether the floor replaced a smaller pseudo standard error.
    advice : str
        What to do where the method cannot judge; empty otherwise.
    """

    names: tuple[str, ...]
    contrasts: NDArray[np.float64]
    s0: float
    pse: float
    me: float
    sme: float
    alpha: float
    noise_floor: float
    floored: bool
    advice: str

    @property
    def active(self) -> NDArray[np.bool_]:
        """Contrasts beyond the margin of error, shape (m,): they may act."""
        return np.abs(self.contrasts) > self.me

    @property
    def surely_active(self) -> NDArray[np.bool_]:
        """Contrasts beyond the simultaneous margin, shape (m,): they act."""
        return np.abs(self.contrasts) > self.sme

    @property
    def active_names(self) -> tuple[str, ...]:
        """Names of the active contrasts."""
        return tuple(n for n, a in zip(self.names, self.active, strict=True) if a)


def lenth(
    contrasts: ArrayLike,
    names: Sequence[str] | None = None,
    alpha: float = 0.05,
    noise_floor: float = 0.0,
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
    contrasts = np.array(contrasts, dtype=np.float64)
    if contrasts.ndim != 1 or len(contrasts) < 3:
        raise ValueError(f"Lenth's method needs at least 3 contrasts in a row, got shape {contrasts.shape}")
    if not np.isfinite(contrasts).all():
        raise ValueError("Lenth's method needs finite contrasts")
    if not 0.0 < alpha < 1.0:
        raise ValueError(f"alpha must lie between 0 and 1, got {alpha}")
    if not (np.isfinite(noise_floor) and noise_floor >= 0.0):
        raise ValueError(f"noise_floor must be 0 or a positive number, got {noise_floor}")
    m = len(contrasts)
    names = tuple(names) if names is not None else tuple(f"c{i + 1}" for i in range(m))
    if len(names) != m:
        raise ValueError(f"need one name for each of {m} contrasts, got {len(names)}")
    size = np.abs(contrasts)
    s0 = 1.5 * float(np.median(size))
    small = size[size < 2.5 * s0]
    estimate = 1.5 * float(np.median(small)) if small.size else 0.0
    pse = max(estimate, noise_floor)
    freedom = m / 3.0
    gamma = 0.5 * (1.0 + (1.0 - alpha) ** (1.0 / m))
    advice = ""
    if size.any() and noise_floor == 0.0 and estimate <= COLLAPSED * size.max():
        advice = "most contrasts are zero to rounding, so no error can be estimated: give a noise_floor"
    return LenthResult(
        names,
        contrasts,
        s0,
        pse,
        float(stdtrit(freedom, 1.0 - 0.5 * alpha)) * pse,
        float(stdtrit(freedom, gamma)) * pse,
        alpha,
        noise_floor,
        noise_floor > estimate,
        advice,
    )

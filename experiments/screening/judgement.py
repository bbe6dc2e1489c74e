"""What a method says about the contrasts of one response, and the margins that all methods share."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import stdtr, stdtrit

from .critical import reference_distribution

COLLAPSED = 1e-9
"""A standard error below this fraction of the largest contrast is rounding, not experimental error."""
CRITICAL = ("t", "simulated")


@dataclass(frozen=True, eq=False)
class Judgement:
    """Outcome of a method for one response, in the unit of its contrasts.

    Parameters
    ----------
    names : tuple of str
        Contrast names, length m.
    contrasts : ndarray, shape (m,)
        The contrasts judged.
    s0 : float
        First estimate, 1.5 × median of the absolute contrasts.
    pse : float
        Standard error of a contrast (Lenth: pseudo standard error), never below `noise_floor`.
    me, sme : float
        Margin of error, and simultaneous margin of error over all m contrasts.
    alpha : float
        Error rate of both margins.
    noise_floor : float
        Smallest standard error that is believed.
    floored : bool
        Whether the floor replaced a smaller standard error.
    advice : str
        What to do where the method cannot judge; empty otherwise.
    method : str
        ``"lenth"``, ``"dong"``, ``"zahn"`` or ``"daniel"``.
    error_from : str
        What the standard error was estimated from: ``"contrasts"``, ``"dummies"`` or ``"floor"``.
    crowded : bool
        Whether half or more of the contrasts seem to act, so that the contrasts tell nothing about the error.
    p_values, simultaneous_p : ndarray, shape (m,)
        Probability of a contrast this large if nothing acts: for this one, and for the largest of all.
    scaled : bool
        Whether the contrasts of factors are effects over the root of their inflation, as runs are missing.
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
    method: str = "lenth"
    error_from: str = "contrasts"
    crowded: bool = False
    p_values: NDArray[np.float64] = field(default_factory=lambda: np.empty(0))
    simultaneous_p: NDArray[np.float64] = field(default_factory=lambda: np.empty(0))
    scaled: bool = False

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

    @property
    def ratios(self) -> NDArray[np.float64]:
        """Contrasts over their standard error, shape (m,); zero where both are zero."""
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.nan_to_num(self.contrasts / self.pse, nan=0.0, posinf=np.inf, neginf=-np.inf)


@dataclass(frozen=True)
class Scale:
    """How a ratio of contrast and standard error is judged: Student's t, or a simulated reference."""

    m: int
    freedom: float
    simulated: str = ""
    seed: int = 0

    def margins(self, alpha: float) -> tuple[float, float]:
        """Ratios beyond which one contrast, and one of all m, are called active at error rate `alpha`."""
        if self.simulated:
            return reference_distribution(self.simulated, self.m, self.seed).critical(alpha)
        gamma = 0.5 * (1.0 + (1.0 - alpha) ** (1.0 / self.m))
        return float(stdtrit(self.freedom, 1.0 - 0.5 * alpha)), float(stdtrit(self.freedom, gamma))

    def p_values(self, ratios: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Individual and simultaneous p-values, each shape (m,)."""
        if self.simulated:
            return reference_distribution(self.simulated, self.m, self.seed).p_values(ratios)
        single = 2.0 * stdtr(self.freedom, -np.abs(ratios))
        return single, -np.expm1(self.m * np.log1p(-np.minimum(single, 1.0 - 1e-16)))


def checked(
    contrasts: ArrayLike, names: Sequence[str] | None, alpha: float, noise_floor: float, method: str
) -> tuple[NDArray[np.float64], tuple[str, ...]]:
    """A copy of the contrasts, and their names.

    Raises
    ------
    ValueError
        If there are fewer than three contrasts, one is not finite, or a setting is out of range.
    """
    contrasts = np.array(contrasts, dtype=np.float64)
    if contrasts.ndim != 1 or len(contrasts) < 3:
        raise ValueError(f"{method} method needs at least 3 contrasts in a row, got shape {contrasts.shape}")
    if not np.isfinite(contrasts).all():
        raise ValueError(f"{method} method needs finite contrasts")
    if not 0.0 < alpha < 1.0:
        raise ValueError(f"alpha must lie between 0 and 1, got {alpha}")
    if not (np.isfinite(noise_floor) and noise_floor >= 0.0):
        raise ValueError(f"noise_floor must be 0 or a positive number, got {noise_floor}")
    m = len(contrasts)
    names = tuple(names) if names is not None else tuple(f"c{i + 1}" for i in range(m))
    if len(names) != m:
        raise ValueError(f"need one name for each of {m} contrasts, got {len(names)}")
    return contrasts, names


def simulation(critical: str, method: str) -> str:
    """The estimator to simulate, empty for Student's t.

    Raises
    ------
    ValueError
        If `critical` is neither ``"t"`` nor ``"simulated"``.
    """
    if critical not in CRITICAL:
        raise ValueError(f"critical must be 't' or 'simulated', got {critical!r}")
    return method if critical == "simulated" else ""

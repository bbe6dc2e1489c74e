"""Daniel's half-normal plot in numbers: the line of the inert contrasts."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .judgement import checked
from .standard_errors import daniel_error, half_normal_quantiles, n_inert, zahn_error


@dataclass(frozen=True, eq=False)
class HalfNormalFit:
    """A half-normal plot and the line through its inert contrasts.

    Parameters
    ----------
    names : tuple of str
        Contrast names by rising size, length m.
    quantiles : ndarray, shape (m,)
        Half-normal quantiles of the plotting positions.
    sizes : ndarray, shape (m,)
        Absolute contrasts, rising.
    slope : float
        Slope of the line through the origin and the smallest contrasts: a standard error.
    n_line : int
        How many contrasts the line was fitted to.
    reading : float
        Daniel's own reading of the standard error: the contrast at the 68.3 % point.
    """

    names: tuple[str, ...]
    quantiles: NDArray[np.float64]
    sizes: NDArray[np.float64]
    slope: float
    n_line: int
    reading: float

    @property
    def above(self) -> NDArray[np.float64]:
        """Contrasts over what the line gives at their place, shape (m,): near 1 if inert; NaN without a slope."""
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.where(self.slope > 0.0, self.sizes / (self.slope * self.quantiles), np.nan)


def half_normal_fit(contrasts: ArrayLike, names: Sequence[str] | None = None) -> HalfNormalFit:
    """Fit the half-normal line.

    Parameters
    ----------
    contrasts : array_like, shape (m,)
        Effects of mutually orthogonal columns, the dummies included.
    names : sequence of str, optional
        Length m; ``c1``, ``c2``, … if not given.

    Raises
    ------
    ValueError
        If there are fewer than three contrasts, or one is not finite.

    Notes
    -----
    Daniel (1959), "Use of half-normal plots in interpreting factorial two-level experiments",
    Technometrics 1, 311–341; the slope is Zahn's (1975).
    """
    contrasts, names = checked(contrasts, names, 0.05, 0.0, "Daniel's")
    order = np.argsort(np.abs(contrasts), kind="stable")
    sizes = np.abs(contrasts[order])
    return HalfNormalFit(
        tuple(names[i] for i in order),
        half_normal_quantiles(len(sizes)),
        sizes,
        float(zahn_error(sizes)),
        n_inert(len(sizes)),
        float(daniel_error(sizes)),
    )

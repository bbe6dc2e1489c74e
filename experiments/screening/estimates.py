"""The effects of a two-level design: the noun that everything after it looks at."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ..runs import Response
from .aliasing import alias_matrix, main_effect_aliases
from .curvature import CentrePoints
from .holes import Holes

ROUNDING = 1e-12
"""Aliases below this are rounding of least squares."""


@dataclass(frozen=True, eq=False)
class Effects:
    """Effects of all columns of a two-level design, the unassigned (dummy) ones last.

    Parameters
    ----------
    names : tuple of str
        Column names, length n_contrasts: the factors, then the dummies; a dummy that is a product of
        factors has its name (``"A:B"``), the others are ``dummy1``, ``dummy2``, …
    n_factors : int
        How many of them are factors.
    responses : tuple of Response
        Length n_responses.
    values : ndarray, shape (n_contrasts, n_responses)
        Mean at high minus mean at low, in the response's SI unit: twice the coefficient.
    magnitude : ndarray, shape (n_responses,)
        Largest absolute response among the runs, the scale of rounding errors.
    aliases : tuple of str
        Length n_contrasts: the two-factor interactions that each column also measures in full, such as
        ``"A:B - C:D"``; empty where there are none.
    columns : ndarray, shape (n_runs, n_contrasts)
        The contrasts: ±1, and rows of zeros at centre points. Where runs are lost, rows of zeros there, too, the
        dummies' columns are not ±1, and effects of factors are least squares.
    spread : ndarray, shape (n_responses,)
        Standard deviation over the two-level runs: the root of a quarter of all squared effects.
    centre : CentrePoints or None
        What the centre points say; None if there are none.
    holes : Holes or None
        What failed runs cost; None if there are none.
    """

    names: tuple[str, ...]
    n_factors: int
    responses: tuple[Response, ...]
    values: NDArray[np.float64]
    magnitude: NDArray[np.float64]
    aliases: tuple[str, ...] = ()
    columns: NDArray[np.float64] = field(default_factory=lambda: np.empty((0, 0)))
    spread: NDArray[np.float64] = field(default_factory=lambda: np.empty(0))
    centre: CentrePoints | None = None
    holes: Holes | None = None

    @property
    def standardised(self) -> NDArray[np.float64]:
        """The values over the root of their inflation: contrasts of one variance, shape (n_contrasts, n_responses).

        What a method that compares contrasts needs. Where no run is lost they are the values.
        """
        if self.holes is None or self.holes.orthogonal:
            return self.values
        root = np.ones((len(self.names), 1))
        root[: self.n_factors, 0] = np.sqrt(self.holes.inflation)
        return self.values / root

    @property
    def clear(self) -> bool:
        """Whether no two-factor interaction goes into the main effects."""
        if self.holes is None or self.holes.orthogonal:
            return not np.abs(alias_matrix(self.columns, self.n_factors)[: self.n_factors]).any()
        return not (np.abs(main_effect_aliases(self.columns[:, : self.n_factors])) > ROUNDING).any()

    @property
    def mean_runs(self) -> float:
        """As many runs of an orthogonal design would know the mean as well as the two-level runs do."""
        return self.n_runs if self.holes is None else self.n_runs / self.holes.mean_inflation

    @property
    def is_dummy(self) -> NDArray[np.bool_]:
        """Which columns no factor was assigned to, shape (n_contrasts,)."""
        return np.arange(len(self.names)) >= self.n_factors

    @property
    def n_runs(self) -> int:
        """Two-level runs of the design, centre points left out: 4σ²/n is the variance of a standardised contrast."""
        if self.holes is not None:
            return self.holes.n_corners
        return int(np.count_nonzero(np.abs(self.columns).max(axis=1)))

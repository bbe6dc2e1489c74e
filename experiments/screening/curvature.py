"""What centre points say: whether the response bends between the two levels."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class CentrePoints:
    """Centre points of a two-level design against its other runs.

    Parameters
    ----------
    n_runs : int
        How many centre points there are.
    curvature : ndarray, shape (n_responses,)
        Mean of the two-level runs minus mean of the centre points, SI: the sum of all quadratic coefficients.
    pure_error : ndarray, shape (n_responses,)
        Standard deviation of one run from the repeated centre points; NaN if there is only one.
    """

    n_runs: int
    curvature: NDArray[np.float64]
    pure_error: NDArray[np.float64]

    @classmethod
    def compare(cls, corners: NDArray[np.float64], centres: NDArray[np.float64]) -> "CentrePoints":
        """From the responses at the two-level runs and at the centre points, shapes (·, n_responses).

        Box and Draper (1987), "Empirical Model-Building and Response Surfaces": the difference of
        the two means estimates β₁₁ + β₂₂ + …; squares of opposite sign can cancel in it.
        """
        return cls.against(corners.mean(axis=0), centres)

    @classmethod
    def against(cls, mean: NDArray[np.float64], centres: NDArray[np.float64]) -> "CentrePoints":
        """The same from the mean of the two-level runs, shape (n_responses,); by least squares if some failed."""
        n = len(centres)
        error = centres.std(axis=0, ddof=1) if n > 1 else np.full(centres.shape[1], np.nan)
        return cls(n, mean - centres.mean(axis=0), error)

    def standard_error(self, noise: float, n_corners: float) -> float:
        """Standard error of the curvature where one run has standard deviation `noise`."""
        return noise * float(np.sqrt(1.0 / n_corners + 1.0 / self.n_runs))

"""What every way of choosing terms gives back."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


def root_mean_square(values: NDArray[np.float64]) -> float:
    """Of any size: squares of tiny or huge values would leave the range of floats; infinite if one value is."""
    largest = float(np.abs(values).max(initial=0.0))
    if largest == 0.0 or not np.isfinite(largest):
        return largest
    return largest * float(np.sqrt(np.mean((values / largest) ** 2)))


@dataclass(frozen=True, eq=False)
class Fit:
    """One response fitted on some columns of a model matrix.

    Parameters
    ----------
    columns : ndarray of int, shape (n_used,)
        Columns used.
    coefficients : ndarray, shape (n_used,)
    penalty : float
        The relative ridge penalty chosen.
    loo : ndarray, shape (n_runs,)
        Exact leave-one-out residuals.
    strength : ndarray, shape (n_used,)
        Each coefficient over its standard error, up to the common noise level.
    root : ndarray, shape (n_used, n_directions)
        ``root @ root.T`` is the covariance of the coefficients, the residuals being taken for noise; NaN where there
        are too few runs to tell.
    """

    columns: NDArray[np.int64]
    coefficients: NDArray[np.float64]
    penalty: float
    loo: NDArray[np.float64]
    strength: NDArray[np.float64]
    root: NDArray[np.float64]

    @property
    def loo_rmse(self) -> float:
        """Root mean square of the leave-one-out residuals."""
        return root_mean_square(self.loo)

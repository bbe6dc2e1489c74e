"""Stiffness from a model's slopes: what a factor has to do for one response while the others stay."""

import numpy as np
from numpy.typing import NDArray


def held_stiffness(slopes: NDArray[np.float64], half_range: NDArray[np.float64]) -> NDArray[np.float64] | None:
    """Diagonal of the inverse of a square map, d factor i / d response i while the other responses stay.

    Parameters
    ----------
    slopes : ndarray, shape (n_responses, n_factors)
        d response / d factor, in the units of both.
    half_range : ndarray, shape (n_factors,)
        Half of each factor's range, by which the rank is judged whatever the units.

    Returns
    -------
    ndarray, shape (n_factors,), or None
        Factor unit per response unit; None where the map has no inverse.
    """
    scaled = slopes * half_range
    largest = np.abs(scaled).max(axis=1, keepdims=True)
    balanced = scaled / np.where(largest > 0.0, largest, 1.0)
    if scaled.shape[0] != scaled.shape[1] or np.linalg.matrix_rank(balanced) < len(scaled):
        return None
    return np.asarray(np.diag(np.linalg.inv(slopes)), dtype=np.float64)

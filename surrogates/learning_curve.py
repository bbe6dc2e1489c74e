"""How an error falls with the number of runs, and how many runs would do."""

from math import ceil, isfinite, log, log10

import numpy as np
from numpy.typing import ArrayLike

SLOWEST = -0.5
"""Power of the runs with which an error must fall to be extrapolated: slower, and the answer is a guess."""

FARTHEST = 10.0
"""How many times the runs an extrapolation may ask for."""


def runs_for(n_runs: ArrayLike, loo: ArrayLike, error: float, required: float) -> int | None:
    """About how many runs would bring an error down to what is required, rounded up to two digits; None if not known.

    The leave-one-out error is taken to fall as a power of the runs, and the error on fresh runs with it: as over all
    sizes, or as over the last two where that is slower. It takes three sizes, a power that falls well, and an answer
    not too far away.

    Parameters
    ----------
    n_runs : array_like, shape (n_sizes,)
        Runs of each fit, rising.
    loo : array_like, shape (n_sizes,)
        Leave-one-out errors of the fits, of any unit.
    error, required : float
        The error of the last fit on fresh runs, and the one wanted, of one unit.
    """
    sizes, errors = np.asarray(n_runs, dtype=np.float64), np.asarray(loo, dtype=np.float64)
    if len(sizes) < 3 or not (np.isfinite(errors) & (errors > 0.0)).all():
        return None
    powers = (np.polyfit(np.log(sizes[-k:]), np.log(errors[-k:]), 1)[0] for k in (2, len(sizes)))
    power = float(max(powers))
    if not power <= SLOWEST or not isfinite(error) or not 0.0 < required < error:
        return None
    times = log(error / required) / -power
    if times > log(FARTHEST):
        return None
    needed = float(sizes[-1] * np.exp(times))
    digit = 10 ** max(0, int(log10(needed)) - 1)
    return ceil(needed / digit - 1e-9) * digit

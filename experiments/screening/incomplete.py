"""Effects of a two-level design some of whose runs failed."""

import numpy as np
from numpy.typing import NDArray

from ..runs import Runs
from .curvature import CentrePoints
from .estimates import Effects
from .holes import Holes, check
from .regression import LeastSquares, error_columns

STANDS_IN = "~"
"""Before the name of a dummy column for which another stands in, as near to it as the runs left allow."""


def effects_with_holes(
    runs: Runs, columns: NDArray[np.float64], names: tuple[str, ...], aliases: tuple[str, ...]
) -> Effects:
    """Effects from the runs that have an answer.

    Parameters
    ----------
    runs : Runs
        Of an orthogonal two-level design.
    columns, names, aliases
        The contrasts of the whole design, as :class:`~.estimates.Effects` holds them.

    Raises
    ------
    TooManyHoles
        If the runs left cannot be analysed.
    """
    factors = runs.design.space.names
    k, corner = len(factors), np.abs(columns).max(axis=1) > 0.0
    check(columns, factors, runs.ok)
    here, n = corner & runs.ok, int(corner.sum())
    fitted = LeastSquares.of(np.hstack([np.ones((int(here.sum()), 1)), columns[here, :k]]))
    answers, n_dummies = runs.values[here], columns.shape[1] - k
    coefficients = fitted.inverse @ answers
    if here.sum() == n:  # Only centre points are lost.
        values = 2.0 / n * columns[here].T @ answers
    else:
        error, kept = error_columns(fitted, columns[here, k:])
        values = np.vstack([2.0 * coefficients[1:], 2.0 / np.sqrt(n) * error.T @ answers])
        left = np.zeros((len(columns), len(values)))
        left[here] = np.hstack([columns[here, :k], np.sqrt(len(answers)) * error])
        columns = left
        names = factors + tuple(STANDS_IN + names[k + i] for i in kept)
        aliases = aliases[:k] + tuple(aliases[k + i] for i in kept)
    centres = runs.values[~corner & runs.ok]
    contrasts, remains = (len(names) - k, n_dummies), fitted.left_over(answers, n)
    return Effects(
        names,
        k,
        runs.responses,
        values,
        np.abs(runs.values[runs.ok]).max(axis=0),
        aliases,
        columns,
        answers.std(axis=0),
        CentrePoints.against(coefficients[0], centres) if len(centres) else None,
        Holes.of(factors, corner, runs.ok, columns[here, :k], fitted, contrasts, remains),
    )

"""Effects from an orthogonal two-level design, one for every column it has."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..designs.base import Design
from ..runs import Response, Runs


@dataclass(frozen=True, eq=False)
class Effects:
    """Effects of all columns of a two-level design, the unassigned (dummy) ones last.

    Parameters
    ----------
    names : tuple of str
        Column names, length n_contrasts: the factors, then ``dummy1``, ``dummy2``, …
    n_factors : int
        How many of them are factors.
    responses : tuple of Response
        Length n_responses.
    values : ndarray, shape (n_contrasts, n_responses)
        Mean at high minus mean at low, in the response's SI unit: twice the coefficient.
    magnitude : ndarray, shape (n_responses,)
        Largest absolute response among the runs, the scale of rounding errors.
    """

    names: tuple[str, ...]
    n_factors: int
    responses: tuple[Response, ...]
    values: NDArray[np.float64]
    magnitude: NDArray[np.float64]

    @property
    def is_dummy(self) -> NDArray[np.bool_]:
        """Which columns no factor was assigned to, shape (n_contrasts,)."""
        return np.arange(len(self.names)) >= self.n_factors


def effects(runs: Runs) -> Effects:
    """Effects of every column of the runs' design.

    Raises
    ------
    ValueError
        If a run failed, a column is not two-level and balanced, or two columns are not orthogonal:
        contrasts would then mix effects.
    """
    if not runs.ok.all():
        raise ValueError(f"effects need every run of the design: {runs.failures()}")
    columns = contrast_columns(runs.design)
    n_runs = len(columns)
    names = runs.design.space.names
    return Effects(
        names + runs.design.dummy_names,
        len(names),
        runs.responses,
        2.0 / n_runs * columns.T @ runs.values,
        np.abs(runs.values).max(axis=0),
    )


def contrast_columns(design: Design) -> NDArray[np.float64]:
    """The ±1 columns of a two-level design, factors first, then dummies, shape (n_runs, n_contrasts).

    Raises
    ------
    ValueError
        If a column is not two-level and balanced, or two columns are not orthogonal.
    """
    columns = np.hstack([design.coded, design.dummies])
    if not np.allclose(np.abs(columns), 1.0, rtol=0.0, atol=1e-12):
        raise ValueError("effects need a two-level design: every coded setting must be -1 or +1")
    columns = np.sign(columns)
    with_mean = np.hstack([np.ones((len(columns), 1)), columns])
    if not np.array_equal(with_mean.T @ with_mean, len(columns) * np.eye(with_mean.shape[1])):
        raise ValueError("effects need an orthogonal, balanced design; this one's columns are correlated")
    return columns

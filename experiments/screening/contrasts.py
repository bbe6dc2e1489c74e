"""Effects from an orthogonal two-level design, one for every column it has."""

from dataclasses import dataclass, field
from itertools import chain, combinations, islice

import numpy as np
from numpy.typing import NDArray

from ..designs.base import Design
from ..runs import Response, Runs
from .aliasing import named_columns
from .curvature import CentrePoints

EXACT = 1e-12
"""How far a coded setting may be from -1, 0 or +1: physical units do not round-trip exactly."""
MOST_PRODUCTS = 5000
"""How many products of factors are tried as columns that a design does not name itself."""


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
        The contrasts: ±1, and rows of zeros at centre points.
    spread : ndarray, shape (n_responses,)
        Standard deviation over the two-level runs: the root of a quarter of all squared effects.
    centre : CentrePoints or None
        What the centre points say; None if there are none.
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

    @property
    def is_dummy(self) -> NDArray[np.bool_]:
        """Which columns no factor was assigned to, shape (n_contrasts,)."""
        return np.arange(len(self.names)) >= self.n_factors

    @property
    def n_runs(self) -> int:
        """Number of two-level runs, the centre points left out."""
        return int(np.count_nonzero(np.abs(self.columns).max(axis=1)))


def effects(runs: Runs) -> Effects:
    """Effects of every column of the runs' design, and of the products of factors that it has room for.

    Centre points (rows of zeros) are left out of the contrasts and kept for curvature.

    Raises
    ------
    ValueError
        If a run failed, a column is not two-level and balanced, or two columns are not orthogonal:
        contrasts would then mix effects.
    """
    if not runs.ok.all():
        raise ValueError(f"effects need every run of the design: {runs.failures()}")
    columns = contrast_columns(runs.design)
    factors = runs.design.space.names
    corner = np.abs(columns).max(axis=1) > 0.0
    more, labels = completing_columns(columns, factors)
    columns, names, aliases = named_columns(np.hstack([columns, more]), factors, runs.design.dummy_names + labels)
    at_corners = runs.values[corner]
    return Effects(
        names,
        len(factors),
        runs.responses,
        2.0 / len(at_corners) * columns.T @ runs.values,
        np.abs(runs.values).max(axis=0),
        aliases,
        columns,
        at_corners.std(axis=0),
        None if corner.all() else CentrePoints.compare(at_corners, runs.values[~corner]),
    )


def contrast_columns(design: Design) -> NDArray[np.float64]:
    """The ±1 columns of a two-level design, factors first, then dummies, shape (n_runs, n_contrasts).

    Rows of zeros are centre points and stay zero.

    Raises
    ------
    ValueError
        If a column is not two-level and balanced, or two columns are not orthogonal.
    """
    columns = np.hstack([design.coded, design.dummies])
    corner = np.abs(design.coded).max(axis=1) > EXACT
    columns[~corner] = 0.0
    off = np.argwhere(np.abs(np.abs(columns) - 1.0) > EXACT)
    off = off[corner[off[:, 0]]]
    if off.size or not corner.any():
        found = f"run {off[0, 0] + 1} has {columns[tuple(off[0])]:g}" if off.size else "all runs are centre points"
        raise ValueError(
            "effects need a two-level design: every coded setting must be -1 or +1, or a whole run 0 (a centre point); "
            f"{found}; take a two-level design such as 'plackett_burman', or fit a model to these runs instead"
        )
    columns = np.sign(np.where(corner[:, None], columns, 0.0))
    _check_orthogonal(columns[corner], (*design.space.names, *design.dummy_names))
    return columns


def count_contrasts(design: Design) -> int:
    """How many contrasts the runs of `design` will give; raises as :func:`contrast_columns` does."""
    columns = contrast_columns(design)
    return columns.shape[1] + completing_columns(columns, design.space.names)[0].shape[1]


def _check_orthogonal(columns: NDArray[np.float64], names: tuple[str, ...]) -> None:
    n = len(columns)
    with_mean = np.hstack([np.ones((n, 1)), columns])
    gram = np.abs(with_mean.T @ with_mean)
    np.fill_diagonal(gram, 0.0)
    if not gram.any():
        return
    i, j = np.unravel_index(np.argmax(gram), gram.shape)
    first, second = ("the mean", *names)[min(i, j)], names[max(i, j) - 1]
    raise ValueError(
        f"effects need an orthogonal, balanced design; this one's columns are correlated ({first} with {second} by "
        f"{gram[i, j] / n:.2g}): take a whole orthogonal design such as 'plackett_burman', or fit a model to these runs"
    )


def completing_columns(
    columns: NDArray[np.float64], factors: tuple[str, ...]
) -> tuple[NDArray[np.float64], tuple[str, ...]]:
    """Products of the factors that are orthogonal to all `columns` and to each other, and their names.

    The contrasts that a design such as a full factorial has beside its main effects, shape
    (n_runs, n_more): Lenth's method judges better the more it sees. Lower orders come first.
    """
    k, n_given = len(factors), columns.shape[1]
    corner = np.abs(columns).max(axis=1) > 0.0
    n_settings = len(np.unique(columns[corner, :k], axis=0))
    known, labels = np.hstack([corner[:, None].astype(float), columns]), []
    subsets = chain.from_iterable(combinations(range(k), order) for order in range(2, k + 1))
    for subset in islice(subsets, MOST_PRODUCTS):
        if known.shape[1] >= n_settings:
            break
        product = columns[:, list(subset)].prod(axis=1)
        if not (known.T @ product).any():
            known = np.column_stack([known, product])
            labels.append(":".join(factors[i] for i in subset))
    return known[:, 1 + n_given :], tuple(labels)

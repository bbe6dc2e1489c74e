"""Effects from an orthogonal two-level design, one for every column it has."""

from itertools import chain, combinations, islice

import numpy as np
from numpy.typing import NDArray

from ..designs.base import Design
from ..runs import Runs
from .aliasing import named_columns
from .curvature import CentrePoints
from .estimates import Effects
from .incomplete import effects_with_holes
from .regression import LeastSquares

EXACT = 1e-12
"""How far a coded setting may be from -1, 0 or +1: physical units do not round-trip exactly."""
MOST_PRODUCTS = 5000
"""How many products of factors are tried as columns that a design does not name itself."""


def effects(runs: Runs) -> Effects:
    """Effects of every column of the runs' design, and of the products of factors that it has room for.

    Centre points (rows of zeros) are left out of the contrasts and kept for curvature. Where runs failed the main
    effects are least squares on those left, and what is left of the dummy columns stands in for them.

    Raises
    ------
    ValueError
        If a column is not two-level and balanced, or two columns are not orthogonal: contrasts would then mix effects.
    TooManyHoles
        If the runs that did not fail are too few for main effects or for Lenth's method; a ValueError, too.

    Notes
    -----
    Box (1990), "A simple way to deal with missing observations from designed experiments", Quality Engineering 3,
    249–254, estimates the missing ones, which gives the same effects, and prefers regression where there is a
    computer (from a summary). :func:`completed_values` shows what he would have put in.
    """
    columns = contrast_columns(runs.design)
    factors = runs.design.space.names
    corner = np.abs(columns).max(axis=1) > 0.0
    more, labels = completing_columns(columns, factors)
    columns, names, aliases = named_columns(np.hstack([columns, more]), factors, runs.design.dummy_names + labels)
    if not runs.ok.all():
        return effects_with_holes(runs, columns, names, aliases)
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


def completed_values(runs: Runs) -> NDArray[np.float64]:
    """Answers, shape (n_runs, n_responses), with what the main effects predict where a run failed.

    For plots: contrasts of the whole design over these are the least-squares effects (Yates's missing values).
    """
    if runs.ok.all():
        return runs.values
    found, design = effects(runs), runs.design
    here = np.abs(found.columns).max(axis=1) > 0.0
    matrix = np.hstack([np.ones((len(design), 1)), np.rint(design.coded)])
    guess = matrix @ (LeastSquares.of(matrix[here]).inverse @ runs.values[here])
    return np.where(runs.ok[:, None], runs.values, guess)


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

"""The domain guard: whether settings lie inside the box of the factors, on its edge, or outside."""

from enum import StrEnum

import numpy as np
from numpy.typing import ArrayLike, NDArray

from experiments.factors import FactorSpace

ROUNDING = 1e-9
"""How far beyond ±1 a coded setting may lie and still count as in the box, as in :meth:`.FactorSpace.contains`."""

NEAR = 0.05
"""A setting this share of the range from one of its ends is near that end."""

MOST_ROWS = 3
"""Rows outside the domain that a refusal names."""


class Place(StrEnum):
    """Where a setting lies: strictly inside the box, on its edge (still in the domain), or outside."""

    INSIDE = "inside"
    EDGE = "edge"
    OUTSIDE = "outside"


def guard(space: FactorSpace, X: ArrayLike, margin: float = ROUNDING) -> NDArray[np.str_]:
    """Where settings lie, shape (n,): ``"inside"``, ``"edge"`` or ``"outside"``.

    The farthest factor decides. With r the largest absolute coded setting of a row: outside if r > 1 + 1e-9 (or not a
    number), on the edge if 1 − `margin` ≤ r ≤ 1 + 1e-9, inside otherwise. By default only settings that
    lie on a bound, up to rounding, are on the edge: conversions of units alone could push these out.

    Parameters
    ----------
    space : FactorSpace
        n_factors factors.
    X : array_like, shape (n, n_factors)
        Settings in the factors' units.
    margin : float
        Width of the edge in coded units, inwards from the bound, 0 ≤ margin < 1; 0.02 is one hundredth of a range.

    Raises
    ------
    ValueError
        If `margin` is out of its range or `X` has the wrong shape.
    """
    if not 0.0 <= margin < 1.0:
        raise ValueError(f"margin must be at least 0 and below 1 (coded units), got {margin!r}")
    with np.errstate(over="ignore", invalid="ignore"):
        reach = np.abs(space.code(X)).max(axis=1)
    return np.where(
        ~(reach <= 1.0 + ROUNDING), Place.OUTSIDE, np.where(reach < 1.0 - margin, Place.INSIDE, Place.EDGE)
    ).astype(np.str_)


def outside_sentence(space: FactorSpace, X: ArrayLike) -> str:
    """Which rows of `X` (n, n_factors) lie outside, by what factor and of what range; empty if none does.

    Rows are counted from 1.
    """
    settings = np.asarray(X, dtype=np.float64)
    rows = np.flatnonzero(guard(space, settings) == Place.OUTSIDE)
    if not rows.size:
        return ""
    named = "; ".join(f"row {i + 1}: {_excess(space, settings[i])}" for i in rows[:MOST_ROWS])
    more = f"; and {rows.size - MOST_ROWS} more" if rows.size > MOST_ROWS else ""
    return f"{rows.size} of {len(settings)} settings lie outside the domain: {named}{more}"


def near_ends(space: FactorSpace, point: ArrayLike, share: float = NEAR) -> dict[str, str]:
    """Which end of its range, ``"low"`` or ``"high"``, a factor of `point` (n_factors,) is near, by factor.

    Near is within `share` of the range, or beyond the end; factors near neither end are left out.
    """
    coded = space.code(np.reshape(point, (1, -1)))[0]
    limit = 1.0 - 2.0 * share
    return {n: "high" if c > 0.0 else "low" for n, c in zip(space.names, coded, strict=True) if abs(c) >= limit}


def _excess(space: FactorSpace, setting: NDArray[np.float64]) -> str:
    with np.errstate(over="ignore", invalid="ignore"):
        coded = space.code(setting[None])[0]
    return ", ".join(
        f"{f.name} = {x:g} {f.unit} (allowed: {f.low:g} to {f.high:g})"
        for f, x, c in zip(space, setting, coded, strict=True)
        if not abs(c) <= 1.0 + ROUNDING
    )

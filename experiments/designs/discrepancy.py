"""Discrepancies: how far a set of points is from filling the unit cube evenly."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..naming import suggestion


@dataclass(frozen=True)
class Criterion:
    """A squared L2-discrepancy of n points: ``constant − 2/n Σ Π single + 1/n² ΣΣ Π pair``.

    Parameters
    ----------
    name : str
    constant : callable
        Number of factors -> the part that no point changes.
    single : callable
        Coordinates −1/2 … +1/2 from the centre of the cube -> one-point factor of one dimension.
    pair : callable
        Two such coordinates -> two-point factor of one dimension; positive and symmetric.

    Notes
    -----
    `single` and `pair` are plain arithmetic, so they take NumPy and JAX arrays alike.
    """

    name: str
    constant: Callable[[int], float]
    single: Callable[[Any], Any]
    pair: Callable[[Any, Any], Any]

    def products(self, centred: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """One-point and two-point products over all columns of `centred`, shapes (n,) and (n, n)."""
        once = np.ones(len(centred))
        twice = np.ones((len(centred), len(centred)))
        for column in centred.T:
            once *= self.single(column)
            twice *= self.pair(column[:, None], column[None, :])
        return once, twice

    def value(self, points: ArrayLike) -> float:
        """The squared discrepancy of points in the unit cube, shape (n, s).

        Raises
        ------
        ValueError
            If `points` is not two-dimensional, has no point or leaves the unit cube.
        """
        points = np.asarray(points, dtype=np.float64)
        if points.ndim != 2 or not points.size or not ((points >= 0.0) & (points <= 1.0)).all():
            raise ValueError(f"points must be a table of shape (n, s) inside the unit cube; got shape {points.shape}")
        n, s = points.shape
        once, twice = self.products(points - 0.5)
        return float(self.constant(s) - 2.0 / n * once.sum() + twice.sum() / n**2)


def _centred_single(x: Any) -> Any:
    return 1.0 + 0.5 * abs(x) - 0.5 * x * x


def _centred_pair(x: Any, y: Any) -> Any:
    return 1.0 + 0.5 * (abs(x) + abs(y) - abs(x - y))


def _mixture_single(x: Any) -> Any:
    return 5.0 / 3.0 - 0.25 * abs(x) - 0.25 * x * x


def _mixture_pair(x: Any, y: Any) -> Any:
    apart = abs(x - y)
    return 1.875 - 0.25 * (abs(x) + abs(y)) - 0.75 * apart + 0.5 * apart * apart


def _wraparound_single(x: Any) -> Any:
    return 0.0 * x + 1.0  # no one-point sum: it counts 2 whatever the points, and the constant gives them back


def _wraparound_pair(x: Any, y: Any) -> Any:
    apart = abs(x - y)
    return 1.5 - apart * (1.0 - apart)


CRITERIA: dict[str, Criterion] = {
    c.name: c
    for c in (
        Criterion("centred", lambda s: (13.0 / 12.0) ** s, _centred_single, _centred_pair),
        Criterion("mixture", lambda s: (19.0 / 12.0) ** s, _mixture_single, _mixture_pair),
        Criterion("wraparound", lambda s: 2.0 - (4.0 / 3.0) ** s, _wraparound_single, _wraparound_pair),
    )
}
"""Hickernell (1998), Math. Comp. 67, 299–322 (centred); Zhou, Fang and Ning (2013), J. Complexity 29, 283–301
(mixture); Hickernell (1998), "Lattice rules: how well do they measure up?" (wrap-around)."""


def criterion_named(name: object) -> Criterion:
    """The criterion of that name; ``ValueError`` with the nearest known one if there is none."""
    if not isinstance(name, str) or name not in CRITERIA:
        raise ValueError(f"unknown discrepancy {name!r}{suggestion(str(name), CRITERIA)}")
    return CRITERIA[name]


def unit_levels(levels: int) -> NDArray[np.float64]:
    """Where `levels` levels sit in [0, 1]: (2k − 1)/(2q) for k = 1 … q, shape (levels,)."""
    return (np.arange(1, levels + 1, dtype=np.float64) - 0.5) / levels


def centred_discrepancy_squared(points: ArrayLike) -> float:
    """Squared centred L2-discrepancy CD₂² of points in the unit cube.

    Parameters
    ----------
    points : array_like, shape (n, s)
        Points in [0, 1]^s.

    Raises
    ------
    ValueError
        If `points` is not two-dimensional, has no point or leaves the unit cube.

    Notes
    -----
    Hickernell (1998), "A generalized discrepancy and quadrature error bound", Math. Comp. 67,
    299–322, the centred discrepancy. The square, not the root, is what tables of uniform designs
    usually print.
    """
    return CRITERIA["centred"].value(points)


def mixture_discrepancy_squared(points: ArrayLike) -> float:
    """Squared mixture discrepancy MD² of points in the unit cube, shape (n, s); refuses as the centred one does.

    Notes
    -----
    Zhou, Fang and Ning (2013), "Mixture discrepancy for quasi-random point sets", J. Complexity 29,
    283–301: neither the centre nor the corners of the cube are preferred.
    """
    return CRITERIA["mixture"].value(points)


def wraparound_discrepancy_squared(points: ArrayLike) -> float:
    """Squared wrap-around discrepancy WD² of points in the unit cube, shape (n, s); refuses as the centred one does.

    Notes
    -----
    Hickernell (1998), "Lattice rules: how well do they measure up?", in Hellekalek and Larcher,
    Random and Quasi-Random Point Sets, 109–166. Opposite faces of the cube are the same.
    """
    return CRITERIA["wraparound"].value(points)


def level_discrepancy_squared(coded: ArrayLike, criterion: str = "centred") -> float:
    """Squared discrepancy of a design by the ranks of its levels: level k of q counts as (2k − 1)/(2q).

    This is how tables of uniform designs are computed. `coded` has shape (n_runs, n_factors) and
    equally spaced levels in each column; `criterion` is ``"centred"``, ``"mixture"`` or
    ``"wraparound"``.
    """
    columns = []
    for column in np.asarray(coded, dtype=np.float64).T:
        found, rank = np.unique(np.round(column, 9), return_inverse=True)
        columns.append(unit_levels(len(found))[rank])
    return criterion_named(criterion).value(np.column_stack(columns))

"""A two-level design with holes: what lost runs cost, when they cost too much, and which to run again then."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import combinations
from math import comb

import numpy as np
from numpy.typing import NDArray

from .regression import LeastSquares, inflation_factors, rank

MOST_INFLATION = 4.0
"""Largest variance of an effect that is let pass, over that of the whole design.

At 4 its standard error is doubled: a whole design of a quarter of the runs would tell as much, so the margins are no
longer those that the design was chosen for, and running the lost points again is cheaper than what they hide."""
ROUNDING = 1e-9
"""Correlations and inflations this near to what they should be are rounding."""
FEWEST_CONTRASTS = 3
"""Lenth's method needs as many."""
MOST_TRIED = 1000
"""Sets of runs that are tried for the smallest one to run again; beyond, a set that cannot be made smaller is given."""


class TooManyHoles(ValueError):
    """The runs that are left cannot be analysed.

    Parameters
    ----------
    reason : str
        Why not.
    lost : tuple of int
        Numbers of the failed two-level runs, from 1.
    rerun : tuple of int
        Those of them that must be run again; with their answers the rest is enough.
    """

    def __init__(self, reason: str, lost: tuple[int, ...], rerun: tuple[int, ...]) -> None:
        self.reason, self.lost, self.rerun = reason, lost, rerun
        super().__init__(f"without {named(lost)} {reason}; with {named(rerun)} run again, the rest would do")


@dataclass(frozen=True, eq=False)
class Holes:
    """What is lost with the runs that failed.

    Parameters
    ----------
    factors : tuple of str
        Their names, length k.
    lost : tuple of int
        Numbers of the failed two-level runs, from 1 as everywhere.
    lost_centres : tuple of int
        Numbers of the failed centre points.
    n_corners, n_centres : int
        Two-level runs and centre points of the design, the failed ones included.
    inflation : ndarray, shape (k,)
        Variance of each effect over that which the whole design gives it: n (X'X)⁻¹, X the mean and the factors at the
        runs left. Margins of error hold for an effect over its root.
    mean_inflation : float
        The same of the mean.
    vif : ndarray, shape (k,)
        Variance inflation factor 1/(1 − R²) of each factor by the others: what correlation alone costs.
    correlation : float
        Largest correlation of two estimated effects, with its sign; 0 if there is one factor.
    correlated : tuple of str
        Those two factors; empty if none are.
    freedom : int
        Two-level runs left, less the terms estimated.
    n_error, n_dummies : int
        Contrasts left to measure the error, and as many as the whole design has.
    left : ndarray, shape (n_responses,)
        Standard deviation that main effects leave, as it would be over all two-level runs: least squares on fewer runs
        leaves less, so it is taken per degree of freedom. 0 if there is none.
    """

    factors: tuple[str, ...]
    lost: tuple[int, ...]
    lost_centres: tuple[int, ...]
    n_corners: int
    n_centres: int
    inflation: NDArray[np.float64]
    mean_inflation: float
    vif: NDArray[np.float64]
    correlation: float
    correlated: tuple[str, ...]
    freedom: int
    n_error: int
    n_dummies: int
    left: NDArray[np.float64]

    @classmethod
    def of(
        cls,
        factors: tuple[str, ...],
        corner: NDArray[np.bool_],
        present: NDArray[np.bool_],
        columns: NDArray[np.float64],
        fitted: LeastSquares,
        contrasts: tuple[int, int],
        left: NDArray[np.float64],
    ) -> "Holes":
        """From what is a two-level run, what has an answer, and the fit of the mean and the factors' `columns` there.

        Parameters
        ----------
        factors : tuple of str
        corner, present : ndarray of bool, shape (n_runs,)
        columns : ndarray, shape (n_left, k)
        fitted : LeastSquares
        contrasts : tuple of int
            `n_error` and `n_dummies`.
        left : ndarray, shape (n_responses,)
        """
        n, centre = int(corner.sum()), ~corner
        inflation = n * fitted.variances
        apart = np.triu(fitted.correlations[1:, 1:], 1)
        pair = np.unravel_index(np.argmax(np.abs(apart)), apart.shape)
        some = bool(abs(apart[pair]) > ROUNDING)
        lost, centres = (tuple(int(i) + 1 for i in np.flatnonzero(where & ~present)) for where in (corner, centre))
        return cls(
            factors,
            lost,
            centres,
            n,
            int(centre.sum()),
            inflation[1:],
            float(inflation[0]),
            inflation_factors(columns),
            float(apart[pair]) if some else 0.0,
            tuple(factors[int(i)] for i in pair) if some else (),
            len(columns) - len(factors) - 1,
            *contrasts,
            left,
        )

    @property
    def orthogonal(self) -> bool:
        """Whether only centre points were lost, so that every effect is what it was."""
        return not self.lost

    @property
    def blind(self) -> bool:
        """Whether nothing is left that measures the error, in a design that had something."""
        return self.n_error == 0 < self.n_dummies

    def sentences(self) -> tuple[str, ...]:
        """What was lost, what was done instead, and what it costs: for people."""
        found = []
        if self.lost:
            worst = int(np.argmax(self.inflation))
            apart = f", estimates correlated by up to {abs(self.correlation):.2f}" if self.correlated else ""
            pair = f" ({' with '.join(self.correlated)})" if self.correlated else ""
            found += [
                f"{named(self.lost)} of {self.n_corners} two-level runs failed: the effects are least squares on the "
                f"{self.n_corners - len(self.lost)} left, and the design is no longer orthogonal",
                f"variances are up to {self.inflation[worst]:.2f} times those of the whole design "
                f"({self.factors[worst]}), variance inflation factors up to {self.vif.max():.2f}{apart}{pair}; "
                f"{self.freedom} degrees of freedom and {self.n_error} of {self.n_dummies} error contrasts are left",
            ]
        if self.blind:
            found.append("nothing is left to measure the error by, so every factor is kept")
        if self.lost_centres:
            still = self.n_centres - len(self.lost_centres)
            then = f"{still} left" if still else "none is left, so curvature cannot show"
            found.append(f"{named(self.lost_centres)}, of {self.n_centres} centre points, failed: {then}")
        return tuple(found)


def named(numbers: Sequence[int]) -> str:
    """Such as ``run 3`` or ``runs 3, 7 and 9``."""
    words = [str(n) for n in numbers]
    return f"run {words[0]}" if len(words) == 1 else f"runs {', '.join(words[:-1])} and {words[-1]}"


def check(columns: NDArray[np.float64], factors: Sequence[str], present: NDArray[np.bool_]) -> None:
    """Raise :class:`TooManyHoles` unless the runs present can be analysed.

    Parameters
    ----------
    columns : ndarray, shape (n_runs, n_contrasts)
        Orthogonal ±1 columns, the factors first; rows of zeros are centre points.
    factors : sequence of str
    present : ndarray of bool, shape (n_runs,)
        Which runs have an answer.
    """
    corner = np.abs(columns).max(axis=1) > 0.0
    lost = np.flatnonzero(corner & ~present)

    def lacking(again: Sequence[int]) -> str:
        here = corner & present
        here[list(again)] = True
        return shortcoming(columns[here], factors, len(columns[corner]))

    reason = lacking(())
    if reason:
        rerun = smallest(lost.tolist(), lambda again: not lacking(again))
        raise TooManyHoles(reason, tuple(int(i) + 1 for i in lost), tuple(i + 1 for i in rerun))


def shortcoming(columns: NDArray[np.float64], factors: Sequence[str], n: int) -> str:
    """Why these rows of a design of `n` two-level runs cannot be analysed; empty if they can."""
    k = len(factors)
    matrix = np.hstack([np.ones((len(columns), 1)), columns[:, :k]])
    if rank(matrix) < k + 1:
        few = f"{len(columns)} two-level runs are left, which do"
        return f"the main effects cannot be estimated: {few} not tell {k} factors and the mean apart"
    inflation = n * LeastSquares.of(matrix).variances[1:]
    worst = int(np.argmax(inflation))
    # The bound itself is met by designs exactly: rounding must not decide.
    if inflation[worst] > MOST_INFLATION * (1.0 + ROUNDING):
        return (
            f"the standard error of {factors[worst]} would be {np.sqrt(inflation[worst]):.2g} times that of the whole "
            f"design, and more than {np.sqrt(MOST_INFLATION):g} times tells too little"
        )
    if k < FEWEST_CONTRASTS:
        m = rank(np.hstack([np.ones((len(columns), 1)), columns])) - 1
        if m < FEWEST_CONTRASTS:
            return f"only {m} contrasts are left, and Lenth's method needs {FEWEST_CONTRASTS}"
    return ""


def smallest(lost: Sequence[int], enough: Callable[[Sequence[int]], bool]) -> tuple[int, ...]:
    """The fewest of the lost runs whose answers are enough.

    All sets are tried by size, as long as that takes at most MOST_TRIED trials; then runs are struck off the whole
    list one by one, which ends with a set that cannot be made smaller, though another one may be. Both are right
    because more runs never tell less.
    """
    tried = 0
    for size in range(1, len(lost)):
        tried += comb(len(lost), size)
        if tried > MOST_TRIED:
            break
        for chosen in combinations(lost, size):
            if enough(chosen):
                return chosen
    needed = list(lost)
    for one in reversed(lost):
        rest = [i for i in needed if i != one]
        if enough(rest):
            needed = rest
    return tuple(needed)

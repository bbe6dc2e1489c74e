"""Which terms a fit may choose from, where the degree is to be chosen as well."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from math import comb

import numpy as np
from numpy.typing import NDArray

from experiments.terms import Terms

AUTO = "auto"
HIGHEST = 12
"""Highest degree that is offered; monomials of more are too ill-conditioned to be kept as such."""

MOST_TERMS = 1300
"""Sets with more terms are thinned out, or left out."""

NORM = 0.6
"""Of thinned sets: the larger the product of powers, the lower the degree (Blatman and Sudret, 2011, J. Comput.
Phys. 230, 2345–2367, section 3.2: hyperbolic index sets)."""

MOST_TAUGHT = 500
"""The same where derivatives teach, which have many more rows."""

LIKELIEST = 900
"""Terms in a set of the likeliest."""

MOST_CONSIDERED = 50_000
"""Terms among which the likeliest are looked for."""

BETTER = 0.9
"""A larger set must lower the leave-one-out error to this part of what a smaller one has."""


Expected = Callable[[NDArray[np.int64]], NDArray[np.float64]]


@dataclass(frozen=True, eq=False)
class Scope:
    """From which terms a fit may choose.

    Parameters
    ----------
    names : tuple of str
    degree : int or ``"auto"``
    highest : int
        Highest degree if `degree` is ``"auto"``.
    interactions : bool
        Whether products of different factors are candidates.
    levels : ndarray of int, shape (n_factors,)
        Different settings of each factor in the runs; with ``"auto"``, powers that they cannot show are left out.
    """

    names: tuple[str, ...]
    degree: int | str
    highest: int
    interactions: bool
    levels: NDArray[np.int64]

    @property
    def open(self) -> bool:
        """Whether the degree is to be chosen."""
        return self.degree == AUTO

    def sets(self, most: int, only_seen: bool = False) -> list[Terms]:
        """Sets of at most so many terms, the smallest first; only one, of any size, if the degree is given.

        With `only_seen`, powers that the levels cannot show are left out in any case.
        """
        if not self.open:
            given = Terms.polynomial(self.names, int(self.degree), self.interactions)
            return [self._terms(self._seen(np.array(given.exponents, dtype=np.int64)))] if only_seen else [given]
        found: list[Terms] = []
        for d in range(1, self.highest + 1):
            rows = self._seen(_indices(len(self.names), d, self.interactions))
            skipped = d > 6 and d % 2 and d != self.highest
            if not skipped and len(rows) <= most and (not found or len(rows) > len(found[-1])):
                found.append(self._terms(rows))
        return found

    def likeliest(
        self, log_variance_of: Callable[[NDArray[np.int64]], NDArray[np.float64]], count: int = LIKELIEST
    ) -> Terms:
        """The terms of which scales learned on a smaller set expect most, whatever their degree.

        Parameters
        ----------
        log_variance_of : callable
            Logarithms of expected squares, (n_terms,), for exponents (n_terms, n_factors).
        count : int
            So many terms.
        """
        n = len(self.names)
        degree = max(d for d in range(1, self.highest + 1) if d == 1 or comb(n + d, d) <= MOST_CONSIDERED)
        rows = self._seen(_all_up_to(n, degree, self.interactions))
        expected = np.where(rows.any(axis=1), log_variance_of(rows), np.inf)
        return self._terms(rows[np.sort(np.argsort(-expected, kind="stable")[:count])])

    def _seen(self, rows: NDArray[np.int64]) -> NDArray[np.int64]:
        return rows[(rows < self.levels).all(axis=1)]

    def _terms(self, rows: NDArray[np.int64]) -> Terms:
        return Terms(self.names, tuple(map(tuple, rows.tolist())))


def check_degree(degree: object, highest: object) -> None:
    """``ValueError`` if a fit cannot be asked for that degree."""
    for name, value in (("degree", degree), ("highest_degree", highest)):
        if name == "degree" and value == AUTO:
            continue
        whole = isinstance(value, (int, np.integer)) and not isinstance(value, bool)
        if not whole or not 1 <= int(str(value)) <= HIGHEST:
            also = " or 'auto'" if name == "degree" else ""
            raise ValueError(f"{name} must be a whole number from 1 to {HIGHEST}{also}, got {value!r}")


def _indices(n: int, degree: int, interactions: bool) -> NDArray[np.int64]:
    """Exponents up to a degree, by degree; thinned where there would be too many."""
    if not interactions or comb(n + degree, degree) <= MOST_TERMS:
        return _all_up_to(n, degree, interactions)
    return _hyperbolic(n, degree)


@lru_cache(maxsize=64)
def _all_up_to(n: int, degree: int, interactions: bool) -> NDArray[np.int64]:
    names = [str(j) for j in range(n)]
    return np.array(Terms.polynomial(names, degree, interactions).exponents, dtype=np.int64).reshape(-1, n)


def _hyperbolic(n: int, degree: int) -> NDArray[np.int64]:
    """Exponents e with (Σ eⱼ^q)^(1/q) at most the degree."""
    budget = degree**NORM * (1.0 + 1e-12)
    partial: list[tuple[tuple[int, ...], float]] = [((), 0.0)]
    for _ in range(n):
        partial = [
            ((*row, e), spent + e**NORM)
            for row, spent in partial
            for e in range(degree + 1)
            if spent + e**NORM <= budget
        ]
    rows = sorted((row for row, _ in partial), key=lambda row: (sum(row), tuple(-e for e in row)))
    return np.array(rows, dtype=np.int64)

"""Polynomial terms in the notation of the field, and the model matrices they span.

``"1"`` is the constant, ``"A"`` a linear term, ``"A:B"`` an interaction, ``"A^2"`` a square; they
combine: ``"A^2:B"``. Aliasing, effects, D-optimality and the surrogate's basis all use this module.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations_with_replacement

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .naming import suggestion


@dataclass(frozen=True)
class Terms:
    """An ordered set of monomials in coded factors.

    Parameters
    ----------
    names : tuple of str
        Factor names, length n_factors.
    exponents : tuple of tuple of int
        One row per term, one non-negative exponent per factor: shape (n_terms, n_factors).

    Raises
    ------
    ValueError
        If a row has the wrong length, an exponent is negative or no whole number, or a name or a
        term appears twice.
    """

    names: tuple[str, ...]
    exponents: tuple[tuple[int, ...], ...]

    def __post_init__(self) -> None:
        if any(e != int(e) for row in self.exponents for e in row):
            raise ValueError("exponents must be whole numbers")
        rows = tuple(tuple(int(e) for e in row) for row in self.exponents)
        object.__setattr__(self, "names", tuple(self.names))
        object.__setattr__(self, "exponents", rows)
        if len(set(self.names)) < len(self.names):
            raise ValueError(f"factor names must differ; got {', '.join(self.names)}")
        if any(len(row) != len(self.names) for row in rows):
            raise ValueError(f"each term needs {len(self.names)} exponents, one per factor")
        if any(e < 0 for row in rows for e in row):
            raise ValueError("exponents must not be negative")
        if len(set(rows)) < len(rows):
            raise ValueError("a term appears twice")

    @classmethod
    def polynomial(cls, names: Iterable[str], degree: int, interactions: bool = True) -> "Terms":
        """All terms up to total `degree`, constant first, then by degree; pure powers only without `interactions`."""
        names = tuple(names)
        if degree < 0:
            raise ValueError(f"degree must be 0 or more, got {degree}")
        rows = []
        for total in range(degree + 1):
            for chosen in combinations_with_replacement(range(len(names)), total):
                if interactions or len(set(chosen)) <= 1:
                    rows.append(tuple(chosen.count(j) for j in range(len(names))))
        return cls(names, tuple(rows))

    @classmethod
    def parse(cls, labels: Iterable[str], names: Iterable[str]) -> "Terms":
        """Terms from their labels, such as ``["1", "A", "A:B", "A^2"]``.

        Raises
        ------
        ValueError
            If a label names an unknown factor or has a power that is not a positive whole number.
        """
        names = tuple(names)
        return cls(names, tuple(_parse_label(label, names) for label in labels))

    def __len__(self) -> int:
        return len(self.exponents)

    @cached_property
    def labels(self) -> tuple[str, ...]:
        """One readable label per term."""
        return tuple(self._label(row) for row in self.exponents)

    @property
    def degrees(self) -> NDArray[np.int64]:
        """Total degree of each term, shape (n_terms,)."""
        return np.array([sum(row) for row in self.exponents], dtype=np.int64)

    def select(self, indices: Iterable[int]) -> "Terms":
        """The terms at `indices`, in the order given."""
        return Terms(self.names, tuple(self.exponents[int(i)] for i in indices))

    def _label(self, row: tuple[int, ...]) -> str:
        parts = [n if e == 1 else f"{n}^{e}" for n, e in zip(self.names, row, strict=True) if e]
        return ":".join(parts) or "1"


def model_matrix(terms: Terms, coded: ArrayLike) -> NDArray[np.float64]:
    """Terms evaluated on a design.

    Parameters
    ----------
    terms : Terms
    coded : array_like, shape (n_runs, n_factors)
        Coded settings.

    Returns
    -------
    ndarray, shape (n_runs, n_terms)
    """
    coded = _coded(terms, coded)
    powers = _powers(terms, coded)
    matrix = np.ones((len(coded), len(terms)))
    for column, row in enumerate(terms.exponents):
        for factor, exponent in enumerate(row):
            if exponent:
                matrix[:, column] *= powers[exponent][:, factor]
    return matrix


def model_matrix_gradient(terms: Terms, coded: ArrayLike) -> NDArray[np.float64]:
    """Derivative of :func:`model_matrix` with respect to the coded factors, shape (n_runs, n_terms, n_factors)."""
    coded = _coded(terms, coded)
    powers = _powers(terms, coded)
    gradient = np.zeros((len(coded), len(terms), len(terms.names)))
    for column, row in enumerate(terms.exponents):
        for by, degree in enumerate(row):
            if degree:
                part = np.full(len(coded), float(degree))
                for factor, exponent in enumerate(row):
                    exponent -= factor == by
                    if exponent:
                        part *= powers[exponent][:, factor]
                gradient[:, column, by] = part
    return gradient


def _coded(terms: Terms, coded: ArrayLike) -> NDArray[np.float64]:
    coded = np.asarray(coded, dtype=np.float64)
    if coded.ndim != 2 or coded.shape[1] != len(terms.names):
        raise ValueError(f"coded settings must have shape (n_runs, {len(terms.names)}); got {coded.shape}")
    return coded


def _powers(terms: Terms, coded: NDArray[np.float64]) -> list[NDArray[np.float64]]:
    """Powers 0, 1, 2, … of the coded settings, by repeated multiplication as in the exported code."""
    highest = max((e for row in terms.exponents for e in row), default=0)
    powers = [np.ones_like(coded)]
    for _ in range(highest):
        powers.append(powers[-1] * coded)
    return powers


def _parse_label(label: str, names: tuple[str, ...]) -> tuple[int, ...]:
    row = [0] * len(names)
    if label.strip() == "1":
        return tuple(row)
    for part in label.split(":"):
        name, caret, power = part.strip().partition("^")
        if name not in names:
            raise ValueError(f"term {label!r} names an unknown factor {name!r}{suggestion(name, names)}")
        if caret and not (power.isascii() and power.isdigit() and int(power) > 0):
            raise ValueError(f"term {label!r}: the power {power!r} must be a positive whole number")
        row[names.index(name)] += int(power) if caret else 1
    return tuple(row)

"""Factors and the one invertible border between physical and coded units."""

import math
import numbers
import sys
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .naming import check_name, check_unit, column_label, suggestion


@dataclass(frozen=True)
class Factor:
    """An input that is varied.

    Parameters
    ----------
    name : str
        ASCII identifier, so that it is safe in headers, terms and generated code.
    unit : str
        Unit of `low` and `high`; ``"1"`` if dimensionless.
    low, high : float
        Ends of the range in `unit`, ``low < high``.
    source : str
        Where the range comes from.

    Raises
    ------
    ValueError
        If the name or unit is not allowed, or the range is empty or not finite.
    """

    name: str
    unit: str
    low: float
    high: float
    source: str = ""

    def __post_init__(self) -> None:
        check_name("factor", self.name)
        check_unit(self.name, self.unit)
        for end in (self.low, self.high):
            if isinstance(end, bool) or not isinstance(end, numbers.Real) or not abs(end) <= sys.float_info.max:
                raise ValueError(f"factor {self.name!r}: low and high must be finite numbers, got {end!r}")
        if not self.low < self.high:
            raise ValueError(f"factor {self.name!r}: low must be below high, got low = {self.low}, high = {self.high}")
        if not (math.isfinite(self.high - self.low) and 0.5 * self.high - 0.5 * self.low > 0.0):
            raise ValueError(
                f"factor {self.name!r}: the range {self.low} to {self.high} is too wide or too narrow for float64"
            )

    @property
    def label(self) -> str:
        """Column label, ``name[unit]``."""
        return column_label(self.name, self.unit)


@dataclass(frozen=True)
class FactorSpace:
    """An ordered set of factors: the box in which experiments are made.

    Coded units map every factor's range to [−1, +1]; all designs live there. :meth:`code` and
    :meth:`decode` are the only place where the two systems meet.
    """

    factors: tuple[Factor, ...]

    def __post_init__(self) -> None:
        object.__setattr__(self, "factors", tuple(self.factors))
        if not self.factors:
            raise ValueError("a factor space needs at least one factor")
        if len(set(self.names)) < len(self.names):
            repeated = sorted(name for name, n in Counter(self.names).items() if n > 1)
            raise ValueError(f"factor names must differ; repeated: {', '.join(repeated)}")

    def __len__(self) -> int:
        return len(self.factors)

    def __iter__(self) -> Iterator[Factor]:
        return iter(self.factors)

    @property
    def names(self) -> tuple[str, ...]:
        """Factor names in order."""
        return tuple(f.name for f in self.factors)

    @property
    def labels(self) -> tuple[str, ...]:
        """Column labels in order, ``name[unit]``."""
        return tuple(f.label for f in self.factors)

    @property
    def centre(self) -> NDArray[np.float64]:
        """Middle of each range, shape (n_factors,), in each factor's unit."""
        return np.array([0.5 * f.low + 0.5 * f.high for f in self.factors])

    @property
    def half_range(self) -> NDArray[np.float64]:
        """Half the width of each range, shape (n_factors,), in each factor's unit."""
        return np.array([0.5 * f.high - 0.5 * f.low for f in self.factors])

    def code(self, physical: ArrayLike) -> NDArray[np.float64]:
        """Physical to coded units, shape (n, n_factors) to (n, n_factors)."""
        return (self._checked(physical, "physical") - self.centre) / self.half_range

    def decode(self, coded: ArrayLike) -> NDArray[np.float64]:
        """Coded to physical units, shape (n, n_factors) to (n, n_factors)."""
        return self.centre + self._checked(coded, "coded") * self.half_range

    def contains(self, physical: ArrayLike, tolerance: float = 1e-9) -> NDArray[np.bool_]:
        """Whether each point lies in the box, shape (n,); `tolerance` is in coded units."""
        return np.all(np.abs(self.code(physical)) <= 1.0 + tolerance, axis=1)

    def index(self, name: str) -> int:
        """Position of the factor called `name`; ``ValueError`` with the nearest name if there is none."""
        if name not in self.names:
            raise ValueError(f"unknown factor {name!r}{suggestion(name, self.names)}")
        return self.names.index(name)

    def select(self, names: Iterable[str]) -> "FactorSpace":
        """The sub-space of the named factors, in this space's order."""
        wanted = {self.index(name) for name in names}
        return FactorSpace(tuple(f for i, f in enumerate(self.factors) if i in wanted))

    def with_ranges(self, ranges: Mapping[str, tuple[float, float]]) -> "FactorSpace":
        """A copy with other ranges, ``{name: (low, high)}``, in each factor's unit."""
        for name, ends in ranges.items():
            self.index(name)
            if len(ends) != 2:
                raise ValueError(f"factor {name!r}: a range is (low, high), got {ends!r}")
        return FactorSpace(
            tuple(
                replace(f, low=ranges[f.name][0], high=ranges[f.name][1], source="set by the user")
                if f.name in ranges
                else f
                for f in self.factors
            )
        )

    def _checked(self, points: ArrayLike, system: str) -> NDArray[np.float64]:
        points = np.asarray(points, dtype=np.float64)
        if points.ndim != 2 or points.shape[1] != len(self):
            raise ValueError(
                f"{system} points must have shape (n, {len(self)}), one column per factor "
                f"({', '.join(self.names)}); got shape {points.shape}"
            )
        return points

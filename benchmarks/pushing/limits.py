"""The range at which something stops."""

import math
from collections.abc import Callable, Iterable, Mapping
from typing import NamedTuple


class Limit(NamedTuple):
    """Up to `holds` all is well; at `fails`, no further off than was asked for, it is not. Infinite: never met."""

    holds: float
    fails: float

    def __str__(self) -> str:
        return f"{self.holds:.3g}" if math.isfinite(self.fails) else f"beyond {self.holds:g}"


def furthest(holds: Callable[[float], bool], ranges: Iterable[float], precision: float) -> Limit:
    """Between the last of `ranges` that holds and the first that does not, bisected to `precision`.

    The first that fails counts, whatever larger ones would do. The bisection may go down to nothing.

    Raises
    ------
    ValueError
        If `precision` is not positive.
    """
    if not precision > 0.0:
        raise ValueError(f"precision must be positive, got {precision}")
    last, first = 0.0, math.inf
    for reach in ranges:
        if not holds(reach):
            first = reach
            break
        last = reach
    while math.isfinite(first) and first - last > precision:
        middle = 0.5 * (last + first)
        last, first = (middle, first) if holds(middle) else (last, middle)
    return Limit(last, first)


def order(limits: Mapping[str, Limit]) -> list[str]:
    """Names of the limits that were met, the one at the smallest range first."""
    return sorted((name for name in limits if math.isfinite(limits[name].fails)), key=lambda name: limits[name].fails)

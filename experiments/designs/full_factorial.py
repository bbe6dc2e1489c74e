"""Full factorial designs: every combination of the levels."""

from dataclasses import dataclass
from math import prod
from typing import ClassVar

import numpy as np

from ..factors import FactorSpace
from ..settings import parameter
from .base import Design, Seed, check_count

MOST_RUNS = 1_000_000


@dataclass(frozen=True)
class FullFactorial:
    """Every combination of equally spaced levels, the first factor changing fastest.

    Parameters
    ----------
    levels : int or str, optional
        Levels per factor: one number for all of them, or one a factor, such as ``"2, 3, 3"``; two by
        default. The outer levels lie on the faces of the box; one level is the centre.
    n_runs : int, optional
        Instead of `levels`: split so many runs into levels, as evenly as their divisors allow and
        the most levels first. A prime number of runs fits one factor only.

    Raises
    ------
    ValueError
        If both settings are given, a number of levels is no whole number of at least 1, their number
        is neither one nor that of the factors, `n_runs` does not split, or the table would have more
        than a million runs.

    Notes
    -----
    Yates (1937), "The design and analysis of factorial experiments", whose standard order this is.
    """

    method: ClassVar[str] = "full_factorial"
    title: ClassVar[str] = "full factorial"
    summary: ClassVar[str] = "every combination of the levels, which may differ between factors"

    sized_by: ClassVar[tuple[str, ...]] = ("n_runs", "levels")

    levels: int | str | None = parameter(None, "levels", "one number, or one a factor: '2, 3, 3'; default is 2")
    n_runs: int | None = parameter(None, "runs", "split evenly into levels; default is what levels multiply to")

    def __post_init__(self) -> None:
        if self.n_runs is not None:
            check_count("n_runs of a full factorial", self.n_runs, 1, MOST_RUNS)
            if self.levels is not None:
                raise ValueError(
                    f"a full factorial takes its runs from levels or from n_runs, got both ({self.levels!r} and "
                    f"{self.n_runs}); give one of them"
                )
        self._counts()

    def generate(self, space: FactorSpace, rng: Seed = 0) -> Design:
        """The design on `space`; nothing in it is random, so `rng` is not used."""
        counts = self._split(len(space)) if self.n_runs is not None else self._counts()
        if len(counts) == 1:
            counts *= len(space)
        if len(counts) != len(space):
            raise ValueError(
                f"levels {self.levels!r} of a full factorial are for {len(counts)} factors, the space has "
                f"{len(space)} ({', '.join(space.names)}); give one number, or one a factor"
            )
        if prod(counts) > MOST_RUNS:
            raise ValueError(
                f"a full factorial of {' x '.join(map(str, counts))} levels has {prod(counts)} runs, at most "
                f"{MOST_RUNS} are allowed; use fewer levels or another design"
            )
        axes = [np.linspace(-1.0, 1.0, q) if q > 1 else np.zeros(1) for q in counts]
        grid = np.meshgrid(*axes[::-1], indexing="ij")[::-1]
        return Design(space, np.column_stack([axis.ravel() for axis in grid]), self.method)

    def _counts(self) -> list[int]:
        """The numbers in `levels`."""
        words = [word.strip() for word in str(2 if self.levels is None else self.levels).split(",")]
        if not all(word.isascii() and word.isdigit() and int(word) >= 1 for word in words):
            raise ValueError(
                f"levels of a full factorial must be whole numbers of at least 1, got {self.levels!r}; "
                "give one number, or one a factor such as '2, 3, 3'"
            )
        return [int(word) for word in words]

    def _split(self, n_factors: int) -> list[int]:
        """`n_runs` as a product of `n_factors` numbers of at least 2, as even as possible, largest first."""
        n_runs = int(self.n_runs or 0)
        counts, left = [], n_runs
        for remaining in range(n_factors, 0, -1):
            allowed = [q for q in range(2, left + 1) if left % q == 0 and _primes(left // q) >= remaining - 1]
            if not allowed or (remaining == 1 and left < 2):
                raise ValueError(
                    f"{n_runs} runs cannot be split into a full factorial of {n_factors} factors with at least 2 "
                    f"levels each; use n_runs = {2**n_factors} or give the levels"
                )
            mean = left ** (1.0 / remaining) - 1e-9
            counts.append(left if remaining == 1 else min((q for q in allowed if q >= mean), default=allowed[-1]))
            left //= counts[-1]
        return counts


def _primes(number: int) -> int:
    """How many prime factors a number has, repeated ones counted."""
    count, divisor = 0, 2
    while number > 1:
        while number % divisor == 0:
            number, count = number // divisor, count + 1
        divisor += 1
    return count

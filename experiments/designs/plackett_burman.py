"""Plackett–Burman designs: main effects of up to n − 1 factors in n runs."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from ..factors import FactorSpace
from ..settings import parameter
from .base import Design, Seed, check_count

MIN_DUMMIES = 4
"""Dummy columns kept free by default, so that Lenth's method has contrasts that measure noise."""

MAX_RUNS = 640


def constructible(n_runs: int) -> bool:
    """Whether pyDOE3 builds this size: a power of two from 4 up, or 12 or 20 times a power of two."""
    return any(n_runs % base == 0 and (n_runs // base).bit_count() == 1 for base in (4, 12, 20))


@dataclass(frozen=True)
class PlackettBurman:
    """Two-level orthogonal screening design.

    The columns that no factor uses are kept as dummies. Main effects are free of one another but
    aliased with two-factor interactions.

    Parameters
    ----------
    n_runs : int, optional
        A power of two, or 12 or 20 times one; by default the smallest that leaves at least four
        dummy columns.

    Raises
    ------
    ValueError
        If no design of that size can be built, or it has too few columns for the factors.

    Notes
    -----
    Plackett and Burman (1946), "The design of optimum multifactorial experiments", Biometrika 33,
    305–325; the matrices come from pyDOE3.
    """

    method: ClassVar[str] = "plackett_burman"
    title: ClassVar[str] = "Plackett–Burman design"
    summary: ClassVar[str] = "two-level orthogonal screening of main effects, with dummy columns"

    n_runs: int | None = parameter(None, "runs", "4·2^i, 12·2^i or 20·2^i; default leaves four dummies")

    def __post_init__(self) -> None:
        if self.n_runs is None:
            return
        check_count("n_runs of a Plackett-Burman design", self.n_runs, 4)
        if not constructible(self.n_runs) or self.n_runs > MAX_RUNS:
            sizes = [n for n in range(4, MAX_RUNS + 1, 4) if constructible(n)]
            near = sorted(sorted(sizes, key=lambda n: abs(n - (self.n_runs or 0)))[:3])
            raise ValueError(
                f"no Plackett-Burman design with {self.n_runs} runs can be built; nearest sizes: "
                f"{', '.join(map(str, near))}"
            )

    def generate(self, space: FactorSpace, rng: Seed = 0) -> Design:
        """The design on `space`; nothing in it is random, so `rng` is not used."""
        from pyDOE3 import pbdesign  # brings SciPy with it, which a surrogate that only predicts does not need

        n_factors = len(space)
        n_runs = self.n_runs or _smallest(n_factors)
        if n_factors > n_runs - 1:
            raise ValueError(
                f"a Plackett-Burman design of {n_runs} runs has {n_runs - 1} columns, too few for {n_factors} "
                f"factors; use n_runs = {_smallest(n_factors)}"
            )
        matrix = np.asarray(pbdesign(n_runs - 1), dtype=np.float64)
        return Design(space, matrix[:, :n_factors], self.method, matrix[:, n_factors:])


def _smallest(n_factors: int) -> int:
    for n_runs in range(4, MAX_RUNS + 1, 4):
        if constructible(n_runs) and n_runs - 1 >= n_factors + MIN_DUMMIES:
            return n_runs
    raise ValueError(f"no Plackett-Burman design for {n_factors} factors: at most {MAX_RUNS - 1 - MIN_DUMMIES}")

"""Plackett–Burman designs: main effects of up to n − 1 factors in n runs."""

from dataclasses import dataclass
from itertools import islice
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from ..factors import FactorSpace
from ..settings import parameter
from .base import Design, Seed, check_count
from .hadamard import construction, hadamard
from .two_level import CENTRE, FOLDOVER, assemble, check_additions

MIN_DUMMIES = 4
"""Dummy columns kept free by default, so that Lenth's method has contrasts that measure noise."""

MAX_RUNS = 640


def constructible(n_runs: int) -> bool:
    """Whether a design of this size can be built: every multiple of 4 up to 152, most beyond."""
    return n_runs >= 4 and construction(n_runs) is not None


@dataclass(frozen=True)
class PlackettBurman:
    """Two-level orthogonal screening design.

    The columns that no factor uses are kept as dummies. Main effects are free of one another but,
    without foldover, aliased with two-factor interactions.

    Parameters
    ----------
    n_runs : int, optional
        Runs of the two-level design before foldover and centre points, a multiple of 4; by default
        the smallest that leaves at least four dummy columns.
    foldover : bool
        Repeat every run with all signs turned, 2 · n_runs in all. Main effects are then free of
        two-factor interactions, which show in dummies of their own.
    n_centre : int
        Runs at the centre, on top. One shows curvature; more measure the noise of a noisy oracle.

    Raises
    ------
    ValueError
        If no design of that size can be built, or it has too few columns for the factors.

    Notes
    -----
    Plackett and Burman (1946), "The design of optimum multifactorial experiments", Biometrika 33,
    305–325; the matrices come from pyDOE3 where it has them (4, 12 or 20 times a power of two), and
    from :func:`~experiments.designs.hadamard.hadamard` elsewhere.
    """

    method: ClassVar[str] = "plackett_burman"
    title: ClassVar[str] = "Plackett–Burman design"
    summary: ClassVar[str] = "two-level orthogonal screening of main effects, with dummy columns"
    levels: ClassVar[int] = 2

    n_runs: int | None = parameter(None, "runs", "a multiple of 4 before additions; default leaves four dummies")
    foldover: bool = parameter(False, "true/false", FOLDOVER)
    n_centre: int = parameter(0, "runs", CENTRE)

    def __post_init__(self) -> None:
        check_additions("Plackett-Burman design", self.foldover, self.n_centre)
        if self.n_runs is None:
            return
        check_count("n_runs of a Plackett-Burman design", self.n_runs, 4)
        if not constructible(self.n_runs) or self.n_runs > MAX_RUNS:
            wanted = int(self.n_runs)
            sizes = sorted(range(4, MAX_RUNS + 1, 4), key=lambda n: abs(n - wanted))
            near = sorted(islice(filter(constructible, sizes), 3))
            raise ValueError(
                f"no Plackett-Burman design with {self.n_runs} runs can be built; nearest sizes: "
                f"{', '.join(map(str, near))}"
            )

    def generate(self, space: FactorSpace, rng: Seed = 0) -> Design:
        """The design on `space`; nothing in it is random, so `rng` is not used."""
        n_factors = len(space)
        n_runs = self.n_runs or _smallest(n_factors)
        if n_factors > n_runs - 1:
            raise ValueError(
                f"a Plackett-Burman design of {n_runs} runs has {n_runs - 1} columns, too few for {n_factors} "
                f"factors; use n_runs = {_smallest(n_factors)}"
            )
        return assemble(space, _columns(n_runs), self.method, self.foldover, self.n_centre)


def _columns(n_runs: int) -> NDArray[np.float64]:
    """The orthogonal columns, shape (n_runs, n_runs − 1)."""
    if any(n_runs % base == 0 and (n_runs // base).bit_count() == 1 for base in (4, 12, 20)):
        from pyDOE3 import pbdesign  # brings SciPy with it, which a surrogate that only predicts does not need

        return np.asarray(pbdesign(n_runs - 1), dtype=np.float64)
    return hadamard(n_runs)[:, 1:].astype(np.float64)


def _smallest(n_factors: int) -> int:
    for n_runs in range(4, MAX_RUNS + 1, 4):
        if n_runs - 1 >= n_factors + MIN_DUMMIES and constructible(n_runs):
            return n_runs
    raise ValueError(f"no Plackett-Burman design for {n_factors} factors: at most {MAX_RUNS - 1 - MIN_DUMMIES}")

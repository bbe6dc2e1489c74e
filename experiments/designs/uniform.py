"""Uniform designs: balanced multi-level designs that fill the box evenly."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from ..factors import FactorSpace
from ..settings import parameter
from .annealing import Start, anneal
from .base import Design, Seed, check_count
from .discrepancy import criterion_named
from .search import search

MOST_RUNS = 2000
"""Memory and work of one round grow with the square of the runs."""

WARM = 0.2
"""Heat of an annealing from a given design: enough to leave a shallow dip, too little to forget the start."""


@dataclass(frozen=True)
class Uniform:
    """U-type design of low discrepancy.

    Every level appears equally often in every column; the squared discrepancy is minimised by
    exchanging two entries of one column at a time.

    Parameters
    ----------
    n_runs : int
        Runs, a multiple of `levels`.
    levels : int
        Levels per factor, at least 2; level k of q sits at coded −1 + 2(k − 1)/(q − 1), so the
        outer levels lie on the faces of the box. The discrepancy counts it as (2k − 1)/(2q).
    budget : int
        Exchanges tried. Work is counted, not seconds, so the same seed gives the same design. A
        core tries some 15 to 50 million a second, the fewer the more runs and levels.
    criterion : str
        ``"centred"``, ``"mixture"`` or ``"wraparound"``: the squared L2-discrepancy to lower.

    Raises
    ------
    ValueError
        If a count is too small, `n_runs` is not a multiple of `levels`, or `criterion` is unknown.

    Notes
    -----
    Fang, Lin, Winker and Zhang (2000), "Uniform design: theory and application", Technometrics 42,
    237–248, for the designs; :mod:`experiments.designs.annealing` for the search. A fair budget
    buys short annealings of several kinds and a long one of the kind that did best; the best design
    met counts. Some kinds look among *mirrored* designs only, where with each run its mirror image
    in the centre of the box is a run too: half as much to search, and often where the best ones are.
    """

    method: ClassVar[str] = "uniform"
    title: ClassVar[str] = "uniform design"
    summary: ClassVar[str] = "balanced space-filling U-type design, discrepancy minimised"

    n_runs: int = parameter(30, "runs", "a multiple of levels")
    levels: int = parameter(6, "levels", "levels per factor")
    budget: int = parameter(60_000_000, "exchanges", "exchanges tried to lower the discrepancy")
    criterion: str = parameter("centred", "name", "discrepancy: centred, mixture or wraparound")

    def __post_init__(self) -> None:
        check_count("levels of a uniform design", self.levels, 2, MOST_RUNS)
        check_count("n_runs of a uniform design", self.n_runs, 2, MOST_RUNS)
        check_count("budget of a uniform design", self.budget, 0, 10**12)
        criterion_named(self.criterion)
        if self.n_runs % self.levels:
            lower = self.n_runs // self.levels * self.levels
            near = [n for n in (lower, lower + self.levels) if n >= max(2, self.levels)]
            raise ValueError(
                f"a balanced uniform design needs n_runs to be a multiple of levels: {self.n_runs} runs and "
                f"{self.levels} levels do not fit; use n_runs = {' or '.join(map(str, near))}"
            )

    def generate(self, space: FactorSpace, rng: Seed = 0) -> Design:
        """The design on `space`; `rng` seeds the starts and the annealing."""
        return self._search(space, np.empty((0, len(space)), dtype=np.int64), self.n_runs, rng)

    def improve(self, design: Design, rng: Seed = 0) -> Design:
        """A design of the same runs and level counts, annealed from `design`: never worse than it.

        Parameters
        ----------
        design : Design
            Any number of runs; every setting on one of the `levels` levels, balanced or not.
        rng : int, SeedSequence or Generator

        Raises
        ------
        ValueError
            If a setting lies between the levels, or there are too many runs.
        """
        check_count("runs of a design to improve", len(design), 1, MOST_RUNS)
        start = Start(self._ranks(design), self.levels)
        best = anneal(start, criterion_named(self.criterion), self.budget, np.random.default_rng(rng), heat=WARM)
        return self._design(design.space, best.runs)

    def augment(self, design: Design, extra: int, rng: Seed = 0) -> Design:
        """The runs of `design`, in their order, followed by `extra` new ones placed where they fill best.

        The levels are used as equally often as the given runs allow: the new ones go where a column
        has fewest. `n_runs` has no say here.

        Parameters
        ----------
        design : Design
            Runs already paid for; every setting on one of the `levels` levels, balanced or not.
        extra : int
            New runs, at least 1.
        rng : int, SeedSequence or Generator

        Raises
        ------
        ValueError
            If a setting lies between the levels, `extra` is below 1, or there would be too many runs.
        """
        check_count("runs to add to a uniform design", extra, 1, MOST_RUNS)
        check_count("runs of a uniform design and those added", len(design) + extra, 2, MOST_RUNS)
        return self._search(design.space, self._ranks(design), extra, rng)

    def _search(self, space: FactorSpace, given: NDArray[np.int64], extra: int, rng: Seed) -> Design:
        criterion, generator = criterion_named(self.criterion), np.random.default_rng(rng)
        return self._design(space, search(given, self.levels, extra, criterion, self.budget, generator))

    def _ranks(self, design: Design) -> NDArray[np.int64]:
        """Levels 0 … levels − 1 of a given design."""
        position = (design.coded + 1.0) * (self.levels - 1) / 2.0
        ranks = np.rint(position).astype(np.int64)
        off = (np.abs(position - ranks) > 1e-6) | (ranks < 0) | (ranks >= self.levels)
        if off.any():
            row, column = np.argwhere(off)[0]
            raise ValueError(
                f"setting {design.coded[row, column]:.6g} of factor {design.space.names[column]!r} in run {row + 1} is "
                f"not one of {self.levels} equally spaced levels from -1 to 1; give the levels it was made with"
            )
        return ranks

    def _design(self, space: FactorSpace, ranks: NDArray[np.int64]) -> Design:
        return Design(space, -1.0 + 2.0 * ranks / (self.levels - 1), self.method)

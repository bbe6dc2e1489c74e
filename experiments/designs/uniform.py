"""Uniform designs: balanced multi-level designs that fill the box evenly."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from ..factors import FactorSpace
from ..settings import parameter
from .base import Design, Seed, check_count
from .discrepancy import centred_kernels, unit_levels

HOTTEST, COLDEST = 1e-1, 1e-3
"""First and last temperature, as fractions of the typical change of CD₂² at the start."""

MOST_RUNS = 2000
"""Memory and work of one exchange grow with the square of the runs."""


@dataclass(frozen=True)
class Uniform:
    """U-type design of low centred discrepancy.

    Every level appears equally often in every column; CD₂² is minimised by exchanging two entries
    of one column at a time.

    Parameters
    ----------
    n_runs : int
        Runs, a multiple of `levels`.
    levels : int
        Levels per factor, at least 2; level k of q sits at coded −1 + 2(k − 1)/(q − 1), so the
        outer levels lie on the faces of the box.
    budget : int
        Exchanges made. Work is counted, not seconds, so the same seed gives the same design.

    Raises
    ------
    ValueError
        If a count is too small or `n_runs` is not a multiple of `levels`.

    Notes
    -----
    Fang, Lin, Winker and Zhang (2000), "Uniform design: theory and application", Technometrics 42,
    237–248. With all other columns fixed, CD₂² is a quadratic assignment of levels to runs, so one
    matrix product prices every exchange in a column at once. The exchange is then drawn from the
    Boltzmann distribution over all of them (heat-bath annealing) instead of being proposed and
    mostly rejected.
    """

    method: ClassVar[str] = "uniform"
    title: ClassVar[str] = "uniform design"
    summary: ClassVar[str] = "balanced space-filling U-type design, centred discrepancy minimised"

    n_runs: int = parameter(30, "runs", "a multiple of levels")
    levels: int = parameter(6, "levels", "levels per factor")
    budget: int = parameter(20_000, "exchanges", "work spent on lowering the discrepancy")

    def __post_init__(self) -> None:
        check_count("levels of a uniform design", self.levels, 2, MOST_RUNS)
        check_count("n_runs of a uniform design", self.n_runs, 2, MOST_RUNS)
        check_count("budget of a uniform design", self.budget, 0)
        if self.n_runs % self.levels:
            lower = self.n_runs // self.levels * self.levels
            near = [n for n in (lower, lower + self.levels) if n >= max(2, self.levels)]
            raise ValueError(
                f"a balanced uniform design needs n_runs to be a multiple of levels: {self.n_runs} runs and "
                f"{self.levels} levels do not fit; use n_runs = {' or '.join(map(str, near))}"
            )

    def generate(self, space: FactorSpace, rng: Seed = 0) -> Design:
        """The design on `space`; `rng` seeds the start and the annealing."""
        generator = np.random.default_rng(rng)
        balanced = np.tile(np.arange(self.levels), self.n_runs // self.levels)
        start = np.column_stack([generator.permutation(balanced) for _ in space])
        chosen = anneal(start, self.levels, self.budget, generator)
        return Design(space, -1.0 + 2.0 * chosen / (self.levels - 1), self.method)


def anneal(design: NDArray[np.int64], levels: int, budget: int, rng: np.random.Generator) -> NDArray[np.int64]:
    """The design of lowest CD₂² met in `budget` exchanges, shape (n_runs, n_factors), levels 0 … levels − 1."""
    state = _State(design.copy(), levels)
    best, best_value = state.design.copy(), state.value()
    changes = np.concatenate([state.price(c)[0] for c in range(design.shape[1])])
    typical = np.abs(changes[np.isfinite(changes)]).mean() + np.finfo(float).tiny
    value = best_value
    for step, temperature in enumerate(typical * np.geomspace(HOTTEST, COLDEST, budget)):
        column = step % design.shape[1]
        change, first, second = state.price(column)
        noise = rng.gumbel(size=change.shape)
        pick = int(np.argmax(noise - change / temperature))
        value += change[pick]
        state.exchange(column, first[pick], second[pick])
        if value < best_value - 1e-13:
            best, best_value = state.design.copy(), value
    return best


class _State:
    """A design with the products that make every exchange in a column cheap to price."""

    def __init__(self, design: NDArray[np.int64], levels: int) -> None:
        self.design = design
        self.n = len(design)
        self.single, self.pair = centred_kernels(unit_levels(levels))
        self.first, self.second = np.triu_indices(self.n, 1)
        self.once = np.prod(self.single[design], axis=1)
        self.twice = np.ones((self.n, self.n))
        for column in design.T:
            self.twice *= self.pair[np.ix_(column, column)]

    def value(self) -> float:
        constant = (13.0 / 12.0) ** self.design.shape[1]
        return float(constant - 2.0 / self.n * self.once.sum() + self.twice.sum() / self.n**2)

    def price(self, column: int) -> tuple[NDArray[np.float64], NDArray[np.int64], NDArray[np.int64]]:
        """Change of CD₂² for each exchange of two rows in `column`; +inf where both have the same level."""
        level = self.design[:, column]
        own = self.pair[np.ix_(level, level)]
        rest = self.twice / own
        # landed[i, j]: two-point sum of row i if it took the level of row j, all others unmoved.
        landed = rest @ own
        gain = landed - np.diag(landed)[:, None]
        here = np.diag(own)
        # Row i meets its own copy at the old level, and the partner that moves too: put both right.
        kept = np.diag(rest)[:, None] * (here[None, :] + here[:, None] - 2.0 * own)
        met = rest * (2.0 * own - here[None, :] - here[:, None])
        change = (2.0 * (gain + gain.T) + kept + kept.T + 2.0 * met) / self.n**2
        once = (self.once / self.single[level])[:, None] * (self.single[level][None, :] - self.single[level][:, None])
        change -= 2.0 / self.n * (once + once.T)
        flat = change[self.first, self.second]
        flat[level[self.first] == level[self.second]] = np.inf
        return flat, self.first, self.second

    def exchange(self, column: int, i: int, j: int) -> None:
        level = self.design[:, column]
        rows = np.array([i, j])
        self.once[rows] /= self.single[level[rows]]
        self.twice[rows] /= self.pair[np.ix_(level[rows], level)]
        self.twice[:, rows] = self.twice[rows].T
        block = self.twice[np.ix_(rows, rows)]
        level[rows] = level[rows[::-1]]
        self.once[rows] *= self.single[level[rows]]
        self.twice[rows] *= self.pair[np.ix_(level[rows], level)]
        self.twice[:, rows] = self.twice[rows].T
        self.twice[np.ix_(rows, rows)] = block * self.pair[np.ix_(level[rows], level[rows])]

"""Exchange annealing: lowers a discrepancy by exchanging two entries of one column at a time, compiled by JAX."""

from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .discrepancy import Criterion

HOTTEST, COLDEST = 0.3, 1.0
"""First and last temperature: HOTTEST / √n and COLDEST / n^1.5 of the typical change at the start, n rows moving."""

COARSE = 12.0
"""With q levels the last temperature is 1 + COARSE / q times as high: the fewer levels, the larger the smallest step.
All three were measured between 16 and 100 runs and 4 and 100 levels."""

QUENCH = 20
"""One part in so many of the budget ends the annealing at no temperature: straight down into the nearest dip."""

LEG = 3_000
"""Exchanges tried, over n², that one annealing needs before a second one from a new start is worth its time."""

HEATS = (1.0, 0.6, 1.8)
"""Heats of the first annealings; which one is best differs from problem to problem, so the others take the winner's."""

NOISE = 400_000
"""Random numbers drawn at a time: 3 MB, and a few hundredths of a second between two fresh sums."""

PADDED = 8
"""Columns are filled up to a multiple of this, so that one compiled program serves many numbers of factors."""


def prices(criterion: Criterion, levels: Any, partner: Any, off: Any, diagonal: Any, lone: Any, ones: Any) -> Any:
    """Change of the discrepancy if each row exchanged its level with its partner, shape (n,), in O(n) work a row.

    Parameters
    ----------
    criterion : Criterion
    levels : array, shape (n,)
        The column, −1/2 … +1/2 from the centre of the cube.
    partner : array of int, shape (n,)
        An involution: the partner's partner is the row itself.
    off, diagonal : array, shape (n, n) and (n,)
        Two-point products of all *other* columns, off the diagonal (0 on it) and on it.
    lone, ones : array, shape (n,)
        One-point products of all other columns; ones.
    """
    n = len(levels)
    pair, single, other = criterion.pair, criterion.single, levels[partner]
    # A product with ones sums in vector registers, where a plain sum must keep its order.
    moved = (off * (pair(other[:, None], levels[None, :]) - pair(levels[:, None], levels[None, :]))) @ ones
    # The partner moves too, and what the two share stays as it is.
    shared = off[np.arange(n), partner] * (pair(other, other) - pair(levels, other))
    own = diagonal * (pair(other, other) - pair(levels, levels))
    change = (2.0 * (moved - shared) + own) / n**2 - 2.0 / n * lone * (single(other) - single(levels))
    return change + change[partner]


def anneal(
    start: NDArray[np.float64],
    criterion: Criterion,
    budget: int,
    rng: np.random.Generator,
    movable: int | None = None,
    heat: float = 1.0,
) -> NDArray[np.float64]:
    """The design of lowest discrepancy met while trying `budget` exchanges, never worse than `start`.

    Parameters
    ----------
    start : ndarray, shape (n, s)
        Levels from the centre of the cube, −1/2 … +1/2.
    criterion : Criterion
    budget : int
        Exchanges tried, in rounds of `movable` // 2 exchanges that share no row.
    rng : numpy.random.Generator
    movable : int, optional
        Only the last so many rows move; all of them by default.
    heat : float
        Scales all temperatures; below 1 for a start that is good already.

    Notes
    -----
    The exchange search of Fang, Lu and Winker (2003), "Lower bounds for centered and wrap-around
    L2-discrepancies and construction of uniform designs by threshold accepting", J. Complexity 19,
    692–711, with random (Metropolis) thresholds and geometric cooling. One round prices disjoint
    exchanges of a column together and makes the one that clears its threshold by most; a column is
    visited for several rounds, in which the products of the other columns stay. The compiled loop
    takes all its random numbers from `rng`.
    """
    n, s = start.shape
    free = n if movable is None else movable
    rounds = max(1, free // 2)
    visits = -(-budget // rounds**2)
    if free < 2 or visits == 0 or s == 1:  # the order of a single column does not matter
        return start.copy()
    # Rows that move come first inside: a round pairs row i with row (r − i) modulo `movable`.
    state = _State(np.roll(start, free, axis=0), criterion, free)
    coarse = 1.0 + COARSE / len(np.unique(start))
    first, last = HOTTEST / free**0.5 * heat, COLDEST / free**1.5 * heat * coarse
    temperatures = state.typical_change(rng) * np.geomspace(max(first, last), last, visits)
    temperatures[visits - visits // QUENCH :] = 0.0
    chunk = max(1, NOISE // (rounds * n))
    for begin in range(0, visits, chunk):
        cooling = temperatures[begin : begin + chunk]
        noise, pairing = np.zeros((chunk, rounds, n)), np.zeros((chunk, rounds), dtype=np.int64)
        noise[: len(cooling)] = rng.standard_exponential((len(cooling), rounds, n))
        pairing[: len(cooling)] = rng.integers(free, size=(len(cooling), rounds))
        state.walk(begin, cooling, pairing, noise)
    return np.roll(state.best, -free, axis=0)


def legs(budget: int, movable: int) -> list[int]:
    """Budgets of the annealings that `budget` is spent on, every one from a new start.

    A longer annealing pays at first, more of them later: their number grows as the 0.7th power of
    the budget.
    """
    count = max(1, int((budget / (LEG * max(movable, 2) ** 2)) ** 0.7))
    return [int(share) for share in np.diff(np.linspace(0, budget, count + 1).astype(np.int64))]


class _State:
    """A design under way, and the best one met."""

    def __init__(self, design: NDArray[np.float64], criterion: Criterion, movable: int) -> None:
        self.design, self.best = design.copy(), design.copy()
        self.criterion, self.movable = criterion, movable
        self.value = self.lowest = criterion.value(design + 0.5)

    def typical_change(self, rng: np.random.Generator) -> float:
        """Mean size of what an exchange changes, here."""
        n = len(self.design)
        once, twice = self.criterion.products(self.design)
        rows, found = np.arange(n), []
        for column in self.design.T[: 4 * PADDED]:
            lone = once / self.criterion.single(column)
            rest = twice / self.criterion.pair(column[:, None], column[None, :])
            partner = np.where(rows < self.movable, (rng.integers(self.movable) - rows) % self.movable, rows)
            off = rest * (1.0 - np.eye(n))
            found.append(prices(self.criterion, column, partner, off, np.diag(rest), lone, np.ones(n)))
        sizes = np.abs(found)
        return float(sizes[sizes > 1e-14].mean()) if (sizes > 1e-14).any() else 1.0

    def walk(self, begin: int, cooling: NDArray[np.float64], pairing: NDArray[np.int64], noise: Any) -> None:
        """Visit one column for each temperature in `cooling`, starting with column `begin` modulo s."""
        import jax  # half a second to import, and not needed by a surrogate that only predicts

        n, s = self.design.shape
        padding = np.zeros((-s % PADDED, n))
        # The products are summed afresh here, so rounding cannot pile up over a long walk.
        once, twice = self.criterion.products(self.design)
        temperatures = np.resize(cooling, len(pairing))
        order = (np.arange(len(pairing)) + begin) % s
        columns, best = (np.vstack([x.T, padding]) for x in (self.design, self.best))
        start = (columns, once, twice, self.value, best, self.lowest)
        with jax.enable_x64(True):
            walk = _compiled(self.criterion)
            end = walk(start, np.ones(n), self.movable, len(cooling), order, temperatures, pairing, noise)
        self.design, self.best = (np.asarray(end[i])[:s].T for i in (0, 4))
        self.value, self.lowest = (self.criterion.value(x + 0.5) for x in (self.design, self.best))


@cache
def _compiled(criterion: Criterion) -> Callable[..., Any]:
    """The walk over columns for one criterion, compiled once for each number of runs."""
    import jax
    import jax.numpy as jnp

    def walk(start, ones, movable, visits, order, temperatures, pairing, noise):
        n = len(ones)
        rows = jnp.arange(n)

        def round_(i, inner, visit, off, diagonal, lone):
            levels, value, best, lowest = inner
            partner = jnp.where(rows < movable, (pairing[visit, i] - rows) % movable, rows)
            change = prices(criterion, levels, partner, off, diagonal, lone, ones)
            # Metropolis: −T·log(uniform) is T times an exponential number.
            margin = change - temperatures[visit] * noise[visit, i][jnp.minimum(rows, partner)]
            margin = jnp.where(levels != levels[partner], margin, jnp.inf)
            row = jnp.argmin(margin)
            made = margin[row] < 0.0
            chosen = made & ((rows == row) | (rows == partner[row]))
            levels = jnp.where(chosen, levels[partner], levels)
            value = value + jnp.where(made, change[row], 0.0)
            better = value < lowest - 1e-13
            return levels, value, jnp.where(better, levels, best), jnp.where(better, value, lowest)

        def visit_(visit, outer):
            columns, once, twice, value, best, lowest = outer
            levels = columns[order[visit]]
            rest = twice / criterion.pair(levels[:, None], levels[None, :])
            lone = once / criterion.single(levels)
            off, diagonal = rest * (1.0 - jnp.eye(n)), jnp.diagonal(rest)
            levels, value, found, least = jax.lax.fori_loop(
                0,
                pairing.shape[1],
                lambda i, inner: round_(i, inner, visit, off, diagonal, lone),
                (levels, value, levels, lowest),
            )
            best = jnp.where(least < lowest, columns.at[order[visit]].set(found), best)
            columns = columns.at[order[visit]].set(levels)
            twice = rest * criterion.pair(levels[:, None], levels[None, :])
            return columns, lone * criterion.single(levels), twice, value, best, least

        return jax.lax.fori_loop(0, visits, visit_, start)

    return jax.jit(walk)

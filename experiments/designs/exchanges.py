"""The compiled inner loop of the search for uniform designs: exchanges within one column, priced in O(1) each.

All levels are whole numbers 0 … q − 1. A design may be *mirrored*: only half of its runs are kept, and
for each of them its image, level q − 1 − k for level k, is a run too. `images` is 2 then, else 1.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

HOPELESS = 30.0
"""A rise of so many temperatures is refused without drawing a number: e⁻³⁰."""

ROUNDING = 1e-15
"""A fall by less is none."""


class Walker(NamedTuple):
    """A design under way.

    Attributes
    ----------
    columns : ndarray of int, shape (s, h)
        Levels of the kept runs, a row a factor.
    best : ndarray of int, shape (s, h)
        The design of lowest discrepancy met.
    once, twice : ndarray, shape (h,) and (images, h, h)
        Products over all columns of the one-point and two-point factors; twice[g, i, j] is of run i
        and image g of run j.
    single, pair : ndarray, shape (q,) and (images, q, q)
        Those factors for each level; pair[g, a, b] is of level a and image g of level b.
    values : ndarray, shape (2,)
        Squared discrepancy now and at the best, constant part included.
    """

    columns: Ints
    best: Ints
    once: Floats
    twice: Floats
    single: Floats
    pair: Floats
    values: Floats


class Column(NamedTuple):
    """One column while it is visited: what every exchange in it would cost.

    Attributes
    ----------
    levels : ndarray of int, shape (h,)
    between : ndarray, shape (images, h, h)
        Weight of the two-point factor of this column between two runs; 0 between a run and itself.
    own : ndarray, shape (images, h)
        The same of a run with itself and with its own image.
    lone : ndarray, shape (h,)
        Weight of the one-point factor.
    energy : ndarray, shape (h, q)
        Part of the discrepancy that a run has at each level, all others where they are.
    """

    levels: Ints
    between: Floats
    own: Floats
    lone: Floats
    energy: Floats


def compiled(function: Callable[..., Any]) -> Callable[..., Any]:
    """`function` as machine code, kept on disk for the next process where a folder can be written."""
    try:
        return numba.njit(cache=True, error_model="numpy")(function)
    except RuntimeError:  # numba finds no folder to keep it in
        return numba.njit(error_model="numpy")(function)


@compiled
def visited(walker: Walker, k: int) -> Column:
    """Column `k`, with the energies of its runs."""
    pair, single, once, twice = walker.pair, walker.single, walker.once, walker.twice
    levels = walker.columns[k]
    images, q = pair.shape[:2]
    h = len(levels)
    between, own = np.empty((images, h, h)), np.empty((images, h))
    lone, energy, met = np.empty(h), np.zeros((h, q)), np.zeros(q)
    for i in range(h):
        lone[i] = 2.0 / h * once[i] / single[levels[i]]
        for g in range(images):
            met[:] = 0.0
            for j in range(h):
                between[g, i, j] = twice[g, i, j] / pair[g, levels[i], levels[j]] / (images * h * h)
                met[levels[j]] += between[g, i, j]
            own[g, i] = between[g, i, i]
            met[levels[i]] -= own[g, i]
            between[g, i, i] = 0.0
            for b in range(q):
                if met[b] != 0.0:
                    for a in range(q):
                        energy[i, a] += 2.0 * met[b] * pair[g, b, a]
            for a in range(q):
                energy[i, a] += own[g, i] * pair[g, a, a]
        for a in range(q):
            energy[i, a] -= lone[i] * single[a]
    return Column(levels, between, own, lone, energy)


@compiled
def left(walker: Walker, column: Column) -> None:
    """Bring the products of `walker` up to date with a column that was visited."""
    pair, single, once, twice = walker.pair, walker.single, walker.once, walker.twice
    levels, between, own, lone = column.levels, column.between, column.own, column.lone
    images, h = len(pair), len(levels)
    for i in range(h):
        once[i] = lone[i] * h / 2.0 * single[levels[i]]
        for g in range(images):
            for j in range(h):
                weight = own[g, i] if i == j else between[g, i, j]
                twice[g, i, j] = weight * (images * h * h) * pair[g, levels[i], levels[j]]


@compiled
def place(pair: Floats, levels: Ints, between: Floats, energy: Floats, i: int, j: int, new_i: int, new_j: int) -> None:
    """Put runs i and j, which may be one, at new levels; the energies of all runs follow."""
    both = 0.0 if i == j else 2.0
    for g in range(len(pair)):
        old_i, old_j = levels[i], levels[j]
        for r in range(len(levels)):
            weight_i, weight_j = 2.0 * between[g, r, i], both * between[g, r, j]
            for a in range(energy.shape[1]):
                gain_i, gain_j = pair[g, new_i, a] - pair[g, old_i, a], pair[g, new_j, a] - pair[g, old_j, a]
                energy[r, a] += weight_i * gain_i + weight_j * gain_j
    levels[i], levels[j] = new_i, new_j


@compiled
def sweep(
    pair: Floats,
    levels: Ints,
    between: Floats,
    energy: Floats,
    first: int,
    temperature: float,
    rng: np.random.Generator,
) -> float:
    """Try every exchange of two runs from number `first` on, by Metropolis' rule; the sum of the changes made.

    In a mirrored design the two runs may also take each other's image, and each run its own. The price
    is written out here: as a function of its own it would cost three times as much.
    """
    total, q, images = 0.0, pair.shape[1], pair.shape[0]
    for i in range(first, len(levels)):
        for j in range(i, len(levels)):
            for across in range(images):
                a, b = levels[i], levels[j]
                new_i, new_j = (q - 1 - b, q - 1 - a) if across else (b, a)
                if new_i == a:
                    continue
                change = energy[i, new_i] - energy[i, a]
                if i != j:
                    change += energy[j, new_j] - energy[j, b]
                    # Each was priced with the other in its old place; what the two share stays as it is.
                    for g in range(images):
                        own = 1 - g if across else g
                        change -= 2.0 * between[g, i, j] * (pair[own, a, a] + pair[own, b, b] - 2.0 * pair[g, a, b])
                if change < -ROUNDING or (
                    change < HOPELESS * temperature and rng.random() < np.exp(-change / temperature)
                ):
                    place(pair, levels, between, energy, i, j, new_i, new_j)
                    total += change
    return total


@compiled
def walk(walker: Walker, first: int, temperatures: Floats, sweeps: int, rng: np.random.Generator) -> None:
    """Visit a column for each temperature, every column once before any is visited again."""
    order = np.arange(len(walker.columns))
    for visit in range(len(temperatures)):
        if visit % len(order) == 0:
            for k in range(len(order) - 1, 0, -1):
                other = rng.integers(0, k + 1)
                order[k], order[other] = order[other], order[k]
        column = visited(walker, order[visit % len(order)])
        for _ in range(sweeps):
            walker.values[0] += sweep(
                walker.pair, column.levels, column.between, column.energy, first, temperatures[visit], rng
            )
            if walker.values[0] < walker.values[1] - 1e-13:
                walker.values[1] = walker.values[0]
                walker.best[:] = walker.columns
        left(walker, column)


def tables(criterion: Any, levels: int, images: int) -> tuple[Floats, Floats]:
    """`single` and `pair` of :class:`Walker` for a :class:`~.discrepancy.Criterion`."""
    centred = (np.arange(levels) + 0.5) / levels - 0.5
    pair = np.asarray(criterion.pair(centred[:, None], centred[None, :]), dtype=np.float64)
    return np.asarray(criterion.single(centred), dtype=np.float64), np.stack([pair, pair[:, ::-1]][:images])

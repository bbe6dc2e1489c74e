"""Search for a uniform design: short annealings of several kinds, long ones of the two kinds that did best."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .annealing import Start, anneal, tried
from .discrepancy import Criterion

Ints = NDArray[np.int64]


class Kind(NamedTuple):
    """How to anneal: among mirrored designs only or among all, and how hot."""

    mirrored: bool
    heat: float


KINDS = (Kind(False, 1.0), Kind(True, 1.0), Kind(False, 0.4), Kind(True, 2.0), Kind(False, 2.0))
"""Which one is best differs from problem to problem; the first is what a budget too small to try them all goes to."""

TRIAL = 0.08
"""Part of the budget that goes into trying one of them."""

POLISH = 0.02
"""Part of the budget that ends the search by going straight down, a mirrored design no longer held to be one."""

PATIENCE, LONGEST = 200, 25_000
"""Visits to each column that a trial must have to tell anything; that an annealing has at most: then another start
pays more."""


def search(given: Ints, levels: int, extra: int, criterion: Criterion, budget: int, rng: np.random.Generator) -> Ints:
    """`given` followed by `extra` runs that fill the box best, as far as `budget` exchanges find them.

    Parameters
    ----------
    given : ndarray of int, shape (n_given, s)
        Levels 0 … levels − 1 of runs that stay; may be empty.
    levels, extra, budget : int
    criterion : Criterion
    rng : numpy.random.Generator

    Returns
    -------
    ndarray of int, shape (n_given + extra, s)
    """

    def attempt(kind: Kind, budget: int) -> tuple[float, Kind, Start]:
        if kind.mirrored:
            start = Start(mirrored(levels, extra, given.shape[1], rng), levels, mirrored=True)
        else:
            added = np.column_stack([fewest_first(column, levels, extra, rng) for column in given.T])
            start = Start(np.vstack([given, added]), levels, still=len(given))
        found = anneal(start, criterion, budget, rng, kind.heat)
        return found.value(criterion), kind, found

    kinds = [kind for kind in KINDS if not kind.mirrored or (not len(given) and may_mirror(levels, extra))]
    visit = given.shape[1] * max(1, tried(extra, mirrored=True))
    trial, polish = min(int(TRIAL * budget), LONGEST * visit), int(POLISH * budget)
    if trial < PATIENCE * visit:
        kinds, trial, polish = kinds[:1], 0, 0
    attempts = [attempt(kind, trial) for kind in kinds]
    ranked = sorted(attempts, key=lambda found: found[0])
    rest = budget - trial * len(kinds) - polish
    longer = -(-rest // (LONGEST * visit)) or 1
    for leg in range(longer):
        kind = ranked[leg % min(2, len(ranked))][1]
        attempts.append(attempt(kind, rest * (leg + 1) // longer - rest * leg // longer))
    best = min(attempts, key=lambda found: found[0])[2].design
    return anneal(Start(best, levels, still=len(given)), criterion, polish, rng, heat=0.0).runs


def may_mirror(levels: int, runs: int) -> bool:
    """Whether a balanced design of so many runs can hold each run's image beside the run."""
    return runs % 2 == 0 and (levels % 2 == 0 or runs // levels % 2 == 0)


def mirrored(levels: int, runs: int, s: int, rng: np.random.Generator) -> Ints:
    """One of each pair of runs of a random balanced mirrored design, shape (runs // 2, s)."""
    upper = np.sort(np.arange(runs) % levels)[runs // 2 :]
    half = np.column_stack([rng.permutation(upper) for _ in range(s)])
    return np.where(rng.random(half.shape) < 0.5, half, levels - 1 - half)


def fewest_first(column: Ints, levels: int, extra: int, rng: np.random.Generator) -> Ints:
    """`extra` levels in random order that make the counts of `column` and them together as equal as can be.

    Ties are broken at random, so that a remainder does not favour the same levels in every column.
    """
    counts = np.bincount(column, minlength=levels)
    added = []
    for _ in range(extra):
        fewest = np.flatnonzero(counts == counts.min())
        added.append(rng.choice(fewest))
        counts[added[-1]] += 1
    return rng.permutation(np.array(added, dtype=np.int64))

"""Search of two-level fractions of minimum aberration."""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from .fractions import krawtchouk

WIDTH = 60
"""Partial fractions kept at each step; for 16 runs the tests compare with all fractions there are."""

LONGEST = 8
"""Words longer than this do not decide between fractions."""


Pattern = tuple[int, ...]
Kind = tuple[Pattern, bytes]


@lru_cache(maxsize=64)
def minimum_aberration(n_factors: int, n_basic: int) -> tuple[int, ...]:
    """Columns of a fraction of n = 2^n_basic runs with the best word-length pattern found, as bit masks, sorted.

    Notes
    -----
    Of two fractions, the one with fewer words of the shortest length in which they differ has less
    aberration: Fries and Hunter (1980), Technometrics 22, 601–608. Columns are added to the basic ones, or
    taken from a larger set, one at a time; of the fractions reached, one of each kind is kept, the best
    `WIDTH` of them. Fractions are of one kind if their patterns and their columns' sums of two and of three
    agree in number, an invariant in the spirit of the letter patterns of Draper and Mitchell (1970), Ann. Math.
    Statist. 41, 876–887. Up to n/2 factors no word has length 3, and above 5n/16 all are of even length (Butler
    2003, Biometrika 90, 233–238); beyond n/2 the unused columns lie in the smallest subspace that holds
    them (Chen and Hedayat 1996, Ann. Statist. 24, 2536–2548). The published patterns of Chen, Sun and Wu
    (1993), Int. Statist. Rev. 61, 131–145, are reached (tests); beyond 32 runs that is no proof.
    """
    n_runs = 2**n_basic
    masks = np.arange(n_runs)
    walsh = 1.0 - 2.0 * (np.bitwise_count(masks[:, None] & masks[None, :]) % 2)
    odd, found = masks >= n_runs // 2, []
    if 2 * n_factors > n_runs:
        unused = n_runs - 1 - n_factors
        found.append(_walk(masks > 0, (masks > 0) & (masks < 2 ** unused.bit_length()), n_factors, walsh))
    if 16 * n_factors <= 5 * n_runs:
        found.append(_walk(np.bitwise_count(masks) == 1, masks > 0, n_factors, walsh))
    if not any(found) or 4 * n_factors >= n_runs >= 2 * n_factors:
        found.append(_walk(odd, odd, n_factors, walsh))
    _, columns = min((pair for pair in found if pair), key=lambda pair: pair[0])
    return tuple(int(c) for c in np.flatnonzero(columns))


def _walk(
    start: NDArray[np.bool_], free: NDArray[np.bool_], n_factors: int, walsh: NDArray[np.float64]
) -> tuple[Pattern, NDArray[np.float64]] | None:
    """The best pattern and fraction met from `start`, changing `free` columns up to `n_factors`; ``None`` if stuck."""
    pattern, beam = (), [start.astype(np.float64)]
    while beam[0].sum() != n_factors:
        step = 1 if beam[0].sum() < n_factors else -1
        kinds: dict[Kind, tuple[Pattern, NDArray[np.float64]]] = {}
        for columns in beam:
            for key, kind in _neighbours(columns, free, step, walsh):
                kinds.setdefault(key, kind)
        if not kinds:
            return None
        ranked = sorted(kinds.values(), key=lambda kind: kind[0])[:WIDTH]
        pattern, beam = ranked[0][0], [columns for _, columns in ranked]
    return pattern, beam[0]


def _neighbours(
    columns: NDArray[np.float64], free: NDArray[np.bool_], step: int, walsh: NDArray[np.float64]
) -> list[tuple[Kind, tuple[Pattern, NDArray[np.float64]]]]:
    """Fractions with one column more, or less: what kind each is, its word-length pattern, and its columns."""
    k = int(columns.sum()) + step
    changed = free & (columns == (step < 0))
    if step > 0:  # a sum of two columns would make a word of length 3
        changed &= ((columns @ walsh) ** 2 @ walsh) == 0
    where = np.flatnonzero(changed)
    tried = np.repeat(columns[None], len(where), axis=0)
    tried[np.arange(len(where)), where] += step
    sums = tried @ walsh
    lengths = range(3, min(k, LONGEST) + 1)
    polynomials = np.array([[krawtchouk(j, x, k) for x in range(k + 1)] for j in lengths]).reshape(-1, k + 1)
    patterns = polynomials[:, np.rint(k - sums).astype(np.int64) // 2].sum(axis=2).T // len(walsh)
    twos, threes = (sums**2) @ walsh / len(walsh), (sums**3) @ walsh / len(walsh)
    keys = np.sort((tried * 2.0**20 + twos) * 2.0**30 + threes, axis=1)
    spanning = (sums == k).sum(axis=1) == 1  # no other run has the signs of the first
    good = np.flatnonzero(spanning | (step > 0))
    words = [tuple(int(a) for a in row) for row in patterns]
    return [((words[i], keys[i].tobytes()), (words[i], tried[i])) for i in good]

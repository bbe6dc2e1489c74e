"""Williamson's four sequences, found by an exact search over symmetric ±1 sequences."""

from functools import lru_cache
from math import gcd

import numpy as np
from numpy.typing import NDArray

MOST_ORBITS = 14
"""Sequences of up to 2^14 patterns are searched, which takes seconds; longer searches are left out."""


@lru_cache(maxsize=128)
def williamson_blocks(length: int) -> NDArray[np.int64] | None:
    """First rows of four symmetric circulants with A² + B² + C² + D² = 4 · length · I, shape (4, length); or ``None``.

    Notes
    -----
    Williamson (1944), "Hadamard's determinant theorem and the sum of four squares", Duke Math. J.
    11, 65–81. The four periodic autocorrelations must cancel at every shift. Sequences constant on
    the orbits of a group of multipliers modulo the length are tried, fewest orbits first; pairs of
    autocorrelations are matched in whole numbers, so what is found is exact. Sequences, and pairs of them,
    whose power spectrum exceeds 4 · length at any frequency are left out: all four spectra add up to it.
    """
    if length < 3 or length % 2 == 0:
        return None
    groups = {_orbits(length, m) for m in range(1, length) if gcd(m, length) == 1}
    for orbits in sorted(groups, key=lambda orbits: (len(orbits), orbits)):
        if len(orbits) > MOST_ORBITS:
            return None
        found = _search(length, orbits)
        if found is not None:
            found.setflags(write=False)
            return found
    return None


def _orbits(length: int, multiplier: int) -> tuple[tuple[int, ...], ...]:
    """Orbits of the nonzero residues under −1 and `multiplier`."""
    left, orbits = set(range(1, length)), []
    while left:
        new = {min(left)}
        orbit = set(new)
        while new:
            new = {r * m % length for r in new for m in (multiplier, length - 1)} - orbit
            orbit |= new
        orbits.append(tuple(sorted(orbit)))
        left -= orbit
    return tuple(orbits)


def _search(length: int, orbits: tuple[tuple[int, ...], ...]) -> NDArray[np.int64] | None:
    """Four sequences constant on `orbits` whose autocorrelations cancel, +1 at the origin; ``None`` if none do."""
    patterns = np.arange(2 ** len(orbits))
    sequences = np.ones((len(patterns), length), dtype=np.int64)
    for bit, orbit in enumerate(orbits):
        sequences[:, list(orbit)] = 1 - 2 * ((patterns >> bit) & 1)[:, None]
    power = np.fft.rfft(sequences, axis=1).real ** 2
    bound = 4 * length + 1e-6
    possible = (power <= bound).all(axis=1)
    if not possible.any():
        return None
    sequences, power = sequences[possible], power[possible]
    shifts = [(np.arange(length) + s) % length for s in range(1, length // 2 + 1)]
    correlation = np.column_stack([(sequences * sequences[:, s]).sum(axis=1) for s in shifts])
    # One whole number per sequence stands for all its shifts; a chance match is told by the check at the end.
    keys = correlation @ np.random.default_rng(0).integers(-(2**40), 2**40, correlation.shape[1])
    fitting = [i + np.flatnonzero((power[i:] + power[i] <= bound).all(axis=1)) for i in range(len(power))]
    first = np.repeat(np.arange(len(power)), [len(js) for js in fitting])
    second = np.concatenate(fitting)
    sums = keys[first] + keys[second]
    order = np.argsort(sums, kind="stable")
    place = np.minimum(np.searchsorted(sums[order], -sums), len(sums) - 1)
    for i in np.flatnonzero(sums[order][place] == -sums):
        j = order[place[i]]
        four = [first[i], second[i], first[j], second[j]]
        if not correlation[four].sum(axis=0).any():
            return sequences[four]
    return None

"""Regular two-level fractions: which effects they alias, in words."""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations
from math import comb

import numpy as np
from numpy.typing import NDArray

MOST_WORDS = 2**16


@dataclass(frozen=True)
class Fraction:
    """A regular fraction: every factor's column is a signed product of basic two-level columns.

    Parameters
    ----------
    names : tuple of str
        Factor names, length n_factors.
    masks : tuple of int
        Which basic columns multiply to each factor's column, as bits.
    signs : tuple of int
        +1 or −1 for each factor.

    Notes
    -----
    Box, Hunter and Hunter (2005), *Statistics for Experimenters*, 2nd ed., chapter 6 (generators,
    defining relation, resolution); word-length pattern: Fries and Hunter (1980), Technometrics 22, 601–608.
    """

    names: tuple[str, ...]
    masks: tuple[int, ...]
    signs: tuple[int, ...]

    @cached_property
    def _generating(self) -> tuple[frozenset[int], ...]:
        """For each factor that depends on earlier ones: it and those that multiply to it."""
        pivots: dict[int, tuple[int, frozenset[int]]] = {}
        words = []
        for i, mask in enumerate(self.masks):
            members = frozenset({i})
            while mask and mask.bit_length() in pivots:
                reduced, others = pivots[mask.bit_length()]
                mask, members = mask ^ reduced, members ^ others
            if mask:
                pivots[mask.bit_length()] = (mask, members)
            else:
                words.append(members)
        return tuple(words)

    @property
    def generators(self) -> tuple[str, ...]:
        """How each factor that is no basic one is made: ``"E = A:B:C"``."""
        made = []
        for word in self._generating:
            last = max(word)
            sign = "-" if self._sign(word) < 0 else ""
            made.append(f"{self.names[last]} = {sign}{self._label(word - {last})}")
        return tuple(made)

    @property
    def defining_relation(self) -> tuple[str, ...]:
        """All products of factors that are constant, shortest first: ``("A:B:C:E", "-A:C:D:F", …)``; empty if full.

        Raises
        ------
        ValueError
            If there are more than 65 535; the word-length pattern and the alias lists are exact there too.
        """
        if 2 ** len(self._generating) > MOST_WORDS:
            raise ValueError(
                f"the defining relation has 2^{len(self._generating)} - 1 words, at most {MOST_WORDS - 1} are listed; "
                "read word_length_pattern or aliases() instead"
            )
        words: list[frozenset[int]] = [frozenset()]
        for generating in self._generating:
            words += [word ^ generating for word in words]
        words = sorted(words[1:], key=lambda word: (len(word), sorted(word)))
        return tuple(self._signed(word) for word in words)

    @cached_property
    def word_length_pattern(self) -> tuple[int, ...]:
        """Number of words of length 3, 4, …, n_factors in the defining relation, exact.

        From the runs' sums by the MacWilliams identity, so the words need not be listed: Chen and
        Hedayat (1996), Ann. Statist. 24, 2536–2548.
        """
        k = len(self.names)
        counts = np.bincount(self._flips(), minlength=k + 1)
        runs = int(counts.sum())
        pattern = []
        for length in range(3, k + 1):
            total = sum(int(count) * krawtchouk(length, x, k) for x, count in enumerate(counts) if count)
            pattern.append(total // runs)
        return tuple(pattern)

    @property
    def resolution(self) -> int | None:
        """Length of the shortest word; ``None`` for a full factorial, which has no words."""
        return next((i + 3 for i, count in enumerate(self.word_length_pattern) if count), None)

    def aliases(self, order: int = 2) -> tuple[str, ...]:
        """What each contrast measures, effects of up to `order` factors: ``"A + B:C"``; one text per contrast.

        Raises
        ------
        ValueError
            If `order` is no whole number between 1 and 4.
        """
        if isinstance(order, bool) or order not in (1, 2, 3, 4):
            raise ValueError(f"the order of alias lists must be 1, 2, 3 or 4, got {order!r}")
        chains: dict[int, list[frozenset[int]]] = {}
        for size in range(1, order + 1):
            for chosen in combinations(range(len(self.names)), size):
                mask = 0
                for i in chosen:
                    mask ^= self.masks[i]
                chains.setdefault(mask, []).append(frozenset(chosen))
        return tuple(self._chain(mask, members) for mask, members in chains.items())

    def _chain(self, mask: int, members: list[frozenset[int]]) -> str:
        """The effects on one contrast, signed so that the first is positive; the mean leads where it is one of them."""
        lead = self._sign(members[0]) if mask else 1
        labels = [self._label(member) for member in members]
        signs = [" - " if self._sign(member) * lead < 0 else " + " for member in members]
        text = "".join(sign + label for sign, label in zip(signs, labels, strict=True))
        return text[3:] if mask else f"1{text}"

    def _flips(self) -> NDArray[np.int64]:
        """How many factors are at the other level than in the first run, for every run of the basic columns."""
        bits = max(self.masks).bit_length()
        runs = np.arange(2**bits)
        flips = np.zeros(len(runs), dtype=np.int64)
        for mask in self.masks:
            flips += np.bitwise_count(runs & mask) % 2
        return flips

    def _sign(self, word: Iterable[int]) -> int:
        return int(np.prod([self.signs[i] for i in word]))

    def _label(self, word: Iterable[int]) -> str:
        return ":".join(self.names[i] for i in sorted(word))

    def _signed(self, word: frozenset[int]) -> str:
        return f"{'-' if self._sign(word) < 0 else ''}{self._label(word)}"


def krawtchouk(j: int, x: int, k: int) -> int:
    """Krawtchouk polynomial K_j(x; k) in whole numbers: Σ_s (−1)^s C(x, s) C(k − x, j − s)."""
    return sum((-1) ** s * comb(x, s) * comb(k - x, j - s) for s in range(j + 1))

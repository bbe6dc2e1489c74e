"""Two-level fractional factorials 2^(k − p): by size, by resolution, or by given generators."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from ..factors import FactorSpace
from ..naming import suggestion
from ..settings import parameter
from .aberration import minimum_aberration
from .base import Design, Seed, check_count
from .fractions import Fraction
from .two_level import CENTRE, FOLDOVER, assemble, check_additions

MOST_RUNS = 1024
MOST_SEARCHED = 128
"""Largest fraction that is searched; given generators and full factorials may be larger."""


@dataclass(frozen=True)
class FractionalFactorial:
    """Regular two-level design: every two effects are either orthogonal or fully aliased.

    :meth:`fraction` says which. Columns that no factor uses are kept as dummies.

    Parameters
    ----------
    n_runs : int, optional
        A power of two, before foldover and centre points; the fraction of minimum aberration is
        taken. By default the smallest that reaches `resolution`.
    resolution : int, optional
        At least this: 3 frees main effects of one another, 4 also of two-factor interactions, 5 also
        those of one another. By default 4 where `n_runs` is not given.
    generators : str
        Instead of a search, ``"E = A:B:C; F = -B:C:D"`` with the factors' names; factors without a
        generator are basic.
    foldover : bool
        Repeat every run with all signs turned.
    n_centre : int
        Runs at the centre, on top.

    Raises
    ------
    ValueError
        If a size is no power of two or too small, the resolution is not reached, or a generator
        cannot be read, names an unknown factor or aliases two main effects.

    Notes
    -----
    Box and Hunter (1961), "The 2^(k−p) fractional factorial designs", Technometrics 3, 311–351 and
    449–458. The search is :func:`~experiments.designs.aberration.minimum_aberration`.
    """

    method: ClassVar[str] = "fractional_factorial"
    title: ClassVar[str] = "fractional factorial"
    summary: ClassVar[str] = "regular two-level fraction of minimum aberration, its aliases listed"
    levels: ClassVar[int] = 2

    n_runs: int | None = parameter(None, "runs", "a power of two; default is the smallest of the wanted resolution")
    resolution: int | None = parameter(None, "factors", "3, 4, 5, …: length of the shortest word; default 4")
    generators: str = parameter("", "text", "'E = A:B:C; F = B:C:D' instead of a search")
    foldover: bool = parameter(False, "true/false", FOLDOVER)
    n_centre: int = parameter(0, "runs", CENTRE)

    def __post_init__(self) -> None:
        check_additions("fractional factorial", self.foldover, self.n_centre)
        if self.resolution is not None:
            check_count("resolution of a fractional factorial", self.resolution, 3, 100)
        if self.n_runs is None:
            return
        check_count("n_runs of a fractional factorial", self.n_runs, 2, MOST_RUNS)
        if int(self.n_runs).bit_count() != 1:
            above = 1 << int(self.n_runs).bit_length()
            raise ValueError(
                f"a fractional factorial has a power of two of runs, got {self.n_runs}; use n_runs = {above // 2}"
                + (f" or {above}" if above <= MOST_RUNS else "")
            )

    def generate(self, space: FactorSpace, rng: Seed = 0) -> Design:
        """The design on `space`; nothing in it is random, so `rng` is not used."""
        base, n_basic = self._base(space)
        runs = np.arange(2**n_basic)
        free = sorted(set(range(1, len(runs))) - set(base.masks))
        columns = [sign * _column(runs, mask) for mask, sign in zip(base.masks, base.signs, strict=True)]
        table = np.column_stack(columns + [_column(runs, mask) for mask in free])
        return assemble(space, table, self.method, self.foldover, self.n_centre)

    def fraction(self, space: FactorSpace) -> Fraction:
        """The generators, defining relation, resolution and aliases of the design on `space`, foldover included."""
        base, n_basic = self._base(space)
        if not self.foldover:
            return base
        return Fraction(base.names, tuple(mask | 1 << n_basic for mask in base.masks), base.signs)

    def _base(self, space: FactorSpace) -> tuple[Fraction, int]:
        """The fraction before foldover, and its number of basic columns."""
        if self.generators:
            chosen = _parse(self.generators, space.names)
        elif self.n_runs is not None:
            chosen = _search(space.names, int(self.n_runs).bit_length() - 1)
        else:
            chosen = _smallest(space.names, self.resolution or 4)
        n_basic = max(chosen.masks).bit_length()
        if self.n_runs is not None and not self.generators:
            n_basic = int(self.n_runs).bit_length() - 1
        if self.n_runs is not None and 2**n_basic != self.n_runs:
            raise ValueError(
                f"the generators {self.generators!r} leave {n_basic} basic factors, which need {2**n_basic} runs, not "
                f"{self.n_runs}; leave n_runs out or give other generators"
            )
        reached = chosen.resolution
        if self.resolution is not None and reached is not None and reached < self.resolution:
            raise ValueError(
                f"{len(space)} factors in {2**n_basic} runs reach resolution {reached}, not {self.resolution}; leave "
                "n_runs and generators out to get the smallest fraction that does"
            )
        return chosen, n_basic


def _column(runs: NDArray[np.int64], mask: int) -> NDArray[np.float64]:
    """Product of the basic columns in `mask`, ±1; basic column i is +1 where bit i of the run is set."""
    return 1.0 - 2.0 * (np.bitwise_count(~runs & mask) % 2)


def _search(names: tuple[str, ...], n_basic: int) -> Fraction:
    k = len(names)
    if k > 2**n_basic - 1:
        raise ValueError(
            f"a fractional factorial of {2**n_basic} runs has {2**n_basic - 1} columns, too few for {k} factors; "
            f"use n_runs = {1 << k.bit_length()}"
        )
    if k <= n_basic:
        return Fraction(names, tuple(1 << i for i in range(k)), (1,) * k)
    if 2**n_basic > MOST_SEARCHED:
        raise ValueError(
            f"fractions are searched up to {MOST_SEARCHED} runs, got {2**n_basic} runs for {k} factors; give generators"
        )
    return Fraction(names, _basic_first(minimum_aberration(k, n_basic)), (1,) * k)


def _basic_first(columns: tuple[int, ...]) -> tuple[int, ...]:
    """The same columns with independent ones first, named 1, 2, 4, …, and the others as their products."""
    pivots: dict[int, tuple[int, int]] = {}
    n_basic, products = 0, []
    for mask in columns:
        made = 0
        while mask and mask.bit_length() in pivots:
            reduced, of = pivots[mask.bit_length()]
            mask, made = mask ^ reduced, made ^ of
        if mask:
            pivots[mask.bit_length()] = (mask, made ^ 1 << n_basic)
            n_basic += 1
        else:
            products.append(made)
    return tuple(1 << i for i in range(n_basic)) + tuple(sorted(products, key=lambda m: (-m.bit_count(), m)))


def _smallest(names: tuple[str, ...], resolution: int) -> Fraction:
    n_basic = 1
    while 2**n_basic <= (MOST_RUNS if n_basic >= len(names) else MOST_SEARCHED):
        if len(names) < 2**n_basic:
            found = _search(names, n_basic)
            if found.resolution is None or found.resolution >= resolution:
                return found
        n_basic += 1
    raise ValueError(
        f"no fraction of resolution {resolution} for {len(names)} factors was found up to {MOST_SEARCHED} runs; ask "
        "for a lower resolution or give generators"
    )


def _parse(text: str, names: tuple[str, ...]) -> Fraction:
    """The fraction that the generators describe."""
    made: dict[str, tuple[int, list[str]]] = {}
    for part in text.replace(",", ";").split(";"):
        left, equals, right = (word.strip() for word in part.partition("="))
        sign = -1 if right.startswith("-") else 1
        right = right.lstrip("+-").strip()
        spelled = ":" in right or right in names or any(len(name) > 1 for name in names)
        words = [word.strip() for word in right.split(":")] if spelled else list(right)
        if not equals or not all(words) or not right or left in made:
            raise ValueError(
                f"generator {part.strip()!r} cannot be read; write 'E = A:B:C', each factor once, with ';'"
            )
        made[left] = (sign, words)
    for name in [*made, *(word for _, words in made.values() for word in words)]:
        if name not in names:
            raise ValueError(f"generators name an unknown factor {name!r}{suggestion(name, names)}")
    basic = [name for name in names if name not in made]
    if 2 ** len(basic) > MOST_RUNS:
        raise ValueError(f"{len(basic)} basic factors need {2 ** len(basic)} runs, at most {MOST_RUNS} are allowed")
    masks = {name: 1 << i for i, name in enumerate(basic)}
    for left, (_, words) in made.items():
        if set(words) & set(made) or len(set(words)) < len(words):
            raise ValueError(
                f"generator of {left!r} must be a product of different basic factors ({', '.join(basic)}), got "
                f"{':'.join(words)!r}"
            )
        masks[left] = sum(masks[word] for word in words)
    if len(set(masks.values())) < len(names):
        raise ValueError(f"generators {text!r} alias two main effects with one another; give longer or other products")
    return Fraction(names, tuple(masks[name] for name in names), tuple(made.get(name, (1,))[0] for name in names))

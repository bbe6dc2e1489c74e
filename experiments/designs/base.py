"""What every design is, and what every method that makes one offers."""

from dataclasses import dataclass, field
from typing import ClassVar, Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..factors import FactorSpace

Seed = int | np.random.SeedSequence | np.random.Generator | None


@dataclass(frozen=True, eq=False)
class Design:
    """The settings to run.

    Parameters
    ----------
    space : FactorSpace
        The factors, n_factors of them.
    coded : array_like, shape (n_runs, n_factors)
        Settings in coded units.
    method : str
        Name of the method that made it.
    dummies : array_like, shape (n_runs, n_dummies), optional
        Columns of an orthogonal design that no factor was assigned to. Their contrasts carry what
        the main effects cannot explain: noise and interactions. Runs that a column does not weigh,
        such as centre runs, are 0 there.

    Raises
    ------
    ValueError
        If a shape disagrees or a setting is not finite.
    """

    space: FactorSpace
    coded: NDArray[np.float64]
    method: str
    dummies: NDArray[np.float64] = field(default_factory=lambda: np.empty((0, 0)))

    def __post_init__(self) -> None:
        coded = np.array(self.coded, dtype=np.float64)
        if coded.ndim != 2 or coded.shape[1] != len(self.space):
            raise ValueError(
                f"a design of {len(self.space)} factors needs shape (n_runs, {len(self.space)}); got {coded.shape}"
            )
        if not np.isfinite(coded).all():
            raise ValueError("a design must not contain settings that are not finite")
        dummies = np.array(self.dummies, dtype=np.float64)
        dummies = dummies if dummies.size else np.empty((len(coded), 0))
        if dummies.ndim != 2 or len(dummies) != len(coded):
            raise ValueError(f"dummy columns need {len(coded)} rows, one per run; got shape {dummies.shape}")
        for name, array in (("coded", coded), ("dummies", dummies)):
            array.setflags(write=False)
            object.__setattr__(self, name, array)

    @classmethod
    def from_physical(cls, space: FactorSpace, physical: ArrayLike, method: str = "given") -> "Design":
        """A design from settings in physical units, shape (n_runs, n_factors)."""
        return cls(space, space.code(physical), method)

    def __len__(self) -> int:
        return len(self.coded)

    @property
    def physical(self) -> NDArray[np.float64]:
        """Settings in each factor's unit, shape (n_runs, n_factors)."""
        return self.space.decode(self.coded)

    @property
    def dummy_names(self) -> tuple[str, ...]:
        """Names of the dummy columns, none of which is a factor's name."""
        stem = "dummy"
        while any(name.startswith(stem) for name in self.space.names):
            stem += "_"
        return tuple(f"{stem}{i + 1}" for i in range(self.dummies.shape[1]))

    def take(self, rows: ArrayLike) -> "Design":
        """The design of the given rows only."""
        rows = np.asarray(rows)
        rows = rows if rows.size else rows.astype(int)
        return Design(self.space, self.coded[rows], self.method, self.dummies[rows])

    def embed(self, space: FactorSpace) -> "Design":
        """The same physical settings in a larger `space`; factors it adds stay at the centre of their range.

        Raises
        ------
        ValueError
            If `space` lacks one of the factors, or has it in another unit.
        """
        coded = np.zeros((len(self), len(space)))
        for factor, column in zip(self.space, self.coded.T, strict=True):
            j = space.index(factor.name)
            there = space.factors[j]
            if there.unit != factor.unit:
                raise ValueError(f"factor {factor.name!r} is in {factor.unit!r} here and in {there.unit!r} there")
            if (there.low, there.high) != (factor.low, factor.high):
                column = FactorSpace((there,)).code(FactorSpace((factor,)).decode(column[:, None]))[:, 0]
            coded[:, j] = column
        return Design(space, coded, self.method)


@runtime_checkable
class DesignMethod(Protocol):
    """Frozen settings and one pure method.

    The law: the same settings, space and seed give the same design, bit for bit, and every setting
    lies in [−1, +1].
    """

    method: ClassVar[str]
    title: ClassVar[str]
    summary: ClassVar[str]

    def generate(self, space: FactorSpace, rng: Seed = 0) -> Design:
        """A design on `space`; `rng` is a seed or a generator."""
        ...


def check_count(what: str, value: object, at_least: int, at_most: int = 10_000_000) -> None:
    """Raise ``ValueError`` unless `value` is a whole number of at least `at_least` and at most `at_most`."""
    if isinstance(value, bool) or not isinstance(value, (int, np.integer)) or value < at_least:
        raise ValueError(f"{what} must be a whole number of at least {at_least}, got {value!r}")
    if value > at_most:
        raise ValueError(f"{what} must be at most {at_most}, got a larger number")

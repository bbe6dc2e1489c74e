"""Definitive screening designs: main effects and curvature of m factors in 2m + 1 runs."""

from dataclasses import dataclass
from itertools import islice
from typing import ClassVar

import numpy as np

from ..factors import FactorSpace
from ..settings import parameter
from .base import Design, Seed, check_count
from .finite_fields import conference_matrix

MAX_FACTORS = 200
"""Largest order of the conference matrix, fake factors counted."""


@dataclass(frozen=True)
class DefinitiveScreening:
    """Three-level screening design: a conference matrix, its mirror image and a centre run.

    Main effects are orthogonal to one another, to all squares and to all two-factor interactions.
    Squares are estimable, but correlate by 1/3 − 1/(m − 1) with one another and with interactions.
    Columns of the matrix that no factor uses are fake factors, kept as dummies: they are zero
    wherever the column is, and measure noise free of all effects up to second order.

    Parameters
    ----------
    n_runs : int, optional
        2m + 1 for an even order m ≥ 4 that has a conference matrix: 9, 13, 17, 21, 25, 29, …; by
        default the smallest that holds the factors and `fake_factors`.
    fake_factors : int
        At least so many columns are left without a factor; two or more give an estimate of noise. More
        appear where no conference matrix has the wanted order.
    extra_centre : int
        Centre runs on top of `n_runs`.

    Raises
    ------
    ValueError
        If no conference matrix of that order is known here, or it has too few columns.

    Notes
    -----
    Jones and Nachtsheim (2011), "A class of three-level designs for definitive screening in the
    presence of second-order effects", J. Qual. Technol. 43, 1–15; from conference matrices: Xiao, Lin
    and Bai (2012), J. Qual. Technol. 44, 2–8. Fake factors: Jones and Nachtsheim (2017), "Effective
    design-based model selection for definitive screening designs", Technometrics 59, 319–329.
    """

    method: ClassVar[str] = "definitive_screening"
    title: ClassVar[str] = "definitive screening design"
    summary: ClassVar[str] = "three-level screening: main effects free of interactions, curvature visible"
    levels: ClassVar[int] = 3

    n_runs: int | None = parameter(None, "runs", "9, 13, 17, 21, …; default is the smallest that holds the factors")
    fake_factors: int = parameter(0, "columns", "least number of columns without a factor, which measure noise")
    extra_centre: int = parameter(0, "runs", "centre runs on top; a deterministic simulator learns nothing from them")

    def __post_init__(self) -> None:
        check_count("fake_factors of a definitive screening design", self.fake_factors, 0, MAX_FACTORS)
        check_count("extra_centre of a definitive screening design", self.extra_centre, 0, 1000)
        if self.n_runs is None:
            return
        check_count("n_runs of a definitive screening design", self.n_runs, 9)
        wanted = int(self.n_runs)
        if not _constructible(wanted):
            sizes = sorted(range(9, 2 * MAX_FACTORS + 2, 4), key=lambda n: abs(n - wanted))
            near = sorted(islice(filter(_constructible, sizes), 3))
            raise ValueError(
                f"no definitive screening design with {self.n_runs} runs can be built; nearest sizes: "
                f"{', '.join(map(str, near))}"
            )

    def generate(self, space: FactorSpace, rng: Seed = 0) -> Design:
        """The design on `space`; nothing in it is random, so `rng` is not used."""
        columns = len(space) + self.fake_factors
        n_runs = self.n_runs or _smallest(columns)
        matrix = conference_matrix((n_runs - 1) // 2)
        if matrix is None or columns > len(matrix):
            raise ValueError(
                f"a definitive screening design of {n_runs} runs has {(n_runs - 1) // 2} columns, too few for "
                f"{len(space)} factors and {self.fake_factors} fake ones; use n_runs = {_smallest(columns)}"
            )
        mirrored = np.stack([matrix, -matrix], axis=1).reshape(-1, len(matrix))
        table = np.vstack([mirrored, np.zeros((1 + self.extra_centre, len(matrix)))]).astype(np.float64)
        return Design(space, table[:, : len(space)], self.method, table[:, len(space) :])


def _constructible(n_runs: int) -> bool:
    small = 9 <= n_runs <= 2 * MAX_FACTORS + 1
    return small and n_runs % 4 == 1 and conference_matrix((n_runs - 1) // 2) is not None


def _smallest(columns: int) -> int:
    for order in range(4, MAX_FACTORS + 1, 2):
        if order >= columns and _constructible(2 * order + 1):
            return 2 * order + 1
    raise ValueError(
        f"no definitive screening design for {columns} factors, fake ones counted: at most {MAX_FACTORS} are allowed"
    )

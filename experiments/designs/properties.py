"""Properties of a design: how balanced, orthogonal, efficient and even it is, and what it can tell."""

from dataclasses import dataclass
from functools import cached_property
from itertools import combinations, product

import numpy as np
from numpy.typing import NDArray

from ..terms import Terms, model_matrix
from .base import Design
from .d_optimal import model_terms
from .discrepancy import (
    centred_discrepancy_squared,
    mixture_discrepancy_squared,
    wraparound_discrepancy_squared,
)
from .measures import (
    ROUNDING,
    box_moments,
    complete,
    correlation,
    inflation,
    minimum_distance,
    rank,
    two_level_strength,
)

LARGEST_GRID = 20_000
"""Most points of the three-level grid on which the largest prediction variance is sought; beyond, so many at random."""


@dataclass(frozen=True, eq=False)
class Properties:
    """What can be said of a design, computed when asked for; printing it says it in words.

    Parameters
    ----------
    design : Design
        n_runs runs of n_factors factors.
    terms : Terms
        The model that efficiencies, variance inflation and aliases refer to, n_terms terms.

    Notes
    -----
    Efficiencies: Atkinson, Donev and Tobias (2007), *Optimum Experimental Designs, with SAS*, chapter
    10; alias matrix: Box and Wilson (1951), J. R. Stat. Soc. B 13, 1–45; variance inflation:
    Marquardt (1970), Technometrics 12, 591–612; strength: Rao (1947), J. R. Stat. Soc. Suppl. 9, 128–139.
    """

    design: Design
    terms: Terms

    def __str__(self) -> str:
        from .summary import summary  # its sentences read these properties

        return summary(self)

    @cached_property
    def matrix(self) -> NDArray[np.float64]:
        """Model matrix X, shape (n_runs, n_terms)."""
        return model_matrix(self.terms, self.design.coded)

    @cached_property
    def estimable(self) -> bool:
        """Whether the runs tell all terms of the model apart."""
        return rank(self.matrix) == len(self.terms)

    @cached_property
    def distinct_runs(self) -> int:
        """Number of different runs."""
        return len(np.unique(np.round(self.design.coded, 9), axis=0))

    @cached_property
    def levels(self) -> tuple[int, ...]:
        """Number of different levels of each factor."""
        return tuple(len(np.unique(np.round(column, 9))) for column in self.design.coded.T)

    @cached_property
    def balanced(self) -> tuple[bool, ...]:
        """Whether each factor has all its levels equally often; centre runs of a two-level design aside."""
        table = self.design.coded[~self.centre_runs] if self._two_level_with_centre else self.design.coded
        counts = [np.unique(np.round(column, 9), return_counts=True)[1] for column in table.T]
        return tuple(bool(np.ptp(count) == 0) for count in counts)

    @cached_property
    def centre_runs(self) -> NDArray[np.bool_]:
        """Which runs lie at the centre of all ranges, shape (n_runs,)."""
        return np.all(np.abs(self.design.coded) < ROUNDING, axis=1)

    @property
    def _two_level_with_centre(self) -> bool:
        corners = self.design.coded[~self.centre_runs]
        return len(corners) > 0 and bool(np.allclose(np.abs(corners), 1.0, rtol=0.0, atol=ROUNDING))

    @cached_property
    def correlation(self) -> NDArray[np.float64]:
        """Correlation of the factors' columns, shape (n_factors, n_factors); 0 beside a factor that does not vary."""
        return correlation(self.design.coded)

    @cached_property
    def orthogonal(self) -> bool:
        """Whether no two factors correlate and none is constant."""
        off = self.correlation - np.eye(len(self.design.space))
        return min(self.levels) > 1 and bool(np.abs(off).max() < ROUNDING)

    @cached_property
    def _inverse(self) -> NDArray[np.float64]:
        if not self.estimable:
            raise ValueError(
                f"{len(self.design)} runs of this design do not tell the {len(self.terms)} terms of the model apart; "
                "ask for the properties of a smaller model"
            )
        return np.asarray(np.linalg.inv(self.matrix.T @ self.matrix), dtype=np.float64)

    @property
    def d_efficiency(self) -> float:
        """(det XᵀX)^(1/n_terms) / n_runs; 1 for orthogonal ±1 columns, 0 if terms cannot be told apart."""
        if not self.estimable:
            return 0.0
        return float(np.exp(np.linalg.slogdet(self.matrix.T @ self.matrix)[1] / len(self.terms)) / len(self.design))

    @property
    def a_efficiency(self) -> float:
        """n_terms / (n_runs · trace (XᵀX)⁻¹); 1 for orthogonal ±1 columns, 0 if terms cannot be told apart."""
        return float(len(self.terms) / (len(self.design) * np.trace(self._inverse))) if self.estimable else 0.0

    @property
    def g_efficiency(self) -> float:
        """n_terms / (n_runs · largest prediction variance), at most 1; 0 if terms cannot be told apart.

        The variance is sought on the three-level grid of the box and the runs, or on 20 000 random points
        of that grid if it is larger.
        """
        if not self.estimable:
            return 0.0
        k = len(self.design.space)
        if 3**k <= LARGEST_GRID:
            points = np.array(list(product((-1.0, 0.0, 1.0), repeat=k)))
        else:
            points = np.random.default_rng(0).integers(-1, 2, (LARGEST_GRID, k)).astype(np.float64)
        rows = model_matrix(self.terms, np.vstack([points, self.design.coded]))
        largest = np.einsum("ij,jk,ik->i", rows, self._inverse, rows, optimize=True).max()
        return float(len(self.terms) / (len(self.design) * largest))

    @property
    def average_variance(self) -> float:
        """Prediction variance averaged over the box, in units of the variance of one run; exact."""
        return float(np.sum(self._inverse * box_moments(self.terms)))

    @property
    def i_efficiency(self) -> float:
        """Average prediction variance of orthogonal ±1 columns over that of this design.

        0 if terms cannot be told apart.
        """
        best = float(np.trace(box_moments(self.terms))) / len(self.design)
        return best / self.average_variance if self.estimable else 0.0

    @property
    def vif(self) -> dict[str, float]:
        """Variance inflation of each term but the constant: 1 if it correlates with no other, infinite if aliased."""
        labels = [label for label in self.terms.labels if label != "1"]
        columns = self.matrix[:, [i for i, label in enumerate(self.terms.labels) if label != "1"]]
        return dict(zip(labels, (float(v) for v in inflation(columns - columns.mean(axis=0))), strict=True))

    @cached_property
    def omitted(self) -> Terms:
        """Two-factor interactions that the model leaves out, and squares of factors with more than two levels."""
        second = Terms.polynomial(self.terms.names, 2)
        keep = [
            i
            for i, row in enumerate(second.exponents)
            if sum(row) == 2 and row not in self.terms.exponents and (max(row) == 1 or self._bent(row))
        ]
        return second.select(keep)

    @cached_property
    def alias_matrix(self) -> NDArray[np.float64]:
        """How much of each omitted term each coefficient picks up, (XᵀX)⁻¹XᵀX₂, shape (n_terms, n_omitted)."""
        return self._inverse @ self.matrix.T @ model_matrix(self.omitted, self.design.coded)

    @property
    def discrepancies(self) -> dict[str, float]:
        """Squared centred, mixture and wrap-around L2-discrepancy of the runs, the box taken as the unit cube."""
        points = np.clip(0.5 + 0.5 * self.design.coded, 0.0, 1.0)
        return {
            "centred": centred_discrepancy_squared(points),
            "mixture": mixture_discrepancy_squared(points),
            "wrap-around": wraparound_discrepancy_squared(points),
        }

    @property
    def minimum_distance(self) -> float:
        """Smallest Euclidean distance of two runs in coded units; 0 if a run is repeated, infinite for one run."""
        return minimum_distance(self.design.coded)

    @property
    def strength(self) -> int:
        """Largest t ≤ 4 such that any t factors meet all combinations of their levels equally often.

        Centre runs of a two-level design are left aside; 0 if a factor does not vary.
        """
        if min(self.levels) < 2:
            return 0
        if self._two_level_with_centre:
            return two_level_strength(np.sign(self.design.coded[~self.centre_runs]))
        table, found = self.design.coded, 0
        for t in range(1, min(4, table.shape[1]) + 1):
            if not all(complete(table[:, list(chosen)]) for chosen in combinations(range(table.shape[1]), t)):
                break
            found = t
        return found

    def projections(self, size: int = 2) -> dict[tuple[str, ...], float]:
        """Share of the runs that stay different when only `size` factors are looked at, by their names.

        Raises
        ------
        ValueError
            If `size` is no whole number between 1 and the number of factors.
        """
        k = len(self.design.space)
        if isinstance(size, bool) or size not in range(1, k + 1):
            raise ValueError(f"projections are onto 1 to {k} factors, got {size!r}; choose a size among them")
        rounded, names = np.round(self.design.coded, 9), self.design.space.names
        return {
            tuple(names[i] for i in chosen): len(np.unique(rounded[:, list(chosen)], axis=0)) / len(rounded)
            for chosen in combinations(range(k), size)
        }

    def _bent(self, row: tuple[int, ...]) -> bool:
        return self.levels[row.index(2)] > 2 if 2 in row else False


def properties(design: Design, model: str = "linear") -> Properties:
    """The properties of a design for a model: ``"linear"``, ``"interactions"``, ``"quadratic"`` or listed terms.

    Raises
    ------
    ValueError
        If the design has no runs, or the model cannot be read.
    """
    if not len(design):
        raise ValueError("a design without runs has no properties; give one with at least one run")
    return Properties(design, model_terms(model, design.space))

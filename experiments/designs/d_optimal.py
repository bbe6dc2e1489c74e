"""D-optimal designs: the runs that determine the coefficients of a given model best."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from ..factors import FactorSpace
from ..settings import parameter
from ..terms import Terms, model_matrix
from .base import Design, Seed, check_count
from .exchange import Exchange

MOST_RUNS = 2000

SPARE_RUNS = 4
"""Runs beyond the number of terms, where none is given."""


@dataclass(frozen=True)
class DOptimal:
    """Runs on a grid of levels with the largest determinant of the information matrix of a model.

    Parameters
    ----------
    n_runs : int, optional
        By default four more than the model has terms, or all points of the grid if those are fewer and
        replicates are forbidden. For :meth:`augment`, the runs that are added.
    model : str
        ``"linear"``, ``"interactions"`` (two-factor), ``"quadratic"``, or terms such as ``"1, A, A:B, A^2"``.
    levels : int
        Equally spaced levels of each factor that may be used, ends included.
    replicates : bool
        Whether a run may be repeated. A deterministic simulator learns nothing from repeated runs.
    starts : int
        Random starts of the exchange; the best result is kept.

    Raises
    ------
    ValueError
        If the model cannot be read, the runs are fewer than its terms or more than the different points of the
        grid where replicates are forbidden, or the levels are too few for the model.

    Notes
    -----
    Fedorov (1972), *Theory of Optimal Experiments*; the algorithm is :class:`~experiments.designs.exchange.Exchange`.
    An exchange finds a good design, not a proven best one.
    """

    method: ClassVar[str] = "d_optimal"
    title: ClassVar[str] = "D-optimal design"
    summary: ClassVar[str] = "runs that determine the coefficients of a stated model best"

    n_runs: int | None = parameter(None, "runs", "at least the number of terms; default is four more")
    model: str = parameter("quadratic", "text", "linear, interactions, quadratic, or terms: '1, A, A:B, A^2'")
    levels: int = parameter(3, "levels", "equally spaced levels that may be used")
    replicates: bool = parameter(True, "true/false", "whether a run may be repeated")
    starts: int = parameter(10, "starts", "random starts, of which the best is kept")

    def __post_init__(self) -> None:
        if self.n_runs is not None:
            check_count("n_runs of a D-optimal design", self.n_runs, 1, MOST_RUNS)
        check_count("levels of a D-optimal design", self.levels, 2, 101)
        check_count("starts of a D-optimal design", self.starts, 1, 10_000)
        if not isinstance(self.replicates, (bool, np.bool_)):
            raise ValueError(f"replicates of a D-optimal design must be true or false, got {self.replicates!r}")
        if not isinstance(self.model, str) or not self.model.strip():
            raise ValueError(
                f"model of a D-optimal design must be 'linear', 'interactions', 'quadratic' or terms such as "
                f"'1, A, A:B', got {self.model!r}"
            )

    def generate(self, space: FactorSpace, rng: Seed = 0) -> Design:
        """The design on `space`; `rng` seeds the starts."""
        return Design(space, self._search(space, np.empty((0, len(space))), rng), self.method)

    def augment(self, design: Design, rng: Seed = 0) -> Design:
        """The runs of `design`, first and unchanged, and `n_runs` more that serve the model best together with them.

        Dummy columns do not survive: the new runs have none.
        """
        added = self._search(design.space, design.coded, rng)
        return Design(design.space, np.vstack([design.coded, added]), self.method)

    def terms(self, space: FactorSpace) -> Terms:
        """The model's terms on `space`."""
        return model_terms(self.model, space)

    def _search(self, space: FactorSpace, fixed: NDArray[np.float64], rng: Seed) -> NDArray[np.float64]:
        terms = self.terms(space)
        exchange = Exchange(
            len(space), self.levels, lambda coded: model_matrix(terms, coded), fixed, bool(self.replicates)
        )
        spare = max(len(terms) - len(fixed), 0) + SPARE_RUNS
        n_runs = self.n_runs or (spare if self.replicates else min(spare, exchange.room))
        if n_runs + len(fixed) < len(terms):
            raise ValueError(
                f"a D-optimal design of {n_runs + len(fixed)} runs cannot determine {len(terms)} terms; use n_runs = "
                f"{len(terms) - len(fixed)} or more, or a smaller model"
            )
        generator = np.random.default_rng(rng)
        if not self.replicates and n_runs > exchange.room:
            raise ValueError(
                f"{n_runs} different runs were asked for, but {self.levels} levels of {len(space)} factors leave "
                f"{exchange.room} points; use fewer runs, more levels or replicates = true"
            )
        found = [exchange.improve(exchange.start(n_runs, generator)) for _ in range(self.starts)]
        values = [exchange.log_determinant(points) for points in found]
        best = int(np.argmax(values))
        if values[best] == -np.inf:
            raise ValueError(
                f"no {n_runs} runs on {self.levels} levels tell the {len(terms)} terms of the model apart; use more "
                "levels, more runs or fewer terms"
            )
        return exchange.coded(found[best])


def model_terms(model: str, space: FactorSpace) -> Terms:
    """Terms of a model named ``"linear"``, ``"interactions"`` or ``"quadratic"``, or listed: ``"1, A, A:B, A^2"``.

    Raises
    ------
    ValueError
        If a listed term cannot be read or names an unknown factor.
    """
    model = model.strip()
    if model in ("linear", "interactions", "quadratic"):
        terms = Terms.polynomial(space.names, 1 if model == "linear" else 2)
        rows = [row for row in terms.exponents if model != "interactions" or max(row) <= 1]
        return Terms(space.names, tuple(rows))
    return Terms.parse([label.strip() for label in model.split(",")], space.names)

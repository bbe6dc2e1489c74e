"""Runs, models, errors and certificates of one mechanism at any range."""

from dataclasses import dataclass
from functools import cache
from itertools import product

import numpy as np
from numpy.typing import NDArray

from experiments.designs import Uniform
from experiments.runs import Status
from surrogates import PolynomialRegressor, Surrogate
from surrogates.certificate import Certificate, certify
from surrogates.validation import compare

from .cases import Case, Floats

N_FRESH = 1000
LEVELS = 6
EXCHANGES = 20_000_000


@dataclass(frozen=True)
class Way:
    """How a model is fitted: from so many runs, their gradients too if `taught`."""

    degree: int
    n_runs: int
    taught: bool

    @property
    def label(self) -> str:
        """All but the degree."""
        return f"{self.n_runs} runs{' with gradients' if self.taught else ''}"


@dataclass(frozen=True, eq=False)
class Answered:
    """Points that vary (n, n_varied), values (n, n_outputs), NaN where failed, slopes (n, n_outputs, n_varied)."""

    points: Floats
    values: Floats
    slopes: Floats

    @property
    def ok(self) -> NDArray[np.bool_]:
        """Which have an answer, shape (n,)."""
        return np.asarray(np.isfinite(self.values).all(axis=1))


@dataclass(frozen=True, eq=False)
class Campaign:
    """All runs at one range: by size of design, and fresh ones (without slopes); the largest stress among them, Pa."""

    designs: dict[int, Answered]
    fresh: Answered
    stress: float

    @property
    def n_failed(self) -> int:
        """Runs without an answer."""
        return sum(int((~runs.ok).sum()) for runs in (*self.designs.values(), self.fresh))


class Pushing:
    """What is computed of a case, each thing once."""

    def __init__(self, case: Case) -> None:
        self.case = case
        space = case.space(case.ranges[0])
        self.designs = {n: Uniform(n, LEVELS, EXCHANGES).generate(space, 0).coded for n in case.sizes}
        self.fresh = np.random.default_rng(1).uniform(-1.0, 1.0, (N_FRESH, len(space)))
        self.corners = np.array(list(product((-1.0, 1.0), repeat=len(space))))
        self.responses = case.oracle.responses[: case.n_outputs]
        self.campaign, self.model, self.certificate = (
            cache(self._campaign),
            cache(self._model),
            cache(self._certificate),
        )
        self.corner_stress = cache(self._corner_stress)

    @property
    def ways(self) -> list[tuple[int, bool]]:
        """Runs, and whether gradients are taught; the one with most knowledge last."""
        return [(n, taught) for taught in (False, True) for n in self.case.sizes]

    def best(self, degree: int) -> Way:
        """With most knowledge."""
        return Way(degree, *self.ways[-1])

    def error(self, reach: float, way: Way) -> float:
        """Largest error on fresh runs over the range of its response, of the worst response."""
        model, fresh = self.model(reach, way), self.campaign(reach).fresh
        predicted = model.predict(fresh.points[fresh.ok])
        return max(e.max_relative for e in compare(model.responses, fresh.values[fresh.ok], predicted))

    def _campaign(self, reach: float) -> Campaign:
        """One batch of all points, so that no batch size but this one is compiled."""
        case, n_varied = self.case, self.fresh.shape[1]
        coded = [*self.designs.values(), self.fresh]
        points = case.points(reach, np.vstack(coded))
        found = case.oracle.evaluate(points)
        failed = np.array([status is not Status.OK for status in found.status])
        values = np.where(failed[:, None], np.nan, found.values)[:, : case.n_outputs]
        slopes = np.full((len(points), case.n_outputs, n_varied), np.nan)
        taught = len(points) - N_FRESH
        slopes[:taught] = case.oracle.jacobian(points[:taught])[:, : case.n_outputs, :n_varied]
        ends = np.cumsum([len(c) for c in coded])[:-1]
        parts = (np.split(part, ends) for part in (points[:, :n_varied], values, slopes))
        *designs, fresh = (Answered(*part) for part in zip(*parts, strict=True))
        stress = float(np.nanmax(case.stress(points)))
        return Campaign(dict(zip(self.designs, designs, strict=True)), fresh, stress)

    def _model(self, reach: float, way: Way) -> Surrogate:
        runs = self.campaign(reach).designs[way.n_runs]
        space = self.case.space(reach)
        fit = PolynomialRegressor(way.degree, selection="evidence", space=space, responses=self.responses)
        slopes = runs.slopes[runs.ok] if way.taught else None
        return fit.fit(runs.points[runs.ok], runs.values[runs.ok], slopes).surrogate_

    def _certificate(self, reach: float, way: Way) -> Certificate:
        return certify(self.model(reach, way))

    def _corner_stress(self, reach: float) -> float:
        """Largest bending stress over the corners, Pa; infinite where one has no equilibrium."""
        stress = self.case.stress(self.case.points(reach, self.corners))
        return float(np.where(np.isnan(stress), np.inf, stress).max())

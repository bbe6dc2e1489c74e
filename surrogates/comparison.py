"""Two models of one mechanism side by side, and both against runs of the oracle that the first was fitted to.

A model says what its oracle says, to within its own error. So where two differ by much more than their errors, it is
the oracles that differ: beams from shells, a coarse mesh from a fine one, last year's solver from this year's.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from experiments.factors import FactorSpace
from experiments.runs import Response, Runs

from .model import Surrogate
from .validation import ratio, yardstick

SMALL = 0.01
"""An entry of a linear map below this share of its row's largest, over their factors' ranges, is taken for none."""


@dataclass(frozen=True)
class Difference:
    """How far two columns of numbers are apart.

    Parameters
    ----------
    largest, rms : float
        Largest absolute and root mean square difference, SI.
    relative, relative_rms : float
        Both over the response's range in the runs, as the errors of a validation are.
    at : tuple of float
        Settings of the largest, one per factor in its unit.
    """

    largest: float
    rms: float
    relative: float
    relative_rms: float
    at: tuple[float, ...]


@dataclass(frozen=True, eq=False)
class Comparison:
    """Our model beside theirs, in the box where both hold.

    Parameters
    ----------
    box : FactorSpace
        Our factors with the ranges that both models cover.
    is_whole : bool
        Whether that is the whole box of our model.
    responses : tuple of Response
        Ours, n_responses.
    n_runs, n_outside : int
        Runs with an answer that lie in the box, and beyond it.
    ranges : ndarray, shape (n_responses,)
        Largest minus smallest response in those runs, SI; NaN if there are none.
    apart, ours, theirs : tuple of Difference
        For each response, over those runs: the models from each other, ours from the runs, theirs from the runs.
        Empty if there are none.
    our_map, their_map : ndarray, shape (n_responses, n_factors)
        d response / d factor at the centre of the box, SI.
    """

    box: FactorSpace
    is_whole: bool
    responses: tuple[Response, ...]
    n_runs: int
    n_outside: int
    ranges: NDArray[np.float64]
    apart: tuple[Difference, ...]
    ours: tuple[Difference, ...]
    theirs: tuple[Difference, ...]
    our_map: NDArray[np.float64]
    their_map: NDArray[np.float64]

    @property
    def acts(self) -> NDArray[np.bool_]:
        """Entries of our map that are more than :data:`SMALL` of their row's largest, shape of the map.

        Compared over the box: an entry times the half range of its factor. The largest is that of both maps.
        """
        size = np.abs(self.our_map) * self.box.half_range
        return size > SMALL * self._row_size[:, None]

    @property
    def map_difference(self) -> NDArray[np.float64]:
        """Theirs minus ours over ours where it :attr:`acts`, else over the row's largest; shape of the map."""
        apart, half = self.their_map - self.our_map, self.box.half_range
        row = np.where(self._row_size > 0.0, self._row_size, 1.0)[:, None]
        ours = np.where(self.acts, self.our_map, 1.0)
        return np.where(self.acts, apart / ours, apart * half / row)

    @property
    def _row_size(self) -> NDArray[np.float64]:
        both = np.maximum(np.abs(self.our_map), np.abs(self.their_map))
        return (both * self.box.half_range).max(axis=1)


def compare_models(ours: Surrogate, theirs: Surrogate, runs: Runs, resolution: float = 0.0) -> Comparison:
    """Two models beside each other and beside runs of the oracle of the first.

    Parameters
    ----------
    ours, theirs : Surrogate
        Of the same factors and responses, by name and unit, in any order; their ranges may differ.
    runs : Runs
        Fresh runs of the oracle of `ours`, over its box. Those without an answer are left out.
    resolution : float
        Relative; of that oracle. See :func:`.validation.compare`.

    Raises
    ------
    ValueError
        As :func:`aligned` and :func:`common_box`.
    """
    theirs = aligned(theirs, ours.factors, ours.responses)
    box = common_box(ours.factors, theirs.factors)
    done = runs.completed()
    inside = box.contains(done.design.physical) if len(done) else np.zeros(0, dtype=bool)
    points, truth = done.design.physical[inside], done.values[inside]
    here, there = ours.predict(points), theirs.predict(points)
    centre = box.centre[None]
    known = bool(len(points))
    pairs = ((there, here), (here, truth), (there, truth))
    apart = [_differences(a - b, truth, points, resolution) if known else () for a, b in pairs]
    return Comparison(
        box,
        [(f.low, f.high) for f in box] == [(f.low, f.high) for f in ours.factors],
        ours.responses,
        len(points),
        int((~inside).sum()),
        np.ptp(truth, axis=0) if known else np.full(len(ours.responses), np.nan),
        apart[0],
        apart[1],
        apart[2],
        ours.jacobian(centre)[0],
        theirs.jacobian(centre)[0],
    )


def aligned(model: Surrogate, factors: FactorSpace, responses: tuple[Response, ...]) -> Surrogate:
    """The model with its factors and responses in the order of those given, without errors or certificate.

    Raises
    ------
    ValueError
        If it has others, by name or unit; the sentence says which.
    """
    for what, its, wanted in (
        ("factors", {f.name: f.unit for f in model.factors}, {f.name: f.unit for f in factors}),
        ("responses", {r.name: r.unit for r in model.responses}, {r.name: r.unit for r in responses}),
    ):
        if its != wanted:
            raise ValueError(
                f"it has the {what} {_listed(its)}, the study has {_listed(wanted)}: they must be the same"
            )
    columns = [model.factors.index(f.name) for f in factors]
    names = [r.name for r in model.responses]
    rows = [names.index(r.name) for r in responses]
    exponents = [tuple(row[j] for j in columns) for row in model.terms.exponents]
    return replace(
        model,
        factors=FactorSpace(tuple(model.factors.factors[j] for j in columns)),
        responses=tuple(model.responses[j] for j in rows),
        terms=replace(model.terms, names=factors.names, exponents=tuple(exponents)),
        coefficients=model.coefficients[:, rows],
        links=tuple(model.links[j] for j in rows),
        validation=(),
        certificate=None,
        standard_errors=None,
    )


def common_box(ours: FactorSpace, theirs: FactorSpace) -> FactorSpace:
    """`ours` with the ranges that `theirs`, of the same names in the same order, covers as well.

    Raises
    ------
    ValueError
        If the ranges of a factor have nothing in common.
    """
    ranges = {}
    for a, b in zip(ours, theirs, strict=True):
        low, high = max(a.low, b.low), min(a.high, b.high)
        if not low < high:
            raise ValueError(
                f"its range of {a.name} is {b.low:g} to {b.high:g} {b.unit}, that of the study {a.low:g} to "
                f"{a.high:g}: they have nothing in common"
            )
        if (low, high) != (a.low, a.high):
            ranges[a.name] = (low, high)
    return ours.with_ranges(ranges)


def _listed(units: dict[str, str]) -> str:
    return ", ".join(f"{name} [{unit}]" for name, unit in units.items())


def _differences(
    apart: NDArray[np.float64], truth: NDArray[np.float64], points: NDArray[np.float64], resolution: float
) -> tuple[Difference, ...]:
    """Of each column, shape (n_runs, n_responses)."""
    found = []
    for column, true in zip(apart.T, truth.T, strict=True):
        measure, worst = yardstick(true, resolution), int(np.argmax(np.abs(column)))
        largest, rms = float(abs(column[worst])), float(np.sqrt(np.mean(column**2)))
        at = tuple(points[worst].tolist())
        found.append(Difference(largest, rms, ratio(largest, measure), ratio(rms, measure), at))
    return tuple(found)

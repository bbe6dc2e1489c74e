"""What a sweep compares: one row per member, and the rows as one table."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from experiments.factors import FactorSpace
from experiments.naming import column_label
from experiments.runs import Response
from surrogates import ResponseError, Surrogate, Verdict
from surrogates.certificate import Certificate
from surrogates.stiffness import held_stiffness

from .grid import Member, shown
from .runner import Outcome

OUTCOMES = {0: "ok", 1: "bug", 2: "refused", 3: "too many failures", 4: "falls short"}
"""What became of a member, by the exit code that ``flexdoce run`` would have given it."""


@dataclass(frozen=True, eq=False)
class Found:
    """What a finished member found.

    Parameters
    ----------
    kept : tuple of str
        Factors that the model was fitted on.
    factors : FactorSpace
    responses : tuple of Response
    errors : tuple of ResponseError
        On fresh runs, one per response.
    certificate : Certificate or None
        Of the model; of the square model to be commanded, if the config asks for one.
    box : mapping of str to (float, float)
        Low and high of each response in the certified box of targets, SI; empty where there is none.
    slopes : ndarray, shape (n_responses, n_factors)
        d response / d factor at the centre of the ranges, SI per factor unit.
    """

    kept: tuple[str, ...]
    factors: FactorSpace
    responses: tuple[Response, ...]
    errors: tuple[ResponseError, ...]
    certificate: Certificate | None
    box: Mapping[str, tuple[float, float]]
    slopes: NDArray[np.float64]

    @classmethod
    def of(cls, outcome: Outcome) -> "Found":
        """From a finished study."""
        model = outcome.model
        judged: Surrogate = outcome.commanded or model
        certificate = judged.certificate
        names = {r.name for r in model.responses}
        boxes = certificate.response_box if certificate else None
        # A model to be commanded has given factors among its responses: they are no targets.
        box = {r.name: b for r, b in zip(judged.responses, boxes or (), strict=bool(boxes)) if r.name in names}
        slopes = model.jacobian(model.factors.centre[None])[0]
        return cls(outcome.kept, model.factors, model.responses, tuple(model.validation), certificate, box, slopes)

    @property
    def worst(self) -> float:
        """Largest error over its response's range, of all responses."""
        return max(e.max_relative for e in self.errors)

    def error(self, response: str) -> float:
        """Largest error of a response over its range; NaN where it is none of the model's."""
        return next((e.max_relative for e in self.errors if e.response == response), float("nan"))

    def slope(self, response: str, factor: str) -> float | None:
        """One of the slopes by name; None where the model has no such response or factor."""
        names = [r.name for r in self.responses]
        if response not in names or factor not in self.factors.names:
            return None
        return float(self.slopes[names.index(response), self.factors.index(factor)])

    @property
    def verdict(self) -> str:
        """Of the certificate."""
        return str(self.certificate.verdict) if self.certificate else "none"

    @property
    def side(self) -> float:
        """Side of the box of factors on which the inverse is certified, over the ranges: 1 is all, 0 is nowhere."""
        if self.certificate is None:
            return 0.0
        return 1.0 if self.certificate.verdict is Verdict.CERTIFIED else self.certificate.sub_box or 0.0

    @property
    def shares(self) -> dict[str, float]:
        """Sides of the certified box of targets over the responses' ranges on the fresh runs."""
        ranges = {e.response: e.range for e in self.errors}
        return {name: (high - low) / ranges[name] for name, (low, high) in self.box.items() if ranges[name] > 0.0}

    @property
    def stiffness(self) -> NDArray[np.float64] | None:
        """Diagonal of the inverse of `slopes`, d factor i / d response i while the other responses stay.

        Shape (n_factors,); None where there is no inverse.
        """
        return held_stiffness(self.slopes, self.factors.half_range)


@dataclass(frozen=True, eq=False)
class Row:
    """One member of a sweep.

    Parameters
    ----------
    member : Member
    code : int
        The exit code that ``flexdoce run`` would have ended with.
    reason : str
        Why, if it is not 0.
    runs : int
        Points that its folder holds.
    new : int
        Those that no member above it has: what it added to the bill.
    asked : int
        Runs of the oracle on its behalf this time.
    found : Found or None
        None if it came to no model.
    """

    member: Member
    code: int
    reason: str
    runs: int
    new: int
    asked: int
    found: Found | None

    @property
    def outcome(self) -> str:
        """What became of it, in words."""
        return OUTCOMES[self.code]


def frame(rows: Sequence[Row], units: Mapping[str, str]) -> pd.DataFrame:
    """One row per member; units in the headers, SI, as in ``errors.csv``. A cell is empty where nothing is known.

    Parameters
    ----------
    rows : sequence of Row
    units : mapping of str to str
        Of swept keys, where they are known.
    """
    return pd.DataFrame([_told(row, units) for row in rows])


def _told(row: Row, units: Mapping[str, str]) -> dict[str, Any]:
    swept = {column_label(k, units[k]) if k in units else k: _cell(v) for k, v in row.member.settings}
    told = {"member": row.member.name, **swept, "outcome": row.outcome, "exit_code": row.code, "reason": row.reason}
    told |= {"runs": row.runs, "new_runs": row.new}
    return told | (_results(row.found) if row.found else {})


def _cell(value: Any) -> Any:
    return value if isinstance(value, bool | int | float | str) else shown(value)


def _results(found: Found) -> dict[str, Any]:
    told: dict[str, Any] = {"kept": " ".join(found.kept)}
    for error in found.errors:
        told[f"{error.response}_max_relative_to_range"] = error.max_relative
        told[f"{error.response}_rmse_relative_to_range"] = error.relative_rmse
    told |= {"verdict": found.verdict, "certified_side": found.side}
    for response in found.responses:
        low, high = found.box.get(response.name, (None, None))
        told[column_label(f"{response.name}_box_low", response.unit)] = low
        told[column_label(f"{response.name}_box_high", response.unit)] = high
        told[f"{response.name}_box_relative_to_range"] = found.shares.get(response.name)
    for response, slopes in zip(found.responses, found.slopes, strict=True):
        for factor, slope in zip(found.factors, slopes, strict=True):
            told[column_label(f"d_{response.name}_d_{factor.name}", quotient_unit(response.unit, factor.unit))] = slope
    if (stiffness := found.stiffness) is not None:
        for response, factor, slope in zip(found.responses, found.factors, stiffness, strict=True):
            told[column_label(f"d_{factor.name}_d_{response.name}", quotient_unit(factor.unit, response.unit))] = slope
    return told


def quotient_unit(above: str, below: str) -> str:
    """Unit of a quotient: ``m/N``, ``1/N``, ``m/(N*m)``."""
    if below == "1":
        return above
    return f"{above}/({below})" if any(sign in below for sign in "*/· ") else f"{above}/{below}"

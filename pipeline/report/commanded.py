"""What may be commanded: the boxes of the certificate, for people."""

from decimal import ROUND_CEILING, ROUND_FLOOR, Decimal
from typing import Any

import numpy as np

from ..runner import Outcome
from .views import number, percent

DIGITS = 4


def boxes(outcome: Outcome) -> dict[str, Any] | None:
    """The box of factors on which the inverse is certified and the box of targets in it; None where there is no box."""
    found = outcome.model.certificate
    if found is None or found.factor_box is None:
        return None
    space = outcome.study.space
    return {
        "whole": found.sub_box is None,
        "reason": found.box_reason,
        "factors": [
            {"name": f.name, "unit": f.unit, "low": number(low, 6), "high": number(high, 6)}
            for f, (low, high) in zip(space, found.factor_box, strict=True)
        ],
        "responses": _responses(outcome, found.response_box) if found.response_box else [],
        "inside": _inside(outcome, found.response_box) if found.response_box else None,
    }


def _responses(outcome: Outcome, box: tuple[tuple[float, float], ...]) -> list[dict[str, str]]:
    rows = []
    for response, error, (low, high) in zip(outcome.model.responses, outcome.model.validation, box, strict=True):
        rows.append(
            {
                "symbol": response.symbol,
                "unit": response.shown_unit,
                "low": number(inwards(low * response.shown_scale, ROUND_CEILING), DIGITS),
                "high": number(inwards(high * response.shown_scale, ROUND_FLOOR), DIGITS),
                "share": percent((high - low) / error.range) if error.range > 0.0 else "–",
            }
        )
    return rows


def inwards(value: float, rounding: str) -> float:
    """An end of a box rounded to four digits, towards its inside, so that the box shown lies in the one proven."""
    exact = Decimal(value)
    return float(exact.quantize(Decimal(1).scaleb(exact.adjusted() - DIGITS + 1), rounding))


def _inside(outcome: Outcome, box: tuple[tuple[float, float], ...]) -> dict[str, int]:
    """How many of the oracle's answers to the validation runs lie in the box."""
    values = outcome.validation_runs.completed().values
    low, high = np.array(box).T
    return {"n": int(((values >= low) & (values <= high)).all(axis=1).sum()), "of": len(values)}

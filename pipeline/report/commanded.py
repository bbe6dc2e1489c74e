"""What may be commanded: the boxes of the certificate, for people."""

from decimal import ROUND_CEILING, ROUND_FLOOR, Decimal
from typing import Any

import numpy as np

from surrogates import Surrogate
from surrogates.certificate import Box

from ..runner import Outcome
from .views import number, percent

DIGITS = 4


def boxes(outcome: Outcome, model: Surrogate | None) -> dict[str, Any] | None:
    """The box of factors on which the inverse is certified and the box of targets in it; None where there is no box.

    Parameters
    ----------
    outcome : Outcome
    model : Surrogate or None
        The outcome's model, or the square one that is commanded.
    """
    found = model.certificate if model else None
    if model is None or found is None or found.factor_box is None:
        return None
    space = outcome.study.space
    return {
        "given": [f.name for f in space if f.name in {r.name for r in model.responses}],
        "whole": found.sub_box is None,
        "reason": found.box_reason,
        "factors": [
            {"name": f.name, "unit": f.unit, "low": number(low, 6), "high": number(high, 6)}
            for f, (low, high) in zip(space, found.factor_box, strict=True)
        ],
        "responses": _responses(outcome, model, found.response_box) if found.response_box else [],
        "inside": _inside(outcome, model, found.response_box) if found.response_box else None,
    }


def _responses(outcome: Outcome, model: Surrogate, box: Box) -> list[dict[str, str]]:
    ranges = {f.name: f.high - f.low for f in outcome.study.space}
    ranges |= {e.response: e.range for e in outcome.model.validation}
    rows = []
    for response, (low, high) in zip(model.responses, box, strict=True):
        spread = ranges[response.name]
        rows.append(
            {
                "symbol": response.symbol,
                "unit": response.shown_unit,
                "low": number(inwards(low * response.shown_scale, ROUND_CEILING), DIGITS),
                "high": number(inwards(high * response.shown_scale, ROUND_FLOOR), DIGITS),
                "share": percent((high - low) / spread) if spread > 0.0 else "–",
            }
        )
    return rows


def inwards(value: float, rounding: str) -> float:
    """An end of a box rounded to four digits, towards its inside, so that the box shown lies in the one proven."""
    exact = Decimal(value)
    return float(exact.quantize(Decimal(1).scaleb(exact.adjusted() - DIGITS + 1), rounding))


def _inside(outcome: Outcome, model: Surrogate, box: Box) -> dict[str, int]:
    """How many of the oracle's answers to the validation runs, with what was given there, lie in the box."""
    done = outcome.validation_runs.completed()
    columns = {r.name: done.values[:, j] for j, r in enumerate(done.responses)}
    columns |= {f.name: done.design.physical[:, j] for j, f in enumerate(outcome.study.space)}
    values = np.column_stack([columns[r.name] for r in model.responses])
    low, high = np.array(box).T
    return {"n": int(((values >= low) & (values <= high)).all(axis=1).sum()), "of": len(values)}

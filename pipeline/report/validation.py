"""What the report shows of the validation: errors, where they are largest, and prediction intervals."""

from collections.abc import Sequence
from typing import Any

from experiments.factors import FactorSpace
from surrogates import ResponseError
from surrogates.domain import near_ends
from surrogates.intervals import LEVELS, fewest_runs

from ..runner import Outcome
from .views import number, percent


def error_rows(outcome: Outcome, errors: Sequence[ResponseError]) -> list[dict[str, str]]:
    """One row per response, in shown units."""
    shown = {r.name: r for r in outcome.model.responses}
    return [
        {
            "symbol": shown[e.response].symbol,
            "unit": shown[e.response].shown_unit,
            "max_abs": number(e.max_abs * shown[e.response].shown_scale, 3),
            "range": number(e.range * shown[e.response].shown_scale, 4),
            "relative": percent(e.max_relative),
            "rmse": number(e.rmse * shown[e.response].shown_scale, 3),
            "relative_rmse": "–" if e.relative_rmse is None else percent(e.relative_rmse),
            "q2": _q2(e.q2),
            "worst": _worst(outcome.model.factors, e.worst_point),
        }
        for e in errors
    ]


def intervals(outcome: Outcome) -> dict[str, Any] | None:
    """Half-widths in shown units with their measured coverage, by response and level; None if there are none."""
    errors = outcome.model.validation
    offered = [{i.level: i for i in e.intervals} for e in errors]
    levels = sorted({level for found in offered for level in found})
    if not levels:
        return None
    rows = []
    for response, found in zip(outcome.model.responses, offered, strict=True):
        known = [found.get(level) for level in levels]
        cells = [
            (number(i.half_width * response.shown_scale, 3), percent(i.coverage)) if i else ("–", "–") for i in known
        ]
        rows.append({"symbol": response.symbol, "unit": response.shown_unit, "cells": cells})
    one = next(i for found in offered for i in found.values())
    return {
        "levels": [f"{100.0 * level:g}" for level in levels],
        "rows": rows,
        "n_calibration": one.n_calibration,
        "n_check": one.n_check,
        "missing": {f"{100.0 * v:g}": fewest_runs(v) for v in LEVELS if v not in levels},
    }


def _q2(value: float | None) -> str:
    """Q² with the digits that matter: those behind the nines."""
    if value is None:
        return "–"
    return f"1 − {number(1.0 - value, 2)}" if 0.999 <= value < 1.0 else number(value, 3)


def _worst(space: FactorSpace, point: tuple[float, ...]) -> str:
    """Near which ends of the ranges a point lies."""
    if not point:
        return "–"
    near = near_ends(space, point)
    if not near:
        return "in the interior"
    corner = " (a corner)" if len(near) == len(space) > 1 else ""
    return f"near {', '.join(f'{end} {name}' for name, end in near.items())}{corner}"

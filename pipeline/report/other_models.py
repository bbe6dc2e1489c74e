"""What the report shows of a model of another study beside this one's."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from experiments.factors import FactorSpace
from surrogates import Surrogate
from surrogates.comparison import SMALL, Comparison, Difference

from ..runner import Outcome
from .views import number, percent


def comparisons(outcome: Outcome) -> list[dict[str, Any]]:
    """One entry for each model that the config names."""
    compared = outcome.study.compared
    return [_one(name, compared[name], found) for name, found in outcome.comparisons.items()]


def _one(name: str, theirs: Surrogate, found: Comparison) -> dict[str, Any]:
    ratios = np.abs(found.map_difference[found.acts])
    # A response that does not move in the runs has no range to speak of, so the largest share is of those that have.
    farthest = max(found.apart, key=lambda d: d.relative, default=None)
    symbols = [r.symbol for r in found.responses]
    return {
        "name": name,
        "origin": _origin(theirs.provenance),
        "parameters": _parameters(theirs.provenance),
        "own_error": _own_error(theirs),
        "box": [] if found.is_whole else _box(found.box),
        "n_runs": found.n_runs,
        "n_outside": found.n_outside,
        "rows": _rows(found),
        "most": percent(farthest.relative) if farthest else None,
        "most_in": symbols[found.apart.index(farthest)] if farthest else None,
        "map": _map(found),
        "factors": [{"name": f.name, "unit": f.unit} for f in found.box],
        "small": f"{100.0 * SMALL:g}",
        "map_largest": percent(float(ratios.max())) if ratios.size else None,
        "map_median": percent(float(np.median(ratios))) if ratios.size else None,
    }


def _origin(provenance: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Where a model says that it comes from."""
    told = (("study", "study"), ("oracle", "oracle"), ("source", "oracle_source"))
    return [(what, str(provenance[key]).rstrip(".")) for what, key in told if provenance.get(key)]


def _parameters(provenance: Mapping[str, Any]) -> dict[str, str]:
    """What its oracle held fixed, as far as the model says so."""
    given = provenance.get("oracle_parameters")
    return {str(k): str(v) for k, v in given.items()} if isinstance(given, Mapping) else {}


def _own_error(model: Surrogate) -> str | None:
    """Largest error on its own fresh runs."""
    errors = [e.max_relative for e in model.validation]
    return percent(max(errors)) if errors else None


def _box(space: FactorSpace) -> list[str]:
    return [f"{f.name} {number(f.low, 6)} to {number(f.high, 6)} {f.unit}" for f in space]


def _rows(found: Comparison) -> list[dict[str, Any]]:
    rows = []
    for response, *parts in zip(found.responses, found.apart, found.ours, found.theirs, strict=False):
        cells = [cell for part in parts for cell in _cells(part, response.shown_scale)]
        rows.append({"symbol": response.symbol, "unit": response.shown_unit, "cells": cells})
    return rows


def _cells(part: Difference, scale: float) -> list[str]:
    largest, rms = number(part.largest * scale, 3), number(part.rms * scale, 3)
    return [largest, percent(part.relative), rms, percent(part.relative_rms)]


def _map(found: Comparison) -> list[dict[str, Any]]:
    """Both linear maps in shown units, entry by entry, with the median difference of each row."""
    rows = []
    for j, response in enumerate(found.responses):
        acts, apart, scale = found.acts[j], found.map_difference[j], response.shown_scale
        cells = [
            {
                "ours": number(found.our_map[j, k] * scale, 5),
                "theirs": number(found.their_map[j, k] * scale, 5),
                "apart": f"{_signed(100.0 * apart[k])} %" + ("" if acts[k] else " of row"),
                "acts": bool(acts[k]),
                "none": not (found.our_map[j, k] or found.their_map[j, k]),
            }
            for k in range(len(found.box))
        ]
        median = f"{_signed(100.0 * float(np.median(apart[acts])))} %" if acts.any() else "–"
        rows.append({"symbol": response.symbol, "unit": response.shown_unit, "cells": cells, "median": median})
    return rows


def _signed(value: float) -> str:
    text = number(value, 2)
    return text if value <= 0.0 else f"+{text}"

"""The nouns as CSV: headers carry name and unit, numbers round-trip."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from experiments.designs import Design
from experiments.factors import FactorSpace
from experiments.naming import column_label
from experiments.runs import Response, Runs
from experiments.screening import Screening
from surrogates import Inversion, InversionStatus, ResponseError, Surrogate
from surrogates.comparison import Comparison
from surrogates.exports.verification import Finding
from surrogates.preimages import Preimages

from .reading import CODED

CONTINUUM = "inf"
"""Number of preimages that form a curve or a surface; readers of numbers take it for infinity."""


def design_csv(design: Design) -> str:
    """A design in coded units, the dummy columns last."""
    names = [*design.space.names, *design.dummy_names]
    table = np.hstack([design.coded, design.dummies])
    return _csv(pd.DataFrame(table, columns=pd.Index([column_label(n, CODED) for n in names])))


def runs_csv(runs: Runs) -> str:
    """Runs in physical units, with a status and a reason each."""
    columns = [*runs.design.space.labels, *(r.label for r in runs.responses)]
    table = pd.DataFrame(np.hstack([runs.design.physical, runs.values]), columns=pd.Index(columns))
    table["status"], table["reason"] = [str(s) for s in runs.status], list(runs.reasons)
    return _csv(table)


def effects_csv(screening: Screening) -> str:
    """One row per response and contrast; with failed runs, also the inflation that the margins must be widened by.

    ``margin`` is that of the effect itself: ``me`` times the root of its ``inflation``.
    """
    effects, rows = screening.effects, []
    inflation = np.ones(len(effects.names))
    if screening.holes:
        inflation[: effects.n_factors] = screening.holes.inflation
    for j, (response, result) in enumerate(zip(effects.responses, screening.lenth, strict=True)):
        for i, name in enumerate(effects.names):
            rows.append(
                {
                    "response": response.name,
                    "unit": response.unit,
                    "contrast": name,
                    "kind": "dummy" if effects.is_dummy[i] else "factor",
                    "effect": effects.values[i, j],
                    "active": bool(result.active[i]),
                    "s0": result.s0,
                    "pse": result.pse,
                    "me": result.me,
                    "sme": result.sme,
                    "noise_floor": result.noise_floor,
                }
            )
            if screening.holes:
                vif = None if effects.is_dummy[i] else screening.holes.vif[i]
                margin = result.me * np.sqrt(inflation[i])
                rows[-1] |= {"inflation": inflation[i], "vif": vif, "margin": margin}
    return _csv(pd.DataFrame(rows))


def errors_csv(errors: Sequence[ResponseError], responses: Sequence[Response], space: FactorSpace | None = None) -> str:
    """One row per response: MAXABS, RMSE, both over the response's range, Q², intervals with their measured coverage.

    Given the factors, also the settings of the largest error. A cell is empty where a number is not known.
    """
    units = {r.name: r.unit for r in responses}
    levels = sorted({i.level for e in errors for i in e.intervals})
    return _csv(pd.DataFrame([_error_row(e, units[e.response], levels, space) for e in errors]))


def comparison_csv(comparison: Comparison) -> str:
    """One row per response: how far the models are apart, and each of them from the runs; where they are apart most.

    Differences also over the response's range in these runs. Cells are empty where no run lies in the box of both.
    """
    rows = []
    for j, response in enumerate(comparison.responses):
        row: dict[str, Any] = {"response": response.name, "unit": response.unit, "n_runs": comparison.n_runs}
        row["range"] = comparison.ranges[j]
        for what, found in (("apart", comparison.apart), ("ours", comparison.ours), ("theirs", comparison.theirs)):
            one = found[j] if found else None
            row |= {
                f"{what}_max_abs": one and one.largest,
                f"{what}_max_relative_to_range": one and one.relative,
                f"{what}_rms": one and one.rms,
                f"{what}_rms_relative_to_range": one and one.relative_rms,
            }
        at = comparison.apart[j].at if comparison.apart else [None] * len(comparison.box)
        rows.append(row | {f"apart_most_{label}": v for label, v in zip(comparison.box.labels, at, strict=True)})
    return _csv(pd.DataFrame(rows))


def findings_csv(findings: Sequence[Finding]) -> str:
    """One row per check of an export."""
    return _csv(pd.DataFrame([{"check": f.what, "outcome": str(f.outcome), "detail": f.detail} for f in findings]))


def _error_row(error: ResponseError, unit: str, levels: list[float], space: FactorSpace | None) -> dict[str, Any]:
    intervals = {i.level: i for i in error.intervals}
    known = space is not None and len(error.worst_point) == len(space)
    return {
        "response": error.response,
        "unit": unit,
        "n_runs": error.n_runs,
        "max_abs": error.max_abs,
        "range": error.range,
        "max_relative_to_range": error.max_relative,
        "rmse": error.rmse,
        "rmse_relative_to_range": error.relative_rmse,
        "q2": error.q2,
        **{f"half_width_{v:g}": intervals[v].half_width if v in intervals else None for v in levels},
        **{f"coverage_{v:g}": intervals[v].coverage if v in intervals else None for v in levels},
        "worst_run": error.worst_run + 1,
        **{f"worst_{n}": v for n, v in zip(space.labels if space else (), error.worst_point, strict=known)},
    }


def inversion_csv(
    targets: NDArray[np.float64], inversion: Inversion, space: FactorSpace, responses: Sequence[Response]
) -> str:
    """Targets, the settings found (empty if refused), how many there are, and the nearest reachable responses.

    ``preimages`` is how many settings were found (``inf`` for a continuum), ``complete`` whether no others is proven.
    """
    count = np.where(inversion.continuum, CONTINUUM, inversion.count.astype(str))
    status = [str(s) for s in inversion.status]
    numbers = targets, inversion.settings, inversion.nearest
    return _inversion_table(numbers, (status, count, inversion.complete), space, responses)


def preimages_csv(
    targets: NDArray[np.float64], inversion: Inversion, found: Sequence[Preimages], model: Surrogate
) -> str:
    """As :func:`inversion_csv`, with a row for each of the settings found; one, as refused, where there is none."""
    rows: list[NDArray[np.float64]] = []
    words: list[tuple[str, str, bool]] = []
    for i, one in enumerate(found):
        settings = one.settings if len(one) else np.full((1, len(model.factors)), np.nan)
        nearest = model.predict(settings) if len(one) else inversion.nearest[i : i + 1]
        rows.append(np.hstack([np.tile(targets[i], (len(settings), 1)), settings, nearest]))
        status = InversionStatus.OK if len(one) else InversionStatus.OUTSIDE
        count = CONTINUUM if one.continuum else str(len(one))
        words += [(str(status), count, one.complete)] * len(settings)
    n, k = len(model.responses), len(model.factors)
    numbers = np.split(np.vstack([np.empty((0, n + k + n)), *rows]), [n, n + k], axis=1)
    columns = list(zip(*words, strict=True)) if words else [(), (), ()]
    return _inversion_table(numbers, columns, model.factors, model.responses)


def _inversion_table(
    numbers: Sequence[NDArray[np.float64]], words: Sequence[Any], space: FactorSpace, responses: Sequence[Response]
) -> str:
    """Targets, settings and nearest responses; status, number of preimages and whether they are all."""
    labels = [r.label for r in responses]
    columns = labels, space.labels, [f"nearest_{label}" for label in labels]
    parts = [pd.DataFrame(v, columns=pd.Index(c)) for v, c in zip(numbers, columns, strict=True)]
    told = pd.DataFrame(dict(zip(("status", "preimages", "complete"), words, strict=True)))
    return _csv(pd.concat([*parts[:2], told, parts[2]], axis=1))


def prediction_csv(model: Surrogate, points: NDArray[np.float64], level: float | None = None) -> str:
    """Settings, predicted responses, and whether each setting lies inside the model's domain, on its edge, or outside.

    With a level also the ends of that interval, empty outside the domain.
    """
    labels = [r.label for r in model.responses]
    columns, parts = [*model.factors.labels, *labels], [points, model.predict(points)]
    if level is not None:
        columns += [f"{end}_{label}" for end in ("low", "high") for label in labels]
        parts += model.interval(points, level, outside="nan")
    table = pd.DataFrame(np.hstack(parts), columns=pd.Index(columns))
    table["status"] = model.guard(points)
    return _csv(table)


def sweep_csv(table: pd.DataFrame) -> str:
    """The members of a sweep, a row each."""
    return _csv(table)


def _csv(table: pd.DataFrame) -> str:
    return table.to_csv(index=False, lineterminator="\n")

"""The nouns as CSV: headers carry name and unit, numbers round-trip."""

from collections.abc import Sequence

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from experiments.designs import Design
from experiments.factors import FactorSpace
from experiments.naming import column_label
from experiments.runs import Response, Runs
from experiments.screening import Screening
from surrogates import Inversion, ResponseError, Surrogate

from .reading import CODED


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
    """One row per response and contrast."""
    effects, rows = screening.effects, []
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
    return _csv(pd.DataFrame(rows))


def errors_csv(errors: Sequence[ResponseError], responses: Sequence[Response]) -> str:
    """One row per response: MAXABS, its ratio to the response's range, RMSE."""
    units = {r.name: r.unit for r in responses}
    rows = [
        {
            "response": e.response,
            "unit": units[e.response],
            "n_runs": e.n_runs,
            "max_abs": e.max_abs,
            "range": e.range,
            "max_relative_to_range": e.max_relative,
            "rmse": e.rmse,
            "worst_run": e.worst_run + 1,
        }
        for e in errors
    ]
    return _csv(pd.DataFrame(rows))


def inversion_csv(
    targets: NDArray[np.float64], inversion: Inversion, space: FactorSpace, responses: Sequence[Response]
) -> str:
    """Targets, the settings found (empty if refused), and the nearest reachable responses."""
    table = pd.DataFrame(targets, columns=pd.Index([r.label for r in responses]))
    settings = pd.DataFrame(inversion.settings, columns=pd.Index(space.labels))
    nearest = pd.DataFrame(inversion.nearest, columns=pd.Index([f"nearest_{r.label}" for r in responses]))
    status = pd.Series([str(s) for s in inversion.status], name="status")
    return _csv(pd.concat([table, settings, status, nearest], axis=1))


def prediction_csv(model: Surrogate, points: NDArray[np.float64], inside: NDArray[np.bool_]) -> str:
    """Settings, predicted responses, and whether each setting lies in the model's domain."""
    columns = [*model.factors.labels, *(r.label for r in model.responses)]
    table = pd.DataFrame(np.hstack([points, model.predict(points)]), columns=pd.Index(columns))
    table["status"] = np.where(inside, "ok", "outside")
    return _csv(table)


def _csv(table: pd.DataFrame) -> str:
    return table.to_csv(index=False, lineterminator="\n")

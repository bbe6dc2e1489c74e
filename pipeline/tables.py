"""The nouns as CSV: headers carry name and unit, numbers round-trip."""

import io
from collections.abc import Sequence

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from experiments.designs import Design
from experiments.factors import FactorSpace
from experiments.naming import column_label, parse_column_label
from experiments.runs import Response, Runs, Status
from experiments.screening import Screening
from surrogates import Inversion, ResponseError, Surrogate

from .errors import InputError

CODED = "coded"


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


def read_runs(design_text: str, runs_text: str, space: FactorSpace, responses: Sequence[Response], method: str) -> Runs:
    """Runs from the two tables that :func:`design_csv` and :func:`runs_csv` wrote."""
    design_table = read_csv(design_text)
    coded = [column_label(n, CODED) for n in space.names]
    dummies = [c for c in design_table.columns if c not in coded]
    settings = numbers(design_table, coded)
    design = Design(space, settings, method, numbers(design_table, dummies))
    table = read_csv(runs_text)
    try:
        status = tuple(Status(s) for s in table["status"])
        reasons = tuple("" if pd.isna(r) else str(r) for r in table["reason"])
        return Runs(design, tuple(responses), numbers(table, [r.label for r in responses]), status, reasons)
    except (KeyError, ValueError) as error:
        raise InputError(f"the runs are not as flexdoce wrote them: {error}") from None


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


def read_points(text: str, wanted: Sequence[Response] | FactorSpace, origin: str) -> NDArray[np.float64]:
    """Columns of a person's CSV, by name with or without ``[unit]``; others are ignored.

    Raises
    ------
    InputError
        If a column is missing, doubled, in another unit, or has a value that is not a finite number.
    """
    table = read_csv(text, origin)
    given: dict[str, str] = {}
    for label in table.columns:
        name, _ = parse_column_label(str(label))
        if name in given:
            raise InputError(f"{origin}: the column {name!r} appears twice")
        given[name] = label
    missing = [item.label for item in wanted if item.name not in given]
    if missing:
        raise InputError(
            f"{origin} has the wrong columns: {', '.join(missing)} missing; found {', '.join(map(str, table.columns))}"
        )
    for item in wanted:
        unit = parse_column_label(given[item.name])[1]
        if unit is not None and unit != item.unit:
            raise InputError(f"{origin}: the column {given[item.name]!r} must be in {item.unit!r}, not {unit!r}")
    if not len(table):
        raise InputError(f"{origin} has no rows")
    points = numbers(table, [given[item.name] for item in wanted], origin)
    bad = np.argwhere(~np.isfinite(points))
    if len(bad):
        row, column = bad[0]
        raise InputError(f"{origin}: row {row + 1}, column {wanted_label(wanted, column)} is not a finite number")
    return points


def wanted_label(wanted: Sequence[Response] | FactorSpace, column: int) -> str:
    """Label of the column at that position."""
    return [item.label for item in wanted][column]


def read_csv(text: str, origin: str = "the table") -> pd.DataFrame:
    """A table from CSV text, numbers exact; ``InputError`` if it is none."""
    try:
        return pd.read_csv(io.StringIO(text), float_precision="round_trip", skipinitialspace=True)
    except (pd.errors.ParserError, pd.errors.EmptyDataError, ValueError) as error:
        raise InputError(f"{origin} is not a CSV table: {str(error).strip()}") from None


def numbers(table: pd.DataFrame, columns: Sequence[str], origin: str = "the table") -> NDArray[np.float64]:
    """Columns as float64, shape (n, n_columns); ``InputError`` if one is missing or not numeric."""
    try:
        return table[list(columns)].to_numpy(dtype=np.float64).reshape(len(table), len(columns))
    except KeyError as error:
        raise InputError(f"{origin} has the wrong columns: {error.args[0]}") from None
    except (ValueError, TypeError):
        for column in columns:
            values = pd.to_numeric(table[column], errors="coerce")
            for row in np.flatnonzero(values.isna() & table[column].notna()):
                raise InputError(
                    f"{origin}: row {row + 1}, column {column} is not a number: {table[column].iloc[row]!r}"
                ) from None
        raise


def _csv(table: pd.DataFrame) -> str:
    return table.to_csv(index=False, lineterminator="\n")

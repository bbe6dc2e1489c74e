"""What the report shows, as plain rows of text and numbers for the template."""

import json
from typing import Any

import numpy as np

from experiments.designs import METHODS, level_discrepancy_squared
from experiments.oracles import Shape
from experiments.oracles.plots import exaggeration, size
from surrogates import Verdict, affine_inverse

from ..runner import Outcome


def number(value: float, digits: int = 4) -> str:
    """A number for people: significant digits, a true minus sign, powers of ten where they help."""
    if not np.isfinite(value):
        return "–"
    if value == 0.0:
        return "0"
    exponent = int(np.floor(np.log10(abs(value))))
    if -4 <= exponent < 7:
        text = f"{value:.{max(0, digits - 1 - exponent)}f}"
        text = text.rstrip("0").rstrip(".") if "." in text else text
    else:
        mantissa, power = f"{value:.{max(0, digits - 2)}e}".split("e")
        text = f"{mantissa}·10{_superscript(int(power))}"
    return text.replace("-", "−")


def percent(value: float) -> str:
    """A ratio as a percentage."""
    return f"{number(100.0 * value, 3)} %"


def headline(outcome: Outcome) -> list[dict[str, str]]:
    """The four numbers that a reader wants first."""
    model, trip = outcome.model, outcome.round_trip
    worst = max(model.validation, key=lambda e: e.max_relative)
    used = sum(len(model.terms_of(j)) for j in range(len(model.responses)))
    offered = len(outcome.study.candidates(len(outcome.kept))) * len(model.responses)
    certificate = model.certificate
    verdict = str(certificate.verdict) if certificate else "none"
    if certificate and certificate.condition is not None:
        verdict += f", condition {number(certificate.condition, 3)}"
    answered = len(trip.targets) - trip.n_refused
    return [
        {
            "label": "model",
            "value": "linear" if model.is_affine else f"polynomial of degree {model.terms.degrees.max()}",
            "note": f"{used} of {offered} candidate coefficients are supported by the data",
        },
        {
            "label": "largest error",
            "value": f"{percent(worst.max_relative)} of the range",
            "note": f"on {worst.n_runs} fresh random runs, in {worst.response}",
        },
        {"label": "inverse", "value": verdict, "note": "no two settings in the box give the same responses"
         if verdict.startswith("certified") else "see “Inverse” below"},
        {
            "label": "round trip",
            "value": f"{answered} of {len(trip.targets)}",
            "note": "wanted responses inverted and confirmed by the oracle",
        },
    ]  # fmt: skip


def factors(outcome: Outcome) -> list[dict[str, str]]:
    """One row per factor."""
    acting = set(outcome.screening.active_factors)
    return [
        {
            "name": f.name,
            "unit": f.unit,
            "low": number(f.low, 6),
            "high": number(f.high, 6),
            "acts": "yes" if f.name in acting else "no",
            "kept": "yes" if f.name in outcome.kept else "no",
            "source": f.source,
        }
        for f in outcome.study.space
    ]


def activity(outcome: Outcome) -> dict[str, Any]:
    """Effects by contrast and response, with what is active."""
    screening = outcome.screening
    scale = np.array([r.shown_scale for r in outcome.model.responses])
    rows = []
    for i, name in enumerate(screening.effects.names):
        cells = [
            {"text": number(v, 5) if a else "·", "active": bool(a)}
            for v, a in zip(screening.effects.values[i] * scale, screening.active[i], strict=True)
        ]
        rows.append({"name": name, "dummy": bool(screening.effects.is_dummy[i]), "cells": cells})
    margins = [
        {
            "name": label,
            "cells": [number(getattr(r, attribute) * s, 3) for r, s in zip(screening.lenth, scale, strict=True)],
        }
        for label, attribute in (("s0", "s0"), ("PSE", "pse"), ("ME", "me"), ("SME", "sme"))
    ]
    return {"rows": rows, "margins": margins, "floored": any(r.floored for r in screening.lenth)}


def fill(outcome: Outcome) -> dict[str, Any]:
    """The filling design in numbers."""
    design = outcome.fit_runs.design
    columns = [design.space.index(name) for name in outcome.kept]
    settings = design.coded[:, columns]
    levels = {len(np.unique(np.round(c, 9))) for c in settings.T}
    few = max(levels) < len(design)
    return {
        "title": METHODS[design.method].title,
        "n_runs": len(design),
        "n_factors": len(columns),
        "levels": max(levels) if few else None,
        "cd2": f"{level_discrepancy_squared(settings):.6f}",
    }


def linear_map(outcome: Outcome) -> dict[str, Any] | None:
    """The map and its inverse with shown units, for an affine model."""
    model = outcome.model
    if not model.is_affine:
        return None
    scale = np.array([r.shown_scale for r in model.responses])
    centre = model.factors.centre[None]
    slope = model.jacobian(centre)[0] * scale[:, None]
    inverse = affine_inverse(model)
    offset = (model.predict(centre)[0] * scale) - slope @ centre[0]
    return {
        "matrix": [[number(v, 6) for v in row] for row in slope],
        "offset": [number(v, 6) for v in offset],
        "has_offset": bool(np.any(offset != 0.0)),
        "inverse": [[number(v, 5) for v in row] for row in inverse.gain / scale],
        "condition": number(inverse.condition, 4),
    }


def coefficients(outcome: Outcome) -> list[dict[str, Any]]:
    """Coefficients in coded units, shown units, one row per term."""
    model = outcome.model
    shown = model.coefficients * [r.shown_scale for r in model.responses]
    return [
        {"term": label, "cells": [number(v, 5) if v != 0.0 else "" for v in row]}
        for label, row in zip(model.terms.labels, shown, strict=True)
    ]


def published(outcome: Outcome) -> dict[str, Any] | None:
    """Published entries against the fitted map, entry by entry."""
    known, model = outcome.study.oracle.published, outcome.model
    if known is None:
        return None
    shown = {r.name: r for r in model.responses}
    slope = model.jacobian(model.factors.centre[None])[0]
    names = [r.name for r in model.responses]
    notes: list[str] = []
    rows, worst, leak = [], 0.0, 0.0
    for i, response in enumerate(known.responses):
        row_scale = float(np.abs(known.values[i]).max())
        cells = []
        for j, factor in enumerate(known.factors):
            theirs = known.values[i, j]
            ours = slope[names.index(response), model.factors.index(factor)]
            note = known.notes.get((response, factor), "")
            if note and note not in notes:
                notes.append(note)
            if theirs != 0.0:
                worst = max(worst, abs(ours / theirs - 1.0))
                difference = f"{number(100.0 * (ours / theirs - 1.0), 2)} %"
            else:
                leak = max(leak, abs(ours) / row_scale)
                difference = "" if ours == 0.0 else f"{number(abs(ours) / row_scale, 2)} of row"
            unit_scale = shown[response].shown_scale
            cells.append(
                {
                    "theirs": number(theirs * unit_scale, 7),
                    "ours": number(ours * unit_scale, 7),
                    "difference": difference,
                    "mark": notes.index(note) + 1 if note else None,
                }
            )
        rows.append({"response": shown[response], "cells": cells})
    return {
        "source": known.source,
        "factors": known.factors,
        "rows": rows,
        "notes": notes,
        "remarks": known.remarks,
        "worst": percent(worst),
        "leak": number(leak, 2),
    }


def error_rows(outcome: Outcome, errors: Any) -> list[dict[str, str]]:
    """A table like the thesis's Table 2.5, in shown units."""
    shown = {r.name: r for r in outcome.model.responses}
    return [
        {
            "symbol": shown[e.response].symbol,
            "unit": shown[e.response].shown_unit,
            "max_abs": number(e.max_abs * shown[e.response].shown_scale, 3),
            "range": number(e.range * shown[e.response].shown_scale, 4),
            "relative": percent(e.max_relative),
            "rmse": number(e.rmse * shown[e.response].shown_scale, 3),
        }
        for e in errors
    ]


def certificate(outcome: Outcome) -> dict[str, Any] | None:
    """The certificate in words."""
    found = outcome.model.certificate
    if found is None:
        return None
    return {
        "verdict": str(found.verdict),
        "good": found.verdict is Verdict.CERTIFIED,
        "claim": found.claim,
        "reason": found.reason,
        "method": found.method,
    }


def shapes(outcome: Outcome) -> list[tuple[str, Shape]]:
    """Cases to draw: a validation run first, as in the thesis, then each factor alone at its high end."""
    oracle, space = outcome.study.oracle, outcome.study.space
    cases = [("first validation run", outcome.validation_runs.design.physical[0])]
    for i, factor in enumerate(space):
        point = space.centre.copy()
        point[i] = factor.high
        cases.append((f"{factor.name} = {number(factor.high)} {factor.unit}, others at mid-range", point))
    drawn = [(label, oracle.shape(point)) for label, point in cases]
    return [(label, shape) for label, shape in drawn if shape is not None]


def viewer_data(cases: list[tuple[str, Shape]]) -> str:
    """The shapes as JSON for the viewer, lengths in mm, safe inside a script element."""
    document = [
        {
            "label": label,
            "factor": exaggeration(shape),
            "size": _short(1e3 * size(shape)),
            "anchors": _short(1e3 * shape.anchors) if len(shape.anchors) else [],
            "lines": [
                {"rest": _short(1e3 * line.points), "move": _short(1e3 * line.displacement), "rigid": line.rigid}
                for line in shape.lines
            ],
            "arrows": [
                {
                    "label": arrow.label,
                    "rest": _short(1e3 * arrow.point),
                    "move": _short(1e3 * arrow.displacement),
                    "direction": _short(arrow.direction),
                }
                for arrow in shape.arrows
            ],
        }
        for label, shape in cases
    ]
    text = json.dumps(document, separators=(",", ":"), allow_nan=False)
    return text.replace("<", "\\u003c").replace("&", "\\u0026")


def _short(values: Any) -> Any:
    """Nested lists of numbers with six significant digits: a drawing needs no more."""
    return np.vectorize(lambda v: float(f"{v:.6g}"), otypes=[float])(values).tolist()


def _superscript(power: int) -> str:
    return str(power).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))

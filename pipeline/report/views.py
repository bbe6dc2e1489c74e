"""What the report shows, as plain rows of text and numbers for the template."""

import json
from functools import partial
from typing import Any

import numpy as np

from experiments.designs import METHODS, level_discrepancy_squared
from experiments.oracles import Shape, asked
from experiments.oracles.plots import exaggeration, is_planar, size
from surrogates import Surrogate, Verdict, affine_inverse, affine_map
from surrogates.candidates import AUTO
from surrogates.links import LOG, logarithmic, unit_of

from ..runner import Outcome

MOST_NAMED = 12
"""Terms of one response that are listed by name beside the design; all of them are in the table of coefficients."""


def number(value: float, digits: int = 4) -> str:
    """A number for people: at least `digits` significant digits, a true minus sign, powers of ten where they help."""
    if not np.isfinite(value):
        return "–"
    if value == 0.0:
        return "0"
    mantissa, power = f"{value:.{digits - 1}e}".split("e")
    mantissa = mantissa.rstrip("0").rstrip(".") if "." in mantissa else mantissa
    exponent = int(power)
    if -4 <= exponent < 7:
        # Whole numbers keep all their digits: rounding 141402 to 141400 would look like a measured zero.
        text = f"{value:.{max(0, digits - 1 - exponent)}f}"
        text = text.rstrip("0").rstrip(".") if "." in text else text
    else:
        text = f"{mantissa}·10{_superscript(int(power))}"
    return text.replace("-", "−")


def percent(value: float) -> str:
    """A ratio as a percentage."""
    return f"{number(100.0 * value, 3)} %"


def headline(outcome: Outcome) -> list[dict[str, str]]:
    """The numbers that a reader wants first."""
    model, trip = outcome.model, outcome.round_trip
    worst = max(model.validation, key=lambda e: e.max_relative)
    used = sum(len(model.terms_of(j)) for j in range(len(model.responses)))
    # Where the degree is chosen, the candidates differ from response to response.
    offered = len(outcome.study.candidates(len(outcome.kept))) * len(model.responses)
    of_offered = "" if outcome.fit.degree == AUTO else f" of {offered} candidate"
    certificate = model.certificate
    verdict = str(certificate.verdict) if certificate else "none"
    if certificate and certificate.condition is not None:
        verdict += f", condition {number(certificate.condition, 3)}"
    certified = verdict.startswith("certified")
    inverse = [
        {
            "label": "inverse",
            "value": verdict,
            "note": "no two settings in the box give the same responses" if certified else "see “Inverse” below",
        }
    ]
    if trip is None:
        inverse = [{"label": "inverse", "value": "none", "note": outcome.obstacle}]
    else:
        inverse.append(
            {
                "label": "round trip",
                "value": f"{len(trip.targets) - trip.n_refused} of {len(trip.targets)} inverted",
                "note": f"there the oracle is within {percent(trip.worst)} of the range of what was wanted"
                if trip.errors
                else "none could be tried on the oracle",
            }
        )
    return [
        {
            "label": "model",
            "value": "linear" if model.is_affine_map else f"polynomial of degree {model.terms.degrees.max()}",
            "note": f"{used}{of_offered} coefficients are supported by the data",
        },
        {
            "label": "largest error",
            "value": f"{percent(worst.max_relative)} of the range",
            "note": f"against the oracle on {worst.n_runs} fresh random runs, in {worst.response}",
        },
        *inverse,
    ]


def factors(outcome: Outcome) -> list[dict[str, str]]:
    """One row per factor."""
    acting = set(outcome.screening.active_factors)
    used = np.array(outcome.model.terms.exponents).reshape(-1, len(outcome.study.space)).any(axis=0)
    return [
        {
            "name": f.name,
            "unit": f.unit,
            "low": number(f.low, 6),
            "high": number(f.high, 6),
            "acts": "yes" if f.name in acting else "no",
            "kept": "yes" if f.name in outcome.kept else "no",
            "used": "yes" if u else "no",
            "source": f.source,
        }
        for f, u in zip(outcome.study.space, np.atleast_1d(used), strict=True)
    ]


def activity(outcome: Outcome) -> dict[str, Any]:
    """Effects by contrast and response, with what is active; effects below the noise floor are shown as a dot."""
    screening = outcome.screening
    scale = np.array([r.shown_scale for r in outcome.model.responses])
    floor = np.array([r.noise_floor for r in screening.lenth])
    rows = []
    for i, name in enumerate(screening.effects.names):
        seen = np.abs(screening.effects.values[i]) > floor
        cells = [
            {"text": number(v, 5) if s else "·", "active": bool(a)}
            for v, s, a in zip(screening.effects.values[i] * scale, seen, screening.active[i], strict=True)
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
        "cd2": f"{level_discrepancy_squared(settings):.6f}" if few else None,
    }


def linear_map(outcome: Outcome) -> dict[str, Any] | None:
    """The map and its inverse with shown units, for an affine model."""
    model = outcome.model
    if not model.is_affine_map:
        return None
    scale = np.array([r.shown_scale for r in model.responses])
    matrix, offset = affine_map(model)
    inverse = affine_inverse(model)
    return {
        "matrix": [[number(v, 6) for v in row] for row in matrix * scale[:, None]],
        "offset": [number(v, 6) for v in offset * scale],
        "has_offset": bool(np.any(offset != 0.0)),
        "inverse": [[number(v, 5) for v in row] for row in inverse.gain / scale],
        "condition": number(inverse.condition, 4),
    }


def coefficients(outcome: Outcome) -> dict[str, Any]:
    """Coefficients by coded factors, one row per term, with standard errors where they are known.

    In shown units; of a response that is given by its logarithm, those of the logarithm of its SI value.
    """
    model, heads = outcome.model, []
    by_log = logarithmic(model.links)
    for r, log in zip(model.responses, by_log, strict=True):
        symbol, unit = ("", unit_of(LOG, r.symbol, r.unit)) if log else (r.symbol, r.shown_unit)
        heads.append({"symbol": symbol, "unit": unit})
    scale = np.where(by_log, 1.0, [r.shown_scale for r in model.responses])
    unknown = np.full_like(model.coefficients, np.nan)
    errors = unknown if model.standard_errors is None else model.standard_errors
    rows = [
        {"term": label, "cells": [_with_error(v, e) for v, e in zip(values, beside, strict=True)]}
        for label, values, beside in zip(model.terms.labels, model.coefficients * scale, errors * scale, strict=True)
    ]
    return {"heads": heads, "rows": rows, "has_errors": bool(np.isfinite(errors).any()), "has_logs": model.has_logs}


def _with_error(value: float, error: float) -> str:
    """``"1.5 ± 0.2"``; empty for a term that the response does not use."""
    if value == 0.0:
        return ""
    return number(value, 5) + (f" ± {number(error, 2)}" if np.isfinite(error) else "")


def terms(outcome: Outcome) -> list[str]:
    """The terms of each response: by name, or counted by degree where there are too many to read."""
    model, found = outcome.model, []
    for j in range(len(model.responses)):
        names = model.terms_of(j)
        degrees = model.terms.degrees[model.coefficients[:, j] != 0.0]
        counted = [f"{np.sum(degrees == d)} of degree {d}" for d in np.unique(degrees)]
        found.append(", ".join(names) or "none" if len(names) <= MOST_NAMED else f"{len(names)}: {', '.join(counted)}")
    return found


def published(outcome: Outcome) -> dict[str, Any] | None:
    """Published entries against the fitted map, entry by entry."""
    known, model = outcome.study.oracle.published, outcome.model
    if known is None:
        return None
    shown = {r.name: r for r in model.responses}
    rows_of = [[r.name for r in model.responses].index(name) for name in known.responses]
    columns_of = [model.factors.index(name) for name in known.factors]
    ours = model.jacobian(model.factors.centre[None])[0][np.ix_(rows_of, columns_of)]
    differences = known.differences(ours)
    zero = known.values == 0.0
    notes = list(dict.fromkeys(known.notes.values()))
    rows = []
    for i, response in enumerate(known.responses):
        scale, cells = shown[response].shown_scale, []
        for j, factor in enumerate(known.factors):
            apart = number(100.0 * differences[i, j], 2) + (" % of row" if zero[i, j] else " %")
            note = known.notes.get((response, factor))
            cells.append(
                {
                    "theirs": number(known.values[i, j] * scale, 7),
                    "ours": number(ours[i, j] * scale, 7),
                    "difference": "=" if ours[i, j] == known.values[i, j] else apart,
                    "mark": notes.index(note) + 1 if note else None,
                }
            )
        rows.append({"response": shown[response], "cells": cells})
    return {
        "source": known.source,
        "factors": [model.factors.factors[j].label for j in columns_of],
        "rows": rows,
        "notes": notes,
        "remarks": known.remarks,
        "worst": percent(float(np.abs(differences[~zero]).max(initial=0.0))),
        "leak": number(float(np.abs(differences[zero]).max(initial=0.0)), 2),
    }


def certificate(model: Surrogate | None) -> dict[str, Any] | None:
    """The certificate of a model in words."""
    found = model.certificate if model else None
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
    """Cases to draw: a validation run first, then each factor alone at its high end."""
    oracle, space = outcome.study.oracle, outcome.study.space
    cases = [("first validation run", outcome.validation_runs.design.physical[0])]
    for i, factor in enumerate(space):
        point = space.centre.copy()
        point[i] = factor.high
        cases.append((f"{factor.name} = {number(factor.high)} {factor.unit}, others at mid-range", point))
    drawn = [(label, asked(oracle, "shape", partial(oracle.shape, point))) for label, point in cases]
    return [(label, shape) for label, shape in drawn if shape is not None]


def viewer_data(cases: list[tuple[str, Shape]]) -> str:
    """The shapes as JSON for the viewer, lengths in mm, safe inside a script element."""
    document = [
        {
            "label": label,
            "factor": exaggeration(shape),
            "planar": is_planar(shape),
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

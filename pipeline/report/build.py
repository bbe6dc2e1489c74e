"""Puts the report together: views and figures into the template."""

from collections.abc import Mapping
from importlib.resources import files
from typing import Any

from jinja2 import Environment, StrictUndefined
from markupsafe import Markup

from experiments.designs import METHODS

from ..runner import Outcome
from . import commanded, figures, growing, holes, other_models, validation, views

SPACES = "\n\u00a0\u2009\u202f"
ROUNDING = 1e-12
"""Errors over the response's range that are smaller say nothing of the model."""
_HERE = files("pipeline.report")


def report_html(outcome: Outcome, provenance: Mapping[str, Any]) -> str:
    """The report as one HTML text that needs no other file.

    Parameters
    ----------
    outcome : Outcome
    provenance : mapping
        Content of ``provenance.json``.
    """
    return rendered("template.html", _content(outcome, provenance))


def rendered(template: str, content: Mapping[str, Any]) -> str:
    """A template of this folder with its content; `style` is ours."""
    environment = Environment(autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True,
                              finalize=_readable)  # fmt: skip
    return environment.from_string(_read(template)).render({"style": _read("style.css"), **content})


def _content(outcome: Outcome, provenance: Mapping[str, Any]) -> dict[str, Any]:
    """What the template asks for, section by section; a new section is a function of its own."""
    sections = (_head, _screening, _fit, _validation, _inverse, _drawing)
    found = {key: value for section in sections for key, value in section(outcome).items()}
    return {**found, "provenance": provenance, "script": _read("viewer.js")}


def _head(outcome: Outcome) -> dict[str, Any]:
    model, config = outcome.model, outcome.study.config
    return {
        "config": config,
        "title": config.title or config.name,
        "oracle": outcome.study.oracle,
        "responses": model.responses,
        "factors": views.factors(outcome),
        "model": model,
        "headline": views.headline(outcome),
        "shortfalls": outcome.shortfalls,
        "requirements": config.require.model_dump(exclude_none=True),
        "prefix": outcome.study.export_prefix,
        "exported": outcome.exported,
    }


def _screening(outcome: Outcome) -> dict[str, Any]:
    return {
        "activity": views.activity(outcome),
        "adequacy": outcome.adequacy,
        "kept": outcome.kept,
        "screening_title": METHODS[outcome.study.config.screening.design.method].title,
        "screening_runs": len(outcome.screening_runs),
        "missing": holes.missing(outcome),
        "screening_figures": [figures.screening_figure(outcome, j) for j in range(len(outcome.model.responses))],
    }


def _fit(outcome: Outcome) -> dict[str, Any]:
    return {
        "fill": views.fill(outcome),
        "design_figure": figures.design_figure(outcome),
        "terms": views.terms(outcome),
        "candidates": growing.candidates(outcome),
        "growth": growing.rounds(outcome),
        "map": views.linear_map(outcome),
        "coefficients": views.coefficients(outcome),
        "published": views.published(outcome),
    }


def _validation(outcome: Outcome) -> dict[str, Any]:
    model = outcome.model
    return {
        "validation": validation.error_rows(outcome, model.validation),
        "at_rounding": max(e.max_relative for e in model.validation) < ROUNDING,
        "intervals": validation.intervals(outcome),
        "validation_failures": outcome.validation_runs.failures(),
        "validation_figures": [figures.validation_figure(outcome, j) for j in range(len(model.responses))],
        "comparisons": other_models.comparisons(outcome),
    }


def _inverse(outcome: Outcome) -> dict[str, Any]:
    trip = outcome.round_trip
    return {
        "certificate": views.certificate(outcome.model),
        "boxes": commanded.boxes(outcome, outcome.model),
        "command": commanded.boxes(outcome, outcome.commanded),
        "command_verdict": views.certificate(outcome.commanded),
        "trip": trip,
        "trip_rows": validation.error_rows(outcome, trip.errors if trip else ()),
        "obstacle": outcome.obstacle,
    }


def _drawing(outcome: Outcome) -> dict[str, Any]:
    cases = views.shapes(outcome)
    return {
        "shapes": [label for label, _ in cases],
        "shape_figure": figures.shape_figure(cases[0][1]) if cases else "",
        "viewer_data": views.viewer_data(cases),
    }


def _readable(value: Any) -> Any:
    """A text without what cannot be printed: escapes for terminals, and marks that turn the reading order."""
    if not isinstance(value, str) or isinstance(value, Markup) or value.isprintable():
        return value
    return "".join(c if c.isprintable() or c in SPACES else " " for c in value)


def _read(name: str) -> str:
    return (_HERE / name).read_text(encoding="utf-8")

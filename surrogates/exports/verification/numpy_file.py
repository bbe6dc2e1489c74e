"""The Python export against the model: run by this Python, in a process of its own."""

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ...inversion import TARGET_TOLERANCE
from ...links import to_link_units, to_responses
from .base import DOUBLE, Finding, Reference, agreement, invertible, reference, round_trip, statement
from .edges import at_faces
from .python_run import run_file

if TYPE_CHECKING:
    from ...model import Surrogate

BODY = """\
found["responses"] = exported.forward(given["settings"])
found["jacobian"] = exported.jacobian(given["settings"])
found["inside"] = exported.inside(given["anywhere"])
found["not_finite"] = exported.forward(given["not_finite"])
found["not_finite_inside"] = exported.inside(given["not_finite"])
"""

INVERSE = """\
for name in "targets", "far", "bad":
    found[name + "_settings"], found[name + "_status"] = exported.inverse(given[name])
"""

NOT_FINITE = 4
"""The status of a target that is NaN or infinite, in every language."""

ROUNDING = 1.01
"""The file compares with its tolerance after other rounding than here."""


def verify(model: "Surrogate", prefix: str, folder: Path) -> list[Finding]:
    """Findings on ``<prefix>.py`` in `folder`: forward, Jacobian, domain, and the inverse where there is one."""
    points = reference(model)
    anywhere = np.vstack([points.settings, points.outside, at_faces(model)])
    given = {"settings": points.settings, "anywhere": anywhere, "not_finite": _not_finite(points.settings)}
    body = BODY
    if invertible(model):
        given |= {
            "targets": points.targets,
            "far": _far(model, points),
            "bad": _not_finite(points.responses),
        }
        body += INVERSE
    found = run_file("the file runs in Python", folder / f"{prefix}.py", "numpy", body, given)
    if isinstance(found, Finding):
        return [found]
    return _forward(model, points, given, found) + (_inverse(model, given, found) if invertible(model) else [])


def _forward(
    model: "Surrogate",
    points: Reference,
    given: dict[str, NDArray[np.float64]],
    found: dict[str, NDArray[np.float64]],
) -> list[Finding]:
    refused = np.isnan(found["not_finite"]).all() and not found["not_finite_inside"].any()
    return [
        agreement("forward in Python", found["responses"], points.responses, points.magnitude, DOUBLE),
        agreement("Jacobian in Python", found["jacobian"], points.jacobian, points.slope_magnitude, DOUBLE),
        statement("the domain in Python", np.array_equal(found["inside"], model.contains(given["anywhere"]))),
        statement("NaN and infinity are outside and give NaN in Python", bool(refused)),
    ]


def _inverse(
    model: "Surrogate", given: dict[str, NDArray[np.float64]], found: dict[str, NDArray[np.float64]]
) -> list[Finding]:
    ok = found["far_status"] == 0
    settings = found["far_settings"]
    with np.errstate(over="ignore"):
        reached, wanted = (to_link_units(model.links, v) for v in (model.predict(settings[ok]), given["far"][ok]))
    held = model.contains(settings[ok]).all() and np.all(
        np.abs(reached - wanted) <= ROUNDING * TARGET_TOLERANCE * model.scale
    )
    bad = found["bad_status"] == NOT_FINITE
    return [
        round_trip(
            model,
            "inverse in Python",
            given["targets"],
            found["targets_settings"],
            found["targets_status"] == 0,
            DOUBLE,
        ),
        statement(
            "targets from outside the domain, and any others, are refused or given, in Python",
            bool(held and np.isnan(settings[~ok]).all()),
            f"{int((~ok).sum())} of {len(ok)} refused",
        ),
        statement(
            "targets that are NaN or infinite are refused in Python",
            bool(bad.all() and np.isnan(found["bad_settings"]).all()),
        ),
    ]


def _far(model: "Surrogate", points: Reference) -> NDArray[np.float64]:
    """Targets of settings outside the domain, and others that may be of no settings at all."""
    m = len(model.responses)
    anywhere = model.scale * np.random.default_rng(1).uniform(-1.5, 1.5, (len(points.outside), m))
    values = model.predict_coded(np.zeros((1, len(model.factors)))) + anywhere
    return np.vstack([model.predict(points.outside), to_responses(model.links, values)])


def _not_finite(rows: NDArray[np.float64]) -> NDArray[np.float64]:
    """A row for each column and each number that is not finite, the others as in the first of `rows`."""
    values = (np.nan, np.inf, -np.inf)
    bad = np.repeat(rows[:1], rows.shape[1] * len(values), axis=0)
    for k in range(len(bad)):
        bad[k, k // len(values)] = values[k % len(values)]
    return bad

"""The CasADi export against the model: built and called by this Python, in a process of its own."""

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from .base import DOUBLE, Finding, agreement, reference, statement
from .edges import at_faces
from .python_run import run_file

if TYPE_CHECKING:
    from ...model import Surrogate

BODY = """\
found["responses"] = exported.forward(given["settings"].T).full().T
found["jacobian"] = np.array([exported.jacobian(row).full() for row in given["settings"]])
found["inside"] = exported.inside(given["anywhere"].T).full()[0]
"""


def verify(model: "Surrogate", prefix: str, folder: Path) -> list[Finding]:
    """Findings on ``<prefix>_casadi.py`` in `folder`: forward, Jacobian and domain."""
    points = reference(model)
    k = len(model.factors)
    nans = np.where(np.eye(k, dtype=bool), np.nan, model.factors.centre)
    anywhere = np.vstack([points.settings, points.outside, at_faces(model), nans])
    given = {"settings": points.settings, "anywhere": anywhere}
    found = run_file("the file runs with CasADi", folder / f"{prefix}_casadi.py", "casadi", BODY, given)
    if isinstance(found, Finding):
        return [found]
    return [
        agreement("forward in CasADi", found["responses"], points.responses, points.magnitude, DOUBLE),
        agreement("Jacobian in CasADi", found["jacobian"], points.jacobian, points.slope_magnitude, DOUBLE),
        statement("the domain in CasADi, NaN outside", np.array_equal(found["inside"], model.contains(anywhere))),
    ]

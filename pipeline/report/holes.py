"""What the report says of failed runs: what was done without them, and what that costs."""

from typing import Any

import numpy as np

from ..runner import Outcome
from .views import number


def missing(outcome: Outcome) -> dict[str, Any]:
    """By stage, what was done without the runs that failed: a table for the screening, a sentence for the others."""
    said = {stage: outcome.gaps.get(stage, "").capitalize() for stage in ("fit", "validation", "inversion")}
    return said | {"screening": _screening(outcome)}


def _screening(outcome: Outcome) -> dict[str, Any] | None:
    """What the screening lost, one row per factor; None if no run of it failed."""
    found = outcome.screening.holes
    if found is None:
        return None
    columns = found.vif, found.inflation, np.sqrt(found.inflation)
    unjudged = set(outcome.screening.unjudged)
    return {
        "failures": outcome.screening_runs.failures(),
        "sentences": [s[0].upper() + s[1:] for s in found.sentences()],
        "unjudged": [name for name in found.factors if name in unjudged],
        "rows": []
        if found.orthogonal
        else [
            {"name": name, "cells": [number(v, 3) for v in values]}
            for name, *values in zip(found.factors, *columns, strict=True)
        ],
    }

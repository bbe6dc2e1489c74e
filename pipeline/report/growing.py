"""What the report says of how the model was fitted, and how the fit grew until its required error held."""

from typing import Any

from surrogates.candidates import AUTO

from ..runner import Outcome
from .views import percent

ENTERED = "terms entered one at a time, as many as the data support (cross-validated)"
CHOSEN = {
    "forward": ENTERED,
    "lars": f"by least-angle regression {ENTERED}",
    "adaptive_lasso": f"by the adaptive lasso {ENTERED}",
    "evidence": "all were fitted at once, each as large as the smoothness that the runs show allows, and those too "
    "small to matter were removed",
    "backward": "the penalty was chosen by exact leave-one-out and terms were removed until those left are what the "
    "data support (cross-validated)",
}


def candidates(outcome: Outcome) -> str:
    """From which terms the fit chose, and how."""
    fit = outcome.fit
    degree = f"degree {fit.degree}"
    if fit.degree == AUTO:
        degree = f"a degree chosen for each response, at most {fit.highest_degree},"
    how = CHOSEN[fit.selection] if fit.trim else "all were kept, the penalty chosen by exact leave-one-out"
    products = "with" if fit.interactions else "without"
    taught = "; the oracle's derivatives at each run were fitted along with its responses" if fit.gradients else ""
    return f"Candidates were all terms up to {degree} {products} interactions; {how}{taught}."


def rounds(outcome: Outcome) -> dict[str, Any] | None:
    """One row per round, and why there was no other; None if there was one round only."""
    if len(outcome.rounds) < 2:
        return None
    return {
        "end": outcome.rounds[-1].then,
        "looks": sum(one.error is not None and not one.step.endswith("none better") for one in outcome.rounds),
        "rows": [
            {
                "step": one.step,
                "runs": one.runs,
                "degree": one.degree,
                "selection": one.selection,
                "errors": ["–" if e is None else percent(e) for e in (one.loo, one.expected, one.error)],
            }
            for one in outcome.rounds
        ],
    }

"""From what a screening left open to the next design."""

from dataclasses import dataclass
from enum import StrEnum


class NextDesign(StrEnum):
    """What to run next; the values name methods, or are plain words where none is meant."""

    NONE = "none"
    FOLDOVER = "foldover"
    DEFINITIVE_SCREENING = "definitive_screening"
    QUADRATIC_FILL = "quadratic_fill"
    LARGER_SCREENING = "larger_screening"
    CENTRE_POINTS = "centre_points"


@dataclass(frozen=True)
class Question:
    """What is known after a screening.

    Parameters
    ----------
    status : str
        ``"adequate"``, ``"inadequate"``, ``"undecided"``, ``"aliased"`` or ``"unknown"``.
    interactions : bool
        Whether dummy columns are loud.
    curved : bool or None
        Whether centre points show curvature; None without any.
    settled : bool
        Whether who acts is certain all the same: the main effects are clear of interactions, or all factors act.
    crowded : bool
        Whether too many contrasts act for the design to judge.
    few : bool
        Whether the factors in question are few enough for a quadratic fill.
    """

    status: str
    interactions: bool
    curved: bool | None
    settled: bool
    crowded: bool
    few: bool


ADVICE = {
    NextDesign.NONE: "",
    NextDesign.FOLDOVER: "add the foldover (all signs reversed): it frees the main effects of two-factor interactions "
    "and uses the runs already paid for",
    NextDesign.DEFINITIVE_SCREENING: "screen again by a definitive screening design: its main effects are clear of "
    "two-factor interactions and of squares",
    NextDesign.QUADRATIC_FILL: "screening has no more to say: fill the ranges of the kept factors and fit a full "
    "quadratic or more",
    NextDesign.LARGER_SCREENING: "take a larger screening design: more dummy columns measure the error",
    NextDesign.CENTRE_POINTS: "add centre points, or a larger design with dummy columns: they show what hides",
}


def choose(question: Question) -> tuple[NextDesign, str]:
    """The next design, and a sentence of advice.

    A fill once it is certain who acts and affordable; a foldover where only interactions are in the way, as
    centre points tell; a definitive screening design where squares may be in the way as well.
    """
    chosen = _choose(question)
    return chosen, ADVICE[chosen]


def _choose(q: Question) -> NextDesign:
    if q.status == "adequate":
        return NextDesign.NONE
    if q.status == "unknown":
        return NextDesign.CENTRE_POINTS
    if q.status == "aliased":
        return NextDesign.FOLDOVER
    if q.crowded and not q.interactions:
        return NextDesign.LARGER_SCREENING
    if q.few and (q.settled or (q.curved and not q.interactions)):
        return NextDesign.QUADRATIC_FILL
    if q.interactions and q.curved is False and not q.settled:
        return NextDesign.FOLDOVER
    return NextDesign.DEFINITIVE_SCREENING

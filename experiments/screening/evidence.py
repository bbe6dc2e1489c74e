"""What dummy columns and centre points of one response say about interactions and curvature."""

from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from scipy.special import stdtrit

from .contrasts import Effects
from .judgement import Judgement

MARGIN_OF_FLOOR = 10.0
"""How many noise floors a contrast must exceed to be called a movement."""

ROUNDING = 1e-13
"""Differences below this fraction of the largest response are rounding of double precision."""


class AdequacyStatus(StrEnum):
    """Whether main effects tell who acts."""

    ADEQUATE = "adequate"
    INADEQUATE = "inadequate"
    UNDECIDED = "undecided"
    ALIASED = "aliased"
    UNKNOWN = "unknown"


@dataclass(frozen=True)
class ResponseAdequacy:
    """What hides behind the main effects of one response.

    Parameters
    ----------
    response : str
        Its name.
    status : AdequacyStatus
        ``inadequate`` if dummy columns or curvature carry more than noise, ``undecided`` if the response moves and
        no factor stands out, ``aliased`` if a factor that acts is wholly aliased with an interaction of two others
        that act, ``unknown`` if the design has nothing that could tell.
    hidden : float
        Share of the standard deviation over the two-level runs that main effects leave, 0 to 1.
    curvature : float
        Difference of the centre from the two-level runs, over their standard deviation; NaN without centre points.
    loud_dummies : tuple of str
        Dummy columns that carry more than noise.
    curved : bool or None
        Whether the centre points show curvature; None without centre points.
    reasons : tuple of str
        Why, one sentence each.
    """

    response: str
    status: AdequacyStatus
    hidden: float
    curvature: float
    loud_dummies: tuple[str, ...]
    curved: bool | None
    reasons: tuple[str, ...]


def look(effects: Effects, j: int, judgement: Judgement, tolerance: float) -> ResponseAdequacy:
    """What hides behind the main effects of response `j`; shares below `tolerance` are let pass."""
    name, floor = effects.responses[j].name, judgement.noise_floor
    largest, rounding = float(np.abs(effects.values[:, j]).max(initial=0.0)), ROUNDING * float(effects.magnitude[j])
    moves = largest > max(MARGIN_OF_FLOOR * floor, rounding)
    hidden = _hidden_share(effects, j) if moves else 0.0
    loud = _loud_dummies(effects, j, judgement) if hidden > tolerance else ()
    share, curved = _curvature(effects, j, judgement, tolerance, rounding)
    reasons = []
    if loud:
        shown = ", ".join(loud[:4]) + (f" and {len(loud) - 4} more" if len(loud) > 4 else "")
        reasons.append(f"main effects leave {hidden:.1%} of the standard deviation, dummy columns carry it ({shown})")
    if curved:
        size = f"{abs(share):.1%} of their standard deviation" if moves else "by more than noise"
        reasons.append(f"the centre lies {size} off the mean of the other runs")
    status = AdequacyStatus.INADEQUATE if reasons else AdequacyStatus.ADEQUATE
    if not reasons and moves and not judgement.active[: effects.n_factors].any():
        status = AdequacyStatus.UNDECIDED
        reasons.append("it moves, yet no factor stands out: noise, or interactions as large as the main effects")
    elif not reasons and (mixed := _aliased(effects, judgement)):
        status = AdequacyStatus.ALIASED
        reasons.append(f"all of them act, yet these cannot be told apart: {mixed}")
    elif not reasons and moves and not effects.is_dummy.any() and curved is None:
        status = AdequacyStatus.UNKNOWN
        reasons.append("the design has neither dummy columns nor centre points, so nothing hidden could show")
    return ResponseAdequacy(name, status, hidden, share, loud, curved, tuple(reasons))


def _aliased(effects: Effects, judgement: Judgement) -> str:
    """Factors that act and are wholly aliased with an interaction of two others that act: ``C = A:B``.

    An interaction of a factor without a main effect is as well hidden, but rarer: Chipman (1996), "Bayesian variable
    selection with related predictors", Canad. J. Statist. 24, 17–36, on heredity.
    """
    factors = effects.names[: effects.n_factors]
    acting = set(judgement.active_names)
    found = []
    for name, aliases in zip(factors, effects.aliases, strict=False):
        pairs = [term for term in aliases.split() if ":" in term and acting.issuperset(term.split(":"))]
        if name in acting and pairs:
            found.append(" = ".join([name, *pairs]))
    return ", ".join(found[:4]) + (f" and {len(found) - 4} more" if len(found) > 4 else "")


def _hidden_share(effects: Effects, j: int) -> float:
    """Standard deviation that main effects leave over all of it: each effect c adds c²/4 to the variance."""
    total = float(effects.spread[j]) ** 2
    if effects.holes is not None:
        return min(float(effects.holes.left[j]) / float(effects.spread[j]), 1.0) if total > 0.0 else 0.0
    explained = 0.25 * float((effects.values[: effects.n_factors, j] ** 2).sum())
    return float(np.sqrt(max(total - explained, 0.0) / total)) if total > 0.0 else 0.0


def _loud_dummies(effects: Effects, j: int, judgement: Judgement) -> tuple[str, ...]:
    """Dummies beyond the simultaneous margin, or beyond the noise where that is known; the loudest first."""
    sizes = np.abs(effects.values[:, j])
    loud = effects.is_dummy & (sizes > judgement.sme)
    if judgement.noise_floor > 0.0:
        # Interactions spread over all columns inflate the margin itself; a known floor is not deceived.
        loud |= effects.is_dummy & (sizes > MARGIN_OF_FLOOR * judgement.noise_floor)
    return tuple(effects.names[i] for i in np.argsort(-sizes, kind="stable") if loud[i])


def _curvature(
    effects: Effects, j: int, judgement: Judgement, tolerance: float, rounding: float
) -> tuple[float, bool | None]:
    """Curvature over the standard deviation of the two-level runs, and whether it is more than noise."""
    centre, spread, n = effects.centre, float(effects.spread[j]), effects.mean_runs
    if centre is None:
        return float("nan"), None
    bend, repeated = float(centre.curvature[j]), float(centre.pure_error[j])
    share = bend / spread if spread > rounding else float(np.copysign(np.inf, bend) if abs(bend) > rounding else 0.0)
    # An effect's standard error is 2σ/√n, so one run's is √n/2 times that.
    per_run = 0.5 * np.sqrt(effects.n_runs)
    if repeated > 0.0:
        limit = centre.standard_error(repeated, n) * float(stdtrit(centre.n_runs - 1, 1.0 - 0.5 * judgement.alpha))
    elif judgement.noise_floor > 0.0:
        limit = 0.0
    else:
        limit = centre.standard_error(per_run * judgement.me, n)
    limit = max(limit, rounding, centre.standard_error(per_run * MARGIN_OF_FLOOR * judgement.noise_floor, n))
    return share, bool(abs(bend) > limit and abs(share) > tolerance)

"""Is screening adequate, or do interactions and curvature hide behind the main effects? If so, what to run next."""

from dataclasses import dataclass

import numpy as np

from .contrasts import Effects
from .evidence import AdequacyStatus, ResponseAdequacy, look
from .judgement import Judgement
from .next_design import NextDesign, Question, choose

WORST_FIRST = (
    AdequacyStatus.INADEQUATE,
    AdequacyStatus.UNDECIDED,
    AdequacyStatus.ALIASED,
    AdequacyStatus.UNKNOWN,
    AdequacyStatus.ADEQUATE,
)


@dataclass(frozen=True)
class Adequacy:
    """Whether the screening suffices, and the next design if not: data that a pipeline can follow.

    Parameters
    ----------
    status : AdequacyStatus
        The worst of the responses'.
    responses : tuple of ResponseAdequacy
        One per response.
    reasons : tuple of str
        Why it does not suffice, one sentence each; empty if it does.
    next_design : NextDesign
        What to run next; ``none`` if the screening suffices.
    keep : tuple of str
        Factors that the next design must vary: dropping another one is safe.
    advice : str
        The next design in a sentence; empty if the screening suffices.
    """

    status: AdequacyStatus
    responses: tuple[ResponseAdequacy, ...]
    reasons: tuple[str, ...]
    next_design: NextDesign
    keep: tuple[str, ...]
    advice: str

    @property
    def adequate(self) -> bool:
        """Whether main effects can be trusted to tell who acts."""
        return self.status is AdequacyStatus.ADEQUATE


def judge_adequacy(
    effects: Effects, judgements: tuple[Judgement, ...], tolerance: float = 0.01, most_factors: int = 8
) -> Adequacy:
    """Look at dummy columns and centre points of every response.

    Parameters
    ----------
    effects : Effects
        All contrasts of the design.
    judgements : tuple of Judgement
        One per response.
    tolerance : float
        What may hide, as a share of the standard deviation over the runs: less than this is let pass.
    most_factors : int
        Most factors for which a quadratic fill, (k + 1)(k + 2)/2 terms, is affordable.

    Raises
    ------
    ValueError
        If `tolerance` is negative or not finite.

    Notes
    -----
    Box and Hunter (1961), "The 2^(k−p) fractional factorial designs", Technometrics 3, 311–351: two-factor
    interactions show in the columns they are aliased with, and a foldover frees the main effects of them.
    Squares are constant on two levels and show only against centre points, where those of opposite sign cancel.
    No result tells an interaction from a main effect that it is wholly aliased with: ``Effects.aliases`` names them.
    """
    if not (np.isfinite(tolerance) and tolerance >= 0.0):
        raise ValueError(f"tolerance must be 0 or a positive number, got {tolerance}")
    found = tuple(look(effects, j, judgement, tolerance) for j, judgement in enumerate(judgements))
    status = min((r.status for r in found), key=WORST_FIRST.index, default=AdequacyStatus.ADEQUATE)
    factors = effects.names[: effects.n_factors]
    active = {name for judgement in judgements for name in judgement.active_names}
    clear = effects.clear
    keep = _kept(effects, found, judgements, heredity=clear and len(factors) > most_factors)
    bends = [r.curved for r in found if r.curved is not None]
    following, advice = choose(
        Question(
            status=str(status),
            interactions=any(r.loud_dummies for r in found),
            curved=any(bends) if bends else None,
            settled=clear or active.issuperset(factors),
            crowded=any(j.crowded and j.error_from == "contrasts" for j in judgements),
            few=len(keep) <= most_factors,
        )
    )
    reasons = tuple(f"{r.response}: {reason}" for r in found for reason in r.reasons)
    return Adequacy(status, found, reasons, following, keep, advice)


def unjudged(effects: Effects, judgements: tuple[Judgement, ...]) -> tuple[str, ...]:
    """Factors that do not act by a margin that holes have widened, and would act with this effect in the whole design.

    All of them where nothing is left that measures the error. Dropping one would be a guess.
    """
    holes, factors = effects.holes, effects.names[: effects.n_factors]
    if holes is None or holes.orthogonal:
        return ()
    if holes.blind:
        return factors
    found = set()
    for j, judgement in enumerate(judgements):
        large = np.abs(effects.values[: len(factors), j]) > judgement.me
        found |= {i for i in np.flatnonzero(large & ~judgement.active[: len(factors)])}
    return tuple(name for i, name in enumerate(factors) if i in found)


def _kept(
    effects: Effects, found: tuple[ResponseAdequacy, ...], judgements: tuple[Judgement, ...], heredity: bool
) -> tuple[str, ...]:
    """Factors that act, or that a loud column names; all of them where none can be ruled out.

    With `heredity` interactions are sought among active factors only: Hamada and Wu (1992), "Analysis of designed
    experiments with complex aliasing", J. Quality Technology 24, 130–137.
    """
    factors = effects.names[: effects.n_factors]
    loud = {name for r in found for name in r.loud_dummies}
    # An unnamed column carries a little of every interaction, and so may a square that only the centre shows.
    unnamed = any(":" not in name for name in loud) and not heredity
    # Nor does a column that stands in for others tell which of them is loud.
    unnamed |= bool(loud) and effects.holes is not None and not effects.holes.orthogonal
    if unnamed or any(r.curved or r.status is AdequacyStatus.UNDECIDED for r in found):
        return factors
    wanted = {name for judgement in judgements for name in judgement.active_names}
    wanted |= set(unjudged(effects, judgements))
    wanted |= {factor for name in loud if ":" in name for factor in name.split(":")}
    return tuple(name for name in factors if name in wanted)

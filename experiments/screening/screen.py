"""The whole screening step: effects of every response, judged by Lenth's method."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..runs import Runs
from .adequacy import Adequacy, judge_adequacy, unjudged
from .contrasts import Effects, effects
from .evidence import MARGIN_OF_FLOOR
from .holes import Holes
from .lenth import LenthResult, lenth
from .noise import effect_error


@dataclass(frozen=True, eq=False)
class Screening:
    """What a screening design says.

    Parameters
    ----------
    effects : Effects
        All contrasts, n_contrasts × n_responses.
    lenth : tuple of LenthResult
        One per response; where runs are lost, of the standardised contrasts.
    """

    effects: Effects
    lenth: tuple[LenthResult, ...]

    @property
    def active(self) -> NDArray[np.bool_]:
        """Which contrasts act on which responses, shape (n_contrasts, n_responses)."""
        return np.column_stack([result.active for result in self.lenth])

    @property
    def active_factors(self) -> tuple[str, ...]:
        """Factors that act on at least one response."""
        acts = np.atleast_1d(self.active[: self.effects.n_factors].any(axis=1))
        return tuple(n for n, a in zip(self.effects.names, acts, strict=False) if a)

    def active_on(self, response: str) -> tuple[str, ...]:
        """Factors that act on the named response."""
        names = [r.name for r in self.effects.responses]
        if response not in names:
            raise ValueError(f"unknown response {response!r}; known are {', '.join(names)}")
        factors = set(self.effects.names[: self.effects.n_factors])
        return tuple(n for n in self.lenth[names.index(response)].active_names if n in factors)

    @property
    def holes(self) -> Holes | None:
        """What failed runs cost; None if none failed."""
        return self.effects.holes

    @property
    def unjudged(self) -> tuple[str, ...]:
        """Factors that do not act only because runs are missing; see :func:`~.adequacy.unjudged`."""
        return unjudged(self.effects, self.lenth)

    @property
    def undecided(self) -> tuple[str, ...]:
        """Responses that move by more than their noise floor although no factor stands out.

        Interactions as large as the main effects do that: they fill the dummy columns from which the
        error is estimated. So do more active contrasts than Lenth's method can bear.
        """
        found = []
        for response, result in zip(self.effects.responses, self.lenth, strict=True):
            moves = np.abs(result.contrasts).max() > MARGIN_OF_FLOOR * result.noise_floor
            if moves and not self.active_on(response.name):
                found.append(response.name)
        return tuple(found)

    @property
    def flagged_dummies(self) -> dict[str, tuple[str, ...]]:
        """Dummy columns beyond the margin of error, by response: interactions of factors show there.

        Curvature does not: on two levels a square is constant.
        """
        found = {}
        for response, result in zip(self.effects.responses, self.lenth, strict=True):
            flagged = result.active & self.effects.is_dummy
            if flagged.any():
                found[response.name] = tuple(self.effects.names[i] for i in np.flatnonzero(flagged))
        return found

    def adequacy(self, tolerance: float = 0.01, most_factors: int = 8) -> Adequacy:
        """Whether main effects suffice, and the next design if not; see :func:`~.adequacy.judge_adequacy`."""
        return judge_adequacy(self.effects, self.lenth, tolerance, most_factors)


def screen(
    runs: Runs,
    alpha: float = 0.05,
    resolution: float = 0.0,
    noise: ArrayLike | None = None,
    critical: str = "t",
) -> Screening:
    """Effects and Lenth's verdict for every response.

    Parameters
    ----------
    runs : Runs
        An orthogonal two-level design, with or without centre points. Runs may have failed: main effects are then
        least squares on the others, judged by their standard errors, and ``holes`` says what that costs.
    alpha : float
        Error rate of the margins.
    resolution : float
        Relative resolution of the oracle: differences below this fraction of a response's largest
        value are rounding, not physics. Sets each response's noise floor.
    noise : array_like, shape (n_responses,), optional
        Standard deviation of one run, SI, declared or from :mod:`.noise`. Raises the floor to the standard error of
        an effect, 2σ/√n.
    critical : str
        ``"t"`` or ``"simulated"``, as for :func:`~.lenth.lenth`.

    Raises
    ------
    ValueError
        See :func:`effects` and :func:`lenth`; or if `noise` is not one number of 0 or more for each response.
    TooManyHoles
        If too many runs failed, or the wrong ones; it names those to run again.

    Notes
    -----
    With holes, Lenth's method is given the effects over the root of their inflation and the contrasts that stand in
    for the dummies (:func:`~.regression.error_columns`), all of variance 4σ²/n. The latter are uncorrelated with each
    other and with the effects; the effects keep some correlation among themselves, which ``holes`` states.
    """
    found = effects(runs)
    floor = resolution * found.magnitude
    if noise is not None:
        declared = np.asarray(noise, dtype=float)
        if declared.shape != floor.shape or not (np.isfinite(declared).all() and (declared >= 0.0).all()):
            raise ValueError(f"noise needs a number of 0 or more for each of {len(floor)} responses, got {noise!r}")
        floor = np.maximum(floor, effect_error(declared, found.n_runs))
    contrasts = found.standardised
    results = tuple(
        lenth(contrasts[:, j], found.names, alpha, float(floor[j]), critical=critical, dummies=found.is_dummy)
        for j in range(len(found.responses))
    )
    if found.holes is not None and not found.holes.orthogonal:
        results = tuple(replace(result, scaled=True) for result in results)
    return Screening(found, results)

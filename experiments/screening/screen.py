"""The whole screening step: effects of every response, judged by Lenth's method."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..runs import Runs
from .contrasts import Effects, effects
from .lenth import LenthResult, lenth

MARGIN_OF_FLOOR = 10.0
"""How many noise floors a contrast must exceed to be called a movement."""


@dataclass(frozen=True, eq=False)
class Screening:
    """What a screening design says.

    Parameters
    ----------
    effects : Effects
        All contrasts, n_contrasts × n_responses.
    lenth : tuple of LenthResult
        One per response.
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


def screen(runs: Runs, alpha: float = 0.05, resolution: float = 0.0) -> Screening:
    """Effects and Lenth's verdict for every response.

    Parameters
    ----------
    runs : Runs
        A complete orthogonal two-level design.
    alpha : float
        Error rate of the margins.
    resolution : float
        Relative resolution of the oracle: differences below this fraction of a response's largest
        value are rounding, not physics. Sets each response's noise floor.

    Raises
    ------
    ValueError
        See :func:`effects` and :func:`lenth`.
    """
    found = effects(runs)
    results = tuple(
        lenth(found.values[:, j], found.names, alpha, resolution * float(found.magnitude[j]))
        for j in range(len(found.responses))
    )
    return Screening(found, results)

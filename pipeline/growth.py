"""Growing a study until its required error holds: terms first, which cost nothing, then runs, up to a budget.

Rounds are steered by the leave-one-out error of the runs that were paid for. Validation runs are a judge, not a
teacher: they are looked at for the study as configured, then only when the requirement is expected to hold or nothing
more can be done, and every look takes fresh ones. A look teaches one thing: how many times the leave-one-out error the
largest error on fresh runs is.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from experiments.designs import Design
from experiments.runs import Runs
from surrogates import Surrogate
from surrogates.candidates import AUTO, BETTER

from . import stages
from .rounds import BUDGET, MET, RUNS, STALLED, TERMS, UNTRUE, Round
from .sections import FitTable
from .stages import Fitted
from .study import Study, highest_degree

USUAL, LARGEST = 3.0, 10.0
"""The largest of 1000 errors on fresh runs over the leave-one-out RMSE, both over the range: mostly 2 to 5, and at most
9.3, in the fits of docs/methods.md. No less than `USUAL` is expected, no more than `LARGEST` after a first look."""

ROUNDING = 1e-16
"""Leave-one-out errors below it are none."""

PATIENCE = 2
"""Additions in a row that do not lower the leave-one-out error to `BETTER` of it before no more are made."""


class Steps(Protocol):
    """What a study does each time that it is fitted, judged or gets on: the part that runs and writes."""

    def fit(self, kept: tuple[str, ...], design: Design, choices: Sequence[FitTable]) -> tuple[Runs, Fitted]:
        """Run `design`, and fit it in the best of the ways."""
        ...

    def judge(self, model: Surrogate, look: int) -> tuple[Surrogate, Runs]:
        """The model with its errors on fresh runs, never looked at before, and those runs."""
        ...

    def note(self, rounds: Sequence[Round]) -> None:
        """Keep the rounds so far."""
        ...


@dataclass(frozen=True, eq=False)
class Grown:
    """The end of it: the runs of the last round, its model with errors on fresh runs, and how it came about."""

    fit_runs: Runs
    fitted: Fitted
    model: Surrogate
    validation_runs: Runs
    rounds: tuple[Round, ...]


@dataclass(frozen=True, eq=False)
class _Look:
    """One look at fresh runs: errors and leave-one-out errors over the range, (n_responses,), and the runs fitted."""

    errors: NDArray[np.float64]
    loo: NDArray[np.float64]
    n_runs: int

    @property
    def ratios(self) -> NDArray[np.float64]:
        """How many times the leave-one-out error the largest error is; at least the usual."""
        return np.clip(self.errors / np.maximum(self.loo, ROUNDING), USUAL, 1.0 / ROUNDING)

    @property
    def worst_ratio(self) -> float:
        """That of the response with the largest error."""
        return float(self.ratios[int(np.argmax(self.errors))])


def grow(study: Study, kept: tuple[str, ...], fill: Design, steps: Steps) -> Grown:
    """Fit and judge a study; where its config has a budget, add terms and then runs until what it requires holds.

    Parameters
    ----------
    study : Study
    kept : tuple of str
        Factors to fit on.
    fill : Design
        The filling design as configured.
    steps : Steps

    Notes
    -----
    Everything follows from the config, its seed and the oracle's answers, so that a study that was stopped ends as if
    it had not been.
    """
    fit, most = study.config.fit, study.config.require.max_runs
    growth = _Growth(study, kept, steps)
    growth.fit("as configured", fill, [fit])
    growth.look()
    if most is None or growth.met:
        return growth.grown(MET if growth.met else "")
    wide = wider(fit)
    choices = [fit] if wide == fit else [fit, wide]
    if len(choices) > 1:
        growth.then(TERMS)
        growth.fit(TERMS, fill, choices)
        if growth.is_hopeful:
            growth.look()
    return growth.grown(MET if growth.met else _added(growth, fill, choices))


def _added(growth: "_Growth", fill: Design, choices: Sequence[FitTable]) -> str:
    """Add runs until the requirement holds; gives why no more were added."""
    study, stalls, best, design = growth.study, 0, growth.loo, fill
    for number, n_runs in enumerate(study.sizes(len(fill)), start=1):
        growth.then(RUNS)
        added = n_runs - len(design)
        design = stages.grown_design(study, growth.kept, design, n_runs, number)
        growth.fit(f"{added} runs added", design, choices)
        stalls = 0 if growth.loo < BETTER * best else stalls + 1
        best = min(best, growth.loo)
        if growth.is_hopeful or stalls == PATIENCE:
            growth.look()
        if growth.met:
            return MET
        if growth.is_untrue:
            return UNTRUE
        if stalls == PATIENCE:
            return STALLED
    growth.look()
    return MET if growth.met else BUDGET


class _Growth:
    """Rounds so far, the last fit, and what was seen of fresh runs."""

    def __init__(self, study: Study, kept: tuple[str, ...], steps: Steps) -> None:
        self.study, self.kept, self.steps = study, kept, steps
        self.rounds: list[Round] = []
        self.looks: list[_Look] = []
        self.required = study.config.require.max_relative_error
        self.runs: Runs | None = None
        self.fitted: Fitted | None = None
        self.judged: tuple[Surrogate, Runs] | None = None
        """The last fit with its errors, and their runs; None until it is looked at."""

    def fit(self, step: str, design: Design, choices: Sequence[FitTable]) -> None:
        """Another round."""
        before, runs = self.fitted, self.runs
        self.runs, self.fitted = self.steps.fit(self.kept, design, choices)
        same = before is not None and runs is not None and len(runs) == len(design) and before.fit == self.fitted.fit
        # The same fit of the same runs was judged already.
        self.judged = self.judged if same else None
        degree = int(self.fitted.model.terms.degrees.max(initial=0))
        self.rounds.append(
            Round(
                len(self.rounds), f"{step}: none better" if same else step, len(design), degree,
                self.fitted.fit.selection if self.fitted.fit.trim else "none", self.loo, self.expected,
                self.rounds[-1].error if same else None, "",
            )
        )  # fmt: skip
        self._note()

    def look(self) -> None:
        """Judge the last fit on fresh runs, unless it was."""
        if self.judged is not None:
            return
        assert self.fitted is not None
        self.judged = self.steps.judge(self.fitted.model, len(self.looks))
        errors = np.array([error.max_relative for error in self.judged[0].validation])
        self.looks.append(_Look(errors, self.fitted.loo, self.rounds[-1].runs))
        self.rounds[-1] = replace(self.rounds[-1], error=float(errors.max()))
        self._note()

    def then(self, what: str) -> None:
        """What follows the last round."""
        self.rounds[-1] = replace(self.rounds[-1], then=what)
        self._note()

    def grown(self, end: str) -> Grown:
        """The end; `end` says why."""
        self.then(end)
        assert self.runs is not None
        assert self.fitted is not None
        assert self.judged is not None
        return Grown(self.runs, self.fitted, *self.judged, tuple(self.rounds))

    @property
    def loo(self) -> float:
        """Leave-one-out RMSE over the range, of the response where it is largest."""
        return float(self.fitted.loo.max()) if self.fitted else np.inf

    @property
    def expected(self) -> float | None:
        """Largest error over the range to be expected of the last fit on fresh runs."""
        if not self.looks or self.fitted is None:
            return None
        ratios = self.looks[-1].ratios
        # One look, at the study as configured, may have seen what is no longer so.
        ratios = np.minimum(ratios, LARGEST) if len(self.looks) == 1 else ratios
        return float(np.max(ratios * self.fitted.loo))

    @property
    def is_hopeful(self) -> bool:
        """Whether the requirement is expected to hold."""
        return self.expected is not None and self.required is not None and self.expected <= self.required

    @property
    def met(self) -> bool:
        """Whether the requirement was seen to hold."""
        if self.judged is None or self.required is None:
            return False
        return all(error.max_relative <= self.required for error in self.judged[0].validation)

    @property
    def is_untrue(self) -> bool:
        """Whether added runs left errors on fresh runs as they were, beyond what leaving runs out tells of."""
        if len(self.looks) < 2:
            return False
        before, last = self.looks[-2:]
        return (
            before.n_runs < last.n_runs
            and min(before.worst_ratio, last.worst_ratio) > LARGEST
            and float(last.errors.max()) >= BETTER * float(before.errors.max())
        )

    def _note(self) -> None:
        if self.study.config.require.max_runs is not None:
            self.steps.note(self.rounds)


def wider(fit: FitTable) -> FitTable:
    """The widest choice of terms: every degree, all candidates at once by evidence."""
    wide = {"degree": AUTO, "highest_degree": highest_degree(fit), "selection": "evidence", "trim": True}
    return fit.model_copy(update={**wide, "basis": None, "heredity": "none"})

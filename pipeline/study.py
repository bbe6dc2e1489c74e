"""A study: a config resolved into the objects that the stages work with."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from math import ceil
from typing import Any, TypeVar

import numpy as np

from experiments import designs, oracles
from experiments.designs import Design, DesignMethod
from experiments.factors import FactorSpace
from experiments.oracles import Oracle
from experiments.screening import count_contrasts
from experiments.terms import Terms
from surrogates import Surrogate, exports
from surrogates.stepwise import FULLEST, check_selection

from .config import Config
from .errors import InputError

T = TypeVar("T")

STAGES = ("screening", "fit", "validation", "inversion")
"""Stages that run the oracle, in order; each has a folder of its own and a seed of its own."""


@dataclass(frozen=True, eq=False)
class Study:
    """Everything a config names, found and checked; made by :func:`resolve`.

    Parameters
    ----------
    config : Config
    oracle : Oracle
    space : FactorSpace
        All factors of the oracle, with the config's ranges.
    screening_design : Design
    export_prefix : str
    """

    config: Config
    oracle: Oracle
    space: FactorSpace
    screening_design: Design
    export_prefix: str

    def fill_method(self, n_factors: int) -> DesignMethod:
        """The filling design's method, sized for `n_factors` factors that act."""
        fit = self.config.fit
        wanted = fit.runs_per_term * len(self.candidates(n_factors))
        return designs.get(fit.design.method, fit.design.settings, at_least=wanted)

    @cached_property
    def folded_screening(self) -> Design | None:
        """The screening design with its foldover; None if the config does not allow it, or the design has none."""
        chosen = self.config.screening.design
        if not self.config.screening.follow or chosen.settings.get("foldover"):
            return None
        method = designs.get(chosen.method, {**chosen.settings, "foldover": True})
        return method.generate(self.space, self.seed("screening"))

    def candidates(self, n_factors: int) -> Terms:
        """Candidate terms for that many factors."""
        names = [f"x{i}" for i in range(n_factors)]
        return Terms.polynomial(names, self.config.fit.degree, self.config.fit.interactions)

    def fewest_runs(self, n_factors: int) -> int:
        """Runs below which no polynomial of the config can be fitted in that many factors.

        As many as candidates; for forward selection as many as let all linear terms enter.
        """
        if self.config.fit.trim and self.config.fit.selection == "forward":
            return ceil((n_factors + 1) / FULLEST)
        return len(self.candidates(n_factors))

    def seed(self, stage: str) -> np.random.SeedSequence:
        """The seed of one stage; streams are independent, so changing one stage leaves the others alone."""
        return _seed(self.config, stage)


def resolve(config: Config) -> Study:
    """Find and check everything that `config` names; runs nothing and touches nothing.

    Raises
    ------
    InputError
        With one sentence that says which table is wrong, what came and what is allowed.
    """
    oracle = _checked("oracle", lambda: oracles.get(config.oracle.name, **config.oracle.parameters))
    _checked("oracle.parameters", oracle.prepare)
    space = _checked("factors", lambda: _space(config, oracle))
    screening = config.screening
    method = _checked("screening.design", lambda: designs.get(screening.design.method, screening.design.settings))
    design = _checked("screening.design", lambda: method.generate(space, _seed(config, "screening")))
    try:
        n_contrasts = count_contrasts(design)
    except ValueError as error:
        named = f"screening.design: {screening.design.method!r} is not a two-level design that can be screened with"
        raise InputError(f"{named} ({error}); use 'plackett_burman'") from None
    if n_contrasts < 3:
        raise InputError(
            "screening.design: Lenth's method needs at least 3 contrasts, dummies and products included; use more runs"
        )
    for name in screening.keep:
        _checked("screening.keep", lambda name=name: space.index(name))
    study = Study(config, oracle, space, design, config.export.prefix or config.name)
    _checked("screening.follow", lambda: study.folded_screening)
    _checked("fit", lambda: check_selection(config.fit.selection, config.fit.heredity))
    _check_gradients(study)
    _check_fill(study)
    _check_exports(study)
    return study


def _seed(config: Config, stage: str) -> np.random.SeedSequence:
    return np.random.SeedSequence(config.seed, spawn_key=tuple(stage.encode()))


def _space(config: Config, oracle: Oracle) -> FactorSpace:
    for name, table in config.factors.items():
        unit = oracle.factors.factors[oracle.factors.index(name)].unit
        if table.unit is not None and table.unit != unit:
            raise ValueError(f"factor {name!r} is in {unit!r}, not {table.unit!r}")
    return oracle.factors.with_ranges({n: (t.low, t.high) for n, t in config.factors.items()})


def _check_fill(study: Study) -> None:
    """Refuse a filling design that cannot carry the candidate terms."""
    n_factors = len(study.space)
    method: Any = _checked("fit.design", lambda: study.fill_method(n_factors))
    levels = getattr(method, "levels", None)
    if isinstance(levels, int):
        check_levels(study.config, levels)
    if method.n_runs is not None:
        check_runs(study, n_factors, method.n_runs)


def _check_gradients(study: Study) -> None:
    """Refuse gradients that the oracle does not give or the selection does not take."""
    fit = study.config.fit
    if not fit.gradients:
        return
    if fit.selection != "forward" or not fit.trim:
        raise InputError("fit.gradients needs fit.selection = 'forward' and fit.trim = true")
    if not hasattr(study.oracle, "jacobian"):
        raise InputError(f"fit.gradients: the oracle {study.oracle.name!r} gives no Jacobian; leave it false")


def check_runs(study: Study, n_factors: int, n_runs: int) -> None:
    """Refuse a filling design with fewer runs than candidate terms."""
    needed = study.fewest_runs(n_factors)
    if n_runs < needed and study.config.fit.selection == "forward":
        raise InputError(
            f"fit.design: {n_runs} runs are too few for a forward selection in {n_factors} factors; use n_runs = "
            f"{needed} or more"
        )
    if n_runs < needed:
        raise InputError(
            f"fit.design: {n_runs} runs are fewer than the {needed} terms of a degree-{study.config.fit.degree} "
            f"polynomial in {n_factors} factors; use n_runs = {needed} or more, a lower fit.degree, "
            "fit.interactions = false, or leave n_runs out to have it sized from the factors that act"
        )


def check_levels(config: Config, levels: int) -> None:
    """Refuse a filling design whose factors take too few levels for the degree."""
    if levels <= config.fit.degree:
        raise InputError(
            f"fit.design: {levels} levels cannot show a degree of {config.fit.degree}; use {config.fit.degree + 1} "
            f"levels or more (method = 'uniform', levels = {config.fit.degree + 1}), or a lower fit.degree"
        )


def _check_exports(study: Study) -> None:
    """Refuse unknown targets, and a prefix that a target's language does not allow, before anything runs."""
    terms = Terms.polynomial(study.space.names, 1)
    nothing = np.zeros((len(terms), len(study.oracle.responses)))
    blank = Surrogate(study.space, study.oracle.responses, terms, nothing)
    for name in study.config.export.targets:
        target = _checked("export.targets", lambda name=name: exports.get(name))
        _checked("export.prefix", lambda target=target: target.render(blank, study.export_prefix))


def _checked(where: str, make: Callable[[], T]) -> T:
    try:
        return make()
    except ValueError as error:
        raise InputError(f"{where}: {error}") from None

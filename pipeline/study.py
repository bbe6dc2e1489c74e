"""A study: a config resolved into the objects that the stages work with."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from math import ceil, comb
from pathlib import Path
from typing import Any, NoReturn, TypeVar

import numpy as np

from experiments import designs, oracles
from experiments.designs import Design, DesignMethod, DOptimal, Halton, LatinHypercube, Random, Sobol, Uniform
from experiments.designs.uniform import MOST_RUNS
from experiments.factors import FactorSpace
from experiments.oracles import Oracle
from experiments.screening import count_contrasts
from experiments.terms import Terms
from surrogates import Surrogate, commanding, exports
from surrogates.candidates import AUTO
from surrogates.choosing import TAUGHT, Choice, natural_basis
from surrogates.stepwise import FULLEST

from .config import Config, FitTable
from .errors import InputError

T = TypeVar("T")

QUADRATIC = 2
"""Degree by whose terms a filling design is sized where the degree is to be chosen."""

GROWTH, NEARLY = 1.5, 1.2
"""A fit grows to so many times its runs, or at once to the most allowed if that is less than `NEARLY` times as many."""

ROOMY = 2
"""Settings of a grid for every run that a growing design may have; with fewer it would repeat itself."""

SEQUENCES = (Sobol, Halton, Random)
"""Designs of which a longer one begins with the shorter one."""

UNSCREENED = (*SEQUENCES, LatinHypercube, Uniform, DOptimal)
"""Designs whose columns are not orthogonal by construction: not even generated for a screening, some take minutes."""

MOST_SCREENED, MOST_CANDIDATES = 4096, 50_000
"""Runs of a screening and candidate terms of a fit: a config with more is a slip, or wants to fill the memory."""

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
        wanted = fit.runs_per_term * self.count_candidates(n_factors)
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
        """Candidate terms for that many factors; those of a quadratic where the degree is to be chosen."""
        names = [f"x{i}" for i in range(n_factors)]
        degree = self.config.fit.degree
        return Terms.polynomial(names, QUADRATIC if degree == AUTO else int(degree), self.config.fit.interactions)

    def count_candidates(self, n_factors: int) -> int:
        """How many terms :meth:`candidates` has; ``ValueError`` if there are too many to be written down."""
        degree, interactions = self.config.fit.degree, self.config.fit.interactions
        degree = QUADRATIC if degree == AUTO else int(degree)
        count = comb(n_factors + degree, degree) if interactions else 1 + n_factors * degree
        if count > MOST_CANDIDATES:
            raise ValueError(
                f"a degree-{degree} polynomial in {n_factors} factors has {count} terms, at most {MOST_CANDIDATES} are "
                "considered; use a lower fit.degree, fit.interactions = false or fewer factors"
            )
        return count

    def fewest_runs(self, n_factors: int, fit: FitTable | None = None) -> int:
        """Runs below which no polynomial of the config, or of `fit`, can be fitted in that many factors.

        As many as let all linear terms enter; for backward selection, which starts from all, as many as candidates.
        """
        fit = fit or self.config.fit
        if fit.degree == AUTO or (fit.trim and fit.selection != "backward"):
            return ceil((n_factors + 1) / FULLEST)
        return self.count_candidates(n_factors)

    def sizes(self, first: int) -> tuple[int, ...]:
        """Runs in all after each addition to a filling design of `first` runs; empty if it does not grow.

        Multiples of the design's levels, so that they stay in balance, but for the last.
        """
        levels = self.config.fit.design.settings.get("levels", Uniform.levels)
        levels = levels if self.config.fit.design.method == Uniform.method else 1
        found, n, most = [], first, self.config.require.max_runs or 0
        while n < most:
            n = ceil(GROWTH * n / levels) * levels
            n = n if NEARLY * n < most else most
            found.append(n)
        return tuple(found)

    @property
    def most_looks(self) -> int:
        """How often fresh validation runs may be needed: once, or as often as the fit may change."""
        if self.config.require.max_runs is None:
            return 1
        smallest: Any = self.fill_method(1)
        return 2 + len(self.sizes(smallest.n_runs))

    def finest(self, method: Uniform, n_factors: int) -> int:
        """Levels that a growing uniform design needs: old ones stay, and new ones come between where there are too few.

        They must show the highest degree, and must not run out of settings.
        """
        highest, levels = highest_degree(self.config.fit), method.levels
        while levels <= highest or levels**n_factors < ROOMY * (self.config.require.max_runs or 0):
            levels = 2 * levels - 1
        return levels

    def seed(self, stage: str, number: int = 0) -> np.random.SeedSequence:
        """The seed of one stage; streams are independent, so changing one stage leaves the others alone.

        So are those of further designs of the same stage, by number.
        """
        seed = _seed(self.config, stage)
        return seed.spawn(number)[-1] if number else seed


def resolve(config: Config) -> Study:
    """Find and check everything that `config` names; runs nothing and touches nothing.

    Raises
    ------
    InputError
        With one sentence that says which table is wrong, what came and what is allowed.
    """
    oracle = _oracle(config)
    _checked("oracle.parameters", oracle.prepare)
    space = _checked("factors", lambda: _space(config, oracle))
    screening = config.screening
    method = _checked("screening.design", lambda: designs.get(screening.design.method, screening.design.settings))
    design = _checked("screening.design", lambda: _screening_design(config, method, space))
    if _count_contrasts(design) < 3:
        raise InputError(
            "screening.design: Lenth's method needs at least 3 contrasts, dummies and products included; use more runs"
        )
    for name in dict.fromkeys(screening.keep):
        _checked("screening.keep", lambda name=name: space.index(name))
    study = Study(config, oracle, space, design, config.export.prefix or config.name)
    _checked("screening.follow", lambda: study.folded_screening)
    fit = config.fit
    _checked(
        "fit", lambda: Choice(fit.selection, fit.basis or natural_basis(fit.selection), fit.heredity, trim=fit.trim)
    )
    _check_gradients(study)
    _check_fill(study)
    _check_growth(study)
    _check_exports(study)
    _check_command(study)
    return study


def _screening_design(config: Config, method: DesignMethod, space: FactorSpace) -> Design:
    if isinstance(method, UNSCREENED):
        _refuse_screening(method.method, "its columns are not orthogonal by construction")
    design = method.generate(space, _seed(config, "screening"))
    if len(design) > MOST_SCREENED:
        raise ValueError(f"{len(design)} runs are more than a screening can have; use {MOST_SCREENED} or fewer")
    return design


def _count_contrasts(design: Design) -> int:
    try:
        return count_contrasts(design)
    except ValueError as error:
        return _refuse_screening(design.method, str(error))


def _refuse_screening(method: str, why: str) -> NoReturn:
    named = f"screening.design: {method!r} is not a two-level design that can be screened with"
    raise InputError(f"{named} ({why}); use 'plackett_burman'") from None


def _oracle(config: Config) -> Oracle:
    """The oracle of that name, with its parameters or, if it is a program, with its table."""
    table = config.oracle
    if table.command is None and table.name != "command":
        return _checked("oracle", lambda: oracles.get(table.name, **table.parameters))
    if table.command is None or table.name != "command":
        raise InputError(
            "oracle.name = 'command' and a table [oracle.command] belong together; see docs/command-oracle.md"
        )
    if table.parameters:
        raise InputError("oracle.parameters: a program has none; write what it needs into argv or a template")
    settings = table.command.settings
    return _checked("oracle.command", lambda: oracles.get("command", **settings))


def ready(study: Study, place: Path) -> Study:
    """The study with its program's working folders in `place`; as it is where its oracle is no program.

    Raises
    ------
    InputError
        If the program is not on this machine: better now than as so many failed points.
    """
    oracle: Any = study.oracle
    if not hasattr(oracle, "working_in"):
        return study
    if oracle.missing:
        raise InputError(f"oracle.command: {oracle.missing}")
    return replace(study, oracle=oracle.working_in(place))


def highest_degree(fit: FitTable) -> int:
    """Up to which degree a fit that may grow looks."""
    return fit.highest_degree if fit.degree == AUTO else max(fit.highest_degree, int(fit.degree))


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


def _check_growth(study: Study) -> None:
    """Refuse a budget that has nothing to reach, nothing to grow, or no room."""
    require, n_factors = study.config.require, len(study.space)
    if require.max_runs is None:
        return
    if require.max_relative_error is None:
        raise InputError("require.max_runs needs require.max_relative_error: say which error the runs are to reach")
    method: Any = study.fill_method(n_factors)
    if not isinstance(method, (Uniform, *SEQUENCES)):
        names = ", ".join(repr(kind.method) for kind in (Uniform, *SEQUENCES))
        raise InputError(
            f"require.max_runs: no runs can be added to fit.design.method = {method.method!r}; use one of {names}, or "
            "leave max_runs out"
        )
    if isinstance(method, Uniform) and require.max_runs > MOST_RUNS:
        raise InputError(
            f"require.max_runs = {require.max_runs} is more than a uniform design can have; use {MOST_RUNS} or fewer"
        )
    if require.max_runs < method.n_runs:
        sized = "" if "n_runs" in study.config.fit.design.settings else f", if all {n_factors} factors act"
        raise InputError(
            f"require.max_runs = {require.max_runs} is fewer than the {method.n_runs} runs that the fit begins with"
            f"{sized}; use {method.n_runs} or more, or fewer in fit.design.n_runs"
        )


def _check_gradients(study: Study) -> None:
    """Refuse gradients that the oracle does not give or the selection does not take."""
    fit = study.config.fit
    if not fit.gradients:
        return
    if fit.selection not in TAUGHT or not fit.trim:
        named = " or ".join(repr(name) for name in TAUGHT)
        raise InputError(f"fit.gradients needs fit.selection = {named} and fit.trim = true")
    if not hasattr(study.oracle, "jacobian"):
        raise InputError(f"fit.gradients: the oracle {study.oracle.name!r} gives no Jacobian; leave it false")


def check_runs(study: Study, n_factors: int, n_runs: int) -> None:
    """Refuse a filling design with fewer runs than candidate terms."""
    needed = study.fewest_runs(n_factors)
    fit = study.config.fit
    if n_runs < needed and (fit.selection != "backward" or fit.degree == AUTO):
        raise InputError(
            f"fit.design: {n_runs} runs are too few for a fit in {n_factors} factors; use n_runs = {needed} or more"
        )
    if n_runs < needed:
        raise InputError(
            f"fit.design: {n_runs} runs are fewer than the {needed} terms of a degree-{study.config.fit.degree} "
            f"polynomial in {n_factors} factors; use n_runs = {needed} or more, a lower fit.degree, "
            "fit.interactions = false, or leave n_runs out to have it sized from the factors that act"
        )


def check_levels(config: Config, levels: int) -> None:
    """Refuse a filling design whose factors take too few levels for the degree."""
    if config.fit.degree == AUTO:
        return
    degree = int(config.fit.degree)
    if levels <= degree:
        raise InputError(
            f"fit.design: {levels} levels cannot show a degree of {degree}; use {degree + 1} "
            f"levels or more (method = 'uniform', levels = {degree + 1}), or a lower fit.degree"
        )


def _blank(study: Study) -> Surrogate:
    """A model of the study with nothing in it, to try what is asked of the real one before anything runs."""
    terms = Terms.polynomial(study.space.names, 1)
    return Surrogate(study.space, study.oracle.responses, terms, np.zeros((len(terms), len(study.oracle.responses))))


def _check_command(study: Study) -> None:
    """Refuse responses and given factors that make no square model."""
    wanted = study.config.command
    if wanted.responses or wanted.given:
        responses = wanted.responses or [r.name for r in study.oracle.responses]
        _checked("command", lambda: commanding(_blank(study), responses, wanted.given))


def _check_exports(study: Study) -> None:
    """Refuse unknown targets, and a prefix that a target's language does not allow, before anything runs."""
    blank = _blank(study)
    if study.config.export.targets:
        _checked("export.targets", lambda: exports.check_size(blank))
    for name in dict.fromkeys(study.config.export.targets):
        target = _checked("export.targets", lambda name=name: exports.get(name))
        _checked("export.prefix", lambda target=target: target.render(blank, study.export_prefix))


def _checked(where: str, make: Callable[[], T]) -> T:
    try:
        return make()
    except ValueError as error:
        raise InputError(f"{where}: {error}") from None

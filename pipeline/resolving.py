"""From a config to a study: everything that it names is found, and refused with one sentence where it is wrong."""

from collections.abc import Callable
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path
from typing import Any, NoReturn, TypeVar

import numpy as np

from experiments import designs, oracles
from experiments.designs import Design, DesignMethod, DOptimal, LatinHypercube, Uniform
from experiments.designs.uniform import MOST_RUNS
from experiments.factors import FactorSpace
from experiments.oracles import Oracle, asked
from experiments.oracles.files import is_file
from experiments.screening import count_contrasts
from experiments.terms import Terms
from surrogates import Surrogate, commanding, exports
from surrogates.candidates import AUTO
from surrogates.choosing import TAUGHT, Choice, natural_basis

from .config import Config
from .errors import InputError
from .oracle_file import Code, code_of, recorded, unchanged
from .other_models import compared_models
from .study import SEQUENCES, Study, stage_seed

T = TypeVar("T")

UNSCREENED = (*SEQUENCES, LatinHypercube, Uniform, DOptimal)
"""Designs whose columns are not orthogonal by construction: not even generated for a screening, some take minutes."""

MOST_SCREENED = 4096
"""Runs of a screening: a config with more is a slip, or wants to fill the memory."""


def resolve(config: Config, oracle: Oracle | None = None) -> Study:
    """Find and check everything that `config` names; runs nothing and touches nothing.

    An oracle in a file is loaded for it, unless `oracle` stands in for the config's.

    Raises
    ------
    InputError
        With one sentence that says which table is wrong, what came and what is allowed.
    """
    config = config.model_copy(update={"sweep": None})  # a study is one of its members
    code = None if oracle else code_of(config)
    oracle = oracle or _oracle(config, code)
    _checked("oracle.parameters", lambda: asked(oracle, "prepare", oracle.prepare))
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
    compared = compared_models(config.compare, space, oracle.responses)
    study = Study(config, oracle, space, design, config.export.prefix or config.name, code, compared)
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
    _check_executor(study)
    return study


def restored(config: Config, folder: Path, load: bool = False) -> Study:
    """The study of a finished run in `folder`; an oracle in a file is run only if asked, and only if it is the same.

    Raises
    ------
    InputError
        As :func:`resolve`; and if what the run noted of the oracle is damaged, or its code is gone or has changed.
    """
    if not is_file(config.oracle.name):
        return resolve(config)
    if not load:
        return resolve(config, recorded(folder))
    unchanged(config, folder)
    return resolve(config)


def _screening_design(config: Config, method: DesignMethod, space: FactorSpace) -> Design:
    if isinstance(method, UNSCREENED):
        _refuse_screening(method.method, "its columns are not orthogonal by construction")
    design = method.generate(space, stage_seed(config, "screening"))
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


def _oracle(config: Config, code: Code | None) -> Oracle:
    """The oracle of that name, with its parameters or, if it is a program, with its table."""
    table = config.oracle
    if table.command is None and table.name != "command":
        found = _checked("oracle", lambda: oracles.get(code.name if code else table.name, **table.parameters))
        if code and found.code != code.code:
            raise InputError(f"oracle: {code.path} changed while it was read; try again")
        return found
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
        If the program is not on this machine, and is to be run here: better now than as so many failed points. The
        workers of somebody's cluster look for themselves.
    """
    oracle: Any = study.oracle
    if not hasattr(oracle, "working_in"):
        return study
    if oracle.missing and study.config.executor.address is None:
        raise InputError(f"oracle.command: {oracle.missing}")
    return replace(study, oracle=oracle.working_in(place))


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


def _check_executor(study: Study) -> None:
    """Refuse settings of an executor that do not go together, what is not installed, and what no worker can make."""
    table = study.config.executor
    if table.address is not None and table.name != "dask":
        raise InputError(f"executor.address belongs to executor.name = 'dask', not {table.name!r}")
    if table.address is not None and table.workers is not None:
        raise InputError("executor.workers: a cluster that has an address has its own workers; leave one of them out")
    if table.name == "in_process" and (table.workers is not None or table.batch is not None):
        raise InputError("executor.workers and executor.batch belong to executor.name = 'processes' or 'dask'")
    if table.name == "dask" and find_spec("distributed") is None:
        raise InputError("executor.name = 'dask' needs the package distributed; install flexdoce[dask]")
    if table.name != "in_process":
        _checked("executor", lambda: oracles.recipe(study.oracle))


def _checked(where: str, make: Callable[[], T]) -> T:
    try:
        return make()
    except ValueError as error:
        raise InputError(f"{where}: {error}") from None

"""The stages: pure functions from one noun to the next. Nothing here touches the disk or runs an oracle."""

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

import surrogates
from experiments.designs import Design, Random, Uniform
from experiments.runs import Runs
from experiments.screening import Adequacy, NextDesign, Screening, TooManyHoles, screen
from surrogates import Inversion, RoundTrip, Surrogate, Verdict, certify, commanding, errors, obstacle, round_trip
from surrogates.candidates import BETTER
from surrogates.comparison import Comparison, compare_models
from surrogates.links import NotPositive

from .config import dump_config
from .errors import InputError, TooManyFailures
from .resolving import check_levels, check_runs
from .rounds import Round, ending
from .sections import FitTable
from .study import Study, highest_degree
from .version import __version__

INVERSE = "inverse"
"""Method of the design that an inversion makes."""


def screened(study: Study, runs: Runs) -> Screening:
    """Who acts on what: by least squares if some runs failed, as far as the config tolerates and the design allows."""
    tolerate(study, runs, "screening")
    try:
        return screen(runs, study.config.screening.alpha, study.oracle.resolution)
    except TooManyHoles as error:
        kinds = " ".join(f"--retry {kind}" for kind in sorted({runs.status[i - 1] for i in error.rerun}))
        raise TooManyFailures(f"screening: {runs.failures()}; {error} (--retry-failed, or {kinds})") from None


def adequacy(study: Study, screening: Screening) -> Adequacy:
    """Whether main effects tell who acts, by the config's tolerance."""
    return screening.adequacy(study.config.screening.tolerance)


def following(study: Study, screening: Screening) -> Design | None:
    """The foldover, first half included, if the screening asks for it and the config lets it be run."""
    return study.folded_screening if adequacy(study, screening).next_design is NextDesign.FOLDOVER else None


def kept_factors(study: Study, screening: Screening) -> tuple[str, ...]:
    """Factors worth filling: those that act on some response, and those the config keeps.

    Where main effects are not the whole story, also those that may act behind them; all, if none can be
    ruled out: dropping one would be a guess. So it would be where failed runs hide whether one acts.
    """
    found = adequacy(study, screening)
    acting = screening.active_factors if found.adequate else found.keep
    wanted = {*acting, *screening.unjudged, *study.config.screening.keep}
    if not wanted:
        raise InputError(
            "no response moves when the factors do: widen the ranges, look at the oracle, or name the factors "
            "to keep in screening.keep"
        )
    return tuple(n for n in study.space.names if n in wanted)


def fill_design(study: Study, kept: tuple[str, ...]) -> Design:
    """A filling design on the kept factors; the others stay at the centre of their range."""
    inner = study.space.select(kept)
    try:
        design = study.fill_method(len(inner)).generate(inner, study.seed("fit"))
    except ValueError as error:  # What a method asks of the number of factors shows only now.
        raise InputError(f"fit.design: {error}") from None
    check_runs(study, len(inner), len(design))
    check_levels(study.config, min(len(np.unique(column)) for column in design.coded.T))
    return design.embed(study.space)


def most_runs(study: Study) -> int:
    """Runs that a study may ask for, stage by stage, if all factors act and every look is taken.

    Raises
    ------
    InputError
        If its filling design cannot be made for all factors.
    """
    screening, fit = study.folded_screening or study.screening_design, study.config.require.max_runs
    if fit is None:
        method: Any = study.fill_method(len(study.space))
        fit = method.n_runs or len(fill_design(study, study.space.names))
    return len(screening) + fit + (study.most_looks + 1) * study.config.validation.n_runs


def grown_design(study: Study, kept: tuple[str, ...], before: Design, n_runs: int, number: int) -> Design:
    """`before` with runs added, which fill what it leaves empty, to `n_runs` in all; the first of them are its own.

    Parameters
    ----------
    study : Study
    kept : tuple of str
        Factors that are filled.
    before : Design
        On all factors, as :func:`fill_design` or this function made it.
    n_runs, number : int
        Which addition it is, from 1, seeds the search.
    """
    inner, columns = study.space.select(kept), [study.space.index(name) for name in kept]
    method: Any = study.fill_method(len(kept))
    if isinstance(method, Uniform):
        levels = study.finest(method, len(kept))
        given = Design(inner, before.coded[:, columns], before.method)
        finer = replace(method, n_runs=levels, levels=levels)
        design = finer.augment(given, n_runs - len(before), study.seed("fit", number))
    else:
        design = replace(method, n_runs=n_runs).generate(inner, study.seed("fit"))
    # Settings that were run keep their last bit, or the store would not know them.
    coded = np.vstack([before.coded, design.embed(study.space).coded[len(before) :]])
    return Design(study.space, coded, before.method)


def validation_design(study: Study, look: int = 0) -> Design:
    """Fresh random runs over all factors, so that the price of a dropped one shows; others for every look."""
    return Random(study.config.validation.n_runs).generate(study.space, study.seed("validation", look))


@dataclass(frozen=True, eq=False)
class Fitted:
    """A fit that is not certified yet.

    Parameters
    ----------
    model : Surrogate
    fit : FitTable
        How it was fitted.
    loo : ndarray, shape (n_responses,)
        Leave-one-out RMSE over the range of the runs; of the largest value where a response does not move.
    """

    model: Surrogate
    fit: FitTable
    loo: NDArray[np.float64]


def fitted(study: Study, kept: tuple[str, ...], runs: Runs, choices: Sequence[FitTable] = ()) -> Fitted:
    """The polynomial on the kept factors, as a model of all factors, fitted in the best of some ways.

    Parameters
    ----------
    study : Study
    kept : tuple of str
    runs : Runs
    choices : sequence of FitTable
        Ways to fit, by default that of the config. A later one must be clearly better, by the leave-one-out error of
        the response where that is largest.
    """
    tolerate(study, runs, "fit")
    done = runs.completed()
    ways = [(fit, study.fewest_runs(len(kept), fit)) for fit in choices or [study.config.fit]]
    if len(done) < min(needed for _, needed in ways):
        needed = ways[0][1]
        raise TooManyFailures(f"{len(done)} runs are left of the {needed} that the fit needs: {runs.failures()}")
    slopes = _slopes(study, done, [study.space.index(name) for name in kept])
    found = [_fitted(study, kept, done, fit, slopes) for fit, needed in ways if len(done) >= needed]
    best = found[0]
    for other in found[1:]:
        best = other if other.loo.max() < BETTER * best.loo.max() else best
    return best


def _fitted(study: Study, kept: tuple[str, ...], done: Runs, fit: FitTable, slopes: Any) -> Fitted:
    columns = [study.space.index(name) for name in kept]
    # Taken from the package when it is needed: the estimator brings scikit-learn.
    regressor = surrogates.PolynomialRegressor(
        degree=fit.degree,
        highest_degree=fit.highest_degree,
        interactions=fit.interactions,
        trim=fit.trim,
        selection=fit.selection,
        heredity=fit.heredity,
        basis=fit.basis,
        resolution=study.oracle.resolution,
        space=study.space.select(kept),
        responses=study.oracle.responses,
        response_transform=fit.transform,
    )
    try:
        regressor.fit(done.design.physical[:, columns], done.values, slopes)
    except NotPositive as error:  # shows only now, with the answers
        raise InputError(f"fit.transform: {error}") from None
    spread, largest = np.ptp(done.values, axis=0), np.abs(done.values).max(axis=0)
    measure = np.where(spread > study.oracle.resolution * largest, spread, largest)
    loo = regressor.loo_rmse_ / np.where(measure > 0.0, measure, 1.0)
    return Fitted(regressor.surrogate_.embed(study.space), fit, loo)


def certified(study: Study, kept: tuple[str, ...], surrogate: Surrogate, fit: FitTable) -> Surrogate:
    """The model with its certificate, and where it comes from."""
    origin = provenance(study, kept)
    if study.config.require.max_runs is not None:
        origin |= {"fit_degree": fit.degree, "fit_selection": fit.selection}
    return replace(surrogate, certificate=certify(surrogate), provenance=origin)


def commanded(study: Study, surrogate: Surrogate) -> Surrogate | None:
    """The square model that the config asks for, with its own certificate; None if it asks for none."""
    wanted = study.config.command
    if not wanted.responses and not wanted.given:
        return None
    square = commanding(surrogate, wanted.responses or [r.name for r in surrogate.responses], wanted.given)
    return replace(square, certificate=certify(square), provenance=surrogate.provenance)


def _slopes(study: Study, runs: Runs, columns: list[int]) -> Any:
    """The oracle's Jacobian by the kept factors at each run, if the config wants it taught."""
    if not study.config.fit.gradients:
        return None
    oracle: Any = study.oracle  # `resolve` has seen to it that this one gives Jacobians
    return oracle.jacobian(runs.design.physical)[:, :, columns]


def validated(study: Study, surrogate: Surrogate, runs: Runs) -> Surrogate:
    """The model with its errors on fresh runs."""
    tolerate(study, runs, "validation")
    return replace(surrogate, validation=errors(surrogate, runs, study.oracle.resolution))


def comparisons(study: Study, surrogate: Surrogate, runs: Runs) -> dict[str, Comparison]:
    """The models that the config names, beside ours and beside the validation runs."""
    resolution = study.oracle.resolution
    return {name: compare_models(surrogate, theirs, runs, resolution) for name, theirs in study.compared.items()}


def inversion_design(surrogate: Surrogate, runs: Runs) -> tuple[Runs, Inversion, Design]:
    """Invert the responses of the validation runs; the design holds the settings found."""
    targets = runs.completed()
    inversion = surrogate.invert(targets.values)
    return targets, inversion, Design.from_physical(surrogate.factors, inversion.settings[inversion.ok], INVERSE)


def confirmed(study: Study, targets: Runs, inversion: Inversion, answers: Runs) -> RoundTrip:
    """The round trip, if enough of it was answered."""
    tolerate(study, answers, "inversion")
    return round_trip(targets, inversion, answers, study.oracle.resolution)


def tolerate(study: Study, runs: Runs, stage: str) -> None:
    """Raise :class:`TooManyFailures` if more runs failed than the config tolerates."""
    allowed = study.config.oracle.max_failed_fraction
    failed = float((~runs.ok).mean()) if len(runs) else 0.0
    if failed > allowed or (len(runs) and not runs.ok.any()):
        raise TooManyFailures(
            f"{stage}: {runs.failures()}; {failed:.1%} is more than oracle.max_failed_fraction = {allowed:g}"
        )


def gap(stage: str, runs: Runs) -> str:
    """What was done without the runs that failed, in a sentence; empty if none did."""
    done = int(runs.ok.sum())
    what = {"fit": "the model is fitted to", "validation": "errors are those at", "inversion": "errors are those at"}
    return "" if done == len(runs) else f"{what[stage]} {done} of {len(runs)} runs, the others failed"


def shortfalls(study: Study, surrogate: Surrogate, rounds: Sequence[Round] = ()) -> list[str]:
    """Declared requirements that do not hold, one sentence each; how far `rounds` came, for a study that grows."""
    require, found = study.config.require, []
    if require.max_relative_error is not None:
        advice = "more runs in fit.design.n_runs, a higher fit.degree or narrower ranges may help"
        if rounds and require.max_runs is not None:
            advice = ending(rounds, require.max_runs, require.max_relative_error, highest_degree(study.config.fit))
        for error in surrogate.validation:
            if not error.max_relative <= require.max_relative_error:
                found.append(
                    f"{error.response}: maximum relative error {error.max_relative:.3g} exceeds "
                    f"require.max_relative_error = {require.max_relative_error:g} ({advice})"
                )
    certificate = surrogate.certificate
    if require.certified_inverse and (certificate is None or certificate.verdict is not Verdict.CERTIFIED):
        verdict = certificate.verdict if certificate else "missing"
        why = f"; {against}" if (against := obstacle(surrogate)) else ""
        found.append(f"the inverse is not certified (verdict: {verdict}{why})")
    return found


def provenance(study: Study, kept: tuple[str, ...]) -> dict[str, Any]:
    """Where a model comes from: no clock, host or path, so that the same study gives the same file."""
    config, oracle = study.config, study.oracle
    return {
        "generator": f"flexdoce {__version__}",
        "study": config.name,
        "oracle": oracle.name,
        "oracle_version": oracle.version,
        **({"oracle_code": oracle.code} if oracle.code else {}),
        "oracle_source": oracle.source,
        "oracle_parameters": oracle.parameters,
        "seed": config.seed,
        "kept_factors": list(kept),
        "config_sha256": hashlib.sha256(dump_config(config.of_answers).encode()).hexdigest(),
    }

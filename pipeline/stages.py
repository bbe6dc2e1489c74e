"""The stages: pure functions from one noun to the next. Nothing here touches the disk or runs an oracle."""

import hashlib
from dataclasses import replace
from typing import Any

import numpy as np

import surrogates
from experiments.designs import Design, Random
from experiments.runs import Runs
from experiments.screening import Adequacy, NextDesign, Screening, screen
from surrogates import Inversion, RoundTrip, Surrogate, Verdict, certify, errors, obstacle, round_trip

from .config import dump_config
from .errors import InputError, TooManyFailures
from .study import Study, check_levels, check_runs
from .version import __version__

INVERSE = "inverse"
"""Method of the design that an inversion makes."""


def screened(study: Study, runs: Runs) -> Screening:
    """Who acts on what."""
    if not runs.ok.all():
        raise TooManyFailures(f"screening needs every run: {runs.failures()}; mend the oracle or the ranges, run again")
    return screen(runs, study.config.screening.alpha, study.oracle.resolution)


def adequacy(study: Study, screening: Screening) -> Adequacy:
    """Whether main effects tell who acts, by the config's tolerance."""
    return screening.adequacy(study.config.screening.tolerance)


def following(study: Study, screening: Screening) -> Design | None:
    """The foldover, first half included, if the screening asks for it and the config lets it be run."""
    return study.folded_screening if adequacy(study, screening).next_design is NextDesign.FOLDOVER else None


def kept_factors(study: Study, screening: Screening) -> tuple[str, ...]:
    """Factors worth filling: those that act on some response, and those the config keeps.

    Where main effects are not the whole story, also those that may act behind them; all, if none can be
    ruled out: dropping one would be a guess.
    """
    found = adequacy(study, screening)
    acting = screening.active_factors if found.adequate else found.keep
    wanted = {*acting, *study.config.screening.keep}
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


def validation_design(study: Study) -> Design:
    """Fresh random runs over all factors, so that the price of a dropped one shows."""
    return Random(study.config.validation.n_runs).generate(study.space, study.seed("validation"))


def fitted(study: Study, kept: tuple[str, ...], runs: Runs) -> Surrogate:
    """The trimmed polynomial on the kept factors, as a model of all factors."""
    tolerate(study, runs, "fit")
    done = runs.completed()
    inner = study.space.select(kept)
    columns = [study.space.index(name) for name in kept]
    needed = study.fewest_runs(len(kept))
    if len(done) < needed:
        raise TooManyFailures(f"{len(done)} runs are left of the {needed} that the fit needs: {runs.failures()}")
    fit = study.config.fit
    # Taken from the package when it is needed: the estimator brings scikit-learn.
    regressor = surrogates.PolynomialRegressor(
        degree=fit.degree,
        interactions=fit.interactions,
        trim=fit.trim,
        selection=fit.selection,
        heredity=fit.heredity,
        resolution=study.oracle.resolution,
        space=inner,
        responses=study.oracle.responses,
    ).fit(done.design.physical[:, columns], done.values, _slopes(study, done, columns))
    surrogate = regressor.surrogate_.embed(study.space)
    return replace(surrogate, certificate=certify(surrogate), provenance=provenance(study, kept))


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


def shortfalls(study: Study, surrogate: Surrogate) -> list[str]:
    """Declared requirements that do not hold, one sentence each."""
    require, found = study.config.require, []
    if require.max_relative_error is not None:
        for error in surrogate.validation:
            if not error.max_relative <= require.max_relative_error:
                found.append(
                    f"{error.response}: maximum relative error {error.max_relative:.3g} exceeds "
                    f"require.max_relative_error = {require.max_relative_error:g} (more runs in fit.design.n_runs, "
                    "a higher fit.degree or narrower ranges may help)"
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
        "oracle_source": oracle.source,
        "oracle_parameters": oracle.parameters,
        "seed": config.seed,
        "kept_factors": list(kept),
        "config_sha256": hashlib.sha256(dump_config(config).encode()).hexdigest(),
    }

"""The stages: pure functions from one noun to the next. Nothing here touches the disk or runs an oracle."""

import hashlib
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

import surrogates
from experiments.designs import Design, Random
from experiments.runs import Runs
from experiments.screening import Screening, screen
from surrogates import Inversion, ResponseError, Surrogate, Verdict, certify, errors
from surrogates.validation import compare

from .config import dump_config
from .errors import InputError, TooManyFailures
from .study import Study
from .version import __version__

INVERSE = "inverse"
"""Method of the design that an inversion makes."""


@dataclass(frozen=True, eq=False)
class RoundTrip:
    """Wanted responses, inverted, and what the oracle answered at the settings found.

    Parameters
    ----------
    targets : Runs
        Validation runs; their responses are the targets, so every one is known to be reachable.
    inversion : Inversion
        One row per target.
    answers : Runs
        The oracle at the settings found; refused targets are left out.
    errors : tuple of ResponseError
        Answers against targets.
    """

    targets: Runs
    inversion: Inversion
    answers: Runs
    errors: tuple[ResponseError, ...]

    @property
    def worst(self) -> float:
        """Largest error of the answers over the response's range, over all responses; NaN if there is no answer."""
        return max((e.max_relative for e in self.errors), default=float("nan"))

    @property
    def n_refused(self) -> int:
        """Targets that the model would not invert."""
        return int((~self.inversion.ok).sum())


def screened(study: Study, runs: Runs) -> Screening:
    """Who acts on what."""
    if not runs.ok.all():
        raise TooManyFailures(f"screening needs every run: {runs.failures()}; mend the oracle or the ranges, run again")
    return screen(runs, study.config.screening.alpha, study.oracle.resolution)


def kept_factors(study: Study, screening: Screening) -> tuple[str, ...]:
    """Factors worth filling: those that act on some response, and those the config keeps.

    All of them, if some response moves but no single factor stands out: dropping one would be a guess.
    """
    if screening.undecided:
        return study.space.names
    wanted = {*screening.active_factors, *study.config.screening.keep}
    if not wanted:
        raise InputError(
            "no response moves when the factors do: widen the ranges, look at the oracle, or name the factors "
            "to keep in screening.keep"
        )
    return tuple(n for n in study.space.names if n in wanted)


def fill_design(study: Study, kept: tuple[str, ...]) -> Design:
    """A filling design on the kept factors; the others stay at the centre of their range."""
    inner = study.space.select(kept)
    return study.fill_method(len(inner)).generate(inner, study.seed("fit")).embed(study.space)


def validation_design(study: Study) -> Design:
    """Fresh random runs over all factors, so that the price of a dropped one shows."""
    return Random(study.config.validation.n_runs).generate(study.space, study.seed("validation"))


def fitted(study: Study, kept: tuple[str, ...], runs: Runs) -> Surrogate:
    """The trimmed polynomial on the kept factors, as a model of all factors."""
    tolerate(study, runs, "fit")
    done = runs.completed()
    inner = study.space.select(kept)
    columns = [study.space.index(name) for name in kept]
    needed = len(study.candidates(len(kept)))
    if len(done) < needed:
        raise TooManyFailures(f"{len(done)} runs are left for {needed} candidate terms: {runs.failures()}")
    fit = study.config.fit
    # Taken from the package when it is needed: the estimator brings scikit-learn.
    regressor = surrogates.PolynomialRegressor(
        degree=fit.degree,
        interactions=fit.interactions,
        trim=fit.trim,
        resolution=study.oracle.resolution,
        space=inner,
        responses=study.oracle.responses,
    ).fit(done.design.physical[:, columns], done.values)
    surrogate = widened(regressor.surrogate_, study, columns)
    return replace(surrogate, certificate=certify(surrogate), provenance=provenance(study, kept))


def widened(surrogate: Surrogate, study: Study, columns: list[int]) -> Surrogate:
    """The same polynomial as a model of all the study's factors, those not used with exponent zero."""
    terms = surrogate.terms
    exponents = np.zeros((len(terms), len(study.space)), dtype=int)
    exponents[:, columns] = np.reshape(terms.exponents, (len(terms), len(columns)))
    wide = replace(terms, names=study.space.names, exponents=tuple(map(tuple, exponents.tolist())))
    return replace(surrogate, factors=study.space, terms=wide)


def validated(study: Study, surrogate: Surrogate, runs: Runs) -> Surrogate:
    """The model with its errors on fresh runs."""
    tolerate(study, runs, "validation")
    return replace(surrogate, validation=errors(surrogate, runs, study.oracle.resolution))


def inversion_design(surrogate: Surrogate, runs: Runs) -> tuple[Runs, Inversion, Design]:
    """Invert the responses of the validation runs; the design holds the settings found."""
    targets = runs.completed()
    inversion = surrogate.invert(targets.values)
    return targets, inversion, Design.from_physical(surrogate.factors, inversion.settings[inversion.ok], INVERSE)


def round_trip(study: Study, targets: Runs, inversion: Inversion, answers: Runs) -> RoundTrip:
    """How far the oracle, run at the inverted settings, is from the targets."""
    tolerate(study, answers, "inversion")
    wanted, given = targets.values[inversion.ok][answers.ok], answers.completed().values
    found = compare(answers.responses, wanted, given, study.oracle.resolution) if len(given) else ()
    return RoundTrip(targets, inversion, answers, found)


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
        found.append(f"the inverse is not certified (verdict: {verdict})")
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

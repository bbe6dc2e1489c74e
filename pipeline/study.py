"""A study: a config resolved into the objects that the stages work with."""

from dataclasses import dataclass, field
from functools import cached_property
from math import ceil, comb
from typing import Any

import numpy as np

from experiments import designs
from experiments.designs import Design, DesignMethod, Halton, Random, Sobol, Uniform
from experiments.factors import FactorSpace
from experiments.oracles import Oracle
from experiments.terms import Terms
from surrogates import Surrogate
from surrogates.candidates import AUTO
from surrogates.stepwise import FULLEST

from .config import Config
from .oracle_file import Code
from .sections import FitTable

QUADRATIC = 2
"""Degree by whose terms a filling design is sized where the degree is to be chosen."""

GROWTH, NEARLY = 1.5, 1.2
"""A fit grows to so many times its runs, or at once to the most allowed if that is less than `NEARLY` times as many."""

ROOMY = 2
"""Settings of a grid for every run that a growing design may have; with fewer it would repeat itself."""

SEQUENCES = (Sobol, Halton, Random)
"""Designs of which a longer one begins with the shorter one."""

MOST_CANDIDATES = 50_000
"""Candidate terms of a fit: more are a slip, or want to fill the memory."""

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
    code : Code or None
        The file that the oracle was loaded from, if it was.
    compared : dict
        Models of other studies by name, to be shown beside this one's.
    """

    config: Config
    oracle: Oracle
    space: FactorSpace
    screening_design: Design
    export_prefix: str
    code: Code | None = None
    compared: dict[str, Surrogate] = field(default_factory=dict)

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
        seed = stage_seed(self.config, stage)
        return seed.spawn(number)[-1] if number else seed


def highest_degree(fit: FitTable) -> int:
    """Up to which degree a fit that may grow looks."""
    return fit.highest_degree if fit.degree == AUTO else max(fit.highest_degree, int(fit.degree))


def stage_seed(config: Config, stage: str) -> np.random.SeedSequence:
    """The seed of one stage, by its name."""
    return np.random.SeedSequence(config.seed, spawn_key=tuple(stage.encode()))

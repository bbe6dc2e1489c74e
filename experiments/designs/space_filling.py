"""Random, Latin hypercube, Sobol' and Halton designs, by scipy."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from ..factors import FactorSpace
from ..settings import parameter
from .base import Design, Seed, check_count


@dataclass(frozen=True)
class LatinHypercube:
    """Latin hypercube: one run in each of n equal slices of every factor.

    Parameters
    ----------
    n_runs : int
        At least 1.

    Notes
    -----
    McKay, Beckman and Conover (1979), Technometrics 21, 239–245; by :class:`scipy.stats.qmc.LatinHypercube`
    with random coordinate exchange for low centred discrepancy.
    """

    method: ClassVar[str] = "latin_hypercube"
    title: ClassVar[str] = "Latin hypercube"
    summary: ClassVar[str] = "one run in each of n equal slices of every factor"

    n_runs: int = parameter(30, "runs", "any number")

    def __post_init__(self) -> None:
        check_count("n_runs of a Latin hypercube", self.n_runs, 1)

    def generate(self, space: FactorSpace, rng: Seed = 0) -> Design:
        """The design on `space`."""
        from scipy.stats import qmc  # slow to import, and not needed by a surrogate that only predicts

        # scipy's optimiser divides by n - 1: a single run has nothing to exchange.
        optimization = "random-cd" if self.n_runs > 2 and len(space) > 1 else None
        sampler = qmc.LatinHypercube(len(space), rng=np.random.default_rng(rng), optimization=optimization)
        return Design(space, 2.0 * sampler.random(self.n_runs) - 1.0, self.method)


@dataclass(frozen=True)
class Random:
    """Independent uniform random settings, for validation with fresh runs.

    Parameters
    ----------
    n_runs : int
        At least 1.
    """

    method: ClassVar[str] = "random"
    title: ClassVar[str] = "random design"
    summary: ClassVar[str] = "independent uniform random settings, for validation"

    n_runs: int = parameter(1000, "runs", "any number")

    def __post_init__(self) -> None:
        check_count("n_runs of a random design", self.n_runs, 1)

    def generate(self, space: FactorSpace, rng: Seed = 0) -> Design:
        """The design on `space`."""
        coded = np.random.default_rng(rng).uniform(-1.0, 1.0, (self.n_runs, len(space)))
        return Design(space, coded, self.method)


@dataclass(frozen=True)
class Sobol:
    """Scrambled Sobol' points: a sequence whose every power-of-two beginning is balanced.

    Parameters
    ----------
    n_runs : int
        At least 1. Powers of two are balanced: each half, quarter, … of every factor then holds the
        same number of runs; other sizes are cut from the sequence and lose that.

    Notes
    -----
    Sobol' (1967), USSR Comput. Math. Math. Phys. 7(4), 86–112, with the direction numbers of Joe and Kuo
    (2008), SIAM J. Sci. Comput. 30, 2635–2654, and Owen's scrambling by linear matrices; by
    :class:`scipy.stats.qmc.Sobol`. At most 21201 factors.
    """

    method: ClassVar[str] = "sobol"
    title: ClassVar[str] = "Sobol' points"
    summary: ClassVar[str] = "scrambled low-discrepancy sequence, balanced at powers of two"

    n_runs: int = parameter(64, "runs", "any number; powers of two are balanced")

    def __post_init__(self) -> None:
        check_count("n_runs of Sobol' points", self.n_runs, 1)

    def generate(self, space: FactorSpace, rng: Seed = 0) -> Design:
        """The design on `space`; `rng` seeds the scrambling."""
        from scipy.stats import qmc  # slow to import, and not needed by a surrogate that only predicts

        sampler = qmc.Sobol(len(space), rng=np.random.default_rng(rng))
        points = sampler.random_base2((self.n_runs - 1).bit_length())[: self.n_runs]
        return Design(space, 2.0 * points - 1.0, self.method)


@dataclass(frozen=True)
class Halton:
    """Scrambled Halton points: a low-discrepancy sequence of any length, one prime base a factor.

    Parameters
    ----------
    n_runs : int
        At least 1.

    Notes
    -----
    Halton (1960), Numer. Math. 2, 84–90; scrambled digit by digit as in Owen (2017), "A randomized Halton
    algorithm in R", arXiv:1706.02808; by :class:`scipy.stats.qmc.Halton`. Beyond some ten factors its
    pairs of late factors fill poorly, because their bases are large.
    """

    method: ClassVar[str] = "halton"
    title: ClassVar[str] = "Halton points"
    summary: ClassVar[str] = "scrambled low-discrepancy sequence of any length"

    n_runs: int = parameter(60, "runs", "any number")

    def __post_init__(self) -> None:
        check_count("n_runs of Halton points", self.n_runs, 1)

    def generate(self, space: FactorSpace, rng: Seed = 0) -> Design:
        """The design on `space`; `rng` seeds the scrambling."""
        from scipy.stats import qmc  # slow to import, and not needed by a surrogate that only predicts

        sampler = qmc.Halton(len(space), rng=np.random.default_rng(rng))
        return Design(space, 2.0 * sampler.random(self.n_runs) - 1.0, self.method)

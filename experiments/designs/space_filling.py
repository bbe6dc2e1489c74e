"""Random and Latin hypercube designs, by scipy."""

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

"""Designs: where to try. One file a method; each is frozen settings with ``generate(space, rng)``.

>>> from experiments import Factor, FactorSpace
>>> from experiments.designs import PlackettBurman
>>> space = FactorSpace((Factor("force", "N", -1.0, 1.0), Factor("length", "m", 0.1, 0.2)))
>>> PlackettBurman(n_runs=12).generate(space).physical.shape
(12, 2)
"""

from collections.abc import Mapping
from math import ceil
from typing import Any

from ..naming import suggestion
from ..settings import build
from .base import Design, DesignMethod
from .d_optimal import DOptimal
from .definitive_screening import DefinitiveScreening
from .discrepancy import (
    centred_discrepancy_squared,
    level_discrepancy_squared,
    mixture_discrepancy_squared,
    wraparound_discrepancy_squared,
)
from .fractional_factorial import FractionalFactorial
from .fractions import Fraction
from .full_factorial import FullFactorial
from .hadamard import hadamard
from .plackett_burman import PlackettBurman
from .properties import Properties, properties
from .space_filling import Halton, LatinHypercube, Random, Sobol
from .uniform import Uniform

MOST_TRIED = 4096
"""Sizes tried for one that a method allows: more than lie between two sizes of any."""

METHODS: dict[str, type[DesignMethod]] = {
    cls.method: cls
    for cls in (
        PlackettBurman,
        FractionalFactorial,
        FullFactorial,
        DefinitiveScreening,
        DOptimal,
        Uniform,
        LatinHypercube,
        Sobol,
        Halton,
        Random,
    )
}

__all__ = [
    "METHODS",
    "DOptimal",
    "DefinitiveScreening",
    "Design",
    "DesignMethod",
    "Fraction",
    "FractionalFactorial",
    "FullFactorial",
    "Halton",
    "LatinHypercube",
    "PlackettBurman",
    "Properties",
    "Random",
    "Sobol",
    "Uniform",
    "centred_discrepancy_squared",
    "get",
    "hadamard",
    "level_discrepancy_squared",
    "mixture_discrepancy_squared",
    "properties",
    "wraparound_discrepancy_squared",
]


def get(method: str, settings: Mapping[str, Any] | None = None, at_least: float | None = None) -> DesignMethod:
    """The design method of that name with its settings.

    Parameters
    ----------
    method : str
    settings : mapping, optional
        Its settings; defaults where not given.
    at_least : float, optional
        If `n_runs` is not among the settings: take the smallest allowed number of runs that is at
        least this.

    Raises
    ------
    ValueError
        For an unknown method or setting (with the nearest known one), or a value that is refused.
    """
    if method not in METHODS:
        raise ValueError(f"unknown design {method!r}{suggestion(method, METHODS)}")
    kind, cls, chosen = f"design {method!r}", METHODS[method], dict(settings or {})
    if at_least is None or any(name in chosen for name in getattr(cls, "sized_by", ("n_runs",))):
        return build(kind, cls, chosen)
    # Which sizes a method allows is the method's own business: take the first that it does not refuse.
    smallest = ceil(at_least)
    refusal = None
    for n_runs in range(smallest, min(2 * smallest + 64, smallest + MOST_TRIED)):
        try:
            return build(kind, cls, {**chosen, "n_runs": n_runs})
        except ValueError as error:
            refusal = refusal or error
    raise refusal or ValueError(f"{kind} has no size of at least {smallest}")

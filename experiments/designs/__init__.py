"""Designs: where to try. One file a method; each is frozen settings with ``generate(space, rng)``.

>>> from experiments import Factor, FactorSpace
>>> from experiments.designs import PlackettBurman
>>> space = FactorSpace((Factor("force", "N", -1.0, 1.0), Factor("length", "m", 0.1, 0.2)))
>>> PlackettBurman(n_runs=12).generate(space).physical.shape
(12, 2)
"""

from collections.abc import Mapping
from typing import Any

from ..naming import suggestion
from ..settings import build
from .base import Design, DesignMethod
from .discrepancy import centred_discrepancy_squared, level_discrepancy_squared
from .plackett_burman import PlackettBurman
from .space_filling import LatinHypercube, Random
from .uniform import Uniform

METHODS: dict[str, type[DesignMethod]] = {cls.method: cls for cls in (PlackettBurman, Uniform, LatinHypercube, Random)}

__all__ = [
    "METHODS",
    "Design",
    "DesignMethod",
    "LatinHypercube",
    "PlackettBurman",
    "Random",
    "Uniform",
    "centred_discrepancy_squared",
    "get",
    "level_discrepancy_squared",
]


def get(method: str, settings: Mapping[str, Any] | None = None) -> DesignMethod:
    """The design method of that name with its settings; ``ValueError`` with the nearest name or setting if unknown."""
    if method not in METHODS:
        raise ValueError(f"unknown design {method!r}{suggestion(method, METHODS)}")
    return build(f"design {method!r}", METHODS[method], settings or {})

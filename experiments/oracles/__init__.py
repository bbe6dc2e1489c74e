"""Oracles: what answers a run. ``get(name, **parameters)`` makes one; ``oracle(design)`` gives runs.

An oracle is imported when it is asked for, so that listing them needs no JAX.
"""

from importlib import import_module
from typing import Any

from ..naming import check_name, suggestion
from ..settings import build
from .base import Answers, Arrow, JaxOracle, Line, Oracle, PointOracle, PublishedMap, Shape

__all__ = [
    "CONFIGURED",
    "Answers",
    "Arrow",
    "JaxOracle",
    "Line",
    "Oracle",
    "PointOracle",
    "PublishedMap",
    "Shape",
    "get",
    "names",
    "oracle_class",
    "register",
]

_BUILT_IN = {
    "hexflex": ".hexflex:HexFlex",
    "flexure_3rrr": ".flexure_3rrr:Flexure3RRR",
    "cantilever": ".cantilever:Cantilever",
}
CONFIGURED = {"command": ".command:CommandOracle"}
"""Oracles that are nothing without settings of their own; :func:`names` leaves them out."""

_REGISTERED: dict[str, type[Oracle]] = {}


def names() -> tuple[str, ...]:
    """Names of all known oracles that can be had by name alone."""
    return (*_BUILT_IN, *_REGISTERED)


def register(cls: type[Oracle]) -> type[Oracle]:
    """Make an oracle class known under its name; usable as a decorator.

    Raises
    ------
    ValueError
        If the name is not an identifier or belongs to a built-in oracle.
    """
    check_name("oracle", cls.name)
    if cls.name in _BUILT_IN or cls.name in CONFIGURED:
        raise ValueError(f"the oracle name {cls.name!r} is taken by a built-in; choose another")
    _REGISTERED[cls.name] = cls
    return cls


def oracle_class(name: str) -> type[Oracle]:
    """The class behind a name; ``ValueError`` with the nearest name if there is none."""
    if name in _REGISTERED:
        return _REGISTERED[name]
    built_in = {**_BUILT_IN, **CONFIGURED}
    if name not in built_in:
        raise ValueError(f"unknown oracle {name!r}{suggestion(name, (*names(), *CONFIGURED))}")
    module, _, attribute = built_in[name].partition(":")
    return getattr(import_module(module, __package__), attribute)


def get(name: str, **parameters: Any) -> Oracle:
    """The oracle of that name with its parameters; ``ValueError`` for unknown names and bad values."""
    cls: Any = oracle_class(name)
    if name in CONFIGURED:
        return cls.from_settings(parameters)
    return build(f"oracle {name!r}", cls, parameters)

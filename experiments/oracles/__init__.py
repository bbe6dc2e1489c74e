"""Oracles: what answers a run. ``get(name, **parameters)`` makes one; ``oracle(design)`` gives runs.

An oracle is imported when it is asked for, so that listing them needs no JAX.
"""

from importlib import import_module
from typing import Any

from ..naming import check_name, suggestion
from ..settings import build
from .base import Answers, Arrow, JaxOracle, Line, Oracle, PointOracle, PublishedMap, Shape

__all__ = [
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
_REGISTERED: dict[str, type[Oracle]] = {}


def names() -> tuple[str, ...]:
    """Names of all known oracles."""
    return (*_BUILT_IN, *_REGISTERED)


def register(cls: type[Oracle]) -> type[Oracle]:
    """Make an oracle class known under its name; usable as a decorator.

    Raises
    ------
    ValueError
        If the name is not an identifier or belongs to a built-in oracle.
    """
    check_name("oracle", cls.name)
    if cls.name in _BUILT_IN:
        raise ValueError(f"the oracle name {cls.name!r} is taken by a built-in; choose another")
    _REGISTERED[cls.name] = cls
    return cls


def oracle_class(name: str) -> type[Oracle]:
    """The class behind a name; ``ValueError`` with the nearest name if there is none."""
    if name in _REGISTERED:
        return _REGISTERED[name]
    if name not in _BUILT_IN:
        raise ValueError(f"unknown oracle {name!r}{suggestion(name, names())}")
    module, _, attribute = _BUILT_IN[name].partition(":")
    return getattr(import_module(module, __package__), attribute)


def get(name: str, **parameters: Any) -> Oracle:
    """The oracle of that name with its parameters; ``ValueError`` for unknown names and bad values."""
    return build(f"oracle {name!r}", oracle_class(name), parameters)

"""Oracles: what answers a run. ``get(name, **parameters)`` makes one; ``oracle(design)`` gives runs.

An oracle is imported when it is asked for, so that listing them needs no JAX. It is built in, registered in this
process, offered by an installed package, or lies in a file.

====================  ================================================================================================
:mod:`.base`          the protocol, and classes to derive from; :mod:`.functions` makes one of a function
:mod:`.plugins`       those of installed packages; :mod:`.files` those in files; :mod:`.foreign` what both must be
:mod:`.checking`      whether one keeps its contract
:mod:`.recipes`       how another process makes it; :mod:`.record` what is read of it without its code
:mod:`.command`       any program; :mod:`.equilibrium` what the nonlinear frames of two built-in ones share
====================  ================================================================================================
"""

from importlib import import_module
from typing import Any

from ..naming import check_name, suggestion
from ..settings import build
from . import files, foreign, plugins
from .base import Answers, Arrow, JaxOracle, Leave, Line, Oracle, OracleError, PointOracle, PublishedMap, Shape, asked
from .checking import check_oracle
from .functions import point_oracle
from .plugins import GROUP, Offer
from .recipes import Recipe, recipe
from .record import Recorded, described

__all__ = [
    "CONFIGURED",
    "GROUP",
    "Answers",
    "Arrow",
    "JaxOracle",
    "Leave",
    "Line",
    "Offer",
    "Oracle",
    "OracleError",
    "PointOracle",
    "PublishedMap",
    "Recipe",
    "Recorded",
    "Shape",
    "all_oracles",
    "asked",
    "check_oracle",
    "described",
    "findable",
    "get",
    "names",
    "offers",
    "oracle_class",
    "origin_of",
    "point_oracle",
    "recipe",
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
    """Names of all known oracles that can be had by name alone: built in, registered, offered by installed packages."""
    return tuple(dict.fromkeys((*_BUILT_IN, *_REGISTERED, *(o.name for o in offers() if not o.flaw))))


def offers() -> list[Offer]:
    """What installed packages offer in the group :data:`GROUP`, also what cannot be used; nothing is imported."""
    return plugins.offers(GROUP, (*_BUILT_IN, *CONFIGURED))


def all_oracles() -> dict[str, type[Oracle]]:
    """Name to class of every oracle that can be had by name; broken ones of other packages are left out."""
    found = {name: oracle_class(name) for name in (*_BUILT_IN, *_REGISTERED)}
    ours = {offer.name: plugins.tried(offer)[0] for offer in offers() if not offer.flaw}
    return {**{name: cls for name, cls in ours.items() if cls is not None}, **found}


def origin_of(name: str) -> str:
    """Where the oracle called `name` comes from, in words; empty if there is none."""
    if name in _REGISTERED:
        return "registered in this process"
    if name in _BUILT_IN or name in CONFIGURED:
        return "built in"
    return next((offer.origin for offer in offers() if offer.name == name), "")


def findable(cls: type[Oracle]) -> bool:
    """Whether another process finds this very class under its name."""
    if cls.name in _BUILT_IN:
        return oracle_class(cls.name) is cls
    return bool(cls.origin) and any(offer.origin == cls.origin for offer in offers())


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
    """The class behind a name, or behind ``path/to/file.py:name``: a file that is run.

    Raises
    ------
    ValueError
        With the nearest name if there is none, or with what is wrong with somebody's own oracle.
    """
    if files.is_file(name):
        return files.load(name)
    if name in _REGISTERED:
        return _REGISTERED[name]
    built_in = {**_BUILT_IN, **CONFIGURED}
    if name in built_in:
        module, _, attribute = built_in[name].partition(":")
        return getattr(import_module(module, __package__), attribute)
    offered = [offer for offer in offers() if offer.name == name]
    if not offered:
        file = "; an oracle in a file goes by path/to/file.py:name" if "." in name or "/" in name else ""
        raise ValueError(f"unknown oracle {name!r}{suggestion(name, (*names(), *CONFIGURED))}{file}")
    return plugins.load(offered[0])


def get(name: str, **parameters: Any) -> Oracle:
    """The oracle of that name with its parameters.

    Parameters
    ----------
    name : str
        A known name, or ``path/to/file.py:name``: then the file is run, so it must be one that you trust.
    **parameters
        Inputs held fixed; defaults where not given.

    Raises
    ------
    ValueError
        For unknown names and bad values, and for whatever is wrong with somebody's own oracle.
    """
    cls: Any = oracle_class(name)
    if name in CONFIGURED:
        return cls.from_settings(parameters)
    return foreign.made(cls, parameters) if cls.origin else build(f"oracle {name!r}", cls, parameters)

"""Oracles that installed packages offer: entry points of the group ``flexdoce.oracles``, imported when asked for."""

from collections.abc import Iterable
from importlib.metadata import EntryPoint, distributions, entry_points
from typing import NamedTuple

from ..naming import check_name
from .base import Oracle, told
from .foreign import flaw_of, oracle_class

GROUP = "flexdoce.oracles"
"""Entry points in which installed packages offer classes of oracles."""


class Offer(NamedTuple):
    """An entry point, who offers it, and why it cannot be used; empty if nothing is known against it."""

    name: str
    value: str
    distribution: str
    flaw: str = ""

    @property
    def origin(self) -> str:
        """Distribution and value: ``springs 1.2, springs.oracles:Spring``."""
        return f"{self.distribution}, {self.value}"


def offers(group: str = GROUP, taken: Iterable[str] = ()) -> list[Offer]:
    """What installed packages offer, by name; nothing is imported.

    Parameters
    ----------
    group : str
        Of the entry points.
    taken : iterable of str
        Names that are not to be had.
    """
    taken, found = set(taken), {(e.name, e.value, _distribution(e)) for e in _entries(group)}
    by_name: dict[str, list[Offer]] = {}
    for name, value, distribution in sorted(found):
        by_name.setdefault(name, []).append(Offer(name, value, distribution))
    return [offer._replace(flaw=_flaw(same, taken)) for same in by_name.values() for offer in same]


def load(offer: Offer) -> type[Oracle]:
    """The class that is offered, its `origin` set; its package is imported.

    Raises
    ------
    ValueError
        With one sentence that names the distribution.
    """
    what = f"the oracle {offer.name!r} that the package {offer.distribution} offers ({offer.value})"
    if offer.flaw:
        raise ValueError(f"{what} cannot be used: {offer.flaw}")
    try:
        found = EntryPoint(offer.name, offer.value, GROUP).load()
    except (Exception, SystemExit) as error:
        raise ValueError(f"{what} cannot be imported: {told(error)}") from error
    cls = oracle_class(what, found)
    if cls.name != offer.name:
        raise ValueError(f"{what} calls itself {cls.name!r}; the entry point and the class must have one name")
    cls.origin = offer.origin
    return cls


def tried(offer: Offer) -> tuple[type[Oracle] | None, str]:
    """The class that is offered, or None and why not; what can be made without settings is looked at, too."""
    try:
        cls = load(offer)
    except ValueError as error:
        return None, offer.flaw or str(error)
    try:
        oracle = cls()
    except Exception:
        return cls, ""  # it needs settings
    flaw = flaw_of(oracle)
    return (None, flaw) if flaw else (cls, "")


def _flaw(same: list[Offer], taken: set[str]) -> str:
    name = same[0].name
    try:
        check_name("oracle", name)
    except ValueError as error:
        return str(error)
    if name in taken:
        return f"the name {name!r} is taken by a built-in oracle"
    if len(same) > 1:
        others = " and ".join(f"{offer.distribution} ({offer.value})" for offer in same)
        return f"the name {name!r} is offered more than once, by {others}; uninstall one"
    return ""


def _entries(group: str) -> list[EntryPoint]:
    try:
        return list(entry_points(group=group))
    except Exception:  # one package's damaged metadata must not hide the others'
        return list(_one_by_one(group))


def _one_by_one(group: str) -> Iterable[EntryPoint]:
    for distribution in distributions():
        try:
            yield from distribution.entry_points.select(group=group)
        except Exception:  # it is the damaged one
            continue


def _distribution(entry: EntryPoint) -> str:
    """Name and version of the distribution of an entry point."""
    try:
        return f"{entry.dist.name} {entry.dist.version}" if entry.dist else "of unknown name"
    except Exception:
        return "of unknown name"

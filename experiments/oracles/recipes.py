"""How an oracle is made anew in another process: plain data that any process can be sent."""

from collections.abc import Mapping
from dataclasses import dataclass, fields, is_dataclass
from typing import Any

from .base import Oracle


@dataclass(frozen=True)
class Recipe:
    """Made by :func:`recipe`; goes through pickle.

    Parameters
    ----------
    name : str
        What :func:`.get` takes: a known name, or ``/path/to/file.py:name``.
    parameters : mapping
    code : str
        That the oracle must have; empty where it is from no file.
    ready : Oracle or None
        The oracle itself, where its class is known everywhere and holds nothing but data.
    """

    name: str
    parameters: Mapping[str, Any]
    code: str = ""
    ready: Oracle | None = None

    def make(self) -> Oracle:
        """The oracle, in this process.

        Raises
        ------
        ValueError
            If it cannot be found here, or its file has changed.
        """
        from . import get

        if self.ready is not None:
            return self.ready
        oracle = get(self.name, **self.parameters)
        if oracle.code != self.code:
            raise ValueError(f"{oracle.origin} has changed since the recipe was written; begin anew")
        return oracle


def recipe(oracle: Oracle) -> Recipe:
    """How `oracle` is made anew elsewhere.

    Raises
    ------
    ValueError
        If nobody else could find its class: it is known to this process alone.
    """
    from . import CONFIGURED, findable

    cls = type(oracle)
    if oracle.name in CONFIGURED:
        return Recipe(oracle.name, {}, ready=oracle)
    made_with = {f.name: getattr(oracle, f.name) for f in fields(cls) if f.init} if is_dataclass(cls) else {}
    if oracle.code:
        return Recipe(oracle.origin, made_with, oracle.code)
    if not findable(cls):
        raise ValueError(
            f"the oracle {oracle.name!r} is known to this process alone, so that no other can make it; "
            "put it into a file (oracle = 'file.py:name') or offer it from a package"
        )
    return Recipe(oracle.name, made_with)

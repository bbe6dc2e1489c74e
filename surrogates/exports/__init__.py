"""Code generated from a surrogate alone, one file a target: ``get("c99").render(model, "stage")``.

A target is frozen settings and one pure method from a model to files by name; whoever calls it writes the files.
"""

from collections.abc import Mapping
from typing import Any

from experiments.naming import suggestion
from experiments.settings import build

from .base import Target
from .c99 import C99, C99Float

TARGETS: dict[str, type[Target]] = {cls.name: cls for cls in (C99, C99Float)}

__all__ = ["C99", "TARGETS", "C99Float", "Target", "get"]


def get(name: str, settings: Mapping[str, Any] | None = None) -> Target:
    """The export target of that name with its settings; ``ValueError`` with the nearest name or setting if unknown."""
    if name not in TARGETS:
        raise ValueError(f"unknown export {name!r}{suggestion(name, TARGETS)}")
    return build(f"export {name!r}", TARGETS[name], settings or {})

"""Code generated from a surrogate alone, one folder or file a target: ``get("c99").render(model, "stage")``.

A target is frozen settings and one pure method from a model to files by name; whoever calls it writes the files.

What they share: `base` (the protocol, safe names and text), `horner` (polynomials as straight lines of code),
`products` (their terms as a chain of products), `inverse_plan` (the inverse in numbers, the same steps in every
language).
`verification` proves each against its model.
"""

from collections.abc import Mapping
from typing import Any

from experiments.naming import suggestion
from experiments.settings import build

from ..model import Surrogate
from .base import Target
from .c99 import C99, C99Float
from .fmi import FMI2, FMI3
from .iec61131 import StructuredText
from .matlab import Matlab
from .onnx_graph import ONNX
from .python import CasADi, NumPyFile

TARGETS: dict[str, type[Target]] = {
    cls.name: cls for cls in (C99, C99Float, FMI2, FMI3, NumPyFile, Matlab, StructuredText, CasADi, ONNX)
}

__all__ = [
    "C99", "FMI2", "FMI3", "ONNX", "TARGETS", "C99Float", "CasADi", "Matlab", "NumPyFile", "StructuredText", "Target",
    "check_size", "get",
]  # fmt: skip

MOST_ENTRIES = 10_000
"""Factors times responses of a model that is written as code: the inverse of 100 by 100 is 12 MB of C, written out."""


def check_size(model: Surrogate) -> None:
    """``ValueError`` if the code of a model would fill the memory: elimination, written out, grows with the cube."""
    n, m = len(model.factors), len(model.responses)
    if n * m > MOST_ENTRIES:
        raise ValueError(
            f"a model of {n} factors and {m} responses is too large to be written as code; at most {MOST_ENTRIES} "
            "pairs of a factor and a response are"
        )


def get(name: str, settings: Mapping[str, Any] | None = None) -> Target:
    """The export target of that name with its settings; ``ValueError`` with the nearest name or setting if unknown."""
    if name not in TARGETS:
        raise ValueError(f"unknown export {name!r}{suggestion(name, TARGETS)}")
    return build(f"export {name!r}", TARGETS[name], settings or {})

"""Proof that an export is the model it was made from: each target in its own language, at the same points.

``verify("c99", model, "stage", folder)`` runs what lies in `folder` and returns findings. It needs tools that need not
be there (compilers, Octave, onnxruntime): what is missing is a finding that says so.
"""

from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

from experiments.naming import suggestion

from .base import Finding, Outcome, Verifier

if TYPE_CHECKING:
    from ...model import Surrogate

MODULES = {
    "c99": "c99:verify",
    "c99_float": "c99:verify_single",
    "fmi2": "fmi:verify",
    "fmi3": "fmi:verify",
    "python": "numpy_file:verify",
    "matlab": "matlab:verify",
    "iec61131": "iec61131:verify",
    "casadi": "casadi_sx:verify",
    "onnx": "onnx_graph:verify",
}
"""Module and function by target."""

__all__ = ["Finding", "Outcome", "Verifier", "verifier", "verify"]


def verifier(target: str) -> Callable[["Surrogate", str, Path], list[Finding]]:
    """The verifier of that target; ``ValueError`` if it is unknown."""
    if target not in MODULES:
        raise ValueError(f"unknown export {target!r}{suggestion(target, MODULES)}")
    module, _, function = MODULES[target].partition(":")
    return getattr(import_module(f".{module}", __name__), function)


def verify(target: str, model: "Surrogate", prefix: str, folder: Path) -> list[Finding]:
    """What the files of `target` in `folder`, with that prefix, do at reference points, against `model`.

    Raises
    ------
    ValueError
        If the target is unknown.
    """
    return verifier(target)(model, prefix, folder)

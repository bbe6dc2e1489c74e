"""FMUs for several tests: models, files in a folder, what their descriptions hold."""

import shutil
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree as ET

import pytest

from surrogates import Surrogate
from surrogates.exports.fmi.archive import COMPILERS, unpack
from surrogates.exports.fmi.targets import FMI2, FMI3
from tests.surrogates.cases import (
    hexflex_like,
    more_responses,
    square_quadratic,
    underdetermined,
)

COMPILER = next((c for c in COMPILERS if shutil.which(c)), None)
needs_compiler = pytest.mark.skipif(
    COMPILER is None, reason=f"NO C COMPILER: looked for {', '.join(COMPILERS)} on PATH. The FMUs were not compiled."
)
TARGETS = [FMI2(), FMI3()]
both = pytest.mark.parametrize("target", TARGETS, ids=["fmi2", "fmi3"])


def need_fmpy():
    return pytest.importorskip("fmpy", reason="NO FMPY (pip install fmpy): the FMUs were neither validated nor run.")


def logarithms() -> Surrogate:
    model = square_quadratic()
    return replace(model, coefficients=model.coefficients * [1.0, 100.0, 1.0], links=("identity", "log", "log"))


MODELS = {
    "affine": hexflex_like,
    "curved": square_quadratic,
    "logarithms": logarithms,
    "underdetermined": underdetermined,
    "without_inverse": more_responses,
}


def write(folder: Path, target, model: Surrogate, prefix: str = "dev", complete: bool = False) -> Path:
    files = target.render(model, prefix)
    if complete:
        files, notes = target.complete(files)
        assert notes == []
    for name, content in files.items():
        (folder / name).write_bytes(content)
    return folder


def description(fmu: bytes) -> ET.Element:
    return ET.fromstring(unpack(fmu)["modelDescription.xml"])


def variables(fmu: bytes) -> dict[str, dict[str, str]]:
    """Attributes of every variable by name, in both versions."""
    found = {}
    for element in description(fmu).iterfind("ModelVariables/*"):
        inner = element[0].attrib if len(element) else {}
        found[element.attrib["name"]] = {**element.attrib, **inner}
    return found

"""Runs an exported Python file in a process of its own: it is never imported into this one."""

import sys
from collections.abc import Mapping
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .base import Finding, Outcome, not_checked, run_tool

MISSING = "not installed: "

DRIVER = """\
import sys

try:
    import {package}
except ImportError:
    print("{missing}{package}")
    sys.exit()

import importlib.util

import numpy as np

spec = importlib.util.spec_from_file_location("exported", sys.argv[1])
exported = importlib.util.module_from_spec(spec)
spec.loader.exec_module(exported)
given = np.load("given.npz", allow_pickle=False)
found = {{}}
{body}
np.savez("found.npz", **found)
"""


def run_file(
    what: str, source: Path, package: str, body: str, given: Mapping[str, NDArray[np.float64]]
) -> dict[str, NDArray[np.float64]] | Finding:
    """What the file computes; or the finding that says why it did not.

    Parameters
    ----------
    what : str
        For the finding.
    source : Path
        The exported file; it is copied, and only read.
    package : str
        What it needs; where this is not installed, nothing is checked.
    body : str
        Statements that fill the dictionary ``found`` from the arrays ``given`` with the module ``exported``.
    given : mapping of str to ndarray
    """
    with TemporaryDirectory() as place:
        folder = Path(place)
        try:
            (folder / source.name).write_bytes(source.read_bytes())
        except OSError as error:
            return Finding(what, Outcome.DIFFERS, f"{source.name} cannot be read: {error.strerror}")
        (folder / "driver.py").write_text(
            DRIVER.format(package=package, missing=MISSING, body=body), encoding="ascii", newline="\n"
        )
        arrays: dict[str, Any] = dict(given)
        np.savez(folder / "given.npz", **arrays)
        # Isolated: no variable of the environment and no file beside the driver can stand in for a package.
        good, told = run_tool([sys.executable, "-I", "driver.py", source.name], folder)
        if not good:
            return Finding(what, Outcome.DIFFERS, f"it ended with an error: {_last(told)}")
        if told.startswith(MISSING):
            return not_checked(what, f"the package {package} is not installed: pip install {package}")
        try:
            with np.load(folder / "found.npz", allow_pickle=False) as found:
                return {name: found[name] for name in found.files}
        except (OSError, ValueError) as error:
            return Finding(what, Outcome.DIFFERS, f"it gave no numbers: {error}")


def _last(told: str) -> str:
    lines = told.strip().splitlines()
    return lines[-1] if lines else "it said nothing"

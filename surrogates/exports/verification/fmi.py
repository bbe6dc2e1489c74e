"""The FMUs of both FMI versions, checked against the standard and run step by step by FMPy."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...links import to_responses
from ..fmi.archive import NotCompiled, compiled, library_path, unpack, version_and_identifier
from .base import (
    DOUBLE,
    Finding,
    Reference,
    agreement,
    invertible,
    not_checked,
    reference,
    round_trip,
    statement,
)

if TYPE_CHECKING:
    from ...model import Surrogate

OK, OUTSIDE_DOMAIN, NOT_FINITE = 0, 1, 4
STEP = 1e-3
"""Length of a communication step, s."""

FAR = 10.0
"""How far a target that cannot be reached lies from the centre, in scales of the polynomials."""


def verify(model: "Surrogate", prefix: str, folder: Path) -> list[Finding]:
    """Both FMUs in `folder`: the standard's schemas and rules, then values and statuses; see :class:`.Verifier`.

    Its sources are compiled in a temporary folder; without a compiler its values are not checked. The library that it
    holds for this machine, if any, is compared with that one byte for byte, and is not loaded.
    """
    try:
        from fmpy.validation import validate_fmu  # pyright: ignore[reportMissingImports]
    except ImportError:
        return [not_checked("FMUs", "the Python package fmpy is not there: install it (pip install fmpy)")]
    findings, points = [], reference(model)
    for kind in ("forward", "inverse") if invertible(model) else ("forward",):
        path = folder / f"{prefix}_{kind}.fmu"
        if not path.is_file():
            findings.append(statement(f"{path.name} is there", False, "it is missing: write the export again"))
            continue
        problems = validate_fmu(str(path))
        findings.append(statement(f"{path.name} by fmpy.validation", not problems, "; ".join(problems)))
        try:
            with running(path) as fmu:
                findings += (_forward if kind == "forward" else _inverse)(model, path.name, fmu, points)
        except NotCompiled as error:
            findings.append(not_checked(f"values of {path.name}", str(error)))
            continue
        findings.append(_library(path))
    return findings


def _library(path: Path) -> Finding:
    content = path.read_bytes()
    files, (version, identifier) = unpack(content), version_and_identifier(content)
    what, held = f"{path.name}: its library", files.get(library_path(version, identifier))
    if held is None:
        return not_checked(what, "it holds none for this machine, only sources")
    if held == compiled(files, version, identifier):
        return statement(what, True, "byte for byte what this compiler makes of its sources")
    return not_checked(what, "another compiler made it: only its sources were checked")


class Running:
    """One instance of an FMU in step mode.

    Parameters
    ----------
    slave : fmpy.fmi2.FMU2Slave or fmpy.fmi3.FMU3Slave
        Initialized.
    version : str
        ``"2.0"`` or ``"3.0"``.
    inputs, outputs, status : list of int
        Value references.
    """

    def __init__(self, slave: Any, version: str, inputs: list[int], outputs: list[int], status: list[int]) -> None:
        self.slave, self.inputs, self.outputs, self.status, self.time = slave, inputs, outputs, status, 0.0
        two = version == "2.0"
        self._set, self._get = (slave.setReal, slave.getReal) if two else (slave.setFloat64, slave.getFloat64)
        self._get_status = slave.getInteger if two else slave.getInt32

    def step(self, given: ArrayLike) -> tuple[NDArray[np.float64], int]:
        """Outputs and status after a step with the inputs `given`."""
        self._set(self.inputs, [float(v) for v in np.asarray(given)])
        self.slave.doStep(currentCommunicationPoint=self.time, communicationStepSize=STEP)
        self.time += STEP
        return np.array(self._get(self.outputs)), int(self._get_status(self.status)[0])

    def steps(self, given: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
        """The same for one row after the other: (n, n_outputs) and (n,)."""
        answers = [self.step(row) for row in np.asarray(given)]
        return np.array([a for a, _ in answers]), np.array([s for _, s in answers])


@contextmanager
def running(path: Path, name: str = "verified") -> Iterator[Running]:
    """An instance of the FMU at `path`, freed at the end: of its sources, compiled anew.

    A library that lies in an FMU is not loaded: nobody can tell what it is but by making it again.

    Raises
    ------
    NotCompiled
        If there is no compiler, or it fails.
    """
    import fmpy  # pyright: ignore[reportMissingImports]
    from fmpy.fmi2 import FMU2Slave  # pyright: ignore[reportMissingImports]
    from fmpy.fmi3 import FMU3Slave  # pyright: ignore[reportMissingImports]

    content = path.read_bytes()
    files, (version, identifier) = unpack(content), version_and_identifier(content)
    binary = compiled(files, version, identifier)
    described = fmpy.read_model_description(str(path))
    references = {
        causality: [v.valueReference for v in described.modelVariables if v.causality == causality and v.type in kinds]
        for causality, kinds in (("input", ("Real", "Float64")), ("output", ("Real", "Float64")))
    }
    status = [v.valueReference for v in described.modelVariables if v.type in ("Integer", "Int32")]
    # FMPy goes to the library's folder while it loads, and stays there if that fails.
    here = Path.cwd()
    with TemporaryDirectory() as temporary:
        binaries = Path(temporary) / "binaries" / (fmpy.platform if version == "2.0" else fmpy.platform_tuple)
        binaries.mkdir(parents=True)
        (binaries / f"{identifier}{fmpy.sharedLibraryExtension}").write_bytes(binary)
        try:
            slave = (FMU2Slave if version == "2.0" else FMU3Slave)(
                guid=described.guid,
                unzipDirectory=temporary,
                modelIdentifier=identifier,
                instanceName=name,
            )
        finally:
            os.chdir(here)
        try:
            slave.instantiate()
            if version == "2.0":
                slave.setupExperiment(startTime=0.0)
            slave.enterInitializationMode()
            slave.exitInitializationMode()
            yield Running(slave, version, references["input"], references["output"], status)
            slave.terminate()
        finally:
            slave.freeInstance()


def _forward(model: "Surrogate", name: str, fmu: Running, points: Reference) -> list[Finding]:
    got, status = fmu.steps(points.settings)
    beyond = fmu.steps(points.outside)[1]
    last = fmu.step(points.settings[0])[0]
    kept, refused = fmu.step(np.full(len(model.factors), np.nan))
    return [
        agreement(f"{name}: responses", got, points.responses, points.magnitude, DOUBLE),
        statement(f"{name}: settings inside are called good", bool((status == OK).all())),
        statement(f"{name}: settings outside are called so", bool((beyond == OUTSIDE_DOMAIN).all())),
        _refusal(f"{name}: NaN is refused, outputs stay", refused == NOT_FINITE, kept, last),
    ]


def _inverse(model: "Surrogate", name: str, fmu: Running, points: Reference) -> list[Finding]:
    found, status = fmu.steps(points.targets)
    good = np.flatnonzero(status == OK)
    trip = round_trip(model, f"{name}: round trip", points.targets, found, status == OK, DOUBLE)
    if not good.size:
        return [trip]
    last = fmu.step(points.targets[good[0]])[0]
    far = to_responses(model.links, model.predict_coded(np.zeros((1, len(model.factors))))[0] + FAR * model.scale)
    kept_far, refused_far = fmu.step(far)
    kept, refused = fmu.step(np.full(len(model.responses), np.nan))
    return [
        trip,
        _refusal(f"{name}: a far target is refused, outputs stay", refused_far != OK, kept_far, last),
        _refusal(f"{name}: NaN is refused, outputs stay", refused == NOT_FINITE, kept, last),
    ]


def _refusal(what: str, refused: bool, kept: NDArray[np.float64], last: NDArray[np.float64]) -> Finding:
    return statement(what, refused and bool((kept == last).all()))

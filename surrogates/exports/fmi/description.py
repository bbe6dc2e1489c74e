"""``modelDescription.xml`` of FMI 2.0 and 3.0 and ``buildDescription.xml`` of FMI 3.0, from a model alone."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING
from xml.etree import ElementTree as ET

import numpy as np

from ..base import number, plain
from .units import BASE, base_unit

if TYPE_CHECKING:
    from ...model import Surrogate

STATUS_TEXT = "0 good, 1 outside the domain, 2 unreachable, 3 not converged, 4 an input is NaN or infinite"


@dataclass(frozen=True)
class Variable:
    """One real input or output of an FMU.

    Parameters
    ----------
    name : str
        Unique among the variables of its FMU.
    unit : str
        Plain ASCII on one line.
    description : str
        Plain text.
    start : float
        Of an input its start value, of an output what it keeps until there is a good value.
    bounds : tuple of float, optional
        Range of a factor.
    depends_on : tuple of int
        Positions of the inputs that an output follows.
    """

    name: str
    unit: str
    description: str
    start: float
    bounds: tuple[float, float] | None = None
    depends_on: tuple[int, ...] = ()


@dataclass(frozen=True)
class Interface:
    """What one FMU shows: ``forward`` from settings to responses, or ``inverse``.

    Parameters
    ----------
    kind : str
        ``"forward"`` or ``"inverse"``: the C99 function behind it.
    identifier : str
        FMI's modelIdentifier.
    inputs, outputs : tuple of Variable
        Value references count through the inputs, then the outputs; the status and the time follow.
    status, time : str
        Names of the status output and, FMI 3.0 only, of the independent variable.
    """

    kind: str
    identifier: str
    inputs: tuple[Variable, ...]
    outputs: tuple[Variable, ...]
    status: str
    time: str


def interface(model: "Surrogate", prefix: str, kind: str) -> Interface:
    """The interface of the FMU of that `kind`; raises ``ValueError`` where a start value overflows."""
    centre = model.factors.centre
    at_centre = model.predict(centre[None])[0]
    factors = [
        Variable(f.name, plain(f.unit), "factor", float(c), (float(f.low), float(f.high)))
        for f, c in zip(model.factors, centre, strict=True)
    ]
    responses = [
        Variable(r.name, plain(r.unit), "response", float(v), depends_on=_acting(model, j))
        for j, (r, v) in enumerate(zip(model.responses, at_centre, strict=True))
    ]
    if kind == "forward":
        inputs, outputs = factors, responses
    else:
        everything = tuple(range(len(responses)))
        inputs, outputs = responses, [replace(f, depends_on=everything) for f in factors]
    taken = {v.name for v in inputs}
    outputs = [replace(v, name=_free(v.name, taken)) for v in outputs]  # a response may be named as a factor is
    status, time = _free("status", taken), _free("time", taken)
    return Interface(kind, f"{prefix}_{kind}", tuple(inputs), tuple(outputs), status, time)


def model_description(shown: Interface, version: str, token: str) -> bytes:
    """``modelDescription.xml`` of FMI 2.0.1 (section 2.2) or FMI 3.0 (section 2.4), ASCII."""
    return _written(_description2(shown, token) if version == "2.0" else _description3(shown, token))


def build_description(shown: Interface) -> bytes:
    """``buildDescription.xml`` of FMI 3.0 (section 2.5.1.4): one file to compile, and libm where it is apart."""
    root = ET.Element("fmiBuildDescription", fmiVersion="3.0")
    for platform in ("", "x86_64-linux", "aarch64-linux"):
        build = ET.SubElement(root, "BuildConfiguration", modelIdentifier=shown.identifier)
        files = ET.SubElement(build, "SourceFileSet", language="C99")
        ET.SubElement(files, "SourceFile", name=f"{shown.identifier}.c")
        ET.SubElement(
            files,
            "PreprocessorDefinition",
            name="FMI3_OVERRIDE_FUNCTION_PREFIX",
            optional="true",
            value="1",
            description="for a shared library, whose functions have no prefix",
        )
        if platform:
            build.set("platform", platform)
            ET.SubElement(build, "Library", name="m", external="true")
    return _written(root)


def _description2(shown: Interface, token: str) -> ET.Element:
    root = _root(shown, "2.0", guid=token)
    simulation = ET.SubElement(
        root,
        "CoSimulation",
        modelIdentifier=shown.identifier,
        canHandleVariableCommunicationStepSize="true",
        canNotUseMemoryManagementFunctions="true",
        canGetAndSetFMUstate="true",
        canSerializeFMUstate="true",
    )
    ET.SubElement(ET.SubElement(simulation, "SourceFiles"), "File", name=f"{shown.identifier}.c")
    _common(root, shown)
    variables = ET.SubElement(root, "ModelVariables")
    for reference, (variable, causality) in enumerate(_reals(shown)):
        said = _said(variable.name, reference, variable.description, causality, "continuous")
        ET.SubElement(ET.SubElement(variables, "ScalarVariable", said), "Real", _real(variable, causality))
    last = len(shown.inputs) + len(shown.outputs)
    said = _said(shown.status, last, STATUS_TEXT, "output", "discrete")
    ET.SubElement(ET.SubElement(variables, "ScalarVariable", said), "Integer", min="0", max="4")
    structure = ET.SubElement(root, "ModelStructure")
    for name in ("Outputs", "InitialUnknowns"):
        listed = ET.SubElement(structure, name)
        for reference, known in _dependencies(shown):
            # FMI 2.0 counts variables from 1, in the order of ModelVariables.
            ET.SubElement(listed, "Unknown", index=str(reference + 1), dependencies=_list(k + 1 for k in known))
    return root


def _description3(shown: Interface, token: str) -> ET.Element:
    root = _root(shown, "3.0", instantiationToken=token)
    ET.SubElement(
        root,
        "CoSimulation",
        modelIdentifier=shown.identifier,
        canGetAndSetFMUState="true",
        canSerializeFMUState="true",
        canHandleVariableCommunicationStepSize="true",
    )
    _common(root, shown)
    variables = ET.SubElement(root, "ModelVariables")
    for reference, (variable, causality) in enumerate(_reals(shown)):
        said = _said(variable.name, reference, variable.description, causality, "continuous")
        ET.SubElement(variables, "Float64", {**said, **_real(variable, causality)})
    last = len(shown.inputs) + len(shown.outputs)
    said = _said(shown.status, last, STATUS_TEXT, "output", "discrete")
    ET.SubElement(variables, "Int32", {**said, "min": "0", "max": "4"})
    ET.SubElement(variables, "Float64", _said(shown.time, last + 1, "time", "independent", "continuous"))
    structure = ET.SubElement(root, "ModelStructure")
    for name in ("Output", "InitialUnknown"):
        for reference, known in _dependencies(shown):
            ET.SubElement(structure, name, valueReference=str(reference), dependencies=_list(known))
    return root


def _root(shown: Interface, version: str, **token: str) -> ET.Element:
    what = "responses at settings" if shown.kind == "forward" else "settings that give responses"
    return ET.Element(
        "fmiModelDescription",
        {"fmiVersion": version, "modelName": shown.identifier, **token},
        description=f"Polynomial surrogate: {what}",
        generationTool="flexdoce",
        variableNamingConvention="flat",
    )


def _common(root: ET.Element, shown: Interface) -> None:
    """Units and log categories, the same in both versions."""
    units = ET.SubElement(root, "UnitDefinitions")
    for name in sorted({v.unit for v in (*shown.inputs, *shown.outputs)}):
        unit, base = ET.SubElement(units, "Unit", name=name), base_unit(name)
        if base:
            said = {b: str(base.exponents[b]) for b in BASE if b in base.exponents}
            said |= {"factor": number(base.factor)} if base.factor != 1.0 else {}
            said |= {"offset": number(base.offset)} if base.offset else {}
            ET.SubElement(unit, "BaseUnit", said)
    categories = ET.SubElement(root, "LogCategories")
    ET.SubElement(categories, "Category", name="logStatusError", description="calls that were refused")


def _reals(shown: Interface) -> list[tuple[Variable, str]]:
    return [(v, "input") for v in shown.inputs] + [(v, "output") for v in shown.outputs]


def _real(variable: Variable, causality: str) -> dict[str, str]:
    said = {"unit": variable.unit}
    if variable.bounds:
        said |= dict(zip(("min", "max"), map(number, variable.bounds), strict=True))
    return said | ({"start": number(variable.start)} if causality == "input" else {})


def _said(name: str, reference: int, description: str, causality: str, variability: str) -> dict[str, str]:
    return {
        "name": name,
        "valueReference": str(reference),
        "description": description,
        "causality": causality,
        "variability": variability,
    }


def _dependencies(shown: Interface) -> list[tuple[int, Sequence[int]]]:
    """Value reference of each output and of the inputs that it follows; the status follows all."""
    n, everything = len(shown.inputs), range(len(shown.inputs))
    outputs = [(n + i, v.depends_on) for i, v in enumerate(shown.outputs)]
    return [*outputs, (n + len(outputs), everything)]


def _acting(model: "Surrogate", response: int) -> tuple[int, ...]:
    """Positions of the factors in the terms that a response uses."""
    used = np.asarray(model.terms.exponents).reshape(len(model.terms), -1)[model.coefficients[:, response] != 0.0]
    return tuple(int(k) for k in np.flatnonzero((used > 0).any(axis=0)))


def _free(name: str, taken: set[str]) -> str:
    """`name`, with underscores after it as long as it is taken; then it is."""
    while name in taken:
        name += "_"
    taken.add(name)
    return name


def _list(numbers: Iterable[int]) -> str:
    return " ".join(map(str, numbers))


def _written(root: ET.Element) -> bytes:
    ET.indent(root)
    return (
        b'<?xml version="1.0" encoding="UTF-8"?>\n'
        + ET.tostring(root, encoding="us-ascii", xml_declaration=False)
        + b"\n"
    )

"""The FMUs are packed and described as the standards ask, whatever text a model carries."""

import hashlib
import re
from dataclasses import replace
from functools import cache
from xml.etree import ElementTree as ET

import numpy as np
import pytest

from experiments import Factor, FactorSpace, Response
from surrogates import Surrogate, certify, loads
from surrogates.artefact import dumps
from surrogates.exports.fmi.archive import pack, unpack
from surrogates.exports.fmi.targets import HEADERS
from surrogates.exports.fmi.units import BaseUnit, base_unit
from surrogates.exports.verification.fmi import verify
from tests.surrogates.cases import (
    block_map,
    hexflex_like,
    more_responses,
    quintic,
    square_quadratic,
    surrogate,
    unit_box,
)
from tests.surrogates.exports.fmus import both, description, need_fmpy, needs_compiler, variables, write

# --- the archive ------------------------------------------------------------------------------------------------------


@both
def test_the_same_model_gives_the_same_bytes(target):
    model = square_quadratic()
    first = target.render(model, "dev")
    assert first == target.render(loads(dumps(model)), "dev")
    assert list(first) == ["dev_forward.fmu", "dev_inverse.fmu"]
    assert list(target.render(more_responses(), "dev")) == ["dev_forward.fmu"]
    for fmu in first.values():
        assert pack(dict(reversed(unpack(fmu).items()))) == fmu
        assert all(content.isascii() and b"\r" not in content for content in unpack(fmu).values())


@both
def test_every_model_and_kind_has_a_token_of_its_own(target):
    fmus = [f for m in (quintic(), square_quadratic()) for f in target.render(m, "dev").values()]
    key = "guid" if target.version == "2.0" else "instantiationToken"
    tokens = [description(f).attrib[key] for f in fmus]
    assert len(set(tokens)) == 4
    for fmu, token, kind in zip(fmus, tokens, ("forward", "inverse") * 2, strict=True):
        assert f'"{token}"' in unpack(fmu)[f"sources/dev_{kind}.c"].decode()


@both
def test_files_lie_where_the_standard_wants_them(target):
    files = unpack(target.render(quintic(), "dev")["dev_inverse.fmu"])
    major = target.version[0]
    expected = {
        "modelDescription.xml",
        "documentation/index.html",
        "documentation/licenses/license.txt",
        "sources/dev.c",
        "sources/dev.h",
        "sources/dev_inverse.c",
        *(f"sources/fmi_headers/{h.name}" for h in HEADERS.glob(f"fmi{major}*.h")),
    }
    assert set(files) == expected | ({"sources/buildDescription.xml"} if major == "3" else set())
    assert b"THIS SOFTWARE IS PROVIDED BY THE COPYRIGHT HOLDERS" in files["documentation/licenses/license.txt"]
    root = ET.fromstring(files["modelDescription.xml"])
    build = root if major == "2" else ET.fromstring(files["sources/buildDescription.xml"])
    named = {e.attrib["name"] for tag in ("File", "SourceFile") for e in build.iter(tag)}
    assert named == {"dev_inverse.c"}


def test_the_headers_are_the_standards_own():
    sums = {h.name: hashlib.sha256(h.read_bytes()).hexdigest()[:16] for h in HEADERS.glob("*.h")}
    assert sums == {
        "fmi2FunctionTypes.h": "756da446057a5a6d",
        "fmi2Functions.h": "5315e320046c976b",
        "fmi2TypesPlatform.h": "50a180641623f47f",
        "fmi3FunctionTypes.h": "77bb086dbf9b9123",
        "fmi3Functions.h": "6367e9f7895848ed",
        "fmi3PlatformTypes.h": "19ea19ae07cdab58",
    }
    assert all("under the 2-Clause BSD License" in h.read_text() for h in HEADERS.glob("*.h"))


# --- the description --------------------------------------------------------------------------------------------------


@both
def test_variables_carry_start_range_and_unit(target):
    model = hexflex_like()
    fmus = target.render(model, "dev")
    forward, inverse = variables(fmus["dev_forward.fmu"]), variables(fmus["dev_inverse.fmu"])
    for factor, centre in zip(model.factors, model.factors.centre, strict=True):
        said = forward[factor.name]
        assert [float(said[k]) for k in ("min", "max", "start")] == [factor.low, factor.high, centre]
        assert said["causality"] == "input"
        assert said["unit"] == "N"
        assert inverse[factor.name]["causality"] == "output"
        assert "start" not in inverse[factor.name]
    for response, value in zip(model.responses, model.predict(model.factors.centre[None])[0], strict=True):
        assert float(inverse[response.name]["start"]) == value
        assert forward[response.name]["causality"] == "output"
    assert forward["status"]["causality"] == "output"
    assert ("time" in forward) == (target.version == "3.0")


@both
def test_outputs_depend_on_the_factors_in_their_terms(target):
    root = description(target.render(block_map(), "dev")["dev_forward.fmu"])
    structure = root.find("ModelStructure")
    assert structure is not None
    listed = structure.find("Outputs") if target.version == "2.0" else structure.findall("Output")
    assert listed is not None
    first = 1 if target.version == "2.0" else 0
    known = [[int(k) - first for k in e.attrib["dependencies"].split()] for e in listed]
    assert known == [[0, 1], [0, 1], [2, 3], [2, 3], [0, 1, 2, 3]]


@pytest.mark.parametrize(
    ("unit", "exponents", "factor"),
    [
        ("1", {}, 1.0),
        ("N", {"kg": 1, "m": 1, "s": -2}, 1.0),
        ("mN", {"kg": 1, "m": 1, "s": -2}, 1e-3),
        ("N*m", {"kg": 1, "m": 2, "s": -2}, 1.0),
        ("N m", {"kg": 1, "m": 2, "s": -2}, 1.0),
        ("Nm", {"kg": 1, "m": 2, "s": -2}, 1.0),
        ("N/m", {"kg": 1, "s": -2}, 1.0),
        ("N*m/rad", {"kg": 1, "m": 2, "s": -2, "rad": -1}, 1.0),
        ("mm", {"m": 1}, 1e-3),
        ("um", {"m": 1}, 1e-6),
        ("nm", {"m": 1}, 1e-9),
        ("mm^2", {"m": 2}, 1e-6),
        ("m/s2", {"m": 1, "s": -2}, 1.0),
        ("1/K", {"K": -1}, 1.0),
        ("kg", {"kg": 1}, 1.0),
        ("mrad", {"rad": 1}, 1e-3),
        ("deg", {"rad": 1}, np.pi / 180.0),
        ("MPa", {"kg": 1, "m": -1, "s": -2}, 1e6),
        ("V", {"kg": 1, "m": 2, "s": -3, "A": -1}, 1.0),
        ("min", {"s": 1}, 60.0),
    ],
)
def test_units_in_base_units(unit, exponents, factor):
    found = base_unit(unit)
    assert found is not None
    assert found.exponents == exponents
    assert found.factor == pytest.approx(factor, rel=1e-15)
    assert found.offset == 0.0


def test_celsius_has_an_offset():
    assert base_unit("degC") == BaseUnit({"K": 1}, 1.0, 273.15)


@pytest.mark.parametrize(
    "unit", ["furlong", "kg/m*s", "m/s/s", "/m", "m^10", "a b", "1 2", "m2s", "", "<U+1F600>", "Ym9 Ym9 Ym9"]
)
def test_units_that_are_unknown_or_can_be_read_in_two_ways(unit):
    assert base_unit(unit) is None


@both
def test_micro_in_any_writing_is_one_unit(target):
    factors = FactorSpace(tuple(Factor(f"f{i}", unit, 0.0, 1.0) for i, unit in enumerate(("um", "µm", "μm", "N·m"))))
    model = surrogate(factors, ["1", *factors.names], [[1.0, 1.0, 2.0, 3.0, 4.0]], "smoot")
    units = list(description(target.render(model, "dev")["dev_forward.fmu"]).iter("Unit"))
    assert [u.attrib["name"] for u in units] == ["N*m", "smoot", "um"]
    assert units[2][0].attrib == {"m": "1", "factor": "1e-06"}
    assert len(units[1]) == 0


# --- names and hostile text -------------------------------------------------------------------------------------------

HOSTILE = [
    "*/ int injected; /*",
    "</pre><script>alert(1)</script>",
    "<a href='x'>&amp;&lt; ]]> <!-- -- -->",
    '"/><Evil x="',
    "&undefined;",
    "line\r\nbreak\x00\x1b[31m\u2028\ufffe",
    "\ud800",
    "\U0001f600",
    "$p ${P} $ %s%n \\ ??/",
    "µm·θ² — \u202eevil\u2066",
    "x" * 500,
]


def hostile_model(text: str) -> Surrogate:
    unit = text if text.isprintable() and not set(text) & set("[],\"'\\") and not text[0].isspace() else "m"
    factors = FactorSpace((Factor("int", unit, -1.0, 1.0, text), Factor("status", unit, 1.0, 2.0, text)))
    responses = (Response("for", unit, unit, 1.0, text), Response("time", unit, unit, 1.0, text))
    model = surrogate(factors, ["1", "int", "status", "int^2"], [[0.0, 1.0, 2.0, 0.1], [0.0, 2.0, -1.0, 0.0]])
    certificate = replace(certify(model), claim=text, reason=text, method=text)
    return replace(model, responses=responses, certificate=certificate, provenance={text: text, "n": [text, None]})


@cache
def tame(target) -> dict[str, bytes]:
    """The FMUs of the same model without the text."""
    return target.render(replace(hostile_model("m"), provenance={}), "dev")


def code(text: bytes) -> str:
    bare = re.sub(r"/\*.*?\*/", " ", text.decode("ascii"), flags=re.DOTALL)
    return re.sub(r"\{[0-9a-f-]{36}\}", "", " ".join(bare.split()))


@both
@pytest.mark.parametrize("text", HOSTILE, ids=range(len(HOSTILE)))
def test_text_of_the_model_breaks_nothing(tmp_path, target, text):
    model = hostile_model(text)
    bare = tame(target)
    for name, fmu in target.render(model, "dev").items():
        files, expected = unpack(fmu), unpack(bare[name])
        for path, content in files.items():
            assert content.isascii()
            assert all(chr(c).isprintable() or c == 10 for c in content)
            if path.endswith((".c", ".h")):
                assert code(content) == code(expected[path])
        root, plain = ET.fromstring(files["modelDescription.xml"]), ET.fromstring(expected["modelDescription.xml"])
        assert [e.tag for e in root.iter() if e.tag != "BaseUnit"] == [
            e.tag for e in plain.iter() if e.tag != "BaseUnit"
        ]
        assert files["documentation/index.html"].count(b"<") == expected["documentation/index.html"].count(b"<")
    fmpy = need_fmpy()
    from fmpy.validation import validate_fmu  # pyright: ignore[reportMissingImports]

    for name in bare:
        write(tmp_path, target, model)
        assert validate_fmu(str(tmp_path / name)) == []
        assert fmpy.read_model_description(str(tmp_path / name)).coSimulation.modelIdentifier == name.removesuffix(
            ".fmu"
        )


@needs_compiler
@both
def test_names_that_mean_something_in_c_or_fmi(tmp_path, target):
    need_fmpy()
    model = hostile_model("m")
    model = replace(model, responses=(Response("int", "m"), Response("fmi2GetReal", "m")))
    findings = verify(model, "fmu", write(tmp_path, target, model, "fmu"))
    assert [f for f in findings if f.outcome != "agrees" and not f.what.endswith(": its library")] == []
    names = list(variables((tmp_path / "fmu_forward.fmu").read_bytes()))
    assert names == ["int", "status", "int_", "fmi2GetReal", "status_"] + (["time"] if target.version == "3.0" else [])


@both
def test_prefixes_and_numbers_are_refused_as_in_c(target):
    with pytest.raises(ValueError, match=r"prefix name .* is not allowed"):
        target.render(quintic(), "a/../b")
    with pytest.raises(ValueError, match="prefix 'int' is not allowed: a keyword"):
        target.render(quintic(), "int")
    with np.errstate(all="ignore"), pytest.raises(ValueError, match="cannot be exported: a number"):
        target.render(surrogate(unit_box(2), ["1", "f0", "f1"], [[0.0, 1.7e308, 1.7e308]]), "dev")

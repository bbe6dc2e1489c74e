"""The ONNX export is the model: its format, its numbers in onnxruntime, and its metadata."""

import json
import re
import sys
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

from surrogates import Surrogate
from surrogates.exports.base import Target
from surrogates.exports.onnx_graph import ONNX
from surrogates.exports.verification import onnx_graph as verification
from surrogates.exports.verification.base import Outcome
from surrogates.exports.verification.onnx_graph import verify
from tests.surrogates.cases import cantilever_like, many, points, quintic
from tests.surrogates.exports.cases import MODELS
from tests.surrogates.exports.hostile_text import HOSTILE, hostile_model

needs_onnx = pytest.mark.skipif(
    find_spec("onnx") is None, reason="NO ONNX: the package onnx is not installed. No graph was made or checked."
)
needs_runtime = pytest.mark.skipif(
    find_spec("onnx") is None or find_spec("onnxruntime") is None,
    reason="NO ONNXRUNTIME: the packages onnx and onnxruntime are not both installed. No graph was run.",
)


def write(folder: Path, model: Surrogate, prefix: str = "stage") -> Path:
    for name, content in ONNX().render(model, prefix).items():
        (folder / name).write_bytes(content)
    return folder


def graph(model: Surrogate, prefix: str = "stage"):
    import onnx

    return onnx.load_model_from_string(ONNX().render(model, prefix)[f"{prefix}.onnx"])


# --- against the model ------------------------------------------------------------------------------------------------


@needs_runtime
@pytest.mark.parametrize("name", MODELS)
def test_the_verifier_agrees(tmp_path, name):
    found = verify(MODELS[name](), "stage", write(tmp_path, MODELS[name]()))
    assert len(found) == 5
    assert {f.outcome for f in found} == {Outcome.AGREES}, found


@needs_runtime
@pytest.mark.parametrize("name", ["many", "logarithms", "sparse"])
def test_outside_the_domain_the_polynomials_are_the_model_s_and_inside_is_false(name):
    import onnxruntime

    model = MODELS[name]()
    content = ONNX().render(model, "stage")["stage.onnx"]
    session = onnxruntime.InferenceSession(content, providers=["CPUExecutionProvider"])
    settings = points(model, 50, reach=1.5)
    responses, inside = session.run(["responses", "inside"], {"settings": settings})
    expected = model.predict(settings)
    assert np.allclose(responses, expected, rtol=1e-11, atol=0.0)
    assert (inside == model.contains(settings)).all()
    assert 0 < inside.sum() < 50


@needs_onnx
@pytest.mark.parametrize("name", MODELS)
def test_the_graph_is_what_old_runtimes_read(name):
    model = MODELS[name]()
    whole = graph(model)
    assert whole.ir_version == 7
    assert [(o.domain, o.version) for o in whole.opset_import] == [("", 13)]
    assert [i.name for i in whole.graph.input] == ["settings"]
    assert [o.name for o in whole.graph.output] == ["responses", "inside"]
    kinds = {t.name: t.data_type for t in whole.graph.initializer}
    assert set(kinds.values()) <= {7, 11}  # int64 for positions, float64 for numbers
    allowed = {
        "Sub",
        "Div",
        "Abs",
        "LessOrEqual",
        "Cast",
        "ReduceMin",
        "Gather",
        "Mul",
        "Concat",
        "MatMul",
        "Add",
        "Exp",
    }
    assert {n.op_type for n in whole.graph.node} <= allowed
    assert ("Exp" in {n.op_type for n in whole.graph.node}) == model.has_logs


@needs_onnx
@pytest.mark.parametrize("name", MODELS)
def test_the_work_is_what_the_text_says(name):
    whole = graph(MODELS[name]())
    sizes = {t.name: list(t.dims) for t in whole.graph.initializer}
    products = sum(sizes[f"{n.output[0]}_left_at"][0] for n in whole.graph.node if n.op_type == "Mul")
    rows, columns = sizes["coefficients"]
    [said] = re.findall(r"One row takes (\d+) multiplications", whole.graph.doc_string)
    assert int(said) == products + rows * columns


# --- the file ---------------------------------------------------------------------------------------------------------


@needs_onnx
@pytest.mark.parametrize("name", MODELS)
def test_the_same_model_gives_the_same_bytes(name):
    model = MODELS[name]()
    first = ONNX().render(replace(model, provenance={"b": 1, "a": [2]}), "stage")
    assert first == ONNX().render(replace(MODELS[name](), provenance={"a": [2], "b": 1}), "stage")
    assert list(first) == ["stage.onnx"]
    assert isinstance(ONNX(), Target)


@needs_onnx
def test_metadata_say_what_a_reader_must_know():
    model = replace(cantilever_like(), provenance={"config": "leaf.toml", "not JSON": float("nan")})
    given = {p.key: json.loads(p.value) for p in graph(model).metadata_props}
    assert given["flexdoce.factors"][3] == {"name": "load", "unit": "N", "low": 0.8, "high": 1.2}
    assert given["flexdoce.responses"] == [{"name": "r0", "unit": "m"}, {"name": "r1", "unit": "rad"}]
    assert given["flexdoce.certificate"] is None
    assert given["flexdoce.provenance"] == {"config": "leaf.toml", "not JSON": "NaN"}
    assert given["flexdoce.schema"] == "flexdoce-model/1"
    assert "[3] load" in graph(model).graph.doc_string


@needs_onnx
@pytest.mark.parametrize("text", HOSTILE, ids=range(len(HOSTILE)))
def test_text_of_the_model_stays_text(text):
    model = hostile_model(text)
    whole, bare = graph(model), graph(hostile_model("m"))
    assert whole.graph.node == bare.graph.node
    assert whole.graph.initializer == bare.graph.initializer
    given = {p.key: p.value for p in whole.metadata_props}
    assert all(value.isascii() for value in given.values())
    assert json.loads(given["flexdoce.provenance"])[text] == text
    assert json.loads(given["flexdoce.certificate"])["verdict"] == "certified"
    assert all(c.isprintable() or c == "\n" for c in whole.graph.doc_string)


def test_without_the_package_a_sentence_says_what_to_install(monkeypatch):
    for name in [n for n in sys.modules if n == "onnx" or n.startswith("onnx.")]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "onnx", None)
    with pytest.raises(ValueError, match="the ONNX export needs the package onnx, which is not installed: pip install"):
        ONNX().render(quintic(), "stage")


@pytest.mark.parametrize("prefix", ["", "a.b", "../up", "con", "LPT1", None])
def test_a_prefix_that_is_no_file_s_name_is_refused(prefix):
    with pytest.raises(ValueError, match=r"^prefix .* is not allowed"):
        ONNX().render(quintic(), prefix)


# --- the verifier -----------------------------------------------------------------------------------------------------


@needs_runtime
def test_the_verifier_sees_what_is_wrong(tmp_path):
    import onnx

    whole = graph(many())
    [table] = [t for t in whole.graph.initializer if t.name == "coefficients"]
    numbers = onnx.numpy_helper.to_array(table).copy()
    numbers[0, 0] *= 1.0 + 1e-9
    table.CopyFrom(onnx.numpy_helper.from_array(numbers, "coefficients"))
    (tmp_path / "stage.onnx").write_bytes(whole.SerializeToString())
    outcomes = [f.outcome for f in verify(many(), "stage", tmp_path)]
    assert outcomes == [Outcome.AGREES, Outcome.DIFFERS, Outcome.DIFFERS, Outcome.AGREES, Outcome.AGREES]
    whole = graph(many())
    [box] = [t for t in whole.graph.initializer if t.name == "box"]
    box.CopyFrom(onnx.numpy_helper.from_array(np.array(1.00001), "box"))
    (tmp_path / "stage.onnx").write_bytes(whole.SerializeToString())
    assert [f.outcome for f in verify(many(), "stage", tmp_path)].index(Outcome.DIFFERS) == 3


@needs_runtime
def test_the_verifier_reports_a_broken_file(tmp_path):
    [finding] = verify(quintic(), "stage", tmp_path)
    assert finding.outcome is Outcome.DIFFERS
    assert "stage.onnx cannot be read" in finding.detail
    for content in (b"no protobuf", b"", ONNX().render(quintic(), "stage")["stage.onnx"][:300]):
        (tmp_path / "stage.onnx").write_bytes(content)
        found = verify(quintic(), "stage", tmp_path)
        assert [f.outcome for f in found] == [Outcome.DIFFERS, Outcome.DIFFERS], content
        assert all(f.detail for f in found)
    other = cantilever_like()
    (tmp_path / "stage.onnx").write_bytes(ONNX().render(other, "stage")["stage.onnx"])
    assert Outcome.DIFFERS in [f.outcome for f in verify(quintic(), "stage", tmp_path)]


@needs_onnx
def test_the_verifier_says_what_is_missing(tmp_path, monkeypatch):
    write(tmp_path, quintic())
    monkeypatch.setattr(verification, "find_spec", lambda name: None)
    found = verify(quintic(), "stage", tmp_path)
    assert [f.outcome for f in found] == [Outcome.NOT_CHECKED, Outcome.NOT_CHECKED]
    assert [f.detail for f in found] == [
        "the package onnx is not installed: pip install onnx",
        "the package onnxruntime is not installed: pip install onnxruntime",
    ]

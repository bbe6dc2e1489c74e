"""The CasADi export is the model: in numbers, inside a larger expression, and whatever text the model carries."""

import ast
import importlib.util
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from surrogates import Surrogate
from surrogates.exports.base import Target
from surrogates.exports.python.casadi_sx import CasADi, function_prefix
from surrogates.exports.verification.base import Outcome
from surrogates.exports.verification.casadi_sx import verify
from tests.surrogates.cases import hexflex_like, many, points, quintic, surrogate, unit_box
from tests.surrogates.exports.cases import MODELS
from tests.surrogates.exports.hostile_text import HOSTILE, code, hostile_model, random_texts

needs_casadi = pytest.mark.skipif(
    importlib.util.find_spec("casadi") is None,
    reason="NO CASADI: the package casadi is not installed. The exported functions were neither built nor compared.",
)


def write(folder: Path, model: Surrogate, prefix: str = "stage") -> Path:
    for name, content in CasADi().render(model, prefix).items():
        (folder / name).write_text(content, encoding="ascii", newline="\n")
    return folder


def load(folder: Path, model: Surrogate, prefix: str = "stage") -> ModuleType:
    path = write(folder, model, prefix) / f"{prefix}_casadi.py"
    spec = importlib.util.spec_from_file_location(f"{prefix}_casadi", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def size(model: Surrogate) -> np.ndarray:
    total = np.abs(model.coefficients).sum(axis=0)
    return np.where(total > 0.0, total, 1.0)


# --- against the model ------------------------------------------------------------------------------------------------


@needs_casadi
@pytest.mark.parametrize("name", MODELS)
def test_the_verifier_agrees(tmp_path, name):
    found = verify(MODELS[name](), "stage", write(tmp_path, MODELS[name]()))
    assert len(found) == 3
    assert {f.outcome for f in found} == {Outcome.AGREES}, found


@needs_casadi
@pytest.mark.parametrize("name", ["hexflex_like", "many", "sparse"])
def test_forward_and_jacobian_agree_with_the_model(tmp_path, name):
    model = MODELS[name]()
    module = load(tmp_path, model)
    settings = points(model, 30)
    assert (np.abs(module.forward(settings.T).full().T - model.predict(settings)) <= 1e-13 * size(model)).all()
    for point, slope in zip(settings, model.jacobian(settings), strict=True):
        difference = np.abs(module.jacobian(point).full() - slope) * model.factors.half_range
        assert (difference <= 1e-12 * size(model)[:, None]).all()


@needs_casadi
def test_functions_have_names_for_their_inputs_and_outputs(tmp_path):
    module = load(tmp_path, many(), "my__stage_")
    for name, output in (("forward", "responses"), ("jacobian", "jacobian"), ("inside", "inside")):
        function = getattr(module, name)
        assert function.name() == f"my_stage_{name}"
        assert function.name_in() == ["settings"]
        assert function.name_out() == [output]
        assert function.size_in(0) == (5, 1)
    assert module.jacobian.size_out(0) == (3, 5)
    assert [n for n, _ in module.FACTORS] == list(many().factors.names)
    assert [f.low for f in many().factors] == module.LOW
    assert [f.high for f in many().factors] == module.HIGH
    assert function_prefix("a___b_") == "a_b"


@needs_casadi
def test_it_stands_in_larger_expressions_and_is_differentiated_there(tmp_path):
    import casadi

    model = many()
    module = load(tmp_path, model)
    for kind in (casadi.SX, casadi.MX):
        scale = kind.sym("scale")
        x = kind.sym("x", 5)
        cost = casadi.sumsqr(module.forward(scale * x))
        slope = casadi.Function("slope", [scale, x], [casadi.gradient(cost, x)])
        point = points(model, 1)[0]
        expected = 2.0 * (model.predict(point[None])[0] @ model.jacobian(point[None])[0])
        assert np.abs(slope(1.0, point).full()[:, 0] - expected).max() <= 1e-12 * np.abs(expected).max()


@needs_casadi
@pytest.mark.parametrize("name", MODELS)
def test_the_work_is_what_the_header_says(tmp_path, name):
    import casadi

    module = load(tmp_path, MODELS[name]())
    # CasADi writes a division by 0.5 as a product, by 1 not at all: only the sum of both can be counted.
    times = (casadi.OP_MUL, casadi.OP_SQ, casadi.OP_TWICE, casadi.OP_DIV)
    forward = module.forward
    found = sum(forward.instruction_id(k) in times for k in range(forward.n_instructions()))
    [(multiplications, divisions)] = re.findall(r"at most (\d+) multiplications, (\d+) division", module.__doc__)
    most = int(multiplications) + int(divisions)
    assert found <= most
    if name in ("hexflex_like", "many"):  # no coefficient there that costs nothing
        assert found == most - module.HALF_RANGE.count(1.0)


@needs_casadi
@pytest.mark.parametrize("name", ["hexflex_like", "logarithms"])
def test_the_example_in_the_docstring_finds_the_settings(tmp_path, name):
    module = load(tmp_path, MODELS[name]())
    body = "\n".join(line[4:] for line in module.__doc__.partition("Example:")[2].splitlines())
    body = body.replace("forward(CENTRE)", "forward([c + 0.2 * (h - c) for c, h in zip(CENTRE, HIGH)])")
    body = body.replace('"ipopt", problem)', '"ipopt", problem, {"print_time": False, "ipopt.print_level": 0})')
    body += "\nprint(*found.full()[:, 0])\n"
    (tmp_path / "main.py").write_text(body, encoding="ascii")
    done = subprocess.run([sys.executable, "main.py"], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    model = MODELS[name]()
    coded = model.factors.code([[float(word) for word in done.stdout.splitlines()[-1].split()]])
    assert np.abs(coded - 0.2).max() <= 1e-2


# --- the text ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", MODELS)
def test_the_text_is_ascii_the_same_each_time_and_needs_casadi_alone(name):
    files = CasADi().render(MODELS[name](), "stage")
    assert files == CasADi().render(MODELS[name](), "stage")
    assert list(files) == ["stage_casadi.py"]
    text = files["stage_casadi.py"]
    assert text.isascii()
    assert text.endswith("\n")
    assert max(map(len, text.splitlines())) <= 120
    tree = ast.parse(text, feature_version=(3, 8))
    imported = [ast.unparse(node) for node in ast.walk(tree) if isinstance(node, (ast.Import, ast.ImportFrom))]
    assert imported == ["import casadi"]
    assert isinstance(CasADi(), Target)


@pytest.mark.parametrize("text", HOSTILE, ids=range(len(HOSTILE)))
def test_text_of_the_model_cannot_become_code(text):
    source = CasADi().render(hostile_model(text), "stage")["stage_casadi.py"]
    assert all(c.isprintable() or c == "\n" for c in source)
    assert code(source) == code(CasADi().render(hostile_model("m"), "stage")["stage_casadi.py"])


def test_random_text_cannot_become_code():
    model = hostile_model("m")
    expected = code(CasADi().render(model, "stage")["stage_casadi.py"])
    for text in random_texts(60):
        changed = replace(model, provenance={"note": text, text: [text]})
        assert code(CasADi().render(changed, "stage")["stage_casadi.py"]) == expected


@needs_casadi
def test_names_may_be_words_of_python(tmp_path):
    module = load(tmp_path, hostile_model('\'"""\\'))
    assert [n for n, _ in module.FACTORS] == ["lambda", "np"]
    assert [n for n, _ in module.RESPONSES] == ["print", "None"]


@pytest.mark.parametrize("prefix", ["import", "casadi", "CasADi", "math", "nul"])
def test_a_prefix_that_hides_a_module_is_refused(prefix):
    with pytest.raises(ValueError, match=f"^prefix {prefix!r} is not allowed"):
        CasADi().render(quintic(), prefix)


@pytest.mark.filterwarnings("ignore:overflow encountered:RuntimeWarning", "ignore:invalid value:RuntimeWarning")
def test_a_number_that_overflows_is_refused_not_written():
    model = surrogate(unit_box(2), ["1", "f0", "f1"], [[0.0, 1.7e308, 1.7e308]])
    with pytest.raises(ValueError, match="cannot be exported: a number derived from its coefficients overflows"):
        CasADi().render(model, "stage")


# --- the verifier -----------------------------------------------------------------------------------------------------


@needs_casadi
@pytest.mark.parametrize(
    ("old", "new", "what"),
    [
        ("total += _nested", "total -= _nested", "forward"),
        ("casadi.jacobian(_values, _settings)", "casadi.jacobian(2 * _values, _settings)", "Jacobian"),
        ("<= BOX", "<= 1.00001 * BOX", "domain"),
        ("casadi.fabs(x) <= BOX", "casadi.logic_not(casadi.fabs(x) > BOX)", "domain"),
    ],
)
def test_the_verifier_sees_what_is_wrong(tmp_path, old, new, what):
    source = CasADi().render(hexflex_like(), "stage")["stage_casadi.py"]
    assert source.count(old) == 1
    (tmp_path / "stage_casadi.py").write_text(source.replace(old, new))
    wrong = [f.what for f in verify(hexflex_like(), "stage", tmp_path) if f.outcome is Outcome.DIFFERS]
    assert any(what in w for w in wrong), wrong


def test_the_verifier_says_that_there_is_no_file(tmp_path):
    [finding] = verify(quintic(), "stage", tmp_path)
    assert finding.outcome is Outcome.DIFFERS
    assert "stage_casadi.py cannot be read" in finding.detail

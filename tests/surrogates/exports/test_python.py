"""The Python export is the model: in numbers, in what it refuses, and in that no text of the model becomes code."""

import ast
import importlib.util
import subprocess
import sys
import warnings
from dataclasses import replace
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from surrogates import Surrogate, obstacle
from surrogates.exports.base import Target
from surrogates.exports.python.numpy_file import NumPyFile
from surrogates.exports.verification.base import Outcome
from surrogates.exports.verification.numpy_file import verify
from surrogates.exports.verification.python_run import run_file
from tests.surrogates.cases import (
    cantilever_like,
    constant,
    many,
    more_responses,
    overdetermined,
    points,
    quintic,
    square_quadratic,
    surrogate,
    underdetermined,
    unit_box,
)
from tests.surrogates.exports.cases import MODELS, certified, logarithms
from tests.surrogates.exports.hostile_text import HOSTILE, code, hostile_model, random_texts

OK, OUTSIDE_DOMAIN, UNREACHABLE, NOT_CONVERGED, NOT_FINITE = range(5)


def write(folder: Path, model: Surrogate, prefix: str = "stage", **settings) -> Path:
    for name, content in NumPyFile(**settings).render(model, prefix).items():
        (folder / name).write_text(content, encoding="ascii", newline="\n")
    return folder


def load(folder: Path, model: Surrogate, prefix: str = "stage", **settings) -> ModuleType:
    spec = importlib.util.spec_from_file_location(prefix, write(folder, model, prefix, **settings) / f"{prefix}.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module", params=MODELS)
def pair(request, tmp_path_factory):
    model = MODELS[request.param]()
    return model, load(tmp_path_factory.mktemp(request.param), model)


@pytest.fixture
def inverted(pair):
    """The same, where the export has an inverse."""
    if obstacle(pair[0]):
        pytest.skip("this model has no inverse")
    return pair


def sizes(model: Surrogate, responses):
    """What rounding errors are relative to."""
    logs = np.array([link == "log" for link in model.links])
    size = np.maximum(np.abs(model.coefficients).sum(axis=0), np.finfo(float).tiny)
    return np.where(logs, np.abs(responses) * (1.0 + size), size)


# --- against the model ------------------------------------------------------------------------------------------------


def test_forward_jacobian_and_domain_agree_with_the_model(pair):
    model, module = pair
    settings = points(model, 200, reach=1.2)
    expected, slopes = model.predict(settings), model.jacobian(settings)
    size = sizes(model, expected)
    reach = 1.2 ** model.terms.degrees.max(initial=1)
    assert (np.abs(module.forward(settings) - expected) <= 1e-13 * reach * size).all()
    degree = max(1, model.terms.degrees.max(initial=1))
    allowed = 1e-13 * reach * degree * size[:, :, None] / model.factors.half_range
    assert (np.abs(module.jacobian(settings) - slopes) <= allowed).all()
    assert (module.inside(settings) == model.contains(settings)).all()
    assert 0 < module.inside(settings).sum() < 200


@pytest.mark.parametrize("name", MODELS)
def test_the_verifier_agrees(tmp_path, name):
    found = verify(MODELS[name](), "stage", write(tmp_path, MODELS[name]()))
    assert len(found) == (4 if obstacle(MODELS[name]()) else 7)
    assert {f.outcome for f in found} == {Outcome.AGREES}, found


def test_inverse_gives_back_the_settings_or_refuses(inverted):
    model, module = inverted
    settings = points(model, 200, seed=1, reach=0.6)
    targets = model.predict(settings)
    found, status = module.inverse(targets)
    ok = status == OK
    # Where the least-norm steps leave the box the export refuses; the model searches the boundary.
    assert ok.mean() > 0.75
    assert np.isnan(found[~ok]).all()
    assert model.contains(found[ok]).all()
    assert (np.abs(model.predict(found[ok]) - targets[ok]) <= 1.01e-9 * sizes(model, targets[ok])).all()


@pytest.mark.parametrize("name", ["square_quadratic", "certified", "hexflex_like", "logarithms", "quintic"])
def test_where_the_settings_are_the_only_ones_they_come_back(name, tmp_path):
    model = MODELS[name]()
    settings = points(model, 100, seed=1)
    found, status = load(tmp_path, model).inverse(model.predict(settings))
    assert (status == OK).all()
    assert np.abs((found - settings) / model.factors.half_range).max() <= 1e-9


def test_least_norm_where_there_are_more_factors(tmp_path):
    model = underdetermined()
    targets = model.predict(points(model, 20, reach=0.4))
    centre = np.zeros((1, 4))
    slope = model.jacobian_coded(centre)[0]
    expected = np.linalg.lstsq(slope, (targets - model.predict_coded(centre)).T)[0].T
    found, status = load(tmp_path, model).inverse(targets)
    assert (status == OK).all()
    assert np.abs(model.factors.code(found) - expected).max() <= 1e-12


# --- refusals ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_a_row_that_is_not_finite_is_refused_alone(pair, bad):
    model, module = pair
    settings = points(model, 6, reach=0.5)
    wrong = settings.copy()
    wrong[2, -1] = bad
    others = np.arange(6) != 2
    assert (module.inside(wrong) == others).all()
    for name in ("forward", "jacobian"):
        answer = getattr(module, name)(wrong)
        assert np.isnan(answer[2]).all()
        assert np.array_equal(answer[others], getattr(module, name)(settings)[others])
    if not obstacle(model):
        targets = module.forward(settings)
        broken = targets.copy()
        broken[2, 0] = bad
        found, status = module.inverse(broken)
        assert status[2] == NOT_FINITE
        assert np.isnan(found[2]).all()
        assert np.array_equal(found[others], module.inverse(targets)[0][others], equal_nan=True)


def test_the_answer_of_a_row_does_not_depend_on_the_others(pair):
    model, module = pair
    settings = points(model, 40, seed=2)
    responses, slopes = module.forward(settings), module.jacobian(settings)
    for k, row in enumerate(settings):
        assert np.array_equal(module.forward(row[None])[0], responses[k])
        assert np.array_equal(module.jacobian(row[None])[0], slopes[k])
    if not obstacle(model):
        found, status = module.inverse(responses)
        for k, row in enumerate(responses):
            alone, one = module.inverse(row[None])
            assert one[0] == status[k]
            assert np.array_equal(alone[0], found[k], equal_nan=True)


def test_ok_is_never_said_of_settings_outside_or_of_a_missed_target(inverted):
    model, module = inverted
    centre = model.predict_coded(np.zeros((1, len(model.factors))))
    scatter = np.random.default_rng(2).uniform(-2.0, 2.0, (300, len(model.responses)))
    values = centre + model.scale * scatter
    logs = np.array([link == "log" for link in model.links])
    with np.errstate(over="ignore"):
        found, status = module.inverse(np.where(logs, np.exp(values), values))
    ok = status == OK
    coded = model.factors.code(found[ok])
    assert (np.abs(coded) <= 1.0 + 1e-15).all()
    assert (np.abs(model.predict_coded(coded) - values[ok]) <= 1.01e-9 * model.scale).all()
    assert np.isnan(found[~ok]).all()
    assert set(status[~ok]) <= {OUTSIDE_DOMAIN, UNREACHABLE, NOT_CONVERGED}
    assert (~ok).any()


def test_huge_and_tiny_numbers_neither_warn_nor_fail(inverted):
    model, module = inverted
    m, k = len(model.responses), len(model.factors)
    sizes = np.array([1e30, 1e300, 1.7e308, -1.7e308, 5e-324])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found, status = module.inverse(np.repeat(sizes[:4, None], m, axis=1))
        assert (status != OK).all()
        assert np.isnan(found).all()
        assert not module.inside(np.repeat(sizes[:4, None], k, axis=1)).any()
        module.forward(np.repeat(sizes[:, None], k, axis=1))
        module.jacobian(np.repeat(sizes[:, None], k, axis=1))


def test_statuses(tmp_path):
    model = overdetermined()
    target = model.predict(points(model, 1, reach=0.2))
    off = target + np.array([0.0, 0.0, 1e-3 * model.scale[2]])
    module = load(tmp_path, model)
    assert (module.OK, module.OUTSIDE_DOMAIN, module.UNREACHABLE, module.NOT_CONVERGED, module.NOT_FINITE) == (
        OK,
        OUTSIDE_DOMAIN,
        UNREACHABLE,
        NOT_CONVERGED,
        NOT_FINITE,
    )
    assert module.inverse(np.vstack([target, off, target * np.nan]))[1].tolist() == [OK, UNREACHABLE, NOT_FINITE]
    curved = square_quadratic()
    wanted = curved.predict(curved.factors.decode([[1.1, -0.3, 0.5], [0.2, -1.05, 0.9]]))
    assert load(tmp_path, curved).inverse(wanted)[1].tolist() == [OUTSIDE_DOMAIN, OUTSIDE_DOMAIN]
    found, status = load(tmp_path, constant()).inverse([[3.0, 0.0], [3.1, 0.0]])
    assert status.tolist() == [OK, UNREACHABLE]
    assert (found[0] == 0.0).all()


def test_logarithms_refuse_what_has_none(tmp_path):
    module = load(tmp_path, logarithms())
    target = module.forward([module.CENTRE])[0]
    rows = np.array([target] * 4)
    rows[:3, 1] = [0.0, -0.0, -1e300]
    rows[3] = [-1.0, -1.0, np.nan]
    assert module.inverse(rows)[1].tolist() == [UNREACHABLE] * 3 + [NOT_FINITE]
    assert "The polynomials give ln(response / unit) of r1 and r2" in module.__doc__


def test_steps_are_those_of_the_certificate_or_of_the_setting(tmp_path):
    target = square_quadratic().predict(points(square_quadratic(), 1, seed=4, reach=0.9))
    assert load(tmp_path, square_quadratic(), max_iterations=1).inverse(target)[1].tolist() == [NOT_CONVERGED]
    model = certified()
    assert model.certificate is not None
    module = load(tmp_path, model, max_iterations=1)
    assert model.certificate.newton_iterations == module.STEPS
    assert module.LIMIT == 1.0
    assert module.inverse(target)[1].tolist() == [OK]
    with pytest.raises(
        ValueError, match="max_iterations of the Python export must be a whole number of at least 1, got 0"
    ):
        NumPyFile(max_iterations=0)


def test_a_curved_model_of_more_responses_than_factors_has_no_inverse_and_says_why(tmp_path):
    module = load(tmp_path, more_responses())
    assert "There is no inverse: 3 responses follow from 2 factors, so that they cannot be chosen" in module.__doc__
    for name in ("inverse", "GAIN", "TOLERANCE", "OK", "_search", "_solved"):
        assert not hasattr(module, name)


def test_wrong_shapes_are_refused_and_no_rows_are_none(tmp_path):
    model = cantilever_like()
    module = load(tmp_path, model)
    for given in ([1.0, 2.0, 3.0, 4.0], np.zeros((2, 3)), 1.0):
        with pytest.raises(ValueError, match=r"expected shape \(n, 4\), columns length, width, thickness, load; got "):
            module.forward(given)
    with pytest.raises(ValueError, match=r"expected shape \(n, 2\), columns r0, r1; got \(1, 3\)"):
        module.inverse(np.zeros((1, 3)))
    assert module.forward(np.zeros((0, 4))).shape == (0, 2)
    assert module.jacobian(np.zeros((0, 4))).shape == (0, 2, 4)
    assert module.inside(np.zeros((0, 4))).shape == (0,)
    assert [part.shape for part in module.inverse(np.zeros((0, 2)))] == [(0, 4), (0,)]


def test_what_is_given_is_not_changed(tmp_path):
    module = load(tmp_path, logarithms())
    settings = np.array([module.CENTRE, module.CENTRE * np.nan])
    responses = module.forward(settings)
    kept = settings.copy(), responses.copy()
    module.forward(settings)
    module.jacobian(settings)
    module.inverse(responses)
    assert np.array_equal(settings, kept[0], equal_nan=True)
    assert np.array_equal(responses, kept[1], equal_nan=True)


# --- the text ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", MODELS)
def test_the_text_is_ascii_the_same_each_time_and_python_3_8(name):
    model = MODELS[name]()
    files = NumPyFile().render(model, "stage")
    assert files == NumPyFile().render(MODELS[name](), "stage")
    assert list(files) == ["stage.py"]
    text = files["stage.py"]
    assert text.isascii()
    assert text.endswith("\n")
    assert max(map(len, text.splitlines())) <= 120
    tree = ast.parse(text, feature_version=(3, 8))
    imported = [ast.unparse(node) for node in ast.walk(tree) if isinstance(node, (ast.Import, ast.ImportFrom))]
    assert imported == ["from collections import namedtuple", "import numpy as np"]
    assert isinstance(NumPyFile(), Target)


def test_every_number_survives_the_text(tmp_path):
    model = many()
    module = load(tmp_path, model)
    table = {positions: row for positions, row in module.TERMS}
    for row, coefficients in zip(model.terms.exponents, model.coefficients, strict=True):
        positions = tuple(j for j, power in enumerate(row) for _ in range(power))
        assert table[positions] == tuple(coefficients)
    assert [tuple(f) for f in module.FACTORS] == [(f.name, f.unit, f.low, f.high) for f in model.factors]
    assert [tuple(r) for r in module.RESPONSES] == [(r.name, r.unit) for r in model.responses]


@pytest.mark.parametrize("name", ["hexflex_like", "cantilever_like", "more_responses", "logarithms"])
def test_the_example_in_the_docstring_runs(tmp_path, name):
    module = load(tmp_path, MODELS[name]())
    example = module.__doc__.partition("Example:")[2]
    body = "\n".join(line[4:] for line in example.splitlines())
    (tmp_path / "main.py").write_text(body, encoding="ascii")
    done = subprocess.run([sys.executable, "main.py"], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("text", HOSTILE, ids=range(len(HOSTILE)))
def test_text_of_the_model_cannot_become_code(tmp_path, text):
    source = NumPyFile().render(hostile_model(text), "stage")["stage.py"]
    assert all(c.isprintable() or c == "\n" for c in source)
    assert code(source) == code(NumPyFile().render(hostile_model("m"), "stage")["stage.py"])
    module = load(tmp_path, hostile_model(text))
    assert [f.name for f in module.FACTORS] == ["lambda", "np"]
    assert module.inverse(module.forward([module.CENTRE]))[1].tolist() == [OK]


def test_random_text_cannot_become_code():
    model = hostile_model("m")
    expected = code(NumPyFile().render(model, "stage")["stage.py"])
    for text in random_texts(60):
        changed = replace(model, provenance={"note": text, text: [text]})
        assert code(NumPyFile().render(changed, "stage")["stage.py"]) == expected


@pytest.mark.parametrize("prefix", ["import", "None", "numpy", "NumPy", "math", "Random", "con", "surrogates"])
def test_a_prefix_that_hides_a_module_is_refused(prefix):
    with pytest.raises(ValueError, match=f"^prefix {prefix!r} is not allowed"):
        NumPyFile().render(quintic(), prefix)


@pytest.mark.parametrize("prefix", ["", "1a", "a-b", "a.b", "../up", "é", None])
def test_a_prefix_that_is_not_an_identifier_is_refused(prefix):
    with pytest.raises(ValueError, match=r"^prefix name .* is not allowed: use letters, digits and underscores"):
        NumPyFile().render(quintic(), prefix)


@pytest.mark.filterwarnings("ignore:overflow encountered:RuntimeWarning", "ignore:invalid value:RuntimeWarning")
def test_a_number_that_overflows_is_refused_not_written():
    model = surrogate(unit_box(2), ["1", "f0", "f1"], [[0.0, 1.7e308, 1.7e308]])
    with pytest.raises(ValueError, match="cannot be exported: a number derived from its coefficients overflows"):
        NumPyFile().render(model, "stage")


# --- the verifier -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "old", "new", "what"),
    [
        ("folded", "((0,), (0.2,))", "((0,), (0.2000000001,))", "forward"),
        ("many", "/ HALF_RANGE\n    slopes", "\n    slopes", "Jacobian"),
        ("folded", "BOX = 1.000000001", "BOX = 1.00001", "domain"),
        (
            "hexflex_like",
            "responses[~np.isfinite(settings).all(axis=1)] = np.nan",
            "pass",
            "NaN and infinity are outside",
        ),
        ("overdetermined", "<= TOLERANCE", "<= 1e9 * TOLERANCE", "targets from outside"),
        ("certified", "step = _step(", "step = -_step(", "inverse"),
        ("hexflex_like", "] = NOT_FINITE", "] = UNREACHABLE", "targets that are NaN"),
    ],
)
def test_the_verifier_sees_what_is_wrong(tmp_path, name, old, new, what):
    model = MODELS[name]()
    source = NumPyFile().render(model, "stage")["stage.py"]
    assert source.count(old) == 1
    (tmp_path / "stage.py").write_text(source.replace(old, new))
    wrong = [f.what for f in verify(model, "stage", tmp_path) if f.outcome is Outcome.DIFFERS]
    assert any(what in w for w in wrong), wrong


def test_the_verifier_says_what_it_could_not_run(tmp_path):
    [finding] = verify(quintic(), "stage", tmp_path)
    assert finding.outcome is Outcome.DIFFERS
    assert "stage.py cannot be read" in finding.detail
    (tmp_path / "stage.py").write_text("raise RuntimeError('broken')")
    [finding] = verify(quintic(), "stage", tmp_path)
    assert finding.outcome is Outcome.DIFFERS
    assert finding.detail == "it ended with an error: RuntimeError: broken"
    missing = run_file("it", tmp_path / "stage.py", "no_such_package", "", {})
    assert not isinstance(missing, dict)
    assert missing.outcome is Outcome.NOT_CHECKED
    assert missing.detail == "the package no_such_package is not installed: pip install no_such_package"

"""``model.json``: written and read bit for bit, and refused with a sentence when it is not one."""

import copy
import json
import subprocess
import sys
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from experiments import Factor, FactorSpace, Response
from surrogates import ResponseError, certify, dumps, load, loads
from surrogates.intervals import Interval
from surrogates.validation import compare
from tests.surrogates.cases import ALL, constant, hexflex_like, points, quintic, surrogate, underdetermined

ROOT = Path(__file__).parents[2]


def dressed(model):
    """The model as the pipeline leaves it: validated, certified, with provenance."""
    point = tuple((model.factors.centre + 0.3 * model.factors.half_range).tolist())
    intervals = Interval(0.9, 1e-9 / 7.0, 25, 0.88, 25), Interval(0.95, 2e-9 / 7.0, 25, 0.96, 25)
    errors = tuple(
        ResponseError(r.name, 50, 1e-9 / 3.0, 1e-6, 1e-3 / 3.0, 1e-10, 7, 1e-4 / 3.0, 1.0 - 1e-6, point, intervals)
        for r in model.responses
    )
    provenance = {"config": "study.toml", "seed": 7, "versions": {"numpy": "2.0"}, "warnings": ["a", "µ"], "none": None}
    return replace(model, validation=errors, certificate=certify(model), provenance=provenance)


# --- the round trip ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ALL)
@pytest.mark.parametrize("dress", [dressed, lambda model: model], ids=["dressed", "bare"])
def test_reading_and_writing_again_gives_the_same_text(name, dress):
    model = dress(ALL[name]())
    text = dumps(model)
    again = loads(text)
    assert dumps(again) == text
    assert_array_equal(again.coefficients, model.coefficients)
    assert again.factors == model.factors
    assert again.responses == model.responses
    assert again.terms == model.terms
    assert again.validation == model.validation
    assert again.certificate == model.certificate
    assert dict(again.provenance) == dict(model.provenance)
    X = points(model, 20)
    assert_array_equal(again.predict(X), model.predict(X))


def test_awkward_numbers_and_texts_survive():
    space = FactorSpace((Factor("a", "µm", -0.1, 0.1 + 0.2, 'quote " and \\ and */'), Factor("b", "1", 5e-324, 1e300)))
    values = [[1.0 / 3.0, 5e-324, -1e300], [0.1 + 0.2, -0.0, 2.0**-1074]]
    model = replace(
        surrogate(space, ["1", "a", "a^2"], values),
        responses=(Response("r", "m", "µm", 1e6, "θx"), Response("s", "rad")),
    )
    again = loads(dumps(model))
    assert again.coefficients.tobytes() == model.coefficients.tobytes()
    assert (again.factors, again.responses) == (model.factors, model.responses)


def test_an_error_on_a_response_that_is_always_zero_survives():
    model = constant()
    errors = compare(model.responses, [[3.0, 0.0]] * 2, [[3.0, 1e-15], [3.0, 0.0]])
    assert errors[1].max_relative == np.inf
    text = dumps(replace(model, validation=errors))
    json.loads(text, parse_constant=pytest.fail)
    assert loads(text).validation == errors


def test_a_file_from_before_q2_and_intervals_is_read_and_comes_back_as_it_was():
    """Schema flexdoce-model/1 as it was first written: seven entries an error."""
    model = hexflex_like()
    old = tuple(ResponseError(r.name, 50, 1e-9 / 3.0, 1e-6, 1e-3 / 3.0, 1e-10, 7) for r in model.responses)
    document = json.loads(dumps(model)) | {
        "validation": [
            {
                "response": e.response, "n_runs": 50, "max_abs": e.max_abs, "range": e.range,
                "max_relative": e.max_relative, "rmse": e.rmse, "worst_run": 7,
            }
            for e in old
        ]
    }  # fmt: skip
    del document["digest"]
    text = json.dumps(document, indent=2, ensure_ascii=False) + "\n"
    again = loads(text)
    assert again.validation == old
    assert {(e.relative_rmse, e.q2, e.worst_point, e.intervals) for e in again.validation} == {(None, None, (), ())}
    written = json.loads(dumps(again))
    assert written.pop("digest").startswith("sha256:")
    assert written == document
    with pytest.raises(
        ValueError, match="response 'r0' has no intervals, as in models from before they were calibrated"
    ):
        replace(again, validation=tuple(replace(e, n_runs=1000) for e in old)).interval(points(model, 1), 0.9)


def test_what_has_no_denominator_is_null_and_comes_back():
    model = constant()
    errors = compare(model.responses, [[3.0, 0.0]] * 2, [[3.0, 1e-15], [3.0, 0.0]])
    assert (errors[1].relative_rmse, errors[1].q2) == (np.inf, -np.inf)
    entry = json.loads(dumps(replace(model, validation=errors)))["validation"][1]
    assert [entry[name] for name in ("max_relative", "relative_rmse", "q2")] == [None] * 3


def test_the_text_is_json_that_a_person_can_read(tmp_path):
    text = dumps(dressed(hexflex_like()))
    document = json.loads(text)
    assert text.endswith("}\n")
    assert document["schema"] == "flexdoce-model/1"
    assert document["factors"][0] == asdict(hexflex_like().factors.factors[0])
    assert list(document["coefficients"]) == [f"r{j}" for j in range(6)]
    assert "µ" in text
    (tmp_path / "model.json").write_text(text, encoding="utf-8")
    assert dumps(load(tmp_path / "model.json")) == text
    assert dumps(load(str(tmp_path / "model.json"))) == text


def test_the_affine_part_is_the_map_and_its_inverse_in_physical_units():
    model = hexflex_like()
    affine = json.loads(dumps(model))["affine"]
    X = points(model, 10)
    Y = X @ np.array(affine["matrix"]).T + affine["offset"]
    assert np.abs((Y - model.predict(X)) / model.scale).max() < 1e-13
    back = Y @ np.array(affine["inverse"]).T + affine["inverse_offset"]
    assert np.abs((back - X) / model.factors.half_range).max() < 1e-12
    assert affine["rows"][0] == "r0[m]"
    assert affine["columns"][0] == "T1D1[N]"
    assert json.loads(dumps(quintic()))["affine"] is None
    assert json.loads(dumps(underdetermined()))["affine"]["condition"] > 1.0


@pytest.mark.parametrize("blocked", [["jax", "sklearn", "pandas", "matplotlib"], ["scipy", "pyDOE3"]])
def test_load_and_predict_need_numpy_alone(tmp_path, blocked):
    (tmp_path / "model.json").write_text(dumps(dressed(hexflex_like())), encoding="utf-8")
    script = f"""
import sys
for name in {blocked!r}:
    sys.modules[name] = None  # an import of it now raises
from surrogates import load
model = load({str(tmp_path / "model.json")!r})
X = model.factors.centre[None]
assert model.invert(model.predict(X)).ok.all() and model.jacobian(X).shape == (1, 6, 6)
assert not any(sys.modules.get(name) for name in {blocked!r})
"""
    done = subprocess.run([sys.executable, "-c", script], cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[-600:]


# --- refusals ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "not valid JSON"),
        ("{", "not valid JSON"),
        ("nonsense", "not valid JSON"),
        ("[]", "expected schema 'flexdoce-model/1' or 'flexdoce-model/2', found 'list'"),
        ("3", "expected schema 'flexdoce-model/1' or 'flexdoce-model/2', found 'int'"),
        ("null", "found 'NoneType'"),
        ("{}", "expected schema 'flexdoce-model/1' or 'flexdoce-model/2', found None"),
        ('{"schema": "flexdoce-model/3"}', "found 'flexdoce-model/3'"),
        ('{"schema": ["flexdoce-model/1"]}', "expected schema"),
        ('{"schema": "flexdoce-model/1"}', "missing or of the wrong kind: 'factors'"),
        ('{"schema": "flexdoce-model/1", "x": NaN}', "not valid JSON: NaN is not a number"),
        ('{"schema": "flexdoce-model/1", "x": -Infinity}', "not valid JSON: -Infinity is not a number"),
        ("[" * 100_000, "not valid JSON"),
        ("1" * 5000, "digits|schema"),
    ],
)
def test_a_text_that_is_no_model_is_refused(text, message):
    with pytest.raises(ValueError, match=message):
        loads(text)


def test_a_text_cut_anywhere_is_refused():
    text = dumps(dressed(quintic()))
    for end in range(0, len(text) - 2, 7):
        with pytest.raises(ValueError, match="not valid JSON"):
            loads(text[:end])


def changed(change):
    document = json.loads(dumps(dressed(hexflex_like())))
    change(document)
    return json.dumps(document)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda d: d.pop("terms"), "missing or of the wrong kind: 'terms'"),
        (lambda d: d.pop("validation"), "missing or of the wrong kind: 'validation'"),
        (lambda d: d.pop("certificate"), "missing or of the wrong kind: 'certificate'"),
        (lambda d: d["factors"][0].pop("unit"), "'unit'"),
        (lambda d: d["factors"][0].update(colour="red"), "'colour'"),
        (lambda d: d["factors"][0].update(low=9.0), "low must be below high"),
        (lambda d: d["factors"][0].update(low=True), "low must be .*got True|must be finite numbers, got True"),
        (lambda d: d["factors"][0].update(low=10**400), "factor.*low"),
        (lambda d: d["factors"][0].update(name="a b"), "factor name 'a b' is not allowed"),
        (lambda d: d["factors"].append(d["factors"][0]), "factor names must differ"),
        (lambda d: d.update(factors=[]), "at least one factor"),
        (lambda d: d["terms"].append("T9D9"), "one coefficient per term|unknown factor 'T9D9'"),
        (lambda d: d["terms"].__setitem__(1, "T1D1^-1"), "must be a positive whole number"),
        (lambda d: d["terms"].__setitem__(1, "T2D1"), "a term appears twice"),
        (lambda d: d["coefficients"].pop("r3"), "coefficients must be given for r0, r1, r2, r3, r4, r5"),
        (lambda d: d["coefficients"].update(r9=[1.0]), "coefficients must be given for"),
        (lambda d: d["coefficients"]["r0"].pop(), "one coefficient per term"),
        (lambda d: d["coefficients"].update(r0=5.0), "r0 must be a list, got 5.0"),
        (lambda d: d["coefficients"]["r0"].__setitem__(0, "x"), "could not convert string|numbers"),
        (lambda d: d["coefficients"]["r0"].__setitem__(0, None), "finite|wrong kind|numbers"),
        (lambda d: d["coefficients"]["r0"].__setitem__(0, 10**400), "r0|wrong kind|finite"),
        (lambda d: d["validation"][0]["worst_point"].pop(), "worst_point must be 6 finite numbers, .*; got 5"),
        (lambda d: d["validation"][0].update(worst_point=3), "worst_point must be a list, got 3"),
        (lambda d: d["validation"][0].update(intervals=3), "intervals must be a list, got 3"),
        (lambda d: d["validation"][0].update(q2="good"), "validation: q2 must be a number, got 'good'"),
        (
            lambda d: d["validation"][0]["intervals"][0].update(level=90),
            "level of an interval must lie between 0 and 1",
        ),
        (
            lambda d: d["validation"][0]["intervals"][0].update(half_width=-1.0),
            "half_width must be finite and at least",
        ),
        (lambda d: d["validation"][0]["intervals"][0].update(coverage=88), "coverage must be from 0 to 1, got 88"),
        (lambda d: d["validation"][0]["intervals"][0].update(colour=1), "interval has no setting 'colour'"),
        (lambda d: d["validation"][0]["intervals"][0].pop("n_check"), "interval needs the setting 'n_check'"),
        (lambda d: d["certificate"].update(verdict="proven"), "'proven' is not a valid Verdict"),
        (lambda d: d["certificate"].update(verdict=None), "not a valid Verdict"),
    ],
)
def test_a_document_that_is_inconsistent_is_refused(change, message):
    with pytest.raises(ValueError, match=message):
        loads(changed(change))


@pytest.mark.parametrize(
    "change",
    [
        lambda d: d["validation"][0].update(max_abs="small"),
        lambda d: d["validation"][0].update(max_abs=None),
        lambda d: d["validation"][0].update(n_runs=[50]),
        lambda d: d["validation"][0].update(response="nobody"),
        lambda d: d["certificate"].update(claim=3),
        lambda d: d["certificate"].update(witness=["x"]),
        lambda d: d["factors"][0].update(source=["a"]),
        lambda d: d["responses"][0].update(symbol=3),
        lambda d: d["responses"][0].update(shown_scale=True),
        lambda d: d["coefficients"]["r0"].__setitem__(0, "3"),
        lambda d: d["coefficients"]["r0"].__setitem__(0, True),
    ],
    ids=[
        "max_abs text", "max_abs null", "n_runs list", "unknown response", "claim number", "witness text",
        "source list", "symbol number", "scale bool", "coefficient text", "coefficient bool",
    ],
)  # fmt: skip
def test_a_value_of_the_wrong_kind_is_refused(change):
    with pytest.raises(ValueError, match=r"."):
        loads(changed(change))


BAD = [None, True, 0, -1, 1.5, 1e308, 10**400, "", "x", "1", "\ud800", [], [1], [[1]], [None], {}, {"a": 1}, [[[]]]]


def places(node, path=()):
    yield path
    if isinstance(node, dict | list):
        for key, child in list(node.items() if isinstance(node, dict) else enumerate(node))[:8]:
            yield from places(child, (*path, key))


@pytest.mark.filterwarnings("ignore::RuntimeWarning")  # 1e308 may overflow on its way to a refusal
@pytest.mark.parametrize("name", ["overdetermined", "quintic"])
def test_no_mutation_of_a_document_escapes_as_another_error(name):
    document = json.loads(dumps(dressed(ALL[name]())))
    escaped = []
    for path in places(document):
        for value in ("delete", "double", *BAD):
            text = json.dumps(mutated(document, path, value))
            try:
                dumps(loads(text))
            except ValueError:
                continue
            except Exception as error:
                escaped.append((path, str(value)[:20], repr(error)[:60]))
    assert not escaped, escaped[:5]


def mutated(document, path, value):
    if not path:
        return document if isinstance(value, str) else value
    document = copy.deepcopy(document)
    parent = document
    for key in path[:-1]:
        parent = parent[key]
    if value == "delete":
        del parent[path[-1]]
    elif value == "double" and isinstance(parent, list):
        parent.append(parent[path[-1]])
    elif value != "double":
        parent[path[-1]] = value
    return document


# --- files ------------------------------------------------------------------------------------------------------------


def test_files_that_cannot_be_read_are_named(tmp_path):
    with pytest.raises(ValueError, match=r"cannot read the model .*missing\.json: No such file"):
        load(tmp_path / "missing.json")
    with pytest.raises(ValueError, match=r"cannot read the model .*: Is a directory"):
        load(tmp_path)
    (tmp_path / "latin.json").write_bytes(b'{"schema": "\xff\xfe"}')
    with pytest.raises(ValueError, match=r"cannot read the model .*latin\.json"):
        load(tmp_path / "latin.json")
    (tmp_path / "other.json").write_text("{}")
    with pytest.raises(ValueError, match=r"other\.json: not a model this version reads"):
        load(tmp_path / "other.json")

"""Any text as a model.json: a surrogate that predicts, inverts and exports, or one printable sentence."""

import copy
import json
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from experiments import Factor, FactorSpace, Response
from experiments.terms import Terms
from surrogates import Surrogate, certify, dumps, loads
from surrogates.artefact import HIGHEST, MOST_NAMES, digest_of
from surrogates.exports import get
from surrogates.intervals import Interval
from surrogates.validation import ResponseError
from tests.pipeline.hostile import EXAMPLES, NUMBERS, TEXTS, VALUES, fuzzed, inert, is_one_line, within

__all__ = ["inert"]
pytestmark = pytest.mark.usefixtures("inert")

SECONDS = 20.0


def sound(schema: int = 1) -> dict[str, Any]:
    """A model with everything that a file can hold."""
    space = FactorSpace((Factor("a", "N", -1.0, 1.0, "here"), Factor("b", "mm", 1.0, 3.0)))
    terms = Terms.polynomial(space.names, 2)
    columns = {"1": (0.0, 1.0), "a": (1.0, 0.1), "b": (0.1, 1.0), "a:b": (0.01, 0.0), "a^2": (0.02, 0.01)}
    table = np.array([columns.get(label, (0.0, 0.0)) for label in terms.labels])
    errors = tuple(
        ResponseError(
            response=name,
            n_runs=20,
            max_abs=0.1,
            range=2.0,
            max_relative=0.05,
            rmse=0.01,
            worst_run=3,
            worst_point=(0.5, 2.0),
            intervals=(Interval(0.9, 0.1, 10, 0.9, 10),),
        )
        for name in ("u", "v")
    )
    made = Surrogate(space, (Response("u", "m", "µm", 1e6, "u_x"), Response("v", "rad")), terms, table, errors,
                     standard_errors=np.abs(table), provenance={"study": "s", "seed": 1, "nested": {"x": [1, None]}},
                     links=("log", "identity") if schema == 2 else ())  # fmt: skip
    return json.loads(dumps(Surrogate(**{**vars(made), "certificate": certify(made)})))


SOUND = [sound(1), sound(2)]


def places(document: Any, at: tuple = ()) -> list[tuple]:
    inner: Any = document.items() if isinstance(document, dict) else []
    inner = enumerate(document) if isinstance(document, list) else inner
    return [path for key, value in inner for path in [(*at, key), *places(value, (*at, key))]]


def change(document: Any, path: tuple, how: str, value: Any) -> None:
    """Remove, replace, double or empty one place of a JSON document."""
    *above, last = path
    for key in above:
        document = document[key]
    if how == "remove":
        del document[last]
    elif how == "double" and isinstance(document, list):
        document.insert(last, copy.deepcopy(document[last]))
    elif how == "empty":
        document[last] = type(document[last])()
    else:
        document[last] = value


@st.composite
def changed(draw: st.DrawFn) -> dict[str, Any]:
    """A sound model with one to three changes, and mostly a digest that is right for what it says now."""
    document = copy.deepcopy(draw(st.sampled_from(SOUND)))
    for _ in range(draw(st.integers(1, 3))):
        if paths := places(document):
            value = draw(VALUES | NUMBERS | st.sampled_from(["a^64", "a^65", "a^999999999", "b:b:b", "1", "u", [], {}]))
            how = draw(st.sampled_from(["remove", "replace", "double", "empty"]))
            change(document, draw(st.sampled_from(paths)), how, value)
    if draw(st.integers(0, 4)):
        document.pop("digest", None)
        document["digest"] = digest_of(document)
    return document


def outcome(text: str) -> Surrogate | str:
    """The model of a text, or the sentence that refuses it; anything else is a defect."""
    with within(SECONDS):
        try:
            return loads(text)
        except ValueError as error:
            said = str(error)
    assert is_one_line(said), repr(said)[:300]
    return said


def works(model: Surrogate) -> None:
    """It does all that a model does, or says in a sentence why not."""
    with within(SECONDS), np.errstate(all="ignore"):
        centre = model.factors.centre[None]
        predicted = model.predict(centre)
        assert predicted.shape == (1, len(model.responses))
        model.jacobian(centre)
        acts = [
            lambda: model.interval(centre, 0.9),
            lambda: model.invert(np.where(np.isfinite(predicted), predicted, 0)),
        ]
        acts += [
            lambda: dumps(model),
            lambda: get("c99").render(model, "dev"),
            lambda: get("python").render(model, "dev"),
        ]
        for act in acts:
            said = ""
            try:
                act()
            except ValueError as error:
                said = str(error)
            assert said.isprintable()


class TestAnything:
    @fuzzed(60)
    @given(text=st.text(max_size=40) | VALUES.map(lambda v: json.dumps(v, default=str)))
    def test_text_and_json(self, text):
        assert isinstance(outcome(text), str)

    @fuzzed(40)
    @given(rest=st.dictionaries(st.sampled_from(sorted(SOUND[0])), VALUES, max_size=6))
    def test_an_object_of_our_schema(self, rest):
        outcome(json.dumps({"schema": "flexdoce-model/1", **rest}))

    @fuzzed(120)
    @given(document=changed())
    def test_a_sound_model_with_changes(self, document):
        found = outcome(json.dumps(document))
        if isinstance(found, Surrogate):
            works(found)

    @fuzzed(25)
    @given(
        text=TEXTS,
        where=st.sampled_from([p for p in places(SOUND[0]) if p[-1] in ("source", "unit", "reason", "study")]),
    )
    def test_free_text(self, text, where):
        document = copy.deepcopy(SOUND[0])
        change(document, where, "replace", text)
        document["digest"] = digest_of(document)
        outcome(json.dumps(document))


@pytest.mark.parametrize("path", places(SOUND[0])[:: 1 if EXAMPLES else 3], ids=str)
def test_without_any_one_thing(path):
    document = copy.deepcopy(SOUND[0])
    change(document, path, "remove", None)
    said = outcome(json.dumps(document))
    assert isinstance(said, str) or path == ("digest",)
    document["digest"] = digest_of(document)
    found = outcome(json.dumps(document))
    if isinstance(found, Surrogate):
        works(found)


def test_the_sound_ones_work():
    for document in SOUND:
        found = outcome(json.dumps(document))
        assert isinstance(found, Surrogate)
        works(found)


def large(k: int, m: int, terms: list[str], numbers: Any = None) -> str:
    """A model of k factors and m responses without a digest."""
    column = numbers or [float(j == 1) for j in range(len(terms))]
    return json.dumps(
        {
            "schema": "flexdoce-model/1",
            "factors": [{"name": f"x{i}", "unit": "N", "low": -1.0, "high": 1.0} for i in range(k)],
            "responses": [{"name": f"y{i}", "unit": "m"} for i in range(m)],
            "terms": terms,
            "coefficients": {f"y{i}": column for i in range(m)},
            "validation": [],
            "certificate": None,
            "provenance": {},
        }
    )


SMALL = large(1, 1, ["1", "x0"])
LARGE = {
    "a power of a thousand million": (large(1, 1, ["1", "x0^999999999"]), "degree 999999999; models of degree 64"),
    "a power of 5000 digits": (large(1, 1, ["1", f"x0^{'9' * 5000}"]), "digits"),
    "a product of 100,000": (large(1, 1, ["1", "x0" + ":x0" * 99_999]), "degree 100000; models of degree 64"),
    "one degree too many": (large(2, 1, ["1", f"x0^{HIGHEST}:x1"]), "degree 65"),
    "10,000 factors": (large(10_000, 1, ["1"]), f"at most {MOST_NAMES} factors"),
    "10,000 responses": (large(1, 10_000, ["1"], [1.0]), f"at most {MOST_NAMES} factors and as many responses"),
    "2000 terms in 1000 factors": (large(1000, 1, ["1", *(f"x{i // 2}^{1 + i % 2}" for i in range(2000))]), "too many"),
    "lists in lists": ("[" * 100_000, "not valid JSON"),
    "nested provenance": (SMALL.replace('"provenance": {', f'"provenance": {{"a": {"[" * 3000}{"]" * 3000}'), "JSON"),
    "a number of 5000 digits": (SMALL.replace("1.0", "9" * 5000), "not valid JSON"),
    "a number above all": (SMALL.replace("-1.0", "-1e400"), "must be finite"),
    "not a number": (SMALL.replace("-1.0", "NaN"), "NaN is not a number"),
    "the same factor twice": (large(2, 1, ["1"], [1.0]).replace('"x1"', '"x0"'), "repeated: x0"),
    "the same response twice": (large(1, 2, ["1"], [1.0]).replace('"y1"', '"y0"'), "response names must differ"),
}  # fmt: skip


class TestLarge:
    @pytest.mark.parametrize("what", LARGE)
    def test_is_refused_at_once(self, what):
        text, words = LARGE[what]
        said = outcome(text)
        assert isinstance(said, str)
        assert words in said

    def test_what_is_read_predicts_and_inverts_at_once(self):
        """Thousands of terms of degree 32 in few factors, and many factors."""
        many = [f"x{i}^{p}:x{j}^{q}" for i in range(6) for j in range(i) for p in range(1, 17) for q in range(1, 17)]
        for text in (large(6, 1, ["1", *many]), large(1000, 1, ["1", *(f"x{i}" for i in range(999))])):
            found = outcome(text)
            assert isinstance(found, Surrogate)
            with within(SECONDS):
                assert np.isfinite(found.predict(found.factors.centre[None])).all()
                found.invert([[0.5]])

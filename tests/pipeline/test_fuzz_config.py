"""Any bytes, text or TOML as a config: a study, or one printable sentence; nothing is run, written or evaluated."""

import builtins
import math
from typing import Any

import pytest
import tomli_w
from hypothesis import assume, given
from hypothesis import strategies as st

import pipeline
from pipeline import InputError
from pipeline.config import Config, dump_config, json_schema, load_config, parse_config
from pipeline.nesting import DEEPEST, excess
from pipeline.resolving import resolve
from pipeline.study import Study
from tests.pipeline.bad_inputs import MINIMAL
from tests.pipeline.hostile import NUMBERS, PIECES, SCALARS, TEXTS, VALUES, Acted, fuzzed, inert, is_one_line, within

__all__ = ["inert"]
pytestmark = pytest.mark.usefixtures("inert")

SECONDS = 20.0
"""For one config: a few seconds on a machine that is not doing six other things."""

PROGRAM: dict[str, Any] = {
    "name": "beam",
    "oracle": {
        "name": "command",
        "command": {
            "argv": ["solver", "{{width}}", "{{folder}}"],
            "templates": {"in/beam.inp": {"text": "{{load [N]:.6e}}\n"}},
            "files": {"mesh.inp": {"text": "*NODE"}},
            "factors": {"width": {"unit": "m", "low": 0.1, "high": 1.0}, "load": {"unit": "N", "low": 0, "high": 1.0}},
            "responses": {"u": {"unit": "m", "regex": "u = (.*)"}, "v": {"unit": "N", "column": "v", "file": "a.csv"}},
        },
    },
}  # fmt: skip
BUILT_IN: dict[str, Any] = {
    "name": "small",
    "seed": 1,
    "title": "t",
    "oracle": {"name": "cantilever", "parameters": {"young": 2e11}, "max_failed_fraction": 0.0},
    "factors": {"load": {"low": 1.0, "high": 2.0, "unit": "N"}},
    "screening": {"alpha": 0.05, "keep": ["load"], "design": {"method": "plackett_burman", "n_runs": 12}},
    "fit": {"degree": 2, "design": {"method": "uniform", "n_runs": 30, "levels": 6, "budget": 100}},
    "validation": {"n_runs": 20},
    "require": {"max_relative_error": 0.1, "max_runs": 60},
    "command": {"responses": [], "given": []},
    "export": {"targets": ["c99"], "prefix": "small", "verify": True},
    "compare": [],
    "executor": {"name": "processes", "workers": 2, "batch": 4},
    "sweep": {"fit.degree": [1, 2], "ranges": [0.5, 1]},
}
METHODS = ("plackett_burman", "fractional_factorial", "full_factorial", "definitive_screening", "d_optimal", "uniform",
           "latin_hypercube", "sobol", "halton", "random")  # fmt: skip


def outcome(text: str, overrides: tuple[str, ...] = ()) -> Study | str:
    """The study of a config, or the sentence that refuses it; anything else is a defect."""
    with within(SECONDS):
        try:
            config = parse_config(text, "config", overrides)
            assert parse_config(dump_config(config)) == config
            return resolve(config)
        except InputError as error:
            said = str(error)
    assert is_one_line(said), repr(said)[:300]
    return said


def places(document: Any, at: tuple = ()) -> list[tuple]:
    """Paths of everything in a document."""
    inner = document.items() if isinstance(document, dict) else []
    return [path for key, value in inner for path in [(*at, key), *places(value, (*at, key))]]


def changed(document: Any, path: tuple, change: str, key: str, value: Any) -> Any:
    """A copy with one place removed, replaced, or renamed, or with a key more beside it."""
    first, rest = path[0], path[1:]
    copy = dict(document)
    if rest:
        copy[first] = changed(copy[first], rest, change, key, value)
    elif change == "replace":
        copy[first] = value
    elif change == "beside":
        copy[key] = value
    else:
        old = copy.pop(first)
        if change == "rename":
            copy[key] = old
    return copy


@st.composite
def documents(draw: st.DrawFn) -> dict[str, Any]:
    """A sound config with one to three changes."""
    document = draw(st.sampled_from([PROGRAM, BUILT_IN]))
    for _ in range(draw(st.integers(1, 3))):
        paths = places(document)
        if not paths:
            break
        known = sorted({path[-1] for path in paths})
        document = changed(
            document, draw(st.sampled_from(paths)), draw(st.sampled_from(["replace", "remove", "rename", "beside"])),
            draw(st.sampled_from(known) | TEXTS), draw(VALUES | st.sampled_from(METHODS)),
        )  # fmt: skip
    return document


class TestAnything:
    @fuzzed(25)
    @given(data=st.binary(max_size=60) | st.text(max_size=60).map(lambda t: t.encode("utf-8", "replace")))
    def test_bytes(self, tmp_path_factory, data):
        path = tmp_path_factory.getbasetemp() / "any.toml"
        path.write_bytes(data)
        with pytest.raises(InputError) as caught:
            load_config(path)
        assert is_one_line(str(caught.value))
        assert str(path) in str(caught.value)

    @fuzzed(30)
    @given(text=st.lists(st.sampled_from([*PIECES, "[", "]", "=", "{", "}", ",", "oracle", "fit", "."]), max_size=15))
    def test_text_below_a_sound_config(self, text):
        outcome(MINIMAL + "".join(text))

    @fuzzed(90)
    @given(document=documents())
    def test_documents_with_changes(self, document):
        outcome(tomli_w.dumps(document))

    @fuzzed(40)
    @given(
        key=st.sampled_from([".".join(path) for path in places(BUILT_IN)]) | TEXTS,
        value=(SCALARS | st.sampled_from(METHODS)).map(str),
    )
    def test_overrides(self, key, value):
        outcome(tomli_w.dumps(BUILT_IN), (f"{key}={value}",))

    @fuzzed(40)
    @given(
        table=st.sampled_from(["screening", "fit"]), method=st.sampled_from(METHODS),
        given_=st.dictionaries(st.sampled_from(["n_runs", "levels", "budget", "starts", "n_centre", "foldover", "model",
                                               "generators", "resolution", "fake_factors", "criterion"]),
                               NUMBERS | st.booleans() | st.sampled_from(["2, 3", "load^999999999", "load = length"]),
                               max_size=3),
    )  # fmt: skip
    def test_designs(self, table, method, given_):
        document = {**BUILT_IN, table: {"design": {"method": method, **given_}}}
        outcome(tomli_w.dumps(document))


class TestTheWrongKeyIsNamed:
    @pytest.mark.parametrize("path", [p for p in places(BUILT_IN) if p[0] not in ("factors", "sweep")], ids=".".join)
    def test_of_every_key_with_a_wrong_type(self, path):
        """A list of tables is allowed nowhere, but among the values of a grid, which `flexdoce sweep` checks."""
        said = outcome(tomli_w.dumps(changed(BUILT_IN, path, "replace", "", [{"a": []}])))
        assert isinstance(said, str)
        assert ".".join(path) in said or path[-1] in said


class TestRoundTrip:
    @fuzzed(40)
    @given(title=TEXTS, low=st.floats(-1e100, 1e100))
    def test_what_is_written_is_read(self, title, low):
        assume(title.encode("utf-8", "ignore").decode() == title)
        config = Config.model_validate(
            {**BUILT_IN, "title": title, "factors": {"load": {"low": low, "high": math.nextafter(1e101, 2e101)}}}
        )
        text = dump_config(config)
        assert parse_config(text) == config
        assert all(c.isprintable() or c == "\n" for c in text), "a terminal that shows it could be steered"

    def test_the_schema_has_no_key_that_is_not_tried(self):
        assert set(BUILT_IN) | {"version"} == set(json_schema()["properties"])


LARGE = {
    "ten million validation runs": MINIMAL + "validation.n_runs = 10000000\n",
    "a billion levels": MINIMAL + '[fit.design]\nmethod = "uniform"\nlevels = 1000000000\n',
    "a Plackett-Burman design of a million": MINIMAL + "[screening.design]\nn_runs = 1000000\n",
    "a search of 10^12 exchanges": MINIMAL + '[screening.design]\nmethod = "uniform"\nbudget = 1000000000000\n',
    "a Latin hypercube of ten million": MINIMAL + '[screening.design]\nmethod = "latin_hypercube"\nn_runs = 10000000\n',
    "ten thousand starts": MINIMAL
    + '[screening.design]\nmethod = "d_optimal"\nlevels = 2\nn_runs = 1000\nstarts = 10000\n',
    "182,000 sizes": MINIMAL + "[fit]\nruns_per_term = 100.0\ndegree = 12\n",
    "half a million runs of a factorial": MINIMAL + '[screening.design]\nmethod = "full_factorial"\nlevels = 20\n',
    "ten thousand exports": MINIMAL + "[export]\ntargets = [" + '"c99",' * 10_000 + "]\n",
    "a million characters as a key": "a" * 1_000_000 + " = 1\n" + MINIMAL,
    "a value of a million characters": f'seed = "{"x" * 1_000_000}"\n' + MINIMAL,
    "a list of a million": "seed = [" + "1," * 1_000_000 + "]\n" + MINIMAL,
    "a key of ten thousand parts": MINIMAL + "parameters.a" + ".a" * 10_000 + " = 1\n",
    "a key of a thousand quoted parts": MINIMAL + "parameters.a" + " . 'a'" * 1_000 + " = 1\n",
    "tables in tables": MINIMAL + "parameters.x = " + "{a=" * 5_000 + "1" + "}" * 5_000,
}


def of_a_program(n: int, first: str = "", n_responses: int = 1) -> str:
    factors = {f"x{i}": {"unit": "m", "low": 0.0, "high": 1.0} for i in range(n)}
    responses = {f"y{i}": {"unit": "m", "regex": "(.*)"} for i in range(n_responses)}
    command = {**PROGRAM["oracle"]["command"], "factors": factors, "responses": responses, "templates": {},
               "argv": ["p", *(f"{{{{{name}}}}}" for name in factors)]}  # fmt: skip
    return first + tomli_w.dumps({"name": "many", "oracle": {"name": "command", "command": command}})


class TestLarge:
    @pytest.mark.parametrize("what", LARGE)
    def test_is_refused_or_resolved_at_once(self, what):
        outcome(LARGE[what])

    @pytest.mark.parametrize(
        ("text", "match"),
        [
            (of_a_program(1_001), "1001 factors are too many; at most 1000"),
            (of_a_program(30, "fit.degree = 12\n"), "a degree-12 polynomial in 30 factors has 11058116888 terms"),
            (of_a_program(101, "fit.degree = 1\n", 100), "101 factors and 100 responses is too large"),
            (of_a_program(700), "no Plackett-Burman design for 700 factors"),
            (MINIMAL.replace("cantilever", "command") + f'command.argv = ["{"a" * 200_000}"]\ncommand.factors = {{}}\n'
             "command.responses = {}\n", "argv is longer than"),
        ],
    )  # fmt: skip
    def test_programs(self, text, match):
        with pytest.raises(InputError, match=match):
            resolve(parse_config(text))

    def test_deep_keys_are_told_from_texts_and_numbers(self):
        deep = ".".join("a" * (DEEPEST + 1))
        assert "nested too deep" in excess(f"{deep} = 1")
        assert "nested too deep" in excess(f"[{deep}]")
        assert "nested too deep" in excess(f'x = """\n""" # "\n{deep} = 1')
        assert "nested too deep" in excess("x = ''''a'''''\n" + " . ".join('"a"' for _ in range(DEEPEST + 1)) + "=1")
        for harmless in (f'x = "{deep}"', f"x = '{deep}'", f'x = """\n\\"""{deep}"""', f"# {deep}",
                         f"x = '''\n{deep}'''", "x = [" + "1.0, " * 100 + "]"):  # fmt: skip
            assert excess(harmless) == ""


def test_a_config_evaluates_nothing(monkeypatch):
    """``eval`` and ``exec`` serve the standard library's dataclasses and named tuples at import: all is imported."""
    for text in (MINIMAL, tomli_w.dumps(PROGRAM), tomli_w.dumps(BUILT_IN)):
        resolve(parse_config(text))  # imports what is imported late

    def refused(*arguments, **named):
        raise Acted(arguments)

    monkeypatch.setattr(builtins, "eval", refused)
    monkeypatch.setattr(builtins, "exec", refused)
    for text in (MINIMAL, tomli_w.dumps(PROGRAM), tomli_w.dumps(BUILT_IN)):
        assert isinstance(outcome(text), Study)


def test_a_config_writes_nothing(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "c.toml").write_text(tomli_w.dumps(PROGRAM), encoding="utf-8")
    resolve(pipeline.load_config(tmp_path / "c.toml"))
    assert [p.name for p in tmp_path.iterdir()] == ["c.toml"]

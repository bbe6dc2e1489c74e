"""The structured text is the model, as far as can be shown without a controller; no text of the model becomes code."""

import importlib.util
import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from experiments import Response
from surrogates import Surrogate, certify, loads, obstacle
from surrogates.artefact import dumps
from surrogates.exports.base import Target
from surrogates.exports.iec61131.printing import comment, constant, literal
from surrogates.exports.iec61131.target import StructuredText
from surrogates.exports.verification import iec61131 as verifying
from surrogates.exports.verification.base import Outcome
from surrogates.exports.verification.iec61131_parse import KEYWORDS, NotStructuredText, parse, tokens
from surrogates.exports.verification.iec61131_run import Program
from tests.surrogates import cases
from tests.surrogates.cases import box, hexflex_like, more_responses, points, quintic, square_quadratic, surrogate
from tests.surrogates.exports.cases import MODELS
from tests.surrogates.exports.hostile_text import HOSTILE, hostile_model, random_texts

OK, OUTSIDE_DOMAIN, UNREACHABLE, NOT_CONVERGED, NOT_FINITE = range(5)
needs_blark = pytest.mark.skipif(
    importlib.util.find_spec("blark") is None,
    reason="NO BLARK: the package blark is not installed. The grammar was read by our own parser alone.",
)


def with_chords() -> Surrogate:
    """Certified by chord steps alone: both kinds of steps are in the code."""
    return replace(quintic(), certificate=certify(quintic()))


CASES = {**MODELS, "with_chords": with_chords}


def text_of(model: Surrogate, prefix: str = "stage", **settings) -> str:
    return StructuredText(**settings).render(model, prefix)[f"{prefix}.st"]


def write(folder: Path, text: str, prefix: str = "stage") -> Path:
    (folder / f"{prefix}.st").write_text(text, encoding="ascii", newline="\n")
    return folder


def block(model: Surrogate, word: str, **settings):
    return Program(text_of(model, **settings)).instance(f"stage_{word}")


@pytest.fixture
def without_blark(monkeypatch):
    """Blark is slow, and asked elsewhere."""
    monkeypatch.setattr(verifying, "MOST_FOR_BLARK", 0)


# --- against the model ------------------------------------------------------------------------------------------------


@pytest.mark.usefixtures("without_blark")
@pytest.mark.parametrize("name", CASES)
def test_the_verifier_agrees(tmp_path, name):
    model = CASES[name]()
    grammar, *found = verifying.verify(model, "stage", write(tmp_path, text_of(model)))
    assert grammar.outcome is Outcome.NOT_CHECKED
    assert len(found) == (7 if obstacle(model) else 10)
    assert {f.outcome for f in found} == {Outcome.AGREES}, found


@needs_blark
@pytest.mark.parametrize("name", ["with_chords", "folded", "one_logarithm"])
def test_blark_reads_what_we_read(name):
    """A certified, a free and a closed inverse: together all blocks that there are."""
    finding = verifying.blark_finding(text_of(CASES[name]()))
    assert finding.outcome is Outcome.AGREES, finding


@pytest.mark.parametrize("name", ["square_quadratic", "certified", "with_chords", "many", "dependent", "logarithms"])
def test_the_inverse_is_that_of_python(name):
    model = CASES[name]()
    targets = model.predict(points(model, 40, seed=1, reach=0.6))
    run, wanted = block(model, "inverse"), model.invert(targets)
    answers = [run(responses=row) for row in targets]
    easy = np.array([answer["status"] == OK for answer in answers])
    assert easy.mean() > 0.9
    assert wanted.ok.all()
    found = np.array([answer["settings"] for answer in answers])[easy]
    assert np.abs((found - wanted.settings[easy]) / model.factors.half_range).max() <= 1e-11


def test_an_underdetermined_inverse_is_of_least_coded_norm():
    model = cases.underdetermined()
    run, slope = block(model, "inverse"), model.jacobian_coded(np.zeros((1, 4)))[0]
    for target in model.predict(points(model, 20, reach=0.4)):
        answer = run(responses=target)
        expected = np.linalg.lstsq(slope, target - model.predict_coded(np.zeros((1, 4)))[0])[0]
        assert answer["status"] == OK
        assert np.abs(model.factors.code(answer["settings"][None])[0] - expected).max() <= 1e-12


def test_chords_find_what_newton_s_steps_do_not():
    model = with_chords()
    text = text_of(model)
    assert re.search(r"at most 6 Newton steps and \d+ chord steps", text)
    targets = model.predict(points(model, 30))
    without_newton = text.replace("FOR k := 1 TO 6 DO", "FOR k := 1 TO 0 DO")
    without_both = re.sub(r"FOR k := 1 TO \d+ DO", "FOR k := 1 TO 0 DO", text)
    for changed in (text, without_newton):
        run = Program(changed).instance("stage_inverse")
        answers = [run(responses=row) for row in targets]
        assert {answer["status"] for answer in answers} == {OK}
        found = np.array([answer["settings"] for answer in answers])
        assert np.abs((model.predict(found) - targets) / model.scale).max() <= 1e-12
    run = Program(without_both).instance("stage_inverse")
    assert {run(responses=row)["status"] for row in targets} == {NOT_CONVERGED}


# --- status codes -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["hexflex_like", "many", "one_logarithm"])
def test_the_domain_is_that_of_python(name):
    model = CASES[name]()
    k = len(model.factors)
    reach = np.array([1.0, 1.0 - 1e-6, 1.0 + 1e-6])
    edges = model.factors.decode(np.vstack([sign * r * np.eye(k) for r in reach for sign in (1.0, -1.0)]))
    for word in ("inside", "forward", "jacobian"):
        run = block(model, word)
        for row in [*edges, *points(model, 30, seed=3, reach=1.3)]:
            assert run(settings=row)["status"] == (OK if model.contains(row[None])[0] else OUTSIDE_DOMAIN)


def test_outside_the_domain_responses_are_written():
    model = square_quadratic()
    point = model.factors.decode(np.full((1, 3), 1.5))
    answer = block(model, "forward")(settings=point[0])
    assert answer["status"] == OUTSIDE_DOMAIN
    assert np.abs((answer["responses"] - model.predict(point)[0]) / model.scale).max() <= 1e-12


@pytest.mark.parametrize("name", ["hexflex_like", "square_quadratic", "logarithms", "with_chords"])
def test_what_cannot_be_reached_is_refused_and_nothing_written(name):
    model = CASES[name]()
    run = block(model, "inverse")
    before = run(responses=model.predict(model.factors.centre[None])[0])
    assert before["status"] == OK
    coded = np.full((1, len(model.factors)), 1.05)
    wrong = {
        "beyond": (model.predict(model.factors.decode(coded))[0], (OUTSIDE_DOMAIN, UNREACHABLE, NOT_CONVERGED)),
        "huge": (np.full(len(model.responses), 1.7e308), (OUTSIDE_DOMAIN, UNREACHABLE, NOT_CONVERGED)),
        "nan": (np.full(len(model.responses), np.nan), (NOT_FINITE,)),
        "infinite": (np.full(len(model.responses), -np.inf), (NOT_FINITE,)),
    }
    for kind, (target, statuses) in wrong.items():
        answer = run(responses=target)
        assert answer["status"] in statuses, kind
        assert (answer["settings"] == before["settings"]).all()


def test_a_target_that_has_no_logarithm_is_unreachable():
    model = MODELS["logarithms"]()
    run, centre = block(model, "inverse"), model.predict(model.factors.centre[None])[0]
    for value in (0.0, -1.0, -1e300):
        target = centre.copy()
        target[1] = value
        assert run(responses=target)["status"] == UNREACHABLE
        target[0] = np.nan
        assert run(responses=target)["status"] == NOT_FINITE


def test_targets_off_the_reachable_surface_are_unreachable():
    model = cases.overdetermined()
    run, target = block(model, "inverse"), model.predict(points(model, 1, reach=0.2))[0]
    assert run(responses=target)["status"] == OK
    target[2] += 1e-3 * model.scale[2]
    assert run(responses=target)["status"] == UNREACHABLE
    constant_run = block(cases.constant(), "inverse")
    assert constant_run(responses=[3.0, 0.0])["status"] == OK
    assert constant_run(responses=[3.1, 0.0])["status"] == UNREACHABLE


def test_steps_are_bounded_by_the_setting():
    model = square_quadratic()
    target = model.predict(points(model, 1, seed=4, reach=0.9))[0]
    assert block(model, "inverse", max_iterations=1)(responses=target)["status"] == NOT_CONVERGED
    assert block(model, "inverse")(responses=target)["status"] == OK
    assert "FOR k := 1 TO 40000 DO" in text_of(model, max_iterations=40000)
    Program(text_of(model, max_iterations=40000))  # beyond INT: the counter is a DINT
    with pytest.raises(ValueError, match="max_iterations of the IEC 61131-3 export must be a whole number of at least"):
        StructuredText(max_iterations=0)


# --- the text ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", CASES)
def test_the_text_is_ascii_in_short_lines_and_the_same_each_time(name):
    model = CASES[name]()
    files = StructuredText().render(model, "stage")
    assert files == StructuredText().render(loads(dumps(model)), "stage")
    assert list(files) == ["stage.st"]
    text = files["stage.st"]
    assert text.isascii()
    assert text.endswith("END_FUNCTION_BLOCK\n")
    assert max(map(len, text.splitlines())) <= 120
    assert isinstance(StructuredText(), Target)


USED = """
FUNCTION_BLOCK END_FUNCTION_BLOCK FUNCTION END_FUNCTION VAR VAR_INPUT VAR_OUTPUT VAR_TEMP END_VAR CONSTANT ARRAY OF
LREAL INT DINT BOOL IF THEN ELSE ELSIF END_IF FOR TO BY DO END_FOR EXIT RETURN AND OR NOT TRUE
FALSE
"""


def test_nothing_of_a_vendor_is_used():
    text = "".join(text_of(model()) for model in CASES.values())
    words = {word for kind, word, _ in tokens(text) if kind == "name"}
    assert not words & {"METHOD", "REFERENCE", "POINTER", "WHILE", "REPEAT", "CASE", "GOTO", "CONTINUE", "TYPE", "REF"}
    assert words & KEYWORDS <= set(USED.split())


def test_a_curved_model_of_more_responses_than_factors_has_no_inverse_and_says_why():
    text = text_of(more_responses())
    assert "There is no inverse: 3 responses follow from 2 factors" in text
    assert not {"STAGE_INVERSE", "STAGE_NEWTON", "STAGE_WITHIN"} & set(parse(text))
    assert set(parse(text)) == {f"STAGE_{w}" for w in ("INSIDE", "VALUE", "GRADIENT", "FORWARD", "JACOBIAN")}


def test_the_header_says_what_a_reader_must_know():
    text = text_of(replace(hexflex_like(), provenance={"config": "hexflex.toml"}))
    header = text.partition("*)")[0]
    for words in ("[0] T1D1  N  -5.0 to 4.0", "not validated", "config: hexflex.toml", "schema: flexdoce-model/1"):
        assert words in header
    assert "ln(response / unit) of r1 and r2" in text_of(MODELS["logarithms"]())
    assert "LN(" not in text_of(square_quadratic())


def test_literals_have_digits_on_both_sides_and_survive():
    assert [literal(v) for v in (1.0, -0.5, 1e-6, 1e22, -2.5e-7, 0.0, -0.0)] == [
        *("1.0", "-0.5", "1.0E-6", "1.0E22", "-2.5E-7", "0.0", "0.0")
    ]
    rng = np.random.default_rng(0)
    for value in rng.normal(size=300) * 10.0 ** rng.integers(-300, 300, 300):
        written = literal(value)
        assert float(written) == value
        assert re.fullmatch(r"-?\d+\.\d+(E-?\d+)?", written)
    with pytest.raises(ValueError, match="cannot be exported: a number derived from its coefficients overflows"):
        literal(math.inf)
    long = constant("low", rng.normal(size=30).tolist())
    assert long.startswith("    low : ARRAY [0..29] OF LREAL := [\n")
    assert max(map(len, long.splitlines())) <= 100


@pytest.mark.filterwarnings("ignore:overflow encountered:RuntimeWarning", "ignore:invalid value:RuntimeWarning")
def test_a_number_that_overflows_is_refused_not_written():
    model = surrogate(cases.unit_box(2), ["1", "f0", "f1"], [[0.0, 1.7e308, 1.7e308]])
    with pytest.raises(ValueError, match="cannot be exported: a number derived from its coefficients overflows"):
        text_of(model)


@pytest.mark.parametrize("prefix", ["a__b", "stage_", "__a", "a b", "µ", "a*)", "", "a" * 64])
def test_a_prefix_that_is_no_identifier_is_refused(prefix):
    with pytest.raises(ValueError, match="is not allowed"):
        text_of(quintic(), prefix)


@pytest.mark.parametrize("prefix", ["if", "VAR", "real", "a", "x0", "FUNCTION_BLOCK", "a" * 63])
def test_a_prefix_may_be_a_word_of_the_language(prefix):
    """Names are made of it and another word: none of them is reserved."""
    model = square_quadratic()
    run = Program(text_of(model, prefix)).instance(f"{prefix}_forward")
    assert run(settings=model.factors.centre)["status"] == OK


def test_names_may_be_words_of_the_language_and_equal_but_for_case():
    names = ["IF", "var", "real", "End_If", "a", "A", "coded", "status", "EXP", "exp", "Stage_forward"]
    terms = ["1", *names, "a:A", "IF^2"]
    model = surrogate(box(*((n, -1.0, 2.0) for n in names)), terms, np.arange(1.0, 29.0).reshape(2, 14))
    model = replace(model, responses=(Response("VALUE", "m"), Response("value", "m")))
    point = points(model, 1)
    answer = block(model, "forward")(settings=point[0])
    assert np.abs(answer["responses"] - model.predict(point)[0]).max() <= 1e-12 * model.scale.max()


# --- hostile text -----------------------------------------------------------------------------------------------------

OWN_HOSTILE = [
    "*) injected := 1; (*",
    "*)",
    "(*",
    "(*)",
    "(* nested *)",
    "{attribute 'hide'} {*",
    "{*) x",
    "// line\nEND_FUNCTION_BLOCK",
    "'$'",
    "'",
    "*\u200b)",
    "＊）",
    "*\n)",
    "(",
    "*",
]


@pytest.mark.parametrize("text", [*HOSTILE, *OWN_HOSTILE], ids=lambda text: repr(text)[:20])
def test_text_of_the_model_cannot_become_code(text):
    assert _words(text_of(hostile_model(text))) == _words(text_of(hostile_model("m")))


def test_random_text_cannot_become_code():
    rng = np.random.default_rng(1)
    letters = np.array([*"((()))***{}''$//\n\" a;", "é"])
    own = ["".join(rng.choice(letters, rng.integers(1, 30))) for _ in range(60)]
    model = hostile_model("m")
    expected = _words(text_of(model))
    for text in [*random_texts(60), *own]:
        assert not set(comment(text)) & set("{}'\"\n")
        assert not any(mark in comment(text) for mark in ("(*", "*)", "//"))
        assert _words(text_of(replace(model, provenance={"note": text, text: [text]}))) == expected


def _words(source: str) -> list[tuple[str, str]]:
    """Words of the code, after a check of its comments."""
    assert all(c.isprintable() or c == "\n" for c in source)
    comments = re.findall(r"\(\*.*?\*\)", source, re.DOTALL)
    assert all(c.count("(*") == c.count("*)") == 1 and not set(c) & set("{}'\"") for c in comments)
    return [(kind, word) for kind, word, _ in tokens(source)]


# --- the verifier -----------------------------------------------------------------------------------------------------


@pytest.mark.usefixtures("without_blark")
@pytest.mark.parametrize(
    ("old", "new", "what"),
    [
        ("value[1] := ", "value[1] := 1.0E-9 + ", "forward"),
        ("slope[0, 1] := ", "slope[0, 1] := 1.0E-6 + ", "Jacobian"),
        ("<= 1.000000001)", "<= 1.1)", "settings outside"),
        ("settings[i] >= -1.79E+308", "TRUE", "NaN and infinite settings"),
        ("status := 4;", "status := 4;\n        coded[0] := 0.0;\n        status := 0;", "NaN and infinite settings"),
        ("constant_part : ARRAY [0..2] OF LREAL := [", "constant_part : ARRAY [0..2] OF LREAL := [1.0, ", "grammar"),
        ("settings := found;", "settings := found; settings[0] := settings[0] + 1.0E-3;", "inverse"),
        ("ABS(polynomials.value[i] - wanted[i]) <= tolerance[i]", "TRUE", "a target beyond"),
        ("END_FUNCTION_BLOCK", "END_FUNCTION", "grammar"),
        ("rest[j] := 0.0;", "", "inverse runs"),
    ],
)
def test_a_wrong_export_is_found(tmp_path, old, new, what):
    model = MODELS["certified"]()
    text = text_of(model)
    assert old in text
    changed = text.replace(old, new)
    if what == "a target beyond":  # or else the check of the domain refuses it
        changed = changed.replace("IF domain.status <> 0 THEN", "IF FALSE THEN")
    found = verifying.verify(model, "stage", write(tmp_path, changed))
    wrong = [f.what for f in found if f.outcome is Outcome.DIFFERS]
    assert any(w.startswith(what) for w in wrong), found


def test_what_is_missing_is_said(tmp_path, monkeypatch):
    [finding] = verifying.verify(quintic(), "stage", tmp_path)
    assert finding.outcome is Outcome.DIFFERS
    assert "No such file" in finding.detail
    monkeypatch.setattr(verifying, "find_spec", lambda name: None)
    found = verifying.verify(quintic(), "stage", write(tmp_path, text_of(quintic())))
    assert found[0].outcome is Outcome.NOT_CHECKED
    assert "pip install blark" in found[0].detail
    assert {f.outcome for f in found[1:]} == {Outcome.AGREES}


@needs_blark
def test_blark_refuses_what_is_no_structured_text():
    finding = verifying.blark_finding("FUNCTION_BLOCK a\nVAR x : LREAL; END_VAR\nx := 1.0 +;\nEND_FUNCTION_BLOCK\n")
    assert finding.outcome is Outcome.DIFFERS


# --- the interpreter --------------------------------------------------------------------------------------------------


def run(statements: str, declarations: str = "", **inputs):
    return Program(
        "FUNCTION_BLOCK b VAR_INPUT x : LREAL; END_VAR VAR_OUTPUT y : LREAL; n : INT; p : BOOL; END_VAR "
        f"VAR_TEMP i : INT; a, c : ARRAY [-1..1, 0..1] OF LREAL; END_VAR {declarations} {statements} END_FUNCTION_BLOCK"
    ).instance("B")(**inputs)


@pytest.mark.parametrize(
    ("expression", "value"),
    [
        ("1.0 + 2.0 * 3.0", 7.0),
        ("8.0 / 4.0 / 2.0", 1.0),
        ("8.0 - 4.0 - 2.0", 2.0),
        ("-(2.0 - 5.0) * 2.0", 6.0),
        ("-2.0 + 3.0", 1.0),
        ("EXP(LN(ABS(-2.5E0)))", 2.5),
        ("1.0 / 0.0", math.inf),
        ("-1.0 / 0.0", -math.inf),
        ("EXP(1.0E6)", math.inf),
        ("LN(0.0)", -math.inf),
        ("1.0E300 * 1.0E300", math.inf),
    ],
)
def test_expressions_have_the_language_s_precedence_and_ieee_s_numbers(expression, value):
    assert run(f"y := {expression};")["y"] == pytest.approx(value, rel=1e-15)


@pytest.mark.parametrize(
    ("condition", "value"),
    [
        ("1.0 < 2.0 AND NOT (1 > 2)", True),
        ("FALSE AND FALSE OR TRUE", True),
        ("TRUE OR TRUE AND FALSE", True),
        ("NOT TRUE OR TRUE", True),
        ("1 < 2 = TRUE", True),
        ("1 <> 2", True),
        ("0.0 / 0.0 = 0.0 / 0.0", False),
        ("(0.0 / 0.0 <= 1.0) OR (0.0 / 0.0 >= 1.0)", False),
        ("LN(-1.0) <= 1.0", False),
    ],
)
def test_conditions(condition, value):
    assert run(f"p := {condition};")["p"] is value


def test_loops_choices_and_arrays():
    assert run("n := 0; FOR i := 3 TO 1 BY -1 DO n := n + i; END_FOR;")["n"] == 6
    assert run("n := 0; FOR i := 3 TO 1 DO n := n + i; END_FOR;")["n"] == 0
    assert run("FOR i := 1 TO 9 DO n := i; IF i = 4 THEN EXIT; END_IF; END_FOR; n := n * 2;")["n"] == 8
    assert run("FOR i := 1 TO 9 DO n := i; IF i = 4 THEN RETURN; END_IF; END_FOR;")["n"] == 4
    choice = "IF x < 0.0 THEN n := 1; ELSIF x < 1.0 THEN n := 2; ELSE n := 3; END_IF;"
    assert [run(choice, x=x)["n"] for x in (-1.0, 0.5, 2.0)] == [1, 2, 3]
    fill = "FOR i := -1 TO 1 DO a[i, 0] := 1.0; a[i, 1] := 2.0; END_FOR; c := a; a[1, 1] := 7.0; y := c[1, 1];"
    assert run(fill)["y"] == 2.0  # arrays are copied, not shared
    constants = "VAR CONSTANT t : ARRAY [0..1, 0..2] OF LREAL := [1.0, 2.0, -3.0, 4.0, 5.0, 6.0]; END_VAR"
    assert run("y := t[0, 2] + 10.0 * t[1, 0];", constants)["y"] == 37.0


def test_outputs_stay_and_temporaries_do_not():
    instance = Program(
        "FUNCTION_BLOCK b VAR_INPUT x : LREAL; END_VAR VAR_OUTPUT y : LREAL; END_VAR VAR_TEMP t : LREAL; END_VAR "
        "IF x > 0.0 THEN t := x; END_IF; y := y + t; END_FUNCTION_BLOCK"
    ).instance("b")
    assert [instance(x=2.0)["y"], instance(x=3.0)["y"]] == [2.0, 5.0]
    with pytest.raises(NotStructuredText, match="T is read before it is written"):
        instance(x=-1.0)


@pytest.mark.parametrize(
    ("statements", "message"),
    [
        ("y := 1;", "LREAL expected, not INT"),
        ("n := 1.0;", "INT expected, not LREAL"),
        ("y := 1.0 + n;", "LREAL expected, not INT"),
        ("y := i * x;", "INT expected, not LREAL"),
        ("n := n / 2;", "/ of INT"),
        ("IF y THEN n := 1; END_IF;", "BOOL expected, not LREAL"),
        ("p := x AND TRUE;", "AND of LREAL"),
        ("x := 1.0;", "X is an input or a constant"),
        ("z := 1.0;", "Z is not declared"),
        ("y := a;", "LREAL expected, not an array of LREAL"),
        ("y := a[0];", "1 subscripts for an array"),
        ("y := a[0, 2];", r"subscript 2 is outside 0\.\.1"),
        ("y := a[0, 1];", "A is read before it is written"),
        ("y := a[0, 1.0];", "INT expected, not LREAL"),
        ("n := 40000;", "40000 is beyond INT"),
        ("y := SIN(x);", "SIN is no function"),
        ("y := LN(x, x);", "LN takes one number"),
        ("y := 1.;", "cannot read"),
        ("y := .5;", "expected, not '.'|cannot be the name"),
        ("y := 1e-6;", "cannot read"),
        ("y := 1.0", "; expected"),
        ("y = 1.0;", ":= expected, not '='"),
        ("(* a (* b *) y := 1.0;", "a comment in a comment"),
        ("// y", "cannot be the name|expected"),
        ("{pragma}", "cannot read"),
        ("y := 'a';", "cannot read"),
        ("FOR y := 1 TO 2 DO n := 1; END_FOR;", "must be of type INT or DINT"),
        ("y := y__a;", "no identifier"),
        ("EXP := 1.0;", "cannot be the name"),
    ],
)
def test_what_the_language_does_not_allow_is_refused(statements, message):
    with pytest.raises(NotStructuredText, match=message):
        run(statements)


@pytest.mark.parametrize(
    ("declarations", "message"),
    [
        ("VAR Y : LREAL; END_VAR", "Y is declared twice"),
        ("VAR q : nothing; END_VAR", "unknown type NOTHING"),
        ("VAR CONSTANT q : ARRAY [0..1] OF LREAL := [1.0]; END_VAR", "Q has 1 values for 2 elements"),
        ("VAR CONSTANT q : ARRAY [0..0] OF LREAL := [1]; END_VAR", "a real literal expected"),
        ("VAR step : LREAL; END_VAR", "'STEP' cannot be the name"),
    ],
)
def test_declarations_that_are_refused(declarations, message):
    with pytest.raises(NotStructuredText, match=message):
        run("y := 1.0;", declarations)

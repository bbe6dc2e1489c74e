"""The MATLAB functions are the model, in GNU Octave, and no text of the model is code in them."""

import re
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from experiments import Response
from surrogates import Surrogate, certify, loads, obstacle
from surrogates.artefact import dumps
from surrogates.exports.base import Target
from surrogates.exports.matlab.target import Matlab
from surrogates.exports.verification import matlab as verifying
from surrogates.exports.verification.base import Outcome, run_tool, tool
from tests.surrogates import cases
from tests.surrogates.cases import box, hexflex_like, many, more_responses, points, quintic, square_quadratic, surrogate
from tests.surrogates.exports.cases import MODELS
from tests.surrogates.exports.hostile_text import HOSTILE, hostile_model, random_texts

OK, OUTSIDE_DOMAIN, UNREACHABLE, NOT_CONVERGED, NOT_FINITE = range(5)
OCTAVE = tool(*verifying.OCTAVE)
needs_octave = pytest.mark.skipif(
    OCTAVE is None,
    reason="NO GNU OCTAVE: looked for octave-cli and octave on PATH. The exported functions were not run nor compared.",
)


def with_chords() -> Surrogate:
    """Certified by chord steps alone: both kinds of steps are in the code."""
    return replace(quintic(), certificate=certify(quintic()))


def strange_names() -> Surrogate:
    """Names that are words of the language or functions of it, and equal but for case."""
    names = ["end", "function", "sum", "exp", "a", "A", "coded", "settings", "NaN", "i"]
    model = surrogate(box(*((n, -1.0, 2.0) for n in names)), ["1", *names, "a:A"], np.arange(1.0, 25.0).reshape(2, 12))
    return replace(model, responses=(Response("ones", "m"), Response("Ones", "m")))


CASES = {**MODELS, "with_chords": with_chords, "strange_names": strange_names}


def write(folder: Path, model: Surrogate, prefix: str = "stage", **settings) -> Path:
    for name, content in Matlab(**settings).render(model, prefix).items():
        (folder / name).write_text(content, encoding="ascii", newline="\n")
    return folder


def octave(folder: Path, script: str) -> str:
    """What a script prints; it runs in the folder."""
    (folder / "script.m").write_text(script, encoding="ascii")
    good, printed = run_tool([str(OCTAVE), "--norc", "--quiet", "--no-gui", "script.m"], folder)
    assert good, printed
    return printed


# --- against the model ------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def findings(tmp_path_factory):
    """Findings of all models, of which Octave starts once."""
    if OCTAVE is None:
        pytest.skip(
            "NO GNU OCTAVE: looked for octave-cli and octave on PATH. The exported functions were not compared."
        )
    folder, models = tmp_path_factory.mktemp("matlab"), []
    for k, make in enumerate(CASES.values()):
        models.append((make(), f"m{k}"))
        write(folder, *models[-1])
    return dict(zip(CASES, verifying.verify_all(models, folder), strict=True))


@pytest.mark.parametrize("name", CASES)
def test_the_verifier_agrees(findings, name):
    assert len(findings[name]) == (8 if obstacle(CASES[name]()) else 11)
    assert {f.outcome for f in findings[name]} == {Outcome.AGREES}, findings[name]


@needs_octave
def test_statuses_and_least_norm(tmp_path):
    """Targets beyond, off the surface, without a logarithm and of too few steps, in one start of Octave."""
    square, over, under, logs = (
        square_quadratic(),
        cases.overdetermined(),
        cases.underdetermined(),
        MODELS["logarithms"](),
    )
    write(tmp_path, square)
    write(tmp_path, square, "hasty", max_iterations=1)
    write(tmp_path, over, "over")
    write(tmp_path, under, "under")
    write(tmp_path, logs, "logs")
    beyond = square.predict(square.factors.decode(np.array([[1.1, -0.3, 0.5], [0.2, -1.05, 0.9]])))
    inside = square.predict(points(square, 5, seed=4, reach=0.9))
    off = over.predict(points(over, 2, reach=0.2))
    off[1, 2] += 1e-3 * over.scale[2]
    wanted = under.predict(points(under, 20, reach=0.4))
    positive = logs.predict(logs.factors.centre[None])[0]
    without = np.array([positive, positive * [1.0, -1.0, 1.0], positive * [1.0, 1.0, 0.0], [np.nan, -1.0, 1.0]])
    asked = {"beyond": beyond, "inside": inside, "off": off, "wanted": wanted, "without": without}
    calls = [("stage", "beyond"), ("stage", "inside"), ("hasty", "inside")]
    calls += [("over", "off"), ("under", "wanted"), ("logs", "without")]
    from scipy.io import loadmat, savemat

    savemat(tmp_path / "asked.mat", asked)
    lines = ["load('asked.mat');"]
    lines += [f"[{p}_{name}_x, {p}_{name}] = {p}_inverse({name});" for p, name in calls]
    octave(tmp_path, "\n".join([*lines, "save('-v6', 'got.mat');"]))
    got = loadmat(tmp_path / "got.mat")
    status = {f"{p}_{name}": got[f"{p}_{name}"].ravel().tolist() for p, name in calls}
    assert status["stage_beyond"] == [OUTSIDE_DOMAIN] * 2
    assert np.isnan(got["stage_beyond_x"]).all()
    assert status["stage_inside"] == [OK] * 5
    expected = square.invert(inside).settings
    assert np.abs((got["stage_inside_x"] - expected) / square.factors.half_range).max() <= 1e-12
    assert status["hasty_inside"] == [NOT_CONVERGED] * 5
    assert status["over_off"] == [OK, UNREACHABLE]
    assert status["logs_without"] == [OK, UNREACHABLE, UNREACHABLE, NOT_FINITE]
    assert status["under_wanted"] == [OK] * 20
    assert np.abs((got["under_wanted_x"] - under.invert(wanted).settings) / under.factors.half_range).max() <= 1e-12


@needs_octave
def test_what_is_no_matrix_of_settings_is_refused(tmp_path):
    write(tmp_path, square_quadratic())
    bad = ["[1; 2; 3]", "[1, 2]", "'abc'", "[]", "[1, 2, 3i]", "{1, 2, 3}", "zeros(2, 3, 2)", "true(1, 3)"]
    calls = [(f"{function}({given})") for given in bad for function in ("stage_forward", "stage_inverse")]
    script = "".join(f"try\n {c};\n disp('taken')\ncatch e\n disp([e.identifier ' ' e.message])\nend\n" for c in calls)
    script += "disp(class(stage_forward(single([0, 0, 0]))))\ndisp(size(stage_inverse(zeros(0, 3))))\n"
    *refused, kind, size = octave(tmp_path, script).strip().splitlines()
    forward, inverse = refused[::2], refused[1::2]
    columns = "must be a real matrix with a row for each point and 3 columns: a, b, c"
    assert forward == [f"stage:settings stage: settings {columns}"] * len(bad)
    columns = "must be a real matrix with a row for each target and 3 columns: r0, r1, r2"
    assert inverse == [f"stage:responses stage: responses {columns}"] * len(bad)
    assert kind == "double"
    assert size.split() == ["0", "3"]


@needs_octave
def test_the_example_in_the_help_runs(tmp_path):
    model = hexflex_like()
    write(tmp_path, model)
    example = re.search(r"(?<=Example:\n%     ).*", (tmp_path / "stage_forward.m").read_text())
    assert example is not None
    printed = octave(tmp_path, f"{example[0]};\nfprintf('%.17g ', responses);\n")
    expected = model.predict(model.factors.centre[None])[0]
    assert np.abs(np.array(printed.split(), dtype=float) - expected).max() <= 1e-15 * model.scale.max()


# --- the text ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", CASES)
def test_the_text_is_ascii_and_the_same_each_time(name):
    model = CASES[name]()
    files = Matlab().render(model, "stage")
    assert files == Matlab().render(loads(dumps(model)), "stage")
    words = ["forward", "jacobian", "inside", "polynomials", *([] if obstacle(model) else ["inverse"])]
    assert list(files) == [f"stage_{word}.m" for word in words]
    for file, text in files.items():
        assert text.isascii()
        assert text.startswith("function ")
        assert f" = {file.removesuffix('.m')}(" in text.partition("\n")[0]
        assert max(map(len, text.splitlines())) <= 130
    assert isinstance(Matlab(), Target)


@pytest.mark.parametrize("name", CASES)
def test_no_syntax_of_octave_alone_is_used(name):
    for text in Matlab().render(CASES[name](), "stage").values():
        code = _code(text)
        assert not re.search(r"[!#\"]|\+=|-=|\*=|\+\+|--|\bend\w+\b|\bprintf\b", code)
        # Blocks end, and the function, too: in a file of one function, both languages take that.
        opened = len(re.findall(r"^\s*(?:function|if|for|while)\b", code, re.MULTILINE))
        assert opened == len(re.findall(r"^\s*end$", code, re.MULTILINE))


def test_a_curved_model_of_more_responses_than_factors_has_no_inverse_and_says_why():
    files = Matlab().render(more_responses(), "stage")
    assert "stage_inverse.m" not in files
    assert "There is no inverse: 3 responses follow from 2 factors" in files["stage_forward.m"]
    assert not any("stage_inverse" in text for text in files.values())


def test_every_number_survives_the_text():
    model = many()
    text = Matlab().render(model, "stage")["stage_polynomials.m"]
    written = {float(word) for word in re.findall(r"-?\d+\.?\d*(?:e[+-]?\d+)?", text)}
    assert set(model.coefficients.ravel().tolist()) <= written


def test_long_rows_are_continued_between_numbers():
    names = [f"factor_{k}" for k in range(40)]
    model = surrogate(
        box(*((n, -1.0, 1.0 + k / 7.0) for k, n in enumerate(names))),
        ["1", *names],
        np.random.default_rng(0).normal(size=(12, 41)) * 1e-9,
    )
    for text in Matlab().render(model, "stage").values():
        assert max(map(len, text.splitlines())) <= 130
        assert not re.search(r"[-e.] \.\.\.\n|\d \.\.\.\n", text)
        assert "e-\n" not in text
    assert "40 columns'" in Matlab().render(model, "stage")["stage_inside.m"]


@pytest.mark.filterwarnings("ignore:overflow encountered:RuntimeWarning", "ignore:invalid value:RuntimeWarning")
def test_a_number_that_overflows_is_refused_not_written():
    model = surrogate(cases.unit_box(2), ["1", "f0", "f1"], [[0.0, 1.7e308, 1.7e308]])
    with pytest.raises(ValueError, match="cannot be exported: a number derived from its coefficients overflows"):
        Matlab().render(model, "stage")


@pytest.mark.parametrize("prefix", ["end", "function", "For", "classdef", "endfunction", "until", "nul"])
def test_a_prefix_that_is_a_keyword_is_refused(prefix):
    with pytest.raises(ValueError, match=rf"^prefix {prefix!r} is not allowed: a keyword"):
        Matlab().render(quintic(), prefix)


def test_a_prefix_that_makes_a_name_too_long_is_refused():
    with pytest.raises(ValueError, match=r"MATLAB's names have at most 63 characters, .*; use at most 51"):
        Matlab().render(quintic(), "a" * 52)
    assert all(len(name.removesuffix(".m")) <= 63 for name in Matlab().render(quintic(), "a" * 51))
    with pytest.raises(ValueError, match="use letters, digits and underscores"):
        Matlab().render(quintic(), "a/../b")
    with pytest.raises(ValueError, match="max_iterations of the MATLAB export must be a whole number of at least 1"):
        Matlab(max_iterations=0)


# --- hostile text -----------------------------------------------------------------------------------------------------

OWN_HOSTILE = [
    "%}\nsystem('ls')\n%{",
    "%{",
    "{",
    "}",
    "#{",
    "...",
    "x ...\nsystem('ls')",
    "'); system('ls'); ('",
    "%!test",
    "-*- texinfo -*-",
    "<html>",
    "#codegen",
    "Copyright",
    "end",
]


@pytest.mark.parametrize("text", [*HOSTILE, *OWN_HOSTILE], ids=lambda text: repr(text)[:20])
def test_text_of_the_model_cannot_become_code(text):
    files, expected = (Matlab().render(hostile_model(t), "stage") for t in (text, "m"))
    for name, source in files.items():
        assert all(c.isprintable() or c == "\n" for c in source)
        assert not re.search(r"^\s*[%#][{}]\s*$", source, re.MULTILINE)
        assert _code(source) == _code(expected[name])


def test_random_text_cannot_become_code():
    rng = np.random.default_rng(1)
    letters = np.array([*"%%{}{}..''\n\r#! ;a", "é"])
    model = hostile_model("m")
    expected = _code(Matlab().render(model, "stage")["stage_forward.m"])
    own = ["".join(rng.choice(letters, rng.integers(1, 30))) for _ in range(60)]
    for text in [*random_texts(60), *own]:
        changed = replace(model, provenance={"note": text, text: [text]})
        source = Matlab().render(changed, "stage")["stage_forward.m"]
        assert not re.search(r"^\s*[%#][{}]\s*$", source, re.MULTILINE)
        assert _code(source) == expected


@needs_octave
def test_octave_reads_hostile_text_as_help_alone(tmp_path):
    """All hostile texts in one start: the functions run, and their help is there from the first to the last line."""
    script = []
    for k, text in enumerate([*HOSTILE, *OWN_HOSTILE]):
        write(tmp_path, hostile_model(text), f"h{k}")
        script.append(
            f"text = help('h{k}_forward'); disp(isequal(size(h{k}_forward([0, 1.5])), [1, 2]) "
            f"&& ~isempty(strfind(text, 'H{k}_FORWARD')) && ~isempty(strfind(text, 'See also h{k}_jacobian')));"
        )
    assert octave(tmp_path, "\n".join(script)).split() == ["1"] * len(script)


def _code(text: str) -> str:
    """The code without comments: no string in it has a per cent."""
    return "\n".join(line for line in (re.sub("%.*", "", raw).rstrip() for raw in text.splitlines()) if line)


# --- the verifier -----------------------------------------------------------------------------------------------------

WRONG = [
    ("polynomials", "value = products * coefficients;", "value = 1.000000001 * products * coefficients;", "forward"),
    ("polynomials", "if setting(t) == j", "if setting(t) ~= j", "Jacobian"),
    ("inside", "<= 1.000000001", "<= 1.1", "settings outside"),
    ("inside", "status(~finite) = 4;", "", "NaN and infinite settings"),
    ("forward", "responses(status == 4, :) = NaN;", "responses = responses(:, [1, 1, 1]);", "forward"),
    ("forward", "%   Factors", "%   No factors", "help"),
    ("inverse", "settings(status ~= 0, :) = NaN;", "settings = settings + 0.001;", "inverse"),
    ("inverse", "failed(place ~= 0) = 1;", "failed(:) = 0;", "a target beyond"),
    ("inverse", "status(~all(isfinite(wanted), 2)) = 4;", "", "NaN and infinite targets"),
    ("inverse", "n = size(responses, 1);", "n = size(responses, 1); warning('strange');", "no warning"),
]


@needs_octave
def test_a_wrong_export_is_found(tmp_path):
    models = []
    for k, (word, old, new, _) in enumerate(WRONG):
        prefix = f"wrong{k}"
        models.append((MODELS["certified"](), prefix))
        write(tmp_path, *models[-1])
        path = tmp_path / f"{prefix}_{word}.m"
        assert old in path.read_text()
        path.write_text(path.read_text().replace(old, new), encoding="ascii")
    for found, (_, _, new, what) in zip(verifying.verify_all(models, tmp_path), WRONG, strict=True):
        wrong = [f.what for f in found if f.outcome is Outcome.DIFFERS]
        assert any(w.startswith(what) for w in wrong), (new, found)


@needs_octave
def test_a_file_that_is_missing_or_broken_is_a_finding(tmp_path):
    [finding] = verifying.verify(quintic(), "stage", tmp_path)
    assert finding.outcome is Outcome.DIFFERS
    assert "stage_forward" in finding.detail
    write(tmp_path, quintic())
    (tmp_path / "stage_inside.m").write_text("function status = stage_inside(settings\n")
    [finding] = verifying.verify(quintic(), "stage", tmp_path)
    assert finding.outcome is Outcome.DIFFERS
    assert "parse error" in finding.detail


def test_octave_that_is_missing_is_said(tmp_path, monkeypatch):
    monkeypatch.setattr(shutil, "which", lambda name: None)
    [finding] = verifying.verify(quintic(), "stage", write(tmp_path, quintic()))
    assert finding.outcome is Outcome.NOT_CHECKED
    assert "apt install octave" in finding.detail

"""The exported C does what the Python does, refuses what it must, and lets no text of the model become code."""

import ctypes
import re
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from experiments import Factor, FactorSpace, Response
from surrogates import ResponseError, Surrogate, certify, loads, obstacle
from surrogates.artefact import dumps
from surrogates.exports import C99, TARGETS, Target, get
from tests.surrogates.cases import (
    AFFINE,
    ALL,
    box,
    constant,
    hexflex_like,
    more_responses,
    overdetermined,
    points,
    quintic,
    square_quadratic,
    surrogate,
    underdetermined,
    unit_box,
)

OK, OUTSIDE_DOMAIN, UNREACHABLE, NOT_CONVERGED, NOT_FINITE = range(5)
FLAGS = ["-std=c99", "-Wall", "-Wextra", "-Wconversion", "-pedantic", "-Werror"]
STRICTER = ["-Wdouble-promotion", "-Wshadow", "-Wcast-qual", "-Wundef", "-Wcomment", "-Wtrigraphs"]
C_ONLY = ["-Wstrict-prototypes", "-Wmissing-prototypes", "-Wbad-function-cast"]
COMPILER = next((c for c in ("gcc", "cc", "clang") if shutil.which(c)), None)
needs_compiler = pytest.mark.skipif(
    COMPILER is None,
    reason="NO C COMPILER: looked for gcc, cc and clang on PATH. The exported C was neither compiled nor compared.",
)


def compile_c(folder: Path, *arguments: str, compiler: str | None = COMPILER) -> None:
    done = subprocess.run([str(compiler), *arguments], cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def write(folder: Path, model: Surrogate, prefix: str = "model", **settings) -> Path:
    for name, content in get("c99", settings).render(model, prefix).items():
        (folder / name).write_text(content, encoding="ascii")
    return folder


class Compiled:
    """The exported functions of one model, called through ctypes."""

    def __init__(self, folder: Path, model: Surrogate, prefix: str = "model", **settings) -> None:
        write(folder, model, prefix, **settings)
        compile_c(folder, *FLAGS, "-O2", "-shared", "-fPIC", f"{prefix}.c", "-o", f"{prefix}.so", "-lm")
        self.library = ctypes.CDLL(str(folder / f"{prefix}.so"))
        self.prefix, self.n, self.m = prefix, len(model.factors), len(model.responses)

    def _call(self, name: str, given, *shape: int):
        given = np.ascontiguousarray(given, dtype=np.float64)
        answer = np.full(shape, 777.0)
        pointers = [a.ctypes.data_as(ctypes.POINTER(ctypes.c_double)) for a in (given, answer)]
        return getattr(self.library, f"{self.prefix}_{name}")(*pointers[: 1 if name == "inside" else 2]), answer

    def forward(self, settings):
        return self._call("forward", settings, self.m)

    def jacobian(self, settings):
        return self._call("jacobian", settings, self.m, self.n)

    def inverse(self, responses):
        return self._call("inverse", responses, self.n)

    def inside(self, settings):
        return self._call("inside", settings, 0)[0]


@pytest.fixture(scope="module", params=ALL)
def pair(request, tmp_path_factory):
    """A model and its compiled export; every test of a model shares one compilation."""
    if COMPILER is None:
        pytest.skip("NO C COMPILER: looked for gcc, cc and clang on PATH. The exported C was not compared.")
    model = ALL[request.param]()
    return model, Compiled(tmp_path_factory.mktemp(request.param), model)


@pytest.fixture
def inverted(pair):
    """The same, where the export has an inverse."""
    if obstacle(pair[0]):
        pytest.skip("this model has no inverse")
    return pair


# --- against Python ---------------------------------------------------------------------------------------------------


def test_forward_and_jacobian_agree_with_python(pair):
    model, compiled = pair
    settings = points(model, 200)
    predicted, slopes = model.predict(settings), model.jacobian(settings)
    for point, expected, slope in zip(settings, predicted, slopes, strict=True):
        status, responses = compiled.forward(point)
        assert status == OK
        assert np.abs((responses - expected) / model.scale).max() <= 1e-12
        status, jacobian = compiled.jacobian(point)
        assert status == OK
        assert np.abs((jacobian - slope) * model.factors.half_range / model.scale[:, None]).max() <= 1e-12


def test_inverse_agrees_with_python(inverted):
    model, compiled = inverted
    targets = model.predict(points(model, 200, seed=1, reach=0.6))
    wanted = model.invert(targets)
    answers = [compiled.inverse(target) for target in targets]
    easy = np.array([status == OK for status, _ in answers])
    # Where the least-norm steps leave the box, Python searches its boundary and C refuses: that is documented.
    assert easy.mean() > 0.9
    assert wanted.ok.all()
    found = np.array([settings for _, settings in answers])[easy]
    assert np.abs((found - wanted.settings[easy]) / model.factors.half_range).max() <= 1e-12
    assert np.abs((model.predict(found) - targets[easy]) / model.scale).max() <= 1e-12


def test_ok_is_never_said_of_settings_outside_or_of_a_missed_target(inverted):
    model, compiled = inverted
    scatter = np.random.default_rng(2).uniform(-2.0, 2.0, (300, len(model.responses)))
    centre = model.predict(model.factors.centre[None])[0]
    for target in centre + model.scale * scatter:
        status, settings = compiled.inverse(target)
        assert status in (OK, OUTSIDE_DOMAIN, UNREACHABLE, NOT_CONVERGED)
        if status == OK:
            assert model.contains(settings[None]).all()
            assert (settings >= [f.low for f in model.factors]).all()
            assert (settings <= [f.high for f in model.factors]).all()
            assert np.abs((model.predict(settings[None])[0] - target) / model.scale).max() <= 1.01e-9
        else:
            assert not (model.contains(settings[None]) & _reaches(model, settings, target)).any()


def _reaches(model, settings, target):
    return np.abs((model.predict(settings[None]) - target) / model.scale).max(axis=1) <= 0.99e-9


# --- status codes -----------------------------------------------------------------------------------------------------


def test_domain_is_python_s(pair):
    model, compiled = pair
    low = np.array([f.low for f in model.factors])
    edges = [low, np.array([f.high for f in model.factors]), low - 1e-6 * model.factors.half_range]
    for point in [*edges, *points(model, 100, seed=3, reach=1.3)]:
        expected = OK if model.contains(point[None])[0] else OUTSIDE_DOMAIN
        assert compiled.inside(point) == expected
        assert compiled.forward(point)[0] == expected
        assert compiled.jacobian(point)[0] == expected


def test_outside_the_domain_values_are_written(pair):
    model, compiled = pair
    point = model.factors.decode(np.full((1, len(model.factors)), 1.5))
    status, responses = compiled.forward(point[0])
    assert status == OUTSIDE_DOMAIN
    assert np.abs((responses - model.predict(point)[0]) / model.scale).max() <= 1e-11
    status, jacobian = compiled.jacobian(point[0])
    assert status == OUTSIDE_DOMAIN
    assert not (jacobian == 777.0).any()


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_a_number_that_is_not_finite_is_refused_and_nothing_written(pair, bad):
    model, compiled = pair
    for position in range(len(model.factors)):
        settings = points(model, 1)[0] + 1e9  # the other settings are outside: not finite comes first
        settings[position] = bad
        assert compiled.inside(settings) == NOT_FINITE
        for call in (compiled.forward, compiled.jacobian):
            status, answer = call(settings)
            assert status == NOT_FINITE
            assert (answer == 777.0).all()
    for position in range(0 if obstacle(model) else len(model.responses)):
        responses = model.predict(points(model, 1))[0]
        responses[position] = bad
        status, answer = compiled.inverse(responses)
        assert status == NOT_FINITE
        assert (answer == 777.0).all()


def test_huge_targets_are_refused(inverted):
    model, compiled = inverted
    for size in (1e30, 1e300, 1.7e308):
        assert compiled.inverse(np.full(len(model.responses), size))[0] in (OUTSIDE_DOMAIN, UNREACHABLE, NOT_CONVERGED)


@needs_compiler
def test_affine_inverse_outside_writes_nothing(tmp_path):
    model = hexflex_like()
    compiled = Compiled(tmp_path, model)
    wanted = model.factors.decode(np.array([[1.2, 0, 0, 0, 0, 0]]))
    status, settings = compiled.inverse(model.predict(wanted)[0])
    assert status == OUTSIDE_DOMAIN
    assert (settings == 777.0).all()


@needs_compiler
def test_iterative_inverse_outside_writes_nothing(tmp_path):
    model = square_quadratic()
    compiled = Compiled(tmp_path, model)
    wanted = model.factors.decode(np.array([[1.1, -0.3, 0.5], [0.2, -1.05, 0.9]]))
    for target in model.predict(wanted):
        status, settings = compiled.inverse(target)
        assert status == OUTSIDE_DOMAIN
        assert (settings == 777.0).all()


@needs_compiler
def test_target_off_the_reachable_surface_is_unreachable(tmp_path):
    model = overdetermined()
    compiled = Compiled(tmp_path, model)
    target = model.predict(points(model, 1, reach=0.2))[0]
    assert compiled.inverse(target)[0] == OK
    target[2] += 1e-3 * model.scale[2]
    assert compiled.inverse(target)[0] == UNREACHABLE


def test_a_curved_model_of_more_responses_than_factors_has_no_inverse_and_says_why():
    texts = get("c99").render(more_responses(), "dev")
    assert "There is no inverse: 3 responses follow from 2 factors, so that they cannot be chosen" in texts["dev.h"]
    for text in texts.values():
        assert "dev_inverse" not in text
        assert max(map(len, text.splitlines())) <= 112
    assert not re.search("least_norm|tolerance|dev_check|dev_search", texts["dev.c"])


@needs_compiler
def test_a_constant_response_can_only_be_what_it_is(tmp_path):
    model = constant()
    compiled = Compiled(tmp_path, model)
    status, settings = compiled.inverse([3.0, 0.0])
    assert status == OK
    assert (settings == model.factors.centre).all()
    assert compiled.inverse([3.1, 0.0])[0] == UNREACHABLE


@needs_compiler
def test_steps_are_bounded_by_the_setting(tmp_path):
    model = square_quadratic()
    target = model.predict(points(model, 1, seed=4, reach=0.9))[0]
    statuses = []
    for steps in (1, 50):
        folder = tmp_path / str(steps)
        folder.mkdir()
        statuses.append(Compiled(folder, model, max_iterations=steps).inverse(target)[0])
    assert statuses == [NOT_CONVERGED, OK]


@needs_compiler
def test_an_underdetermined_inverse_is_of_least_coded_norm(tmp_path):
    model = underdetermined()
    compiled = Compiled(tmp_path, model)
    slope = model.jacobian_coded(np.zeros((1, 4)))[0]
    for target in model.predict(points(model, 20, reach=0.4)):
        status, settings = compiled.inverse(target)
        coded = model.factors.code(settings[None])[0]
        expected = np.linalg.lstsq(slope, target - model.predict_coded(np.zeros((1, 4)))[0])[0]
        assert status == OK
        assert np.abs(coded - expected).max() <= 1e-12


# --- the text ---------------------------------------------------------------------------------------------------------


@needs_compiler
@pytest.mark.parametrize("name", ALL)
def test_compiles_without_a_warning_as_c_and_as_cpp(tmp_path, name):
    write(tmp_path, ALL[name](), "dev_1")
    for level in ("-O0", "-O3"):
        compile_c(tmp_path, *FLAGS, level, "-c", "dev_1.c", "-o", "dev.o")
        compile_c(tmp_path, *FLAGS, *STRICTER, *C_ONLY, level, "-c", "dev_1.c", "-o", "dev.o")
    if shutil.which("g++"):
        flags = [f for f in FLAGS if f != "-std=c99"]
        compile_c(tmp_path, *flags, *STRICTER, "-x", "c++", "-c", "dev_1.c", "-o", "dev.o", compiler="g++")


@needs_compiler
@pytest.mark.skipif(shutil.which("nm") is None, reason="nm (binutils) is not on PATH: symbols were not checked")
@pytest.mark.parametrize("name", ALL)
def test_no_globals_and_no_calls_but_mathematics(tmp_path, name):
    write(tmp_path, ALL[name](), "dev")
    compile_c(tmp_path, *FLAGS, "-O0", "-c", "dev.c")
    listing = subprocess.run(["nm", "dev.o"], cwd=tmp_path, capture_output=True, text=True, check=True).stdout
    symbols = [line.split()[-2:] for line in listing.splitlines()]
    public = {s for kind, s in symbols if kind == "T"}
    words = {"forward", "forward_jacobian", "jacobian", "inside"} | (set() if obstacle(ALL[name]()) else {"inverse"})
    assert public == {f"dev_{word}" for word in words}
    assert {kind for kind, _ in symbols} <= {"T", "t", "r", "U"}
    assert {s for kind, s in symbols if kind == "U"} <= {"memset", "_GLOBAL_OFFSET_TABLE_"}
    source = (tmp_path / "dev.c").read_text()
    assert re.findall(r"#include.*", source) == ['#include "dev.h"', "#include <float.h>"]
    assert not re.search(r"\b(malloc|calloc|realloc|free|goto|printf|exit)\b", source)
    assert not re.search(r"^static (?!int|void|double dev_within|const )", source, re.MULTILINE)
    assert not re.search(r"^ +static (?!const )", source, re.MULTILINE)


@needs_compiler
@pytest.mark.parametrize("name", ["hexflex_like", "cantilever_like", "more_responses"])
def test_the_example_in_the_header_runs(tmp_path, name):
    write(tmp_path, ALL[name](), "dev")
    comment = (tmp_path / "dev.h").read_text().partition("Example:")[2].partition("*/")[0]
    body = "\n".join(line.removeprefix(" *") for line in comment.splitlines())
    (tmp_path / "main.c").write_text(f'#include "dev.h"\nint main(void)\n{{{body}}}\n')
    compile_c(tmp_path, *FLAGS, "main.c", "dev.c", "-o", "main", "-lm")
    assert subprocess.run([str(tmp_path / "main")], check=False).returncode == 0


@needs_compiler
def test_fast_math_that_would_remove_the_refusals_is_refused(tmp_path):
    write(tmp_path, quintic(), "dev")
    done = subprocess.run(
        [str(COMPILER), *FLAGS, "-ffast-math", "-c", "dev.c"], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert done.returncode != 0
    assert "compile without -ffast-math" in done.stderr


@pytest.mark.parametrize("name", ALL)
def test_the_same_model_gives_the_same_text(name):
    first, again = (get("c99").render(ALL[name](), "dev") for _ in range(2))
    assert first == again
    assert first == get("c99").render(loads(dumps(ALL[name]())), "dev")
    assert list(first) == ["dev.h", "dev.c", "dev_selftest.c"]
    assert all(text.isascii() and text.endswith("*/\n" if file == "dev.h" else "}\n") for file, text in first.items())


def test_provenance_order_does_not_matter():
    keys = ["zeta", "alpha", "mid"]
    texts = [
        get("c99").render(replace(quintic(), provenance={k: 1 for k in order}), "dev") for order in (keys, keys[::-1])
    ]
    assert texts[0] == texts[1]


def test_zeros_are_left_out():
    source = get("c99").render(AFFINE["block_map"](), "dev")["dev.c"]
    row = source.partition("static void dev_first")[2].partition("moves[0] = ")[2].partition(";")[0]
    assert "d0" in row
    assert "d1" in row
    assert "d2" not in row
    assert "d3" not in row


def test_every_number_survives_the_text():
    model = square_quadratic()
    source = get("c99").render(model, "dev")["dev.c"]
    written = {float(text) for text in re.findall(r"\d+\.?\d*(?:e[+-]?\d+)?", source)}
    assert {abs(float(c)) for c in model.coefficients.ravel()} <= written


def test_header_says_what_a_reader_must_know():
    model = hexflex_like()
    errors = tuple(ResponseError(r.name, 50, 1.25e-9, 1e-6, 1e-3, 3.5e-10, 4) for r in model.responses)
    model = replace(
        model, validation=errors, certificate=certify(model), provenance={"config": "hexflex.toml", "seed": 7}
    )
    header = get("c99").render(model, "dev")["dev.h"]
    for words in (
        "[0] T1D1  N  -5.0 to 4.0",
        "[3] r3  rad  max abs 1.25e-09, rmse 3.5e-10 on 50 runs",
        "Certificate: certified.",
        "config: hexflex.toml",
        "seed: 7",
        "schema: flexdoce-model/1",
        "DEV_FACTOR_T3D2 = 5",
        "#define DEV_N_RESPONSES 6",
    ):
        assert words in header
    assert "not validated" in get("c99").render(quintic(), "dev")["dev.h"]


# --- hostile text -----------------------------------------------------------------------------------------------------

HOSTILE = [
    "*/ int injected; /*",
    "/* nested",
    "*\\\n/ int injected;",
    "??/\nint injected;",
    "//\\",
    "/**//**/*/ */",
    "\\",
    "$p ${P} $",
    "%s%n",
    "µm·θ² — \u202eevil\u2066",
    "line\r\nbreak\x00\x1b[31m\u2028",
    "\ud800",
    "*\u200b/ int injected;",
    "＊／ int injected;",
    "*\u0338/ int injected;",
    "x" * 500,
]


def hostile_model(text: str) -> Surrogate:
    unit = text if text.isprintable() and not set(text) & set("[],\"'\\") and not text[0].isspace() else "m"
    factors = FactorSpace((Factor("int", unit, -1.0, 1.0, text), Factor("gamma", unit, 1.0, 2.0, text)))
    responses = (Response("for", unit, unit, 1.0, text), Response("NAN", unit, unit, 1.0, text))
    model = surrogate(factors, ["1", "int", "gamma", "int^2"], [[0.0, 1.0, 2.0, 0.1], [0.0, 2.0, -1.0, 0.0]])
    certificate = replace(certify(model), claim=text, reason=text, method=text)
    return replace(
        model,
        responses=responses,
        certificate=certificate,
        provenance={text: text, "nested": {"deep": [text, None, 1.5]}},
    )


@needs_compiler
@pytest.mark.parametrize("text", HOSTILE, ids=range(len(HOSTILE)))
def test_text_of_the_model_cannot_become_code(tmp_path, text):
    files = get("c99").render(hostile_model(text), "dev")
    assert all(content.isascii() for content in files.values())
    assert all(c.isprintable() or c == "\n" for content in files.values() for c in content)
    assert not any("??" in content or "\\" in content for content in files.values())
    write(tmp_path, hostile_model(text), "dev")
    compile_c(tmp_path, *FLAGS, *STRICTER, "-c", "dev.c")
    # After the compiler has taken the comments out, the code is that of the same model without the text.
    bare = replace(hostile_model("m"), provenance={})
    expected = get("c99").render(bare, "dev")
    for name in files:
        assert _code(files[name]) == _code(expected[name])


def _code(text: str) -> str:
    return " ".join(re.sub(r"/\*.*?\*/", " ", text, flags=re.DOTALL).split())


@pytest.mark.parametrize(
    "prefix",
    ["", "1a", "a-b", "a b", "_a", "__a", "a\n", "µ", "é", "a/../b", "../up", "a;b", "a*/", "a.b", None, 3, "ａ"],
)
def test_a_prefix_that_is_not_an_identifier_is_refused(prefix):
    with pytest.raises(ValueError, match=r"^prefix name .* is not allowed: use letters, digits and underscores"):
        get("c99").render(quintic(), prefix)


@pytest.mark.parametrize("prefix", ["int", "restrict", "Double", "math", "MATH", "string", "con", "NUL", "com1", "x"])
def test_a_prefix_that_would_clash_is_refused(prefix):
    with pytest.raises(ValueError, match=rf"^prefix {prefix!r} is not allowed: a keyword, a standard header or"):
        get("c99").render(quintic(), prefix)


def test_a_prefix_of_endless_length_is_refused():
    with pytest.raises(ValueError, match="use at most 63 characters"):
        get("c99").render(quintic(), "a" * 64)
    assert get("c99").render(quintic(), "a" * 63)


@needs_compiler
def test_factors_may_be_called_like_anything(tmp_path):
    names = ["coded", "responses", "status", "int", "x", "x2_x", "NAN", "isfinite", "fabs", "main", "j", "DEV_OK", "OK"]
    factors = box(*((name, -1.0, 1.0) for name in names))
    for degree in (1, 2):
        terms = ["1", *(f"{n}^{e}" for n in names for e in range(1, degree + 1))]
        model = surrogate(factors, terms, [np.arange(1.0, len(terms) + 1.0)] * 2)
        model = replace(model, responses=(Response("inverse", "m"), Response("coded", "m")))
        write(tmp_path, model, "dev")
        compile_c(tmp_path, *FLAGS, *STRICTER, "-c", "dev.c")


@pytest.mark.filterwarnings("ignore:overflow encountered:RuntimeWarning", "ignore:invalid value:RuntimeWarning")
@pytest.mark.parametrize("size", [1e308, 1.7e308])
def test_a_number_that_overflows_is_refused_not_written(size):
    model = surrogate(unit_box(2), ["1", "f0", "f1"], [[0.0, size, size]])
    with pytest.raises(ValueError, match="cannot be exported: a number derived from its coefficients overflows"):
        get("c99").render(model, "dev")


# --- the registry -----------------------------------------------------------------------------------------------------


def test_registry():
    assert get("c99") == C99()
    assert get("c99", {"max_iterations": 5}).max_iterations == 5
    assert all(isinstance(get(name), Target) and cls.name == name and cls.summary for name, cls in TARGETS.items())


@pytest.mark.parametrize(
    ("name", "settings", "message"),
    [
        ("c98", {}, r"unknown export 'c98'; did you mean 'c99'\?"),
        ("zzz", {}, r"unknown export 'zzz'; known are .*c99"),
        ("c99", {"max_iteration": 3}, r"export 'c99' has no setting 'max_iteration'; did you mean 'max_iterations'\?"),
        ("c99", {"max_iterations": 0}, r"max_iterations of the C99 export must be a whole number of at least 1, got 0"),
        ("c99", {"max_iterations": 2.5}, r"export 'c99': max_iterations must be a whole number, got 2.5"),
    ],
)
def test_registry_refusals(name, settings, message):
    with pytest.raises(ValueError, match=message):
        get(name, settings)


# --- responses that are given by their logarithm ----------------------------------------------------------------------


def logarithms() -> Surrogate:
    """Three factors to three curved responses, the second and third by their logarithm."""
    model = square_quadratic()
    return replace(model, coefficients=model.coefficients * [1.0, 100.0, 1.0], links=("identity", "log", "log"))


def affine_logarithms() -> Surrogate:
    return replace(
        surrogate(unit_box(2), ["1", "f0", "f1"], [[0.5, 1.0, -0.5], [-14.0, 0.2, 1.0]]), links=("log", "log")
    )


@pytest.fixture(scope="module", params=[logarithms, affine_logarithms], ids=["curved", "affine"])
def logged(request, tmp_path_factory):
    if COMPILER is None:
        pytest.skip("NO C COMPILER: looked for gcc, cc and clang on PATH. The exported C was not compared.")
    return request.param(), Compiled(tmp_path_factory.mktemp(request.param.__name__), request.param())


def test_logarithms_agree_with_python(logged):
    model, compiled = logged
    settings = points(model, 200, reach=0.8)
    for point, expected, slope in zip(settings, model.predict(settings), model.jacobian(settings), strict=True):
        status, responses = compiled.forward(point)
        assert status == OK
        assert np.abs((responses - expected) / expected).max() <= 1e-12
        status, jacobian = compiled.jacobian(point)
        assert status == OK
        assert np.abs((jacobian - slope) / np.abs(slope).max(axis=1, keepdims=True)).max() <= 1e-12
        status, found = compiled.inverse(expected)
        assert status == OK
        assert np.abs((found - point) / model.factors.half_range).max() <= 1e-9


def test_logarithms_refuse_what_has_none(logged):
    model, compiled = logged
    target = model.predict(model.factors.centre[None])[0]
    for j, link in enumerate(model.links):
        for value in (0.0, -0.0, -1.0, -1e300) if link == "log" else ():
            wrong = target.copy()
            wrong[j] = value
            status, settings = compiled.inverse(wrong)
            assert status == UNREACHABLE
            assert (settings == 777.0).all()
            assert model.invert(wrong[None]).status == ("outside",)
        for value in (np.nan, np.inf, -np.inf):
            wrong = target.copy()
            wrong[j] = value
            wrong[0] = value if j == 0 else -1.0
            assert compiled.inverse(wrong)[0] == NOT_FINITE


@needs_compiler
def test_logarithms_compile_without_warnings_in_c_and_c_plus_plus(tmp_path):
    write(tmp_path, logarithms())
    compile_c(tmp_path, *FLAGS, *STRICTER, *C_ONLY, "-c", "model.c", "-o", "model.o")
    if shutil.which("g++"):
        compile_c(tmp_path, "-Wall", "-Wextra", "-Werror", "-x", "c++", "-c", "model.c", "-o", "x.o", compiler="g++")


def test_logarithms_are_told_to_the_reader():
    texts = get("c99").render(logarithms(), "model")
    assert "The polynomials give ln(response / unit) of r1 and r2" in texts["model.h"]
    assert "schema: flexdoce-model/2" in texts["model.h"]
    assert "ln(r1 / m)" in texts["model.c"]
    plain = get("c99").render(replace(logarithms(), links=()), "model")
    assert not any(word in text for text in plain.values() for word in ("ln(", "log(", "exp("))
    assert "schema: flexdoce-model/1" in plain["model.h"]

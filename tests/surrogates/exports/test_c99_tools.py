"""Verification of the exported C, in both precisions, by tools that we did not write."""

import shutil
import subprocess
from dataclasses import replace

import numpy as np
import pytest

from surrogates import certify
from surrogates.exports import get
from surrogates.exports.c99.elimination import MOST
from surrogates.exports.verification import Outcome, verify
from tests.surrogates.cases import ALL, box, square_quadratic, surrogate, unit_box

COMPILERS = [c for c in ("gcc", "clang") if shutil.which(c)]
FLAGS = ["-std=c99", "-Wall", "-Wextra", "-Wconversion", "-Wdouble-promotion", "-pedantic", "-Werror"]
PRECISIONS = ("c99", "c99_float")


def need(*tools):
    missing = [t for t in tools if shutil.which(t) is None]
    return pytest.mark.skipif(
        bool(missing), reason=f"{' AND '.join(missing).upper()} NOT FOUND: that check was not made"
    )


def certified(model):
    return replace(model, certificate=certify(model))


def mild(n: int = 3, seed: int = 0):
    """A certified cubic map of n factors whose Newton steps are counted."""
    rng = np.random.default_rng(seed)
    labels = ["1", *(f"f{i}" for i in range(n)), *(f"f{i}^3" for i in range(n)), "f0:f1"]
    coefficients = np.zeros((n, len(labels)))
    coefficients[:, 1 : n + 1] = np.eye(n) + 0.2 * rng.uniform(-1, 1, (n, n))
    coefficients[:, n + 1 :] = 0.03 * rng.uniform(-1, 1, (n, n + 1))
    return certified(surrogate(unit_box(n), labels, coefficients.tolist()))


def wide():
    """The same of more factors than elimination is written out for."""
    rng = np.random.default_rng(0)
    rows = np.hstack(
        [np.zeros((9, 1)), np.eye(9) + 0.05 * rng.uniform(-1, 1, (9, 9)), 0.05 * rng.uniform(-1, 1, (9, 2))]
    )
    return certified(surrogate(unit_box(9), ["1", *(f"f{i}" for i in range(9)), "f0^2", "f0:f1"], rows.tolist()))


def strong(seed: int = 4):
    """A map whose certificate counts chord steps but no Newton steps."""
    rng = np.random.default_rng(seed)
    labels = ["1", "f0", "f1", "f0^2", "f0:f1", "f1^2"]
    rows = np.hstack([np.zeros((2, 1)), np.eye(2), 0.12 * rng.choice([-1.0, 1.0], (2, 3))])
    return certified(surrogate(unit_box(2), labels, rows.tolist()))


def logarithms():
    model = square_quadratic()
    return certified(
        replace(model, coefficients=model.coefficients * [1.0, 100.0, 1.0], links=("identity", "log", "log"))
    )


CASES = {
    **{name: lambda make=make: certified(make()) for name, make in ALL.items()},
    "mild": mild, "wide": wide, "strong": strong, "logarithms": logarithms,
}  # fmt: skip


def test_the_cases_are_what_they_are_called():
    assert mild().certificate.newton_iterations
    assert wide().certificate.chord_iterations
    assert len(wide().factors) > MOST
    assert strong().certificate.newton_iterations is None
    assert strong().certificate.chord_iterations


@pytest.mark.skipif(not COMPILERS, reason="NEITHER GCC NOR CLANG FOUND: the exported C was not verified")
@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize("name", CASES)
def test_every_compiler_gives_the_model(name, precision, tmp_path):
    model = CASES[name]()
    for file, content in get(precision).render(model, "dev").items():
        (tmp_path / file).write_text(content, encoding="ascii")
    findings = verify(precision, model, "dev", tmp_path)
    assert [f for f in findings if f.outcome is not Outcome.AGREES] == []
    assert len(findings) >= 6 * len(COMPILERS)


@pytest.mark.skipif(not COMPILERS, reason="NEITHER GCC NOR CLANG FOUND: the exported C was not verified")
def test_a_wrong_coefficient_is_seen(tmp_path):
    model = mild()
    wrong = replace(model, coefficients=model.coefficients + 1e-9)
    for file, content in get("c99").render(wrong, "dev").items():
        (tmp_path / file).write_text(content, encoding="ascii")
    findings = verify("c99", model, "dev", tmp_path)
    assert any("forward at" in f.what and f.outcome is Outcome.DIFFERS for f in findings)


def written(folder, precision, model, extra=""):
    name = "dev" if precision == "c99" else "dev_float"
    for file, content in get(precision).render(model, "dev").items():
        (folder / file).write_text(content, encoding="ascii")
    return folder / f"{name}.c", folder / f"{name}_selftest.c"


@need("cppcheck")
@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize("name", ["hexflex_like", "mild", "wide", "strong", "logarithms", "folded"])
def test_cppcheck_finds_nothing(name, precision, tmp_path):
    source, test = written(tmp_path, precision, CASES[name]())
    flags = ["--enable=all", "--inconclusive", "--std=c99", "--error-exitcode=9", "--suppress=missingIncludeSystem",
             "--suppress=unmatchedSuppression"]  # fmt: skip
    # Public functions are used by others than these two files.
    done = subprocess.run(
        ["cppcheck", *flags, "--suppress=unusedFunction", str(source), str(test)],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr


@pytest.mark.skipif(not COMPILERS, reason="NEITHER GCC NOR CLANG FOUND: no sanitizer was run")
@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize("name", ["hexflex_like", "mild", "wide", "strong", "logarithms", "folded"])
def test_sanitizers_find_nothing(name, precision, tmp_path):
    source, test = written(tmp_path, precision, CASES[name]())
    for compiler in COMPILERS:
        flags = ["-O1", "-fsanitize=undefined,address", "-fno-sanitize-recover=all"]
        built = subprocess.run(
            [compiler, *FLAGS, *flags, str(source), str(test), "-o", str(tmp_path / "t"), "-lm"],
            capture_output=True, text=True, check=False,
        )  # fmt: skip
        if "cannot find" in built.stderr:
            pytest.skip(f"THE SANITIZER'S LIBRARY OF {compiler.upper()} IS NOT INSTALLED: that check was not made")
        assert built.returncode == 0, built.stderr
        done = subprocess.run([str(tmp_path / "t")], capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stdout + done.stderr


@need("g++")
@pytest.mark.parametrize("precision", PRECISIONS)
def test_compiles_as_cpp(precision, tmp_path):
    for name in ("mild", "strong", "logarithms", "hexflex_like"):
        source, _ = written(tmp_path, precision, CASES[name]())
        flags = ["-Wall", "-Wextra", "-Wconversion", "-pedantic", "-Werror", "-x", "c++", "-c"]
        subprocess.run(["g++", *flags, str(source), "-o", str(tmp_path / "o")], check=True)


@pytest.mark.skipif(not COMPILERS, reason="NEITHER GCC NOR CLANG FOUND: the exported C was not compiled")
def test_both_precisions_link_into_one_program(tmp_path):
    double, _ = written(tmp_path, "c99", mild())
    single, _ = written(tmp_path, "c99_float", mild())
    (tmp_path / "main.c").write_text(
        '#include "dev.h"\n#include "dev_float.h"\nint main(void) { double s[3] = {0.5, 0.1, 0.2}, r[3];\n'
        "float t[3] = {0.5f, 0.1f, 0.2f}, q[3];\n"
        "return dev_forward(s, r) + dev_float_forward(t, q) + (r[0] - (double)q[0] > 1e-5); }\n"
    )
    sources = [str(p) for p in (double, single, tmp_path / "main.c")]
    subprocess.run([COMPILERS[0], *FLAGS, *sources, "-o", str(tmp_path / "m")], check=True)
    assert subprocess.run([str(tmp_path / "m")], check=False).returncode == 0


def test_a_double_that_single_precision_cannot_hold_is_refused():
    model = surrogate(unit_box(1), ["1", "f0"], [[0.0, 1e39]])
    with pytest.raises(ValueError, match=r"cannot be exported in single precision: 1e\+39 overflows float32"):
        get("c99_float").render(model, "dev")


# --- what an attack on the first version found ------------------------------------------------------------------------


@pytest.mark.skipif(not COMPILERS, reason="NEITHER GCC NOR CLANG FOUND: the exported C was not verified")
@pytest.mark.parametrize("near", [1e-5, 1e-7, 1e-9])
@pytest.mark.parametrize("curved", [0.0, 0.05])
def test_nearly_singular_and_certified_is_inverted_all_the_same(near, curved, tmp_path):
    rows = [[0.0, 1.0, 1.0, 0.0, 0.0], [0.0, 1.0, 1.0 + near, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0, curved]]
    model = certified(surrogate(unit_box(3), ["1", "f0", "f1", "f2", "f2^2"], rows))
    assert model.certificate.verdict == "certified"
    for file, content in get("c99").render(model, "dev").items():
        (tmp_path / file).write_text(content, encoding="ascii")
    findings = verify("c99", model, "dev", tmp_path)
    assert [f for f in findings if f.outcome is not Outcome.AGREES] == []
    # Beyond that, rounding of a target moves settings by more than the margin of 1 % in the box.
    assert near < 1e-8 or not any("refused" in f.detail for f in findings)


def test_chord_steps_beyond_all_use_are_no_certificate_for_a_controller():
    model = certified(surrogate(unit_box(1), ["1", "f0", "f0^2"], [[0.0, 1.0, 0.5 * (1.0 - 1e-5)]]))
    assert model.certificate.chord_iterations > 1000
    header = get("c99").render(model, "dev")["dev.h"]
    assert "if they do not converge" not in header
    assert "at most 50 Gauss-Newton steps" in header


@pytest.mark.parametrize(
    ("factor", "row", "links", "message"),
    [
        (("f0", 1e6 - 1.0, 1e6 + 1.0), [0.0, 1.0], (), "the range of 'f0' is too narrow about 1e.06 for seven digits"),
        (("f0", -1.0, 1.0), [1e5, 1.0], (), "'r0' changes too little beside its size for seven digits"),
        (("f0", -1.0, 1.0), [60.0, 40.0], ("log",), "'r0' spans more than float32 can hold"),
    ],
)
def test_single_precision_refuses_what_seven_digits_cannot_hold(factor, row, links, message):
    model = replace(surrogate(box(factor), ["1", "f0"], [row]), links=links)
    with pytest.raises(ValueError, match=f"cannot be exported in single precision: {message}.*; use the double"):
        get("c99_float").render(model, "dev")
    assert get("c99").render(model, "dev")


@pytest.mark.skipif(not COMPILERS, reason="NEITHER GCC NOR CLANG FOUND: the exported C was not verified")
def test_single_precision_some_way_from_zero_keeps_its_promise(tmp_path):
    model = certified(
        surrogate(box(("f0", 292.0, 294.0), ("f1", 0.0, 1.0)), ["1", "f0", "f1"], [[0, 1, 0.5], [0, 0.2, 5]])
    )
    for file, content in get("c99_float").render(model, "dev").items():
        (tmp_path / file).write_text(content, encoding="ascii")
    assert [f for f in verify("c99_float", model, "dev", tmp_path) if f.outcome is not Outcome.AGREES] == []


def test_a_degree_that_no_nesting_reaches_is_refused():
    model = surrogate(unit_box(1), ["f0", "f0^1200"], [[1.0, 0.5]])
    for name in ("c99", "iec61131"):
        with pytest.raises(ValueError, match="it has a term of degree 1200, the highest is 200"):
            get(name).render(model, "dev")

"""The FMUs run and say what the model says; their C compiles; a missing tool is told."""

import os
import platform
import re
import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from surrogates import Surrogate
from surrogates.exports.fmi.archive import library_path, pack, unpack
from surrogates.exports.fmi.targets import HEADERS
from surrogates.exports.verification.base import Outcome
from surrogates.exports.verification.fmi import running, verify
from tests.surrogates.cases import (
    more_responses,
    quintic,
    square_quadratic,
)
from tests.surrogates.exports.fmus import COMPILER, MODELS, TARGETS, both, need_fmpy, needs_compiler, write

# --- values, through FMPy ---------------------------------------------------------------------------------------------


@needs_compiler
@both
@pytest.mark.parametrize("name", MODELS)
def test_the_fmus_are_valid_and_agree_with_the_model(tmp_path, target, name):
    need_fmpy()
    model = MODELS[name]()
    findings = verify(model, "dev", write(tmp_path, target, model))
    libraries = [f for f in findings if f.what.endswith(": its library")]
    assert {(f.outcome, f.detail) for f in libraries} == {
        (Outcome.NOT_CHECKED, "it holds none for this machine, only sources")
    }
    assert [f for f in findings if f.outcome is not Outcome.AGREES and f not in libraries] == []
    assert len(findings) == (6 if name == "without_inverse" else 11)


@needs_compiler
@both
def test_a_simulation_of_fmpy_follows_the_inputs(tmp_path, target):
    fmpy = need_fmpy()
    model = square_quadratic()
    write(tmp_path, target, model, complete=True)
    signal = np.zeros(3, dtype=[("time", float), *((n, float) for n in model.factors.names)])
    signal["time"] = [0.0, 0.5, 1.0]
    for k, factor in enumerate(model.factors):
        signal[factor.name] = np.linspace(factor.low, factor.high, 3) if k else factor.low
    result = fmpy.simulate_fmu(str(tmp_path / "dev_forward.fmu"), stop_time=1.0, output_interval=0.25, input=signal)
    assert len(result) == 5
    assert (result["status"] == 0).all()
    # A co-simulation step takes the inputs of its start: each output is of the inputs one step before.
    for before, row in zip(result["time"][:-1], result[1:], strict=True):
        settings = [np.interp(before, signal["time"], signal[n]) for n in model.factors.names]
        expected = model.predict([settings])[0]
        assert np.abs((np.array([row[r.name] for r in model.responses]) - expected) / model.scale).max() <= 1e-12


@needs_compiler
@both
def test_what_there_is_before_the_first_good_value(tmp_path, target):
    need_fmpy()
    model = square_quadratic()
    write(tmp_path, target, model)
    for kind, kept in (("forward", model.predict(model.factors.centre[None])[0]), ("inverse", model.factors.centre)):
        with running(tmp_path / f"dev_{kind}.fmu") as fmu:
            outputs, status = fmu.step([np.inf] * 3)
            assert status == 4
            assert (outputs == kept).all()


@needs_compiler
@both
def test_instances_are_apart_and_states_can_be_kept(tmp_path, target):
    need_fmpy()
    model, path = square_quadratic(), write(tmp_path, target, square_quadratic()) / "dev_inverse.fmu"
    settings = [[0.5, -1.0, 0.0012], [1.5, 0.5, 0.0018]]
    targets = model.predict(settings)
    with running(path, "one") as one, running(path, "two") as two:
        first, second = one.step(targets[0]), two.step(targets[1])
        assert np.abs((first[0] - settings[0]) / model.factors.half_range).max() <= 1e-9
        assert np.abs((second[0] - settings[1]) / model.factors.half_range).max() <= 1e-9
        one_two = "FMUstate" if target.version == "2.0" else "FMUState"
        state = getattr(one.slave, f"get{one_two}")()
        kept = getattr(one.slave, f"serialize{one_two}")(state)
        one.step(targets[1])
        getattr(one.slave, f"set{one_two}")(state)
        assert (one._get(one.outputs) == first[0]).all()
        one.step(targets[1])
        again = getattr(one.slave, f"deSerialize{one_two}" if target.version == "2.0" else "deserializeFMUState")(kept)
        getattr(one.slave, f"set{one_two}")(again)
        assert (one._get(one.outputs) == first[0]).all()
        assert (two._get(two.outputs) == second[0]).all()
        for given in (state, again):
            getattr(one.slave, f"free{one_two}")(given)


@needs_compiler
@both
def test_a_getter_sees_what_was_set_just_before(tmp_path, target):
    need_fmpy()
    model = square_quadratic()
    with running(write(tmp_path, target, model) / "dev_forward.fmu") as fmu:
        point = [0.25, -2.0, 0.0011]
        fmu._set(fmu.inputs, point)
        assert np.abs((fmu._get(fmu.outputs) - model.predict([point])[0]) / model.scale).max() <= 1e-12


@needs_compiler
@both
def test_calls_that_are_wrong_are_refused(tmp_path, target):
    need_fmpy()
    with running(write(tmp_path, target, square_quadratic()) / "dev_forward.fmu") as fmu:
        two = target.version == "2.0"
        failure = r"status 3|fmi\dError|failed" if two else r"status 3|fmi3Error|failed"
        for wrong in (
            lambda: fmu._set(fmu.outputs, [0.0] * 3),
            lambda: fmu._set(fmu.status, [0.0]),
            lambda: fmu._get([99]),
            lambda: fmu._get_status(fmu.inputs[:1]),
            lambda: (fmu.slave.getBoolean if two else fmu.slave.getUInt8)([0]),
            lambda: fmu.slave.enterInitializationMode(),
            lambda: fmu.slave.doStep(0.0, 0.0),
            lambda: fmu.slave.doStep(0.0, -1.0),
            lambda: fmu.slave.doStep(0.0, float("nan")),
            lambda: fmu.slave.getDirectionalDerivative([3], [0], [1.0]),
        ):
            with pytest.raises(Exception, match=failure):
                wrong()
        assert fmu.step([1.0, -1.0, 0.0015])[1] == 0
        fmu.slave.reset()
        fmu.slave.enterInitializationMode()
        assert (fmu._get(fmu.inputs) == square_quadratic().factors.centre).all()
        fmu.slave.exitInitializationMode()


@needs_compiler
@both
def test_another_token_is_not_instantiated(tmp_path, target):
    fmpy = need_fmpy()
    write(tmp_path, target, quintic(), complete=True)
    unzipped = fmpy.extract(str(tmp_path / "dev_forward.fmu"), unzipdir=str(tmp_path / "x"))
    xml = Path(unzipped) / "modelDescription.xml"
    token = "guid" if target.version == "2.0" else "instantiationToken"
    xml.write_text(re.sub(rf'{token}="[^"]*"', f'{token}="other"', xml.read_text()))
    with pytest.raises(Exception, match=r"(?i)instantiate"):
        fmpy.simulate_fmu(unzipped, stop_time=1.0)


# --- the C ------------------------------------------------------------------------------------------------------------

FLAGS = ["-std=c99", "-O2", "-Wall", "-Wextra", "-Wconversion", "-pedantic", "-Werror", "-Wmissing-prototypes"]


def unpacked(folder: Path, target, model: Surrogate, kind: str, prefix: str = "dev") -> Path:
    for path, content in unpack(target.render(model, prefix)[f"{prefix}_{kind}.fmu"]).items():
        (folder / path).parent.mkdir(parents=True, exist_ok=True)
        (folder / path).write_bytes(content)
    return folder / "sources"


def compile_c(folder: Path, *arguments: str, compiler: str | None = COMPILER) -> None:
    done = subprocess.run([str(compiler), *arguments], cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


@needs_compiler
@both
@pytest.mark.parametrize("name", ["affine", "logarithms"])
@pytest.mark.parametrize("compiler", [c for c in ("gcc", "clang") if shutil.which(c)])
def test_compiles_without_a_warning(tmp_path, target, name, compiler):
    for kind in ("forward", "inverse"):
        folder = unpacked(tmp_path, target, MODELS[name](), kind)
        for override in ([f"-DFMI{target.version[0]}_OVERRIDE_FUNCTION_PREFIX"], ["-fsyntax-only"]):
            # The standard's own headers are not ours to mend: warnings of theirs do not count.
            compile_c(folder, *FLAGS, *override, "-isystem", "fmi_headers", "-c", f"dev_{kind}.c", compiler=compiler)


def functions(target) -> set[str]:
    """What the standard's header declares; of FMI 2.0, where it is left out for co-simulation, no model exchange."""
    text = (HEADERS / f"fmi{target.version[0]}Functions.h").read_text()
    if target.version == "2.0":
        common, exchange, rest = text.partition("\n/* Enter and exit the different modes */")
        assert exchange
        text = common + rest[rest.index("Functions for FMI2 for Co-Simulation") :]
    return set(re.findall(r"_Export +fmi\d\w+TYPE +(fmi\d\w+);", text))


@needs_compiler
@pytest.mark.skipif(
    shutil.which("nm") is None or not sys.platform.startswith("linux"),
    reason="NO NM (binutils), OR NOT LINUX: the symbols of the libraries were not checked",
)
@both
def test_the_library_shows_all_functions_of_the_standard_and_nothing_else(tmp_path, target):
    assert len(functions(target)) == {"2.0": 34, "3.0": 75}[target.version]
    fmu, notes = target.complete(target.render(square_quadratic(), "dev"))
    assert notes == []
    (tmp_path / "it.so").write_bytes(unpack(fmu["dev_inverse.fmu"])[library_path(target.version, "dev_inverse")])
    listing = subprocess.run(["nm", "-D", "it.so"], cwd=tmp_path, capture_output=True, text=True, check=True).stdout
    symbols = [line.split()[-2:] for line in listing.splitlines()]
    assert {s for kind, s in symbols if kind == "T"} - {"_init", "_fini"} == functions(target)
    assert [s for kind, s in symbols if kind in "BD"] == []


@needs_compiler
@both
def test_forward_and_inverse_can_be_linked_into_one_program(tmp_path, target):
    major, model = target.version[0], square_quadratic()
    for kind in ("forward", "inverse"):
        folder = unpacked(tmp_path, target, model, kind)
    (folder / "main.c").write_text(
        f"const char *dev_forward_fmi{major}GetVersion(void);\nconst char *dev_inverse_fmi{major}GetVersion(void);\n"
        f"int main(void) {{ return dev_forward_fmi{major}GetVersion()[0] != dev_inverse_fmi{major}GetVersion()[0]; }}\n"
    )
    sources = ["main.c", "dev_forward.c", "dev_inverse.c"]
    compile_c(folder, "-std=c99", "-Ifmi_headers", *sources, "-o", "main", "-lm")
    assert subprocess.run([str(folder / "main")], check=False).returncode == 0


@needs_compiler
@both
def test_builds_with_the_headers_of_the_importer_too(tmp_path, target):
    fmpy = need_fmpy()
    folder = unpacked(tmp_path, target, square_quadratic(), "inverse")
    shutil.rmtree(folder / "fmi_headers")
    compile_c(folder, "-std=c99", f"-I{Path(fmpy.__file__).parent / 'c-code'}", "-c", "dev_inverse.c")


@both
def test_no_heap_but_the_instance(target):
    source = unpack(target.render(square_quadratic(), "dev")["dev_inverse.fmu"])["sources/dev_inverse.c"].decode()
    code = re.sub(r"/\*.*?\*/", "", source, flags=re.DOTALL)
    assert not re.search(r"\b(malloc|realloc|alloca|goto|printf|exit)\b", code)
    assert len(re.findall(r"\bcalloc\(", code)) == 2  # the instance, and a copy of its state when asked for
    assert not re.search(r"^static (?!int|void|fmi\dStatus)", code, re.MULTILINE)


# --- completing and verifying -----------------------------------------------------------------------------------------


@needs_compiler
@both
def test_complete_adds_a_library_and_changes_nothing_else(target):
    files = {**target.render(quintic(), "dev"), "note.txt": "text", "other.bin": b"bytes"}
    done, notes = target.complete(files)
    assert notes == []
    assert {n: done[n] for n in ("note.txt", "other.bin")} == {"note.txt": "text", "other.bin": b"bytes"}
    for kind in ("forward", "inverse"):
        before, after = unpack(files[f"dev_{kind}.fmu"]), unpack(done[f"dev_{kind}.fmu"])
        assert set(after) - set(before) == {library_path(target.version, f"dev_{kind}")}
        assert {p: after[p] for p in before} == before
    other = TARGETS[target.version == "2.0"]
    assert other.complete(files) == (files, [])


@both
def test_without_a_compiler_the_sources_stay_and_a_note_says_so(tmp_path, target, monkeypatch):
    monkeypatch.setattr(shutil, "which", lambda *_: None)
    files = target.render(quintic(), "dev")
    assert target.complete(files) == (
        files,
        [
            f"dev_{kind}.fmu holds sources and no library: there is no C compiler: install one of cc, gcc, clang."
            for kind in ("forward", "inverse")
        ],
    )
    need_fmpy()
    found = [f for f in verify(quintic(), "dev", write(tmp_path, target, quintic())) if "values" in f.what]
    assert [f.outcome for f in found] == [Outcome.NOT_CHECKED] * 2
    assert all("install one of cc, gcc, clang" in f.detail for f in found)


@pytest.mark.skipif(os.name == "nt", reason="the stand-in for a compiler is a shell script")
@both
def test_a_compiler_that_fails_is_a_note(tmp_path, target, monkeypatch):
    (tmp_path / "cc").write_text("#!/bin/sh\necho 'x.c:1: error: no luck' >&2\nexit 1\n")
    (tmp_path / "cc").chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path), prepend=os.pathsep)
    files = target.render(more_responses(), "dev")
    done, notes = target.complete(files)
    assert done == files
    assert len(notes) == 1
    assert "error: no luck" in notes[0]


@pytest.mark.parametrize(
    ("system", "machine", "two", "three"),
    [
        ("linux", "x86_64", "linux64/a.so", "x86_64-linux/a.so"),
        ("linux", "aarch64", "aarch64-linux/a.so", "aarch64-linux/a.so"),
        ("darwin", "arm64", "darwin64/a.dylib", "aarch64-darwin/a.dylib"),
        ("darwin", "x86_64", "darwin64/a.dylib", "x86_64-darwin/a.dylib"),
        ("win32", "AMD64", "win64/a.dll", "x86_64-windows/a.dll"),
        ("win32", "ARM64", "aarch64-windows/a.dll", "aarch64-windows/a.dll"),
    ],
)
def test_where_libraries_lie(monkeypatch, system, machine, two, three):
    monkeypatch.setattr(sys, "platform", system)
    monkeypatch.setattr(platform, "machine", lambda: machine)
    assert library_path("2.0", "a") == f"binaries/{two}"
    assert library_path("3.0", "a") == f"binaries/{three}"


@needs_compiler
@both
def test_the_verifier_finds_an_fmu_of_another_model(tmp_path, target):
    need_fmpy()
    model = square_quadratic()
    other = replace(model, coefficients=model.coefficients * (1.0 + 1e-11))
    findings = verify(other, "dev", write(tmp_path, target, model))
    assert [f.what for f in findings if f.outcome is Outcome.DIFFERS] == ["dev_forward.fmu: responses"]
    (tmp_path / "dev_forward.fmu").unlink()
    missing = [f for f in verify(model, "dev", tmp_path) if f.outcome is Outcome.DIFFERS]
    assert [f.detail for f in missing] == ["it is missing: write the export again"]


@both
def test_the_verifier_reports_what_the_standard_does_not_allow(tmp_path, target, monkeypatch):
    need_fmpy()
    files = unpack(target.render(more_responses(), "dev")["dev_forward.fmu"])
    files["modelDescription.xml"] = files["modelDescription.xml"].replace(b'causality="output"', b'causality="exit"')
    (tmp_path / "dev_forward.fmu").write_bytes(pack(files))
    monkeypatch.setattr(shutil, "which", lambda *_: None)
    first = verify(more_responses(), "dev", tmp_path)[0]
    assert first.outcome is Outcome.DIFFERS
    assert "causality" in first.detail


def test_without_fmpy_nothing_is_checked_and_that_is_said(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "fmpy.validation", None)
    (finding,) = verify(quintic(), "dev", tmp_path)
    assert finding.outcome is Outcome.NOT_CHECKED
    assert "pip install fmpy" in finding.detail

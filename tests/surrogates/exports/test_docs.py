"""What docs/exports.md shows is run, on a model of six forces and six pose components."""

import importlib.util
import re
import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from surrogates import certify
from surrogates.exports import TARGETS, get
from tests.surrogates.cases import hexflex_like

PAGE = (Path(__file__).parents[3] / "docs" / "exports.md").read_text(encoding="utf-8")
BLOCKS = [(language, code) for language, code in re.findall(r"^```(\w+)\n(.*?)^```", PAGE, re.MULTILINE | re.DOTALL)]
COMPILER = next((c for c in ("gcc", "clang", "cc") if shutil.which(c)), None)
OCTAVE = next((c for c in ("octave-cli", "octave") if shutil.which(c)), None)


def code(language, word):
    (found,) = [text for name, text in BLOCKS if name == language and word in text]
    return found


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    place, model = tmp_path_factory.mktemp("stage"), hexflex_like()
    model = replace(model, certificate=certify(model))
    for name in ("c99", "fmi3", "python", "matlab", "casadi", *(["onnx"] if importlib.util.find_spec("onnx") else [])):
        target = get(name)
        files = target.render(model, "stage")
        if hasattr(target, "complete"):
            files, _ = target.complete(files)
        for file, content in files.items():
            (place / file).write_bytes(content.encode() if isinstance(content, str) else content)
    return place


@pytest.mark.parametrize(
    ("word", "package"),
    [
        ("import stage", "numpy"),
        ("casadi.nlpsol", "casadi"),
        ("InferenceSession", "onnxruntime"),
        ("simulate_fmu", "fmpy"),
    ],
)
def test_python_blocks_run(word, package, folder):
    if importlib.util.find_spec(package) is None:
        pytest.skip(f"{package.upper()} IS NOT INSTALLED: that example was not run")
    if word == "simulate_fmu" and COMPILER is None:
        pytest.skip("NO C COMPILER: the FMU holds no library and was not run")
    done = subprocess.run(
        [sys.executable, "-c", code("python", word)], cwd=folder, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr


@pytest.mark.skipif(COMPILER is None, reason="NO C COMPILER: the C example was not compiled")
def test_the_c_block_compiles_and_the_self_test_passes(folder):
    (folder / "command.c").write_text(code("c", "stage_inverse"), encoding="ascii")
    flags = ["-std=c99", "-Wall", "-Wextra", "-pedantic", "-Werror"]
    subprocess.run([str(COMPILER), *flags, "-c", "command.c"], cwd=folder, check=True)
    line = code("sh", "stage_selftest").partition("#")[0].strip().replace("cc ", f"{COMPILER} ", 1)
    done = subprocess.run(["sh", "-c", line], cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "WRONG" not in done.stdout


@pytest.mark.skipif(OCTAVE is None, reason="OCTAVE NOT FOUND: the example was not run")
def test_the_matlab_block_runs(folder):
    (folder / "example.m").write_text(code("matlab", "stage_inverse") + "assert(all(status == 0));\n", encoding="ascii")
    arguments = [str(OCTAVE), "--no-gui", "--norc", "example.m"]
    done = subprocess.run(arguments, cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "Factors (index, name, unit, range)" in done.stdout


def test_every_target_is_on_the_page():
    table = PAGE.partition("| target |")[2].partition("\n\n")[0]
    assert {name for name in re.findall(r"`(\w+)`", table) if name in TARGETS} == set(TARGETS)

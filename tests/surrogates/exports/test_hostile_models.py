"""Free text of a model, found by search, never becomes code: in every target it changes comments and strings alone."""

import ast
import io
import re
import zipfile
from dataclasses import replace
from functools import cache

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from experiments import Factor, FactorSpace, Response
from surrogates import Surrogate, certify
from surrogates.exports import TARGETS, get
from tests.surrogates.cases import surrogate

PIECES = [
    "*/", "/*", "//", "??/", "\\", "\n", "\r", '"', "'", '"""', "'''", "(*", "*)", "%{", "%}", "...", "$(x)", "${p}",
          "`", "]]>", "<!--", "&lt;", "\x00", "\x1b[2J", "\u2028", "\u202e", "end", "END_VAR;", "system('x')", "#if 0",
          "é", "µm", "θ", "𝒳", "＊／", "%s", "{x}", "\ud800"]  # fmt: skip
TEXT = st.lists(st.one_of(st.sampled_from(PIECES), st.text(max_size=6)), max_size=8).map("".join)
NAMES = st.lists(
    st.sampled_from(["int", "end", "IF", "lambda", "if_", "x0", "v1", "m0_1", "coded", "status", "NaN", "True", "class",
                     "sum", "exp", "function", "VAR", "real", "LREAL", "None", "time", "a", "A"]),
    min_size=4, max_size=4, unique=True,
).map(tuple)  # fmt: skip


@cache
def model(text: str, names: tuple[str, ...]) -> Surrogate:
    """Once for all targets, which are asked the same: most of the time is its certificate."""
    unit = "m"
    for letter in text:  # what a unit may hold is checked when it is made: as much of the text as it takes
        try:
            Factor("f", unit + letter, -1.0, 1.0)
            unit += letter
        except ValueError:
            continue
    factors = FactorSpace((Factor(names[0], unit, -1.0, 1.0, text), Factor(names[1], unit, 1.0, 2.0, text)))
    responses = (Response(names[2], unit, unit, 1.0, text), Response(names[3], unit, unit, 1.0, text))
    made = surrogate(factors, ["1", names[0], names[1], f"{names[0]}^2"], [[0.0, 1.0, 2.0, 0.1], [0.0, 2.0, -1.0, 0.0]])
    certificate = replace(certify(made), claim=text, reason=text, method=text)
    provenance = {text: text, "nested": {"deep": [text, None, 1.5]}}
    return replace(made, responses=responses, certificate=certificate, provenance=provenance)


def files(name: str, of: Surrogate) -> dict[str, str]:
    found = {}
    for file, content in get(name).render(of, "dev").items():
        if isinstance(content, str):
            found[file] = content
        elif file.endswith(".fmu"):
            with zipfile.ZipFile(io.BytesIO(content)) as archive:
                found |= {f"{file}/{m}": archive.read(m).decode() for m in archive.namelist() if m.endswith(".c")}
    return found


def without_text(file: str, content: str) -> str:
    """What is left of a file without its comments and strings."""
    if file.endswith((".c", ".h")):
        content = re.sub(r'"(?!dev)[^"\n]*"', '""', re.sub(r"/\*.*?\*/", " ", content, flags=re.DOTALL))
    elif file.endswith(".py"):
        tree = ast.parse(content)
        for node in ast.walk(tree):
            if isinstance(node, ast.Constant) and isinstance(node.value, str):
                node.value = ""
        return ast.dump(tree)
    elif file.endswith(".m"):
        content = re.sub(r"'[^'\n]*'", "''", "\n".join(re.sub(r"%.*", "", line) for line in content.split("\n")))
    elif file.endswith(".st"):
        content = re.sub(r"\(\*.*?\*\)", " ", re.sub(r"//.*", "", content), flags=re.DOTALL)
    return " ".join(content.split())


@pytest.mark.parametrize("name", [n for n in TARGETS if n != "onnx"])
@settings(max_examples=25, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))
@given(text=TEXT, names=NAMES)
def test_text_stays_text(name, text, names):
    hostile, plain = files(name, model(text, names)), files(name, model("", names))
    assert hostile.keys() == plain.keys()
    for file, content in hostile.items():
        assert content.isascii(), file
        assert without_text(file, content) == without_text(file, plain[file]), file


def test_the_search_would_see_code():
    assert without_text("a.c", "int a; /* */ int b; */") != without_text("a.c", "int a; /* int b; */")
    assert without_text("a.st", "(* *) b := 1; (* *)") != without_text("a.st", "(* b := 1; *)")
    assert without_text("a.m", "% x\nsystem('y')") != without_text("a.m", "% x")

"""Free text that tries to become code, and models that carry it wherever a model may hold text."""

import ast
from dataclasses import replace

import numpy as np

from experiments import Factor, FactorSpace, Response
from surrogates import Surrogate, certify
from tests.surrogates.cases import surrogate

HOSTILE = [
    '"""\nimport os\n"""',
    "'''\nimport os\n'''",
    '"',
    'ends with a quote"',
    "ends with a backslash\\",
    '\\"""\nraise SystemExit\n"""',
    "\\N{LATIN SMALL LETTER A} \\x00 \\u0000 \\",
    "# comment\nimport os",
    "*/ int injected; /*",
    "{0} {package} %s %n $p ${P} $",
    "null \x00, escape \x1b[31m, line \u2028, next \x85",
    "µm·θ² — \u202eevil\u2066 🦆",
    "\ud800",
    "＂＂＂ full width",
    "x" * 500,
]


def hostile_model(text: str) -> Surrogate:
    """Two factors to two responses whose names are words of Python, with `text` wherever it may stand."""
    unit = text if text.isprintable() and not set(text) & set("[],\"'\\") and not text[0].isspace() else "m"
    factors = FactorSpace((Factor("lambda", unit, -1.0, 1.0, text), Factor("np", unit, 1.0, 2.0, text)))
    responses = (Response("print", unit, unit, 1.0, text), Response("None", unit, unit, 1.0, text))
    model = surrogate(factors, ["1", "lambda", "np", "lambda^2"], [[0.0, 1.0, 2.0, 0.1], [0.0, 2.0, -1.0, 0.0]])
    certificate = replace(certify(model), claim=text, reason=text, method=text)
    provenance = {text: text, "nested": {"deep": [text, None, 1.5]}}
    return replace(model, responses=responses, certificate=certificate, provenance=provenance)


def random_texts(n: int, seed: int = 0) -> list[str]:
    """Texts of the letters that end strings, comments and lines, and of any others."""
    rng = np.random.default_rng(seed)
    letters = [*"\"\"\"'''\\\\\n\r\t#{}$%*/", "\x00", "\u2028", "é", "🦆", "a"]
    return ["".join(rng.choice(letters, rng.integers(1, 30))) for _ in range(n)]


def code(source: str) -> str:
    """The tree of a Python text without its comments and with every text in it made empty."""
    tree = ast.parse(source, feature_version=(3, 8))
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            node.value = ""
    return ast.dump(tree)

"""What every export target is, and what all of them need: safe names, safe text, the model in words."""

import json
import re
import textwrap
import unicodedata
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, ClassVar, Protocol, runtime_checkable

from experiments.naming import check_name

from ..artefact import schema_of

if TYPE_CHECKING:
    from ..model import Surrogate

WIDTH = 100
LONGEST_PREFIX = 63
"""Characters of an internal identifier that C99 promises to tell apart (section 5.2.4.1)."""

_PLAIN = str.maketrans(
    {"μ": "u", "Ω": "Ohm", "°": "deg", "·": "*", "⋅": "*", "×": "x", "⁄": "/", "−": "-", "–": "-", "—": "-", "\\": "/"}
)
_COMMENT_MARKS = re.compile(r"(?<=\*)(?=/)|(?<=/)(?=[*/])|(?<=\?)(?=\?)")


@runtime_checkable
class Target(Protocol):
    """Frozen settings and one pure method.

    The law: the same settings, model and prefix give the same files, byte for byte; texts are
    ASCII, and nothing that a model carries as free text can become code.

    A target may also have ``complete(files) -> (files, notes)``, which adds what only tools of this machine can make,
    such as compiled libraries, and says what could not be added.
    """

    name: ClassVar[str]
    summary: ClassVar[str]

    def render(self, model: "Surrogate", prefix: str) -> Mapping[str, str | bytes]:
        """Files by name; `prefix` begins every public name in them.

        Raises
        ------
        ValueError
            If `prefix` is not allowed in this language, a number of the model overflows, or a package that is needed
            is missing.
        """
        ...


def check_prefix(prefix: str, reserved: frozenset[str]) -> None:
    """Raise ``ValueError`` unless `prefix` is a short ASCII identifier that is not `reserved` (lower case)."""
    check_name("prefix", prefix)
    if len(prefix) > LONGEST_PREFIX:
        raise ValueError(f"prefix {prefix!r} is not allowed: use at most {LONGEST_PREFIX} characters")
    if prefix.lower() in reserved:
        raise ValueError(
            f"prefix {prefix!r} is not allowed: a keyword, a standard header or a special file has that name; "
            "choose a longer one"
        )


def plain(text: str) -> str:
    """`text` on one line of printable ASCII that opens and ends no comment, splices no line and forms no trigraph."""
    letters = unicodedata.normalize("NFKD", " ".join(str(text).split())).translate(_PLAIN)
    return _COMMENT_MARKS.sub(" ", "".join(_ascii(c) for c in letters))


def number(value: float) -> str:
    """`value` with the digits that round-trip float64."""
    value = float(value)
    if not abs(value) < float("inf"):
        raise ValueError("this model cannot be exported: a number derived from its coefficients overflows float64")
    return repr(value + 0.0)


def filled(parts: Iterable[str], width: int) -> list[str]:
    """Parts, none of them broken, joined by blanks into lines of at most `width` characters where that is possible."""
    lines: list[str] = []
    for part in parts:
        if lines and len(lines[-1]) + 1 + len(part) <= width:
            lines[-1] += f" {part}"
        else:
            lines.append(part)
    return lines


def about(model: "Surrogate") -> list[str]:
    """What a reader must know of the model, as lines of plain text: factors, responses, errors, claim, provenance."""
    factors = [(f.name, plain(f.unit), f"{float(f.low)!r} to {float(f.high)!r}") for f in model.factors]
    certificate = model.certificate
    claim = ["Certificate: none."]
    if certificate:
        claim = [
            f"Certificate: {plain(certificate.verdict)}.",
            f"  Claim: {plain(certificate.claim)}.",
            f"  Reason: {plain(certificate.reason)}.",
        ]
    provenance = [f"  {plain(k)}: {plain(_as_text(v))}" for k, v in sorted(model.provenance.items())]
    lines = [
        "Factors (index, name, unit, range):",
        *_table(factors),
        "",
        "Responses (index, name, unit, errors on fresh runs):",
        *_table([(r.name, plain(r.unit), _errors(model, r.name)) for r in model.responses]),
        "",
        *claim,
        "",
        "Provenance:",
        *(provenance or ["  none recorded"]),
        f"  schema: {schema_of(model)}",
    ]
    return [part for line in lines for part in _wrapped(line)]


def _ascii(letter: str) -> str:
    if letter.isascii():
        return letter if letter.isprintable() else f"<U+{ord(letter):04X}>"
    if unicodedata.combining(letter):
        return ""
    name = unicodedata.name(letter, "").split()
    if name[:1] == ["GREEK"] and "LETTER" in name:
        return name[-1].lower() if "SMALL" in name else name[-1].capitalize()
    return f"<U+{ord(letter):04X}>"


def _as_text(value: object) -> str:
    return value if isinstance(value, str) else json.dumps(value, sort_keys=True, default=str)


def _errors(model: "Surrogate", response: str) -> str:
    for e in model.validation:
        if e.response == response:
            return f"max abs {float(e.max_abs):.3g}, rmse {float(e.rmse):.3g} on {int(e.n_runs)} runs"
    return "not validated"


def _table(rows: list[tuple[str, ...]]) -> list[str]:
    widths = [max(len(row[k]) for row in rows) for k in range(2)]
    last = len(str(len(rows) - 1))
    return [f"  [{i:>{last}}] {a:<{widths[0]}}  {b:<{widths[1]}}  {c}" for i, (a, b, c) in enumerate(rows)]


def _wrapped(line: str) -> list[str]:
    if len(line) <= WIDTH:
        return [line]
    indent = " " * (len(line) - len(line.lstrip()) + 2)
    return textwrap.wrap(
        line, WIDTH, subsequent_indent=indent, drop_whitespace=True, break_long_words=False, break_on_hyphens=False
    )

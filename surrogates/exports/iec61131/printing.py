"""Numbers, sums, tables and comments as IEC 61131-3 structured text.

Source: IEC 61131-3:2013 (3rd ed.), sections 6.1.5 (comments), 6.3.2 (numeric literals: digits on both sides of the
point) and 6.4.4.5 (arrays, whose rightmost subscript varies fastest in an initialization).
"""

import re
import textwrap
from collections.abc import Iterable, Sequence

from ..base import filled, number, plain
from ..horner import Assignment, Product

WIDTH = 100

_TOOLS = str.maketrans("{}'\"", "()``")
_MARKS = re.compile(r"(?<=\()(?=\*)|(?<=\*)(?=\))")


def comment(text: str) -> str:
    """Any text for the inside of a comment: it can neither end it nor nest one.

    Braces and quotes are replaced, too: they would be pragmas and strings to tools that look for these first.
    """
    return _MARKS.sub(" ", plain(text).translate(_TOOLS))


def comment_lines(lines: Iterable[str]) -> str:
    """Lines of plain text for the inside of a comment, their indents kept."""
    return "\n".join(f"    {_MARKS.sub(' ', line.translate(_TOOLS))}".rstrip() for line in lines)


def literal(value: float) -> str:
    """A real literal with the digits that round-trip; ``ValueError`` if the value is not finite."""
    mantissa, _, exponent = number(value).partition("e")
    if "." not in mantissa:
        mantissa += ".0"
    return f"{mantissa}E{int(exponent)}" if exponent else mantissa


def total(products: Iterable[Product], indent: str) -> str:
    """``a + b - c`` on as many lines as it takes, zeros left out; ``0.0`` if nothing is left."""
    parts = []
    for coefficient, names in products:
        value = _value(coefficient)
        if value == 0.0:
            continue
        size = (literal(abs(value)),) if abs(value) != 1.0 or not names else ()
        parts.append(("- " if value < 0.0 else "+ ") + " * ".join((*size, *names)))
    if not parts:
        return literal(0.0)
    first = parts[0].removeprefix("+ ").replace("- ", "-", 1)
    return f"\n{indent}".join(filled((first, *parts[1:]), WIDTH - 20))


def assignment(one: Assignment, indent: str) -> str:
    """One statement."""
    return f"{indent}{one.name} := {total(one.products, indent + '    ')};"


def difference(name: str, value: float) -> str:
    """``(name - value)``, or the name alone where there is nothing to subtract."""
    return f"({name} {'-' if value > 0.0 else '+'} {literal(abs(value))})" if value else name


def constant(name: str, values: Sequence[float]) -> str:
    """A declaration of a constant array with an element per value."""
    text = ", ".join(literal(v) for v in values)
    whole = f"    {name} : ARRAY [0..{len(values) - 1}] OF LREAL := [{text}];"
    if len(whole) <= WIDTH:
        return whole
    folded = _block(text)
    return f"{whole.partition('[')[0]}[0..{len(values) - 1}] OF LREAL := [\n{folded}];"


def matrix(name: str, rows: Sequence[Sequence[float]]) -> str:
    """The same of two dimensions, row after row."""
    text = ",\n".join(_block(", ".join(literal(v) for v in row)) for row in rows)
    return f"    {name} : ARRAY [0..{len(rows) - 1}, 0..{len(rows[0]) - 1}] OF LREAL := [\n{text}];"


def temporaries(names: Iterable[str]) -> str:
    """Declarations of temporary numbers, each once; nothing if there are none."""
    found = ", ".join(dict.fromkeys(names))
    if not found:
        return ""
    declared = textwrap.fill(f"{found} : LREAL;", WIDTH, initial_indent="    ", subsequent_indent="    ")
    return f"VAR_TEMP\n{declared}\nEND_VAR\n"


def _block(numbers: str) -> str:
    """Numbers on as many indented lines as they take, none of them broken."""
    folded = textwrap.fill(numbers, WIDTH - 8, break_long_words=False, break_on_hyphens=False)
    return textwrap.indent(folded, " " * 8)


def _value(coefficient: object) -> float:
    if not isinstance(coefficient, float):
        raise TypeError(f"structured text is written with numbers, not with entries of tables; got {coefficient!r}")
    return coefficient

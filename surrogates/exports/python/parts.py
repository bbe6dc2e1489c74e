"""Parts that the exports in Python share: what a model holds, spelled as Python."""

import json
import textwrap
from collections.abc import Iterable
from typing import TYPE_CHECKING

from ..base import number, plain
from ..products import Term

if TYPE_CHECKING:
    from ...model import Surrogate

WIDTH = 100


def text(given: str) -> str:
    """Any text as a Python string of one line of printable ASCII."""
    return json.dumps(plain(given))


def escaped(lines: Iterable[str]) -> str:
    """Lines of plain text for the inside of a triple-quoted string, which they cannot end."""
    return "\n".join(lines).replace("\\", "\\\\").replace('"', '\\"')


def numbers(values: Iterable[float]) -> str:
    """A list of numbers, folded where it is long."""
    whole = f"[{', '.join(number(v) for v in values)}]"
    if len(whole) <= WIDTH - 20:
        return whole
    return "[\n" + textwrap.fill(whole[1:-1] + ",", WIDTH, initial_indent="    ", subsequent_indent="    ") + "\n]"


def factor_rows(model: "Surrogate", ranges: bool) -> str:
    """A line per factor: name and unit, with `ranges` as a Factor with low and high."""
    if not ranges:
        return "\n".join(f"    ({text(f.name)}, {text(f.unit)})," for f in model.factors)
    return "\n".join(
        f"    Factor({text(f.name)}, {text(f.unit)}, {number(f.low)}, {number(f.high)})," for f in model.factors
    )


def response_rows(model: "Surrogate", kind: str = "") -> str:
    """A line per response: name and unit, after the name of their type if there is one."""
    return "\n".join(f"    {kind}({text(r.name)}, {text(r.unit)})," for r in model.responses)


def python_table(terms: tuple[Term, ...], width: int = WIDTH) -> str:
    """Entries of a tuple of ``(positions, coefficients)`` in Python, a line each where they fit, with their labels."""
    lines = []
    for term in terms:
        numbers = [number(c) for c in term.coefficients]
        start = f"    ({term.positions!r}, ("
        whole = f"{start}{', '.join(numbers)}{_tuple_end(numbers)}),  # {term.label}"
        lines += [whole] if len(whole) <= width else [f"    # {term.label}", *_folded(start, numbers, width)]
    return "\n".join(lines)


def _tuple_end(items: list[str]) -> str:
    return ",)" if len(items) == 1 else ")"


def _folded(start: str, numbers: list[str], width: int) -> list[str]:
    """One entry on as many lines as it needs."""
    lines, line = [], start
    for k, text in enumerate(numbers):
        last = k == len(numbers) - 1
        piece = f"{text}{_tuple_end(numbers)})," if last else f"{text}, "
        if len(line) + len(piece.rstrip()) > width and line.strip():
            lines.append(line.rstrip())
            line = " " * min(len(start), 16)
        line += piece
    return [*lines, line.rstrip()]

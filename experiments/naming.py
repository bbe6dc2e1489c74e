"""Names and units that are safe in a CSV header, a term, a config key and generated code alike."""

import re
from collections.abc import Iterable
from difflib import get_close_matches

MOST_LISTED = 40
"""Known words that a message lists."""

_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*")
_UNIT = re.compile(r"[^\s\[\],\"'\\][^\[\],\"'\\\n\r\t]*")
_COLUMN = re.compile(r"\s*([^\[\]]*?)\s*(?:\[([^\[\]]*)\])?\s*")


def check_name(kind: str, name: object) -> None:
    """Raise ``ValueError`` unless `name` is an ASCII identifier: letters, digits, underscores, a letter first."""
    if not isinstance(name, str) or not _NAME.fullmatch(name):
        raise ValueError(
            f"{kind} name {name!r} is not allowed: use letters, digits and underscores, starting with a letter"
        )


def check_unit(name: str, unit: object) -> None:
    """Raise ``ValueError`` unless `unit` is a short text without brackets, commas, quotes or control characters."""
    if not isinstance(unit, str) or not _UNIT.fullmatch(unit) or not unit.isprintable():
        raise ValueError(
            f"unit {unit!r} of {name!r} is not allowed: give a unit such as 'N' or 'm' ('1' if it has none), "
            "without brackets, commas or quotes"
        )


def column_label(name: str, unit: str) -> str:
    """Label of a table column, name and unit: ``T1D1[N]``."""
    return f"{name}[{unit}]"


def parse_column_label(label: str) -> tuple[str, str | None]:
    """Split ``T1D1[N]`` into ``("T1D1", "N")``; the unit is ``None`` where the label has none."""
    match = _COLUMN.fullmatch(label)
    return (match.group(1), match.group(2)) if match else (label, None)


def drawn(text: str) -> str:
    """The text as matplotlib draws it: dollars are dollars, no formula; what cannot be printed is a space."""
    return "".join(c if c.isprintable() else " " for c in text).replace("$", r"\$")


def suggestion(word: str, known: Iterable[str]) -> str:
    """Half a sentence that names the nearest known word, or all of them: ``; did you mean 'uniform'?``."""
    known = list(known)
    near = get_close_matches(word, known, n=1, cutoff=0.6)
    if near:
        return f"; did you mean {near[0]!r}?"
    more = f" and {len(known) - MOST_LISTED} more" if len(known) > MOST_LISTED else ""
    return f"; known are {', '.join(known[:MOST_LISTED])}{more}" if known else ""

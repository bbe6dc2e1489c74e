"""What is allowed in the settings of a program: names of files, of variables, and patterns."""

import re
from collections.abc import Iterable
from typing import Any

from ...naming import suggestion

STDOUT, STDERR = "stdout.txt", "stderr.txt"
"""Files in the working folder that take what the program prints."""

_PART = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_.+-]*")
_VARIABLE = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")
_LONGEST_PATTERN = 1000

_LOADS_CODE = (
    "LD_",
    "DYLD_",
    "PYTHON",
    "PERL",
    "RUBY",
    "NODE_",
    "BASH_",
    "JAVA_",
    "_JAVA_",
    "JDK_JAVA_",
    "LUA_",
    "GIT_",
)
_LOADS_CODE_TOO = {
    "PATH", "ENV", "IFS", "SHELLOPTS", "PS4", "HOME", "GCONV_PATH", "MATLABPATH", "TCLLIBPATH", "R_PROFILE",
    "OCTAVE_PATH", "CLASSPATH", "LOCPATH", "NLSPATH", "TMPDIR", "XDG_CONFIG_HOME", "PROMPT_COMMAND", "SHELL",
}  # fmt: skip


def plain_relative(what: str, name: object) -> str:
    """`name` if it is a plain relative path such as ``beam.inp`` or ``in/beam.inp``.

    Raises
    ------
    ValueError
        For anything else: absolute, with ``..``, hidden, with a drive or a backslash, or empty.
    """
    parts = name.split("/") if isinstance(name, str) else []
    if not parts or len(parts) > 8 or len(str(name)) > 200 or not all(_PART.fullmatch(part) for part in parts):
        raise ValueError(
            f"{what} {name!r} is not allowed: use a relative path of letters, digits, '_', '-', '+' and '.', "
            "without '..', such as 'beam.inp' or 'in/beam.inp'"
        )
    return str(name)


def variable(name: object, value: object) -> None:
    """Raise ``ValueError`` unless a config may set this environment variable to `value`.

    Variables by which loaders and interpreters are told to run something else are refused: what is run must be
    stated in argv. They can be passed on from the user's own environment with `inherit`.
    """
    variable_name(name)
    word = str(name).upper()
    if word.startswith(_LOADS_CODE) or word in _LOADS_CODE_TOO:
        raise ValueError(
            f"environment: {name} may not be set here, because it can make a program run something that argv does not "
            f"state; set it where flexdoce is started and name it in inherit"
        )
    if not isinstance(value, str) or not value.isprintable():
        raise ValueError(f"environment: {name} must be a text of printable characters, got {value!r}")


def variable_name(name: object) -> None:
    """Raise ``ValueError`` unless `name` can be that of an environment variable."""
    if not isinstance(name, str) or not _VARIABLE.fullmatch(name):
        raise ValueError(f"the environment variable name {name!r} is not allowed: use letters, digits and underscores")


def texts(what: str, values: object) -> tuple[str, ...]:
    """`values` as a tuple; ``ValueError`` unless it is a list of texts without null characters."""
    if not isinstance(values, (list, tuple)) or not all(isinstance(v, str) and "\0" not in v for v in values):
        raise ValueError(f"{what} must be a list of texts, got {values!r}")
    return tuple(values)


def one_of(what: str, value: object, known: Iterable[str]) -> None:
    """Raise ``ValueError``, with the nearest known word, unless `value` is one of `known`."""
    if value not in (known := tuple(known)):
        raise ValueError(f"{what} must be one of {', '.join(known)}, got {value!r}{suggestion(str(value), known)}")


def pattern(what: str, text: str, groups: int | None = None) -> re.Pattern[str]:
    """`text` compiled, ``^`` and ``$`` at every line.

    Raises
    ------
    ValueError
        If it is no regular expression, has another number of groups than `groups`, or repeats a repetition,
        which can take for ever on a text that does not match.
    """
    if len(text) > _LONGEST_PATTERN:
        raise ValueError(f"{what}: a pattern of {len(text)} characters is too long; {_LONGEST_PATTERN} are allowed")
    try:
        compiled = re.compile(text, re.MULTILINE)
        nested = _repeats_a_repetition(re._parser.parse(text), False)  # type: ignore[attr-defined]
    except (re.error, RecursionError, OverflowError) as error:
        raise ValueError(f"{what}: {text!r} is no regular expression: {error}") from None
    if nested:
        raise ValueError(
            f"{what}: {text!r} repeats a repetition, which may take for ever; write it without, as in [^ ]+"
        )
    if groups is not None and compiled.groups != groups:
        raise ValueError(
            f"{what}: {text!r} needs {groups} group in parentheses, around the number; it has {compiled.groups}"
        )
    return compiled


def _repeats_a_repetition(node: Any, inside: bool) -> bool:
    """Whether an unbounded repetition holds another one, in what ``re`` parsed."""
    if isinstance(node, (list, tuple)) and len(node) == 2 and str(node[0]) in {"MAX_REPEAT", "MIN_REPEAT"}:
        low, high, body = node[1]
        many = high - low > 1  # an optional part is tried twice, no more
        return (many and inside) or _repeats_a_repetition(body, inside or many)
    if isinstance(node, (list, tuple)) or type(node).__name__ == "SubPattern":
        return any(_repeats_a_repetition(part, inside) for part in node)
    return False

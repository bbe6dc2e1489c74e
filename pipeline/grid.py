"""The grid of a sweep: swept keys with their values, and one member for each combination. Touches nothing."""

import hashlib
import json
import math
import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from itertools import product
from typing import Any

from experiments.factors import FactorSpace

from .config import written_value
from .errors import InputError

RANGES = "ranges"
"""Pseudo key: every factor's range times so much, about its centre; ``ranges.T*D1`` speaks of some factors."""

MOST_MEMBERS = 1000
"""Members of a grid; a larger one is a slip of the keyboard."""

LONGEST_NAME, LONGEST_VALUE = 120, 40
"""Characters of a folder's name, and of one value in it."""

_PART = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_-]*")
_FACTORS = re.compile(r"[A-Za-z0-9_*]+")
_UNSAFE = re.compile(r"[^A-Za-z0-9_.+-]+")
_OPEN, _CLOSE = "[{", "]}"
_ENDS = ("low", "high")
_LARGEST = 2**63


@dataclass(frozen=True)
class Axis:
    """Keys that are varied together, most often one, and the values that they take.

    Parameters
    ----------
    keys : tuple of str
        Dotted.
    values : tuple of tuple
        One value per key, for every step.
    """

    keys: tuple[str, ...]
    values: tuple[tuple[Any, ...], ...]


@dataclass(frozen=True)
class Member:
    """One study of a grid.

    Parameters
    ----------
    name : str
        Of its folder: letters, digits and ``_.+-=,`` only, so that it never leads out of the sweep's folder.
    settings : tuple of (str, value)
        Swept keys, in the order of the grid.
    """

    name: str
    settings: tuple[tuple[str, Any], ...]

    @property
    def overrides(self) -> list[str]:
        """The settings as ``--set`` takes them, without those of ranges."""
        return [f"{key}={toml(value)}" for key, value in self.settings if not of_ranges(key)]

    def ranged(self, space: FactorSpace) -> list[str]:
        """Ranges that the member scales, as ``--set`` takes them.

        Raises
        ------
        InputError
            If a pattern fits no factor of `space`.
        """
        scales = dict.fromkeys(space.names, 1.0)
        for key, value in self.settings:
            if of_ranges(key):
                pattern = key.partition(".")[2] or "*"
                fitting = [name for name in space.names if fnmatchcase(name, pattern)]
                if not fitting:
                    raise InputError(f"{key}: no factor is called so; they are {', '.join(space.names)}")
                scales |= {name: scales[name] * value for name in fitting}
        found = []
        for factor, centre, half in zip(space, space.centre, space.half_range, strict=True):
            scale = scales[factor.name]
            # A range that stays keeps its last bit, so that points are shared.
            if scale != 1.0:
                low, high = float(centre - scale * half), float(centre + scale * half)
                found += [f"factors.{factor.name}.low={low!r}", f"factors.{factor.name}.high={high!r}"]
        return found


def of_ranges(key: str) -> bool:
    """Whether a key is the pseudo key that scales ranges."""
    return key.partition(".")[0] == RANGES


def parse_over(texts: Sequence[str]) -> dict[str, list[Any]]:
    """What ``--over`` says: values by key, ``dotted.key=a,b,c`` each.

    Raises
    ------
    InputError
        If a text has another form, or a key comes twice.
    """
    found: dict[str, list[Any]] = {}
    for text in texts:
        if not text.isprintable():
            raise InputError(f"--over {text!r} has characters that cannot be printed")
        key, equals, values = text.partition("=")
        key = key.strip()
        if not equals or not key:
            raise InputError(f"--over {text!r} is not of the form dotted.key=a,b,c, such as fit.degree=1,2,3")
        if key in found:
            raise InputError(f"--over names {key} twice; give all its values at once")
        try:
            found[key] = [_value(key, part) for part in _split(values)]
        except (ValueError, RecursionError) as error:
            raise InputError(f"--over {key}: {error}") from None
    return found


def axes(table: Mapping[str, Sequence[Any]]) -> tuple[Axis, ...]:
    """The axes of a grid, from values by key; a key may be several with commas, its values lists with one for each.

    Raises
    ------
    InputError
        If there is nothing to sweep, or a key or value cannot be swept.
    """
    found = tuple(_axis(key, values) for key, values in table.items())
    keys = Counter(key for axis in found for key in axis.keys)
    if not found:
        raise InputError("nothing to sweep: say over what with --over dotted.key=a,b,c or in a table [sweep]")
    if repeated := [key for key, n in keys.items() if n > 1]:
        raise InputError(f"the sweep names {repeated[0]} twice; give all its values at once")
    for key in keys:
        if other := next((k for k in keys if k.startswith(f"{key}.") and not of_ranges(k)), None):
            raise InputError(f"the sweep names {key} and {other}, which is a part of it; give one of them")
    n = math.prod(len(axis.values) for axis in found)
    if n > MOST_MEMBERS:
        raise InputError(f"the grid has {n} members; the most is {MOST_MEMBERS}: sweep over less at once")
    return found


def members(grid: Sequence[Axis]) -> tuple[Member, ...]:
    """All combinations, the last axis fastest, each with a name of its own.

    A name depends on the keys of the grid and on the member's values, so that another value added to a key leaves the
    others their folders.
    """
    keys = [key for axis in grid for key in axis.keys]
    short = _short(keys)
    chosen = [
        tuple(zip(keys, (v for step in steps for v in step), strict=True))
        for steps in product(*(axis.values for axis in grid))
    ]
    names = [_name(settings, short) for settings in chosen]
    # On some file systems capitals make no difference.
    often = Counter(name.casefold() for name in names)
    return tuple(
        Member(name if often[name.casefold()] == 1 else f"{name[: LONGEST_NAME - 9]}-{_digest(settings)}", settings)
        for name, settings in zip(names, chosen, strict=True)
    )


def toml(value: Any) -> str:
    """A value as TOML writes it in one line."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False)
    if isinstance(value, list | tuple):
        return f"[{', '.join(toml(v) for v in value)}]"
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{json.dumps(k, ensure_ascii=False)} = {toml(v)}" for k, v in value.items()) + "}"
    return repr(float(value)) if isinstance(value, float) else str(value)


def shown(value: Any) -> str:
    """A value for people: a text without quotes, a number as short as it can be."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return value if isinstance(value, str) else toml(value)
    short = f"{value:.12g}"
    return short if float(short) == value else toml(value)


def _axis(key: str, values: Sequence[Any]) -> Axis:
    keys = tuple(part.strip() for part in key.split(","))
    for one in keys:
        _check_key(one)
    if isinstance(values, str | bytes) or not isinstance(values, Sequence) or not values:
        raise InputError(f"sweep over {key}: give a list of values, got {values!r}")
    steps = []
    for value in values:
        if len(keys) > 1 and (not isinstance(value, list | tuple) or len(value) != len(keys)):
            raise InputError(
                f"sweep over {key}: each value is a list of {len(keys)}, one for each key, got {shown(value)}"
            )
        steps.append(tuple(value) if len(keys) > 1 else (value,))
    for step in steps:
        for one, value in zip(keys, step, strict=True):
            _check_value(one, value)
    texts = [toml(_plain(step)) for step in steps]
    if len(set(texts)) < len(texts):
        twice = next(step for step, text in zip(steps, texts, strict=True) if texts.count(text) > 1)
        raise InputError(f"sweep over {key}: the value {', '.join(map(shown, twice))} occurs twice")
    return Axis(keys, tuple(steps))


def _check_key(key: str) -> None:
    head, _, rest = key.partition(".")
    if head == RANGES:
        if rest and not _FACTORS.fullmatch(rest):
            raise InputError(f"sweep over {key!r}: after 'ranges.' comes the name of a factor, '*' for any letters")
        return
    if "*" in key:
        raise InputError(f"sweep over {key!r}: only ranges know '*'; ranges=0.5,1,2 scales the ranges of all factors")
    if not all(_PART.fullmatch(part) for part in key.split(".")):
        raise InputError(f"sweep over {key!r}: a key is words with dots between them, such as fit.degree")
    if head in ("sweep", "version"):
        raise InputError(f"sweep over {key!r}: this cannot be swept")


def _check_value(key: str, value: Any) -> None:
    for one in _leaves(value):
        if not isinstance(one, bool | int | float | str):
            raise InputError(f"sweep over {key}: a value is a number, a text, true, false, a list or a table of them, "
                             f"got {one!r}")  # fmt: skip
        if isinstance(one, float) and not math.isfinite(one):
            raise InputError(f"sweep over {key}: {one} is not finite")
        if isinstance(one, int) and not -_LARGEST <= one < _LARGEST:
            raise InputError(f"sweep over {key}: a whole number has at most 64 bits; write it as 1e20")
        if isinstance(one, str) and not one.isprintable():
            raise InputError(f"sweep over {key}: {one!r} has characters that cannot be printed")
    if of_ranges(key) and (isinstance(value, bool) or not isinstance(value, int | float) or not value > 0):
        raise InputError(f"sweep over {key}: a range is scaled by a positive number, got {shown(value)}")


def _leaves(value: Any) -> Iterator[Any]:
    """The values in a list or a table of whatever depth, and the table's keys."""
    if isinstance(value, Mapping):
        yield from value
    if isinstance(value, Mapping | list | tuple):
        for one in value.values() if isinstance(value, Mapping) else value:
            yield from _leaves(one)
    else:
        yield value


def _plain(value: Any) -> Any:
    """The value with whole floats as whole numbers: 1 and 1.0 are one setting, true is another."""
    if isinstance(value, float) and value.is_integer():
        return int(value)
    if isinstance(value, Mapping):
        return {k: _plain(v) for k, v in sorted(value.items())}
    return [_plain(v) for v in value] if isinstance(value, list | tuple) else value


def _value(key: str, part: str) -> Any:
    if not part.strip():
        raise InputError(f"--over {key}: a value is empty; write the values as a,b,c")
    return written_value(part)


def _split(text: str) -> list[str]:
    """Parts between commas that stand in no bracket and no quotes."""
    parts, depth, quote, escaped = [""], 0, "", False
    for sign in text:
        if quote:
            quote = "" if sign == quote and not escaped else quote
            escaped = sign == "\\" and quote == '"' and not escaped
        elif sign in "\"'":
            quote = sign
        depth += 0 if quote else (sign in _OPEN) - (sign in _CLOSE)
        if sign == "," and depth == 0 and not quote:
            parts.append("")
        else:
            parts[-1] += sign
    if depth or quote:
        raise ValueError(f"a bracket or a quote is open in {text.strip()!r}")
    return parts


def _short(keys: Sequence[str]) -> dict[str, str]:
    """The last parts of each key, as many as tell it from the others; of ranges the whole key, without its stars."""
    found = {}
    for key in keys:
        parts = key.split(".")
        fewest = min(2 if parts[-1] in _ENDS else 1, len(parts))
        n = next(n for n in range(fewest, len(parts) + 1) if n == len(parts) or _is_alone(parts[-n:], keys))
        found[key] = key if of_ranges(key) else ".".join(parts[-n:])
    return found


def _is_alone(ending: Sequence[str], keys: Sequence[str]) -> bool:
    return sum(key.split(".")[-len(ending) :] == list(ending) for key in keys) == 1


def _name(settings: Sequence[tuple[str, Any]], short: Mapping[str, str]) -> str:
    """A folder's name, such as ``thickness=0.001,ranges=2``; the keys in one order whatever the grid's."""
    text = ",".join(f"{_safe(short[key])}={_safe(shown(value))}" for key, value in sorted(settings))
    return text if len(text) <= LONGEST_NAME else f"{text[: LONGEST_NAME - 9]}-{_digest(settings)}"


def _safe(text: str) -> str:
    """The text where it is safe in a path; else what is left of it, and a digest of what it was."""
    safe = _UNSAFE.sub("-", text)
    if safe == text == text.strip(".") and 0 < len(text) <= LONGEST_VALUE:
        return text
    return f"{safe.strip('-.')[:LONGEST_VALUE]}-{_hash(text)}".lstrip("-")


def _digest(settings: Sequence[tuple[str, Any]]) -> str:
    return _hash(toml({key: _plain(value) for key, value in settings}))


def _hash(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()[:8]

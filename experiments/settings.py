"""Build frozen settings objects from a mapping, with one uniform sentence for every bad key or value.

Oracles, designs and export targets are all made this way, from a config or from keyword arguments.
"""

import dataclasses
import math
import numbers
import typing
from collections.abc import Mapping
from typing import Any

from .naming import suggestion


def parameter(default: Any, unit: str, about: str) -> Any:
    """A dataclass field that carries its unit and one line of explanation."""
    return dataclasses.field(default=default, metadata={"unit": unit, "about": about})


def build(kind: str, cls: type, given: Mapping[str, Any]) -> Any:
    """``cls(**given)`` after checking every key and value against the dataclass fields of `cls`.

    Parameters
    ----------
    kind : str
        What the object is, for the message: ``"oracle 'hexflex'"``.
    cls : type
        A dataclass whose fields are numbers, texts or booleans, possibly ``None``.
    given : mapping
        Values by field name.

    Raises
    ------
    ValueError
        For an unknown key (with the nearest known one), a missing key, a wrong type, a number that
        is not finite, or whatever `cls` itself refuses.
    """
    fields = _fields(cls)
    hints = typing.get_type_hints(cls)
    for key, value in given.items():
        if key not in fields:
            raise ValueError(f"{kind} has no setting {key!r}{suggestion(key, fields)}")
        _check_type(kind, key, value, hints[key])
    missing = [n for n, f in fields.items() if f.default is dataclasses.MISSING and n not in given]
    if missing:
        raise ValueError(f"{kind} needs the setting {missing[0]!r}")
    return cls(**{k: _as_declared(v, hints[k]) for k, v in given.items()})


def describe(cls: type) -> list[dict[str, str]]:
    """Name, default, unit and explanation of every setting of `cls`, for ``flexdoce list`` and the docs."""
    rows = []
    for f in _fields(cls).values():
        rows.append(
            {
                "name": f.name,
                "default": "required" if f.default is dataclasses.MISSING else repr(f.default),
                "unit": f.metadata.get("unit", ""),
                "about": f.metadata.get("about", ""),
            }
        )
    return rows


def _fields(cls: type) -> dict[str, dataclasses.Field]:
    """Fields that can be set; none for a class that is no dataclass."""
    return {f.name: f for f in dataclasses.fields(cls) if f.init} if dataclasses.is_dataclass(cls) else {}


def _options(hint: Any) -> tuple[type, ...]:
    options = typing.get_args(hint) or (hint,)
    return tuple(typing.get_origin(o) or o for o in options)


def _check_type(kind: str, key: str, value: Any, hint: Any) -> None:
    options = _options(hint)
    is_number = isinstance(value, numbers.Real) and not isinstance(value, bool)
    is_whole = isinstance(value, numbers.Integral) and not isinstance(value, bool)
    fits = (
        type(value) in options
        or (float in options and is_number)
        or (int in options and is_whole)
        or (value is None and type(None) in options)
    )
    if not fits:
        words = {float: "a number", int: "a whole number", str: "a text", bool: "true or false"}
        wanted = " or ".join(words.get(o, o.__name__) for o in options if o is not type(None))
        raise ValueError(f"{kind}: {key} must be {wanted}, got {value!r}")
    if isinstance(value, numbers.Real) and not _is_finite(value):
        raise ValueError(f"{kind}: {key} must be finite, got {value!r}")


def _is_finite(value: numbers.Real) -> bool:
    try:
        return math.isfinite(value)
    except OverflowError:  # a whole number beyond float64
        return False


def _as_declared(value: Any, hint: Any) -> Any:
    """Numbers as plain Python of the declared kind: an int where a float is declared, a NumPy scalar anywhere."""
    if isinstance(value, bool) or not isinstance(value, numbers.Real):
        return value
    options = _options(hint)
    return int(value) if int in options and isinstance(value, numbers.Integral) else float(value)

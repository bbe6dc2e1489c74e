"""Units with prefixes and powers, and the exact ratio between two of them: 1000 from ``m`` to ``mm``."""

import math
import re
from fractions import Fraction

Dimension = tuple[int, ...]
"""Powers of metre, kilogram, second, ampere, kelvin and radian."""

_ONE: Dimension = (0, 0, 0, 0, 0, 0)
_BASE: dict[str, tuple[Fraction, Dimension]] = {
    "1": (Fraction(1), _ONE),
    "m": (Fraction(1), (1, 0, 0, 0, 0, 0)),
    "g": (Fraction(1, 1000), (0, 1, 0, 0, 0, 0)),
    "s": (Fraction(1), (0, 0, 1, 0, 0, 0)),
    "A": (Fraction(1), (0, 0, 0, 1, 0, 0)),
    "K": (Fraction(1), (0, 0, 0, 0, 1, 0)),
    "rad": (Fraction(1), (0, 0, 0, 0, 0, 1)),
    "deg": (Fraction(math.pi) / 180, (0, 0, 0, 0, 0, 1)),
    "Hz": (Fraction(1), (0, 0, -1, 0, 0, 0)),
    "N": (Fraction(1), (1, 1, -2, 0, 0, 0)),
    "Pa": (Fraction(1), (-1, 1, -2, 0, 0, 0)),
    "J": (Fraction(1), (2, 1, -2, 0, 0, 0)),
    "W": (Fraction(1), (2, 1, -3, 0, 0, 0)),
    "V": (Fraction(1), (2, 1, -3, -1, 0, 0)),
    "in": (Fraction(254, 10000), (1, 0, 0, 0, 0, 0)),
    "%": (Fraction(1, 100), _ONE),
    "t": (Fraction(1000), (0, 1, 0, 0, 0, 0)),
}
_NO_PREFIX = {"1", "deg", "in", "%", "t"}
_PREFIX = {"n": -9, "u": -6, "µ": -6, "μ": -6, "m": -3, "c": -2, "d": -1, "k": 3, "M": 6, "G": 9}
_ALIASES = {"°": "deg"}
_PART = re.compile(r"(1$|%$|°|[A-Za-zµμ]+)(?:\^?(-?[1-9]))?")
_SUPERSCRIPTS = str.maketrans("⁻²³", "-23")


def ratio(given: str, wanted: str) -> Fraction:
    """By what a number in `given` is multiplied to be in `wanted`.

    Units are products such as ``N/mm^2``, ``N*m`` or ``1/s``; what follows a slash divides.
    The same text twice is 1 whatever it says, so that units of one's own can be used unconverted.

    Raises
    ------
    ValueError
        If a unit is unknown, or they measure different things.
    """
    if given == wanted:
        return Fraction(1)
    (size, kind), (other, other_kind) = _read(given), _read(wanted)
    if kind != other_kind:
        raise ValueError(f"{given!r} and {wanted!r} measure different things; give units of the same kind")
    return size / other


def convert(value: float, factor: Fraction) -> float:
    """The product, rounded once; a value that is not finite stays as it is."""
    if not math.isfinite(value) or factor == 1:
        return value
    try:
        return float(Fraction(value) * factor)
    except OverflowError:
        return math.copysign(math.inf, value) * (1 if factor > 0 else -1)


def _read(unit: str) -> tuple[Fraction, Dimension]:
    """Size in SI and dimension of a product of units."""
    size, kind, sign = Fraction(1), _ONE, 1
    for piece in re.split(r"([*·/ ])", unit.translate(_SUPERSCRIPTS)):
        if piece == "/":
            sign = -1
        if piece in {"", " ", "*", "·", "/"}:
            continue
        match = _PART.fullmatch(piece)
        if not match:
            raise ValueError(f"unknown unit {piece!r} in {unit!r}; {_known()}")
        one, its_kind = _single(match.group(1), unit)
        power = sign * int(match.group(2) or 1)
        size *= one**power
        kind = tuple(k + power * i for k, i in zip(kind, its_kind, strict=True))
    return size, kind


def _single(name: str, unit: str) -> tuple[Fraction, Dimension]:
    """One unit, with a prefix or without; the whole word first, so that ``m`` is a metre and ``Pa`` no year."""
    name = _ALIASES.get(name, name)
    if name in _BASE:
        return _BASE[name]
    prefix, rest = name[0], name[1:]
    if prefix in _PREFIX and rest in _BASE and rest not in _NO_PREFIX:
        size, kind = _BASE[rest]
        return size * Fraction(10) ** _PREFIX[prefix], kind
    raise ValueError(f"unknown unit {name!r} in {unit!r}; {_known()}")


def _known() -> str:
    return f"known are {', '.join(_BASE)} with prefixes {', '.join(p for p in _PREFIX if p.isascii())}"

"""Units as FMI wants them: exponents of the SI base units, a factor and an offset; only where the text is clear."""

import math
import re
from dataclasses import dataclass

BASE: tuple[str, ...] = ("kg", "m", "s", "A", "K", "mol", "cd", "rad")
"""Attributes of BaseUnit, FMI 2.0.1 section 2.2.2 and FMI 3.0 section 2.4.3."""

_PREFIXES = {
    "": 0, "Y": 24, "Z": 21, "E": 18, "P": 15, "T": 12, "G": 9, "M": 6, "k": 3, "h": 2, "da": 1,
    "d": -1, "c": -2, "m": -3, "u": -6, "n": -9, "p": -12, "f": -15, "a": -18, "z": -21, "y": -24,
}  # fmt: skip

_PREFIXED = {
    "m": (0, {"m": 1}),
    "g": (-3, {"kg": 1}),
    "s": (0, {"s": 1}),
    "A": (0, {"A": 1}),
    "K": (0, {"K": 1}),
    "mol": (0, {"mol": 1}),
    "cd": (0, {"cd": 1}),
    "rad": (0, {"rad": 1}),
    "Hz": (0, {"s": -1}),
    "N": (0, {"kg": 1, "m": 1, "s": -2}),
    "Nm": (0, {"kg": 1, "m": 2, "s": -2}),
    "Pa": (0, {"kg": 1, "m": -1, "s": -2}),
    "bar": (5, {"kg": 1, "m": -1, "s": -2}),
    "J": (0, {"kg": 1, "m": 2, "s": -2}),
    "W": (0, {"kg": 1, "m": 2, "s": -3}),
    "C": (0, {"A": 1, "s": 1}),
    "V": (0, {"kg": 1, "m": 2, "s": -3, "A": -1}),
    "F": (0, {"kg": -1, "m": -2, "s": 4, "A": 2}),
    "Ohm": (0, {"kg": 1, "m": 2, "s": -3, "A": -2}),
    "S": (0, {"kg": -1, "m": -2, "s": 3, "A": 2}),
    "Wb": (0, {"kg": 1, "m": 2, "s": -2, "A": -1}),
    "T": (0, {"kg": 1, "s": -2, "A": -1}),
    "H": (0, {"kg": 1, "m": 2, "s": -2, "A": -2}),
}
"""Symbols that take SI prefixes: power of ten, exponents of the base units (SI brochure, 9th edition, 2019)."""

_ALONE = {
    "1": (1.0, {}),
    "%": (0.01, {}),
    "deg": (math.pi / 180.0, {"rad": 1}),
    "min": (60.0, {"s": 1}),
    "h": (3600.0, {"s": 1}),
}
"""Symbols that take none, with their factor; they win over a prefixed symbol that reads the same."""

_FACTOR = re.compile(r"([A-Za-z%]+|1)(?:(?:\^|\*\*)?([+-]?[1-9]))?")
_BETWEEN = re.compile(r"\s*(?:(\*(?!\*)|/|\.)\s*|(?<=\S)\s+(?=\S))")


@dataclass(frozen=True)
class BaseUnit:
    """SI value = `factor` × value + `offset`.

    Parameters
    ----------
    exponents : dict
        Whole exponent of each of :data:`BASE` that occurs.
    factor, offset : float
    """

    exponents: dict[str, int]
    factor: float = 1.0
    offset: float = 0.0


def base_unit(text: str) -> BaseUnit | None:
    """What the unit is in SI base units; None where it is not known or can be read in two ways, as ``kg/m*s``.

    Parameters
    ----------
    text : str
        Plain ASCII, such as ``"N*m"``, ``"N m"``, ``"mm"``, ``"um"``, ``"m/s^2"``, ``"1"``.
    """
    if text == "degC":
        return BaseUnit({"K": 1}, 1.0, 273.15)
    parts = _parts(text)
    if parts is None:
        return None
    exponents, ten, factor = dict.fromkeys(BASE, 0), 0, 1.0
    for symbol, power in parts:
        found = _symbol(symbol)
        if found is None:
            return None
        times, tens, of_symbol = found
        factor *= times**power
        ten += tens * power
        for base, exponent in of_symbol.items():
            exponents[base] += exponent * power
    factor *= float(f"1e{ten}")
    return BaseUnit({b: e for b, e in exponents.items() if e}, factor) if 0.0 < factor < math.inf else None


def _parts(text: str) -> list[tuple[str, int]] | None:
    """Symbols and their powers; None for a text that is not a product, or a quotient of one symbol below."""
    parts, position, below = [], 0, False
    while True:
        match = _FACTOR.match(text, position)
        if not match:
            return None
        power = int(match.group(2) or 1)
        parts.append((match.group(1), -power if below else power))
        position = match.end()
        if position == len(text):
            return parts
        between = _BETWEEN.match(text, position)
        if not between or below:
            return None
        below = between.group(1) == "/"
        position = between.end()


def _symbol(symbol: str) -> tuple[float, int, dict[str, int]] | None:
    """Factor, power of ten and base units of one symbol."""
    if symbol in _ALONE:
        factor, exponents = _ALONE[symbol]
        return factor, 0, exponents
    for name, (ten, exponents) in _PREFIXED.items():
        prefix = symbol.removesuffix(name)
        if symbol.endswith(name) and prefix in _PREFIXES:
            return 1.0, ten + _PREFIXES[prefix], exponents
    return None

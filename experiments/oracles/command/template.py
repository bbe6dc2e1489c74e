"""Texts with named placeholders for factors: ``{{length}}``, ``{{length [mm]}}``, ``{{length [mm]:8.4f}}``."""

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction

from ...factors import FactorSpace
from ...naming import suggestion
from .units import convert, ratio

OPEN = "{{"
MOST_PLACEHOLDERS = 50_000
_PLACEHOLDER = re.compile(
    r"\{\{[ ]*([A-Za-z][A-Za-z0-9_]*)[ ]*(?:\[([^\[\]{}\n]{1,40})\])?[ ]*(?::([^{}\n]{0,20}))?\}\}"
)
_FORMAT = re.compile(r"[-+ ]?0?([1-9]\d?)?(?:\.(\d{1,2}))?[eEfFgG]")


class DoesNotFit(ValueError):
    """A number is wider than its format says: in a deck with fixed columns it would move all that follows."""


@dataclass(frozen=True)
class Placeholder:
    """One number in a text.

    Parameters
    ----------
    name : str
        Of the factor.
    column : int
        Its place among the factors; -1 for a word that is no factor.
    factor : Fraction
        From the factor's unit to the one that is written.
    form : str
        Format, as ``format`` takes it; empty for the shortest text that reads back as the same number.
    width : int
        Characters that the number may take; 0 for as many as it needs.
    """

    name: str
    column: int
    factor: Fraction = Fraction(1)
    form: str = ""
    width: int = 0

    def text(self, point: Sequence[float]) -> str:
        """The number as written; :class:`DoesNotFit` if it is too wide."""
        value = convert(float(point[self.column]), self.factor)
        if not math.isfinite(value):
            raise DoesNotFit(f"{self.name} = {value} is not finite")
        text = format(value, self.form) if self.form else repr(value)
        if self.width and len(text) > self.width:
            raise DoesNotFit(
                f"{self.name} = {value!r} does not fit in {self.width} characters as {self.form!r}: {text}"
            )
        return text


@dataclass(frozen=True)
class Template:
    """A text in pieces: literal ones, and placeholders."""

    pieces: tuple[str | Placeholder, ...]

    @classmethod
    def parse(cls, what: str, text: str, space: FactorSpace, words: Sequence[str] = ()) -> "Template":
        """Find the placeholders of a text.

        Parameters
        ----------
        what : str
            What the text is, for messages: ``template 'beam.inp'``.
        text : str
        space : FactorSpace
            Factors that may be named.
        words : sequence of str
            Other names, whose texts are given when it is filled.

        Raises
        ------
        ValueError
            If a name, unit or format is not allowed, or ``{{`` begins something else.
        """
        pieces: list[str | Placeholder] = []
        end = 0
        for match in _PLACEHOLDER.finditer(text):
            pieces.append(_literal(what, text, end, match.start()))
            if len(pieces) > 2 * MOST_PLACEHOLDERS:
                raise ValueError(f"{what} has more than {MOST_PLACEHOLDERS} placeholders")
            try:
                pieces.append(_placeholder(*match.groups(), space=space, words=words))
            except ValueError as error:
                raise ValueError(f"{what}, line {_line(text, match.start())}, {match.group(0)}: {error}") from None
            end = match.end()
        pieces.append(_literal(what, text, end, len(text)))
        return cls(tuple(p for p in pieces if p != ""))

    @property
    def names(self) -> frozenset[str]:
        """Names that occur."""
        return frozenset(p.name for p in self.pieces if isinstance(p, Placeholder))

    def fill(self, point: Sequence[float], words: Mapping[str, str] | None = None) -> str:
        """The text at `point`, shape (n_factors,); :class:`DoesNotFit` if a number is too wide."""
        return "".join(
            p if isinstance(p, str) else (words or {})[p.name] if p.column < 0 else p.text(point) for p in self.pieces
        )


def _literal(what: str, text: str, start: int, end: int) -> str:
    piece = text[start:end]
    if OPEN in piece:
        at = start + piece.index(OPEN)
        raise ValueError(
            f"{what}, line {_line(text, at)}: {text[at : at + 30].splitlines()[0]!r} is no placeholder; write "
            "{{name}}, {{name [unit]}} or {{name [unit]:.6e}}; a file without placeholders belongs in files"
        )
    return piece


def _line(text: str, at: int) -> int:
    return text.count("\n", 0, at) + 1


def _placeholder(
    name: str, unit: str | None, form: str | None, space: FactorSpace, words: Sequence[str]
) -> Placeholder:
    if name in words:
        if unit is not None or form is not None:
            raise ValueError(f"{name!r} is a text and takes no unit or format")
        return Placeholder(name, -1)
    if name not in space.names:
        raise ValueError(f"unknown factor {name!r}{suggestion(name, (*space.names, *words))}")
    column = space.index(name)
    factor = ratio(space.factors[column].unit, unit.strip()) if unit is not None else Fraction(1)
    if form is None:
        return Placeholder(name, column, factor)
    match = _FORMAT.fullmatch(form)
    if not match or int(match.group(1) or 0) > 40 or int(match.group(2) or 0) > 30:
        raise ValueError(
            f"the format {form!r} is not allowed; use e, f or g with a width and digits, such as .6e or 8.4f"
        )
    return Placeholder(name, column, factor, form, int(match.group(1) or 0))

"""How a number is read from what a program leaves: a pattern, a CSV column, a JSON path, or an installed function."""

import csv
import json
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from fractions import Fraction
from importlib.metadata import entry_points
from pathlib import Path
from typing import Any

from ...naming import suggestion
from .checks import STDOUT, one_of, pattern, plain_relative
from .folder import Unreadable, WorkFolder
from .units import convert, ratio

GROUP = "flexdoce.parsers"
"""Entry points in which installed packages offer functions: working folder in, ``{response: value}`` out."""

_DELIMITERS = (",", ";", "\t", "|", ":", " ")
_KINDS = ("regex", "column", "json_path", "function")
# Possessive: a line of a million digits and a letter would take hours.
_NUMBER = re.compile(r"[-+]?(\d++\.?\d*+|\.\d++)([eEdD][-+]?\d++)?|[-+]?(nan|inf|infinity)", re.IGNORECASE)
_REGISTERED: dict[str, Callable[[Path], Mapping[str, float]]] = {}


class Unparsed(ValueError):
    """What the program left does not hold the number; the text says which file, and what was looked for."""


def register_parser(name: str, function: Callable[[Path], Mapping[str, float]]) -> None:
    """Offer a function to the oracles of this process, under a name: for notebooks.

    Parameters
    ----------
    name : str
    function : callable
        Takes the working folder and returns a number for each response, in the response's `file_unit`.
    """
    _REGISTERED[name] = function


def offered() -> dict[str, str]:
    """Functions that a config may name, with what each stands for: ``module:function`` or ``registered``."""
    return {**{e.name: e.value for e in entry_points(group=GROUP)}, **dict.fromkeys(_REGISTERED, "registered")}


def known_function(name: str) -> str:
    """The name of the offered function that is meant, by its name or by ``module:function``.

    Raises
    ------
    ValueError
        If no installed package offers it. A config cannot import what it likes.
    """
    known = offered()
    found = [n for n, value in known.items() if name in (n, value)]
    if not found:
        there = suggestion(name, known) or "; none is installed"
        raise ValueError(
            f"no installed package offers the parser function {name!r} (entry points of the group {GROUP!r}){there}"
        )
    return found[0]


def _function(name: str) -> Callable[[Path], Mapping[str, float]]:
    name = known_function(name)
    if name in _REGISTERED:
        return _REGISTERED[name]
    (entry,) = list(entry_points(group=GROUP, name=name))[:1]
    return entry.load()


@dataclass(frozen=True)
class Reader:
    """Where one response is found; exactly one of `regex`, `column`, `json_path` and `function` is given.

    Parameters
    ----------
    response, unit : str
        Name of the response, and the unit that it is stored in.
    file : str
        In the working folder; what the program printed if not given.
    regex : str
        Pattern with one group, around the number; `take` says which match.
    column : str
        Header of a CSV column; `where` and `take` say which row.
    json_path : str
        Keys and positions with dots between: ``steps.-1.tip.uz``.
    function : str
        An offered function, see :data:`GROUP`.
    take : str
        ``"last"`` or ``"first"`` match or row.
    where : mapping of str to str or float
        Values that other columns must have in the row.
    delimiter : str
        Between CSV cells; a space stands for any white space.
    file_unit : str
        Unit of the number in the file; `unit` if empty.
    scale : float
        The number is multiplied by it, for a sign or a symmetry.
    """

    response: str
    unit: str
    file: str = STDOUT
    regex: str = ""
    column: str = ""
    json_path: str = ""
    function: str = ""
    take: str = "last"
    where: dict | None = None
    delimiter: str = ","
    file_unit: str = ""
    scale: float = 1.0

    def __post_init__(self) -> None:
        kinds = [kind for kind in _KINDS if getattr(self, kind)]
        what = f"response {self.response!r}"
        if len(kinds) != 1:
            raise ValueError(f"{what} needs one of {', '.join(_KINDS)}; got {', '.join(kinds) or 'none'}")
        plain_relative(f"{what}: file", self.file)
        one_of(f"{what}: take", self.take, ("last", "first"))
        if self.regex:
            pattern(f"{what}: regex", self.regex, groups=1)
        if self.function:
            known_function(self.function)
        if self.where and not self.column:
            raise ValueError(f"{what}: where belongs to column")
        if self.delimiter not in _DELIMITERS:
            known = ", ".join(repr(d) for d in _DELIMITERS)
            raise ValueError(f"{what}: delimiter must be one of {known}, got {self.delimiter!r}")
        if self.scale == 0.0:
            raise ValueError(f"{what}: scale must not be 0")
        self.factor  # noqa: B018 - refuses units that do not fit

    @property
    def factor(self) -> Fraction:
        """From the number in the file to the one that is stored."""
        try:
            return Fraction(self.scale) * ratio(self.file_unit or self.unit, self.unit)
        except ValueError as error:
            raise ValueError(f"response {self.response!r}: {error}") from None

    def read(self, folder: WorkFolder, answers: dict[str, Mapping[str, float]]) -> float:
        """The number, in `unit`.

        Parameters
        ----------
        folder : WorkFolder
        answers : dict
            What functions have said about this folder already, by name; each is asked once.

        Raises
        ------
        Unparsed
            With one sentence on what was looked for, and where.
        """
        if self.function:
            return convert(self._ask(folder, answers), self.factor)
        try:
            text = folder.read(self.file)
        except Unreadable as error:
            raise Unparsed(f"{self.response}: {error}") from None
        find = self._match if self.regex else self._cell if self.column else self._member
        return convert(find(text), self.factor)

    def _ask(self, folder: WorkFolder, answers: dict[str, Mapping[str, float]]) -> float:
        try:
            if self.function not in answers:
                answers[self.function] = _function(self.function)(folder.path)
            return float(answers[self.function][self.response])
        except Exception as error:  # somebody else's code: what it raises is this point's failure
            what = f"the function {self.function!r} failed"
            raise Unparsed(f"{self.response}: {what}: {type(error).__name__}: {error}") from None

    def _match(self, text: str) -> float:
        found = None
        for match in re.compile(self.regex, re.MULTILINE).finditer(text):
            found = match
            if self.take == "first":
                break
        if found is None or found.group(1) is None:
            raise Unparsed(f"{self.response}: nothing in {self.file} matches {self.regex!r}")
        return self._number(found.group(1))

    def _cell(self, text: str) -> float:
        where = self.where or {}
        lines = [line for line in text.splitlines() if line.strip()]
        if self.delimiter == " ":
            rows = [line.split() for line in lines]
        else:
            try:
                rows = [[c.strip() for c in row] for row in csv.reader(lines, delimiter=self.delimiter)]
            except csv.Error as error:
                raise Unparsed(f"{self.response}: {self.file} is no CSV: {error}") from None
        header = rows[0] if rows else []
        for name in (self.column, *where):
            if header.count(name) != 1:
                n, known = header.count(name), ", ".join(header[:20])
                raise Unparsed(f"{self.response}: {self.file} has {n} columns {name!r}; its header is {known!r}")
        at = header.index(self.column)
        good = [row for row in rows[1:] if all(_same(row, header.index(n), v) for n, v in where.items())]
        if not good:
            wanted = " and ".join(f"{n} = {v}" for n, v in where.items())
            raise Unparsed(f"{self.response}: {self.file} has no row{f' where {wanted}' if wanted else ''}")
        row = good[-1 if self.take == "last" else 0]
        return self._number(row[at] if at < len(row) else "")

    def _member(self, text: str) -> float:
        try:
            value: Any = json.loads(text)
        except (ValueError, RecursionError) as error:
            raise Unparsed(f"{self.response}: {self.file} is no JSON: {error}") from None
        for key in self.json_path.split("."):
            try:
                value = value[int(key)] if isinstance(value, list) else value[key]
            except (LookupError, TypeError, ValueError):
                raise Unparsed(f"{self.response}: {self.file} has nothing at {self.json_path!r} (no {key!r})") from None
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            raise Unparsed(f"{self.response}: {self.file} has no number at {self.json_path!r}, but {str(value)[:60]!r}")
        try:
            return float(value)
        except OverflowError:
            return float("inf")

    def _number(self, text: str) -> float:
        """A number as programs print it, with Fortran's ``1.5D-03`` too."""
        if not _NUMBER.fullmatch(word := text.strip()):
            raise Unparsed(f"{self.response}: {text[:60]!r} in {self.file} is no number")
        return float(word.lower() if "n" in word.lower() else word.lower().replace("d", "e"))


def _same(row: list[str], at: int, wanted: str | float) -> bool:
    cell = row[at] if at < len(row) else ""
    if isinstance(wanted, str):
        return cell == wanted
    return bool(_NUMBER.fullmatch(cell)) and float(cell.lower().replace("d", "e")) == wanted

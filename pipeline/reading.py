"""CSV tables read strictly: a person's, and our own when a run folder is read back.

The standard library's reader is used because a lenient one guesses: it shifts columns where a row has
a cell too many, renames doubled columns, and takes ``True`` for a number.
"""

import csv
import io
import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from experiments.designs import Design
from experiments.factors import FactorSpace
from experiments.naming import column_label, parse_column_label
from experiments.runs import Response, Runs, Status

from .errors import InputError

CODED = "coded"
NOT_FINITE = {"", "nan", "inf", "-inf", "+inf", "infinity", "-infinity"}
# Possessive: a cell of 100,000 digits and a letter would take minutes.
_NUMBER = re.compile(r"\s*+[+-]?(\d++\.?\d*+|\.\d++)([eE][+-]?\d++)?\s*+", re.ASCII)


@dataclass(frozen=True)
class Table:
    """Cells as text, with the name of the file for messages.

    Parameters
    ----------
    origin : str
    header : tuple of str
        Length n_columns, all different.
    rows : tuple of tuple of str
        Each of length n_columns.
    """

    origin: str
    header: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]

    @classmethod
    def parse(cls, text: str, origin: str) -> "Table":
        """A table from CSV text; ``InputError`` if a row has too many or too few cells, or a column is doubled."""
        try:
            lines = [line for line in csv.reader(io.StringIO(text), strict=True) if line]
        except csv.Error as error:
            raise InputError(f"{origin} is not a CSV table: {error}") from None
        if not lines:
            raise InputError(f"{origin} is not a CSV table: it is empty, and its first row must name the columns")
        header = tuple(cell.strip() for cell in lines[0])
        for label, n in Counter(header).items():
            if n > 1:
                raise InputError(f"{origin}: the column {parse_column_label(label)[0]!r} appears twice")
        for i, line in enumerate(lines[1:], start=1):
            if len(line) != len(header):
                raise InputError(f"{origin}: row {i} has {len(line)} cells, but there are {len(header)} columns")
        return cls(origin, header, tuple(map(tuple, lines[1:])))

    def __len__(self) -> int:
        return len(self.rows)

    def column(self, label: str) -> list[str]:
        """Cells of one column; ``InputError`` if there is none of that label."""
        if label not in self.header:
            found = ", ".join(self.header)
            raise InputError(f"{self.origin} has the wrong columns: {label} missing; found {found}")
        at = self.header.index(label)
        return [row[at] for row in self.rows]

    def numbers(self, labels: Sequence[str], empty: float | None = None) -> NDArray[np.float64]:
        """Columns as finite float64, shape (n_rows, n_labels); empty cells as `empty`, if that is given.

        Raises
        ------
        InputError
            That names the row and column of the first cell that is no finite number.
        """
        values = np.empty((len(self), len(labels)))
        for j, label in enumerate(labels):
            for i, cell in enumerate(self.column(label)):
                if empty is not None and not cell:
                    values[i, j] = empty
                    continue
                number = _NUMBER.fullmatch(cell)
                values[i, j] = float(cell) if number else np.nan
                if not np.isfinite(values[i, j]):
                    kind = "a finite number" if number or cell.strip().lower() in NOT_FINITE else "a number"
                    raise InputError(f"{self.origin}: row {i + 1}, column {label} is not {kind}: {cell[:40]!r}")
        return values


def read_points(text: str, wanted: Sequence[Response] | FactorSpace, origin: str) -> NDArray[np.float64]:
    """Columns of a person's table, by name with or without ``[unit]``, in any order; others are ignored.

    Raises
    ------
    InputError
        If a column is missing, doubled, in another unit, or holds anything but finite numbers.
    """
    table = Table.parse(text, origin)
    given: dict[str, str] = {}
    for label in table.header:
        name, _ = parse_column_label(label)
        if name in given:
            raise InputError(f"{origin}: the column {name!r} appears twice")
        given[name] = label
    missing = [item.label for item in wanted if item.name not in given]
    if missing:
        found = ", ".join(table.header)
        raise InputError(f"{origin} has the wrong columns: {', '.join(missing)} missing; found {found}")
    for item in wanted:
        unit = parse_column_label(given[item.name])[1]
        if unit is not None and unit != item.unit:
            raise InputError(f"{origin}: the column {given[item.name]!r} must be in {item.unit!r}, not {unit!r}")
    if not len(table):
        raise InputError(f"{origin} has no rows")
    return table.numbers([given[item.name] for item in wanted])


def read_runs(design: Table, runs: Table, space: FactorSpace, responses: Sequence[Response], method: str) -> Runs:
    """Runs from the two tables of a stage, as :mod:`.tables` wrote them.

    Raises
    ------
    InputError
        If a table is damaged, or the two do not belong together.
    """
    coded = [column_label(name, CODED) for name in space.names]
    dummies = [label for label in design.header if label not in coded]
    made = Design(space, design.numbers(coded), method, design.numbers(dummies))
    if not np.array_equal(runs.numbers(space.labels), made.physical):
        raise InputError(f"the settings in {runs.origin} are not those of {design.origin}: run the study again")
    try:
        status = tuple(Status(cell) for cell in runs.column("status"))
        values = runs.numbers([r.label for r in responses], empty=np.nan)
        return Runs(made, tuple(responses), values, status, tuple(runs.column("reason")))
    except ValueError as error:
        raise InputError(f"{runs.origin} is damaged: {error}") from None

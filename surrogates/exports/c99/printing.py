"""Numbers, sums and tables as C text, in double or single precision."""

import textwrap
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..base import filled, number
from ..horner import Assignment, Entry, Product

LINE = 88


@dataclass(frozen=True)
class Printer:
    """How one precision is written.

    Parameters
    ----------
    real : str
        The type.
    suffix : str
        Of its literals and of the functions of ``math.h``.
    limit : str
        Its largest number in ``float.h``.
    """

    real: str
    suffix: str
    limit: str

    def number(self, value: float) -> str:
        """A literal with the digits that round-trip; ``ValueError`` if it overflows this precision."""
        if self.real == "double":
            return number(value)
        with np.errstate(over="ignore", under="ignore"):
            rounded = np.float32(value)
        if not np.isfinite(rounded):
            raise ValueError(f"this model cannot be exported in single precision: {value:.6g} overflows float32")
        text = str(float(str(rounded)) + 0.0)
        return f"{text}{self.suffix}"

    def term(self, product: Product) -> str:
        """A product without its sign, or with the table's entry that holds it."""
        coefficient, names = product
        if isinstance(coefficient, Entry):
            return " * ".join((f"{coefficient.table}[{coefficient.row}][j]", *names))
        size = abs(coefficient)
        return " * ".join(((self.number(size),) if size != 1.0 or not names else ()) + names)

    def sum(self, products: Iterable[Product], indent: str) -> str:
        """``a + b - c`` on as many lines as it takes, zeros left out; ``0.0`` if nothing is left."""
        parts = []
        for product in products:
            coefficient = product[0]
            if not isinstance(coefficient, Entry) and coefficient == 0.0:
                continue
            minus = not isinstance(coefficient, Entry) and coefficient < 0.0
            parts.append(("- " if minus else "+ ") + self.term(product))
        if not parts:
            return self.number(0.0)
        first = parts[0].removeprefix("+ ").replace("- ", "-", 1)
        return f"\n{indent}".join(filled((first, *parts[1:]), LINE))

    def assignment(self, one: Assignment, indent: str) -> str:
        """A constant with its value."""
        return f"{indent}const {self.real} {one.name} = {self.sum(one.products, indent + '    ')};"

    def list(self, values: Iterable[float]) -> str:
        """Numbers of an initializer, without its braces."""
        text = ", ".join(self.number(float(v)) for v in values)
        if len(text) <= 60:
            return text
        return "\n" + textwrap.indent(textwrap.fill(text, 92), " " * 8) + "\n    "

    def table(self, rows: NDArray[np.float64], labels: Sequence[str] = ()) -> str:
        """Rows of a two-dimensional initializer; `labels`, if any, say in a comment what each row is."""
        written = ["    {" + ", ".join(self.number(float(v)) for v in row) + "}" for row in rows]
        commas = [","] * (len(written) - 1) + [""]
        notes = [f" /* {label} */" for label in labels] or [""] * len(written)
        return "\n".join(a + b + c for a, b, c in zip(written, commas, notes, strict=True))

    def difference(self, name: str, value: float) -> str:
        """``name - value``, without a zero."""
        return f"{name} {'-' if value > 0.0 else '+'} {self.number(abs(value))}" if value else name


DOUBLE = Printer("double", "", "DBL_MAX")
SINGLE = Printer("float", "f", "FLT_MAX")


def affine_sum(constant: float, factors: ArrayLike, names: Sequence[str]) -> tuple[Product, ...]:
    """``constant + Σ factor · name`` as products."""
    return ((float(constant), ()), *((float(f), (n,)) for f, n in zip(np.asarray(factors), names, strict=True)))

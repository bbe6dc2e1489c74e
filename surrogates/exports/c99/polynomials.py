"""C functions that evaluate several polynomials at coded settings, alone or with all their derivatives.

Polynomials that use much the same terms share one nesting and are evaluated side by side: the inner loop runs over
the polynomials, a compiler makes vector instructions of it, and where the processor has vectors the rows of the table
of coefficients are padded to whole ones. Others are evaluated one after the other, each with its own terms alone.
"""

import textwrap
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..base import WIDTH
from ..horner import (
    Coefficient,
    Entry,
    Node,
    count,
    edges,
    gradient_of,
    nest,
    products_of,
    value_of,
    variable,
    variables_of,
)
from .printing import Printer

WORTH = 2.0
"""Side by side is chosen if it takes at most this many times the multiplications: vectors make up for more."""


class Count(NamedTuple):
    """Operations of one call."""

    multiplications: int
    additions: int


@dataclass(frozen=True, eq=False)
class Polynomials:
    """Polynomials with what their code needs.

    Parameters
    ----------
    exponents : tuple of tuple of int
        One per term.
    coefficients : ndarray, shape (n_terms, n_polynomials)
    names, labels : tuple of str
        What each polynomial gives and what each term is, for comments: plain text.
    n_factors : int
    shared : bool
        Whether they are evaluated side by side.
    nodes : tuple of Node
        One nesting if shared, else one per polynomial.
    """

    exponents: tuple[tuple[int, ...], ...]
    coefficients: NDArray[np.float64]
    names: tuple[str, ...]
    labels: tuple[str, ...]
    n_factors: int
    shared: bool
    nodes: tuple[Node, ...]

    @property
    def n(self) -> int:
        """How many there are."""
        return self.coefficients.shape[1]

    def count(self, slopes: bool) -> Count:
        """Operations of one evaluation, zeros that fill vectors aside."""
        times = plus = 0
        for i, node in enumerate(self.nodes):
            written = (gradient_of if slopes else value_of)(node, self.coefficient(i, ""))
            one = count([*(s.products for s in written.statements), written.value, *written.slopes])
            times, plus = times + one[0], plus + one[1]
        repeated = self.n if self.shared else 1
        products = count(p.products for p in products_of(self.nodes)) if slopes else (0, 0)
        return Count(times * repeated + products[0], plus * repeated + products[1])

    def coefficient(self, i: int, table: str) -> Callable[[int], Coefficient]:
        """What the code writes for the coefficient of a row in the nesting at `i`."""
        if self.shared:
            return lambda row: Entry(table, row)
        return lambda row: float(self.coefficients[row, i])


def polynomials(
    exponents: Sequence[tuple[int, ...]],
    coefficients: NDArray[np.float64],
    names: Sequence[str],
    labels: Sequence[str],
    n_factors: int,
) -> Polynomials:
    """The polynomials in the quicker of the two ways."""
    n = coefficients.shape[1]
    separate = tuple(nest(exponents, np.flatnonzero(column).tolist(), n_factors) for column in coefficients.T)
    shared = nest(exponents, np.flatnonzero(coefficients.any(axis=1)).tolist(), n_factors)
    alone, together = sum(map(edges, separate)), n * edges(shared)
    side_by_side = n > 1 and alone > 0 and together <= WORTH * alone
    return Polynomials(
        tuple(exponents),
        coefficients,
        tuple(names),
        tuple(labels),
        n_factors,
        side_by_side,
        (shared,) if side_by_side else separate,
    )


def columns_text(n: int, name: str, lanes: tuple[int, int]) -> str:
    """Definition of the tables' columns: `n`, or whole vectors where that adds no more than a third.

    `lanes` are the numbers in a vector of SSE2 or NEON, and of AVX.
    """
    widths = [whole if 3 * whole <= 4 * n else n for whole in (-(-n // k) * k for k in lanes)]
    if set(widths) == {n}:
        return f"\n#define {name} {n}\n"
    return (
        "\n/* Columns of the tables: zeros fill whole vectors where the processor has them. */\n"
        f"#if defined(__AVX__)\n#define {name} {widths[1]}\n"
        f"#elif defined(__SSE2__) || defined(__ARM_NEON)\n#define {name} {widths[0]}\n"
        f"#else\n#define {name} {n}\n#endif\n"
    )


def table_text(which: Polynomials, name: str, columns: str, c: Printer) -> str:
    """The table of coefficients of polynomials side by side; nothing for others."""
    if not which.shared:
        return ""
    told = textwrap.fill(
        f"Coefficients: a row for each term; columns: {', '.join(which.names)}.",
        WIDTH,
        initial_indent=" * ",
        subsequent_indent=" * ",
        break_long_words=False,
        break_on_hyphens=False,
    )
    rows = c.table(which.coefficients, which.labels)
    return f"\n/*\n{told}\n */\nstatic const {c.real} {name}[{len(which.exponents)}][{columns}] = {{\n{rows}\n}};\n"


def body(which: Polynomials, table: str, columns: str, c: Printer, slopes: bool) -> str:
    """Statements that write ``value[i]``, and ``slope[i][j]`` if asked for, from ``coded[j]``.

    `table` and `columns` are what the code calls the table of coefficients and the number of its columns.
    """
    used = variables_of(which.nodes)
    lines = [f"    const {c.real} {variable(k)} = coded[{k}];" for k in used] or ["    (void)coded; /* constant */"]
    if slopes:
        lines += [c.assignment(one, "    ") for one in products_of(which.nodes)]
    if which.shared:
        return "\n".join([*lines, *_side_by_side(which, table, columns, c, slopes)])
    return "\n".join([*lines, "", *_one_by_one(which, c, slopes)])


def _one_by_one(which: Polynomials, c: Printer, slopes: bool) -> list[str]:
    lines = []
    for i, (node, name) in enumerate(zip(which.nodes, which.names, strict=True)):
        written = (gradient_of if slopes else value_of)(node, which.coefficient(i, ""))
        lines.append(f"    {{ /* {name} */")
        lines += [c.assignment(one, " " * 8) for one in written.statements]
        lines.append(f"        value[{i}] = {c.sum(written.value, ' ' * 12)};")
        lines += [f"        slope[{i}][{j}] = {c.sum(s, ' ' * 12)};" for j, s in enumerate(written.slopes)]
        lines.append("    }")
    return lines


def _side_by_side(which: Polynomials, table: str, columns: str, c: Printer, slopes: bool) -> list[str]:
    written = (gradient_of if slopes else value_of)(which.nodes[0], which.coefficient(0, table))
    lines = [f"    {c.real} sum[{columns}];"]
    if slopes:
        lines.append(f"    {c.real} by[{which.n_factors}][{columns}];")
    lines += ["", f"    for (int j = 0; j < {columns}; ++j) {{"]
    lines += [c.assignment(one, " " * 8) for one in written.statements]
    lines.append(f"        sum[j] = {c.sum(written.value, ' ' * 12)};")
    lines += [f"        by[{k}][j] = {c.sum(s, ' ' * 12)};" for k, s in enumerate(written.slopes)]
    lines += ["    }", f"    for (int i = 0; i < {which.n}; ++i) {{", "        value[i] = sum[i];"]
    if slopes:
        lines += [
            f"        for (int k = 0; k < {which.n_factors}; ++k) {{",
            "            slope[i][k] = by[k][i];",
            "        }",
        ]
    return [*lines, "    }"]

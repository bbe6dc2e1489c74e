"""Polynomials as straight lines of code: nested multiplication, and all derivatives by going back through it.

Source: the nested scheme in several variables, with the most frequent variable taken out first, is Ceberio and
Kreinovich (2004), "Greedy algorithms for optimizing multivariate Horner schemes", ACM SIGSAM Bulletin 38(1). The
derivatives are the reverse mode of Griewank and Walther (2008), "Evaluating Derivatives", 2nd ed., section 3.2,
written out for that scheme: what multiplies a nested value on its way to the sum is the product of the variables
taken out so far, one for all polynomials that share the nesting.

With T terms, all of them products of variables that terms themselves hold, a value takes T − 1 multiplications and as
many additions, a value with its whole gradient twice that and the products.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import NamedTuple


class Entry(NamedTuple):
    """A coefficient named by its row of a table, where one text serves several polynomials."""

    table: str
    row: int


HIGHEST = 200
"""Degree up to which nesting is written: one level a variable taken out."""

Coefficient = float | Entry
Product = tuple[Coefficient, tuple[str, ...]]
"""A coefficient and the names it multiplies."""


class Assignment(NamedTuple):
    """``name = sum of products``; every name is assigned once."""

    name: str
    products: tuple[Product, ...]


@dataclass(frozen=True)
class Node:
    """``value = coefficient of term + Σ x_k · value of branch``.

    Parameters
    ----------
    exponents : tuple of int
        Of the product of the variables taken out on the way here, one per factor.
    term : int or None
        Row of the term that is this product; None if there is none.
    branches : tuple of (int, Node)
        A factor and what it multiplies.
    """

    exponents: tuple[int, ...]
    term: int | None
    branches: tuple[tuple[int, "Node"], ...]


class Gradient(NamedTuple):
    """Statements, and then the value and its derivatives by each coded factor as sums of products."""

    statements: tuple[Assignment, ...]
    value: tuple[Product, ...]
    slopes: tuple[tuple[Product, ...], ...]


def variable(factor: int) -> str:
    """What the coded factor at that position is called in generated code."""
    return f"x{factor}"


def nest(exponents: Sequence[tuple[int, ...]], rows: Iterable[int], n_factors: int) -> Node:
    """The terms at `rows` of `exponents`, nested; the first of the most frequent variables is taken out first.

    Raises
    ------
    ValueError
        If a term is of a degree above :data:`HIGHEST`.
    """
    rows = list(rows)
    if (highest := max((sum(exponents[row]) for row in rows), default=0)) > HIGHEST:
        raise ValueError(f"this model cannot be exported: it has a term of degree {highest}, the highest is {HIGHEST}")
    return _nest([(tuple(exponents[row]), row) for row in rows], (0,) * n_factors)


def edges(node: Node) -> int:
    """Multiplications of one evaluation."""
    return sum(1 + edges(branch) for _, branch in node.branches)


def value_of(node: Node, coefficient: Callable[[int], Coefficient]) -> Gradient:
    """The value alone: as :func:`gradient_of`, without slopes."""
    statements, value, _ = _written(node, coefficient, ())
    return Gradient(statements, value, ())


def gradient_of(node: Node, coefficient: Callable[[int], Coefficient]) -> Gradient:
    """The value and its derivatives; `coefficient` gives that of a row. Names as :func:`products_of` assigns them."""
    return _written(node, coefficient, node.exponents)


def products_of(nodes: Iterable[Node]) -> tuple[Assignment, ...]:
    """Assignments of the products of variables that the derivatives of all `nodes` need."""
    needed: dict[tuple[int, ...], Assignment] = {}

    def visit(node: Node, taken: tuple[int, ...], last: int | None) -> None:
        if not node.branches:
            return
        if sum(node.exponents) > 1 and node.exponents not in needed:
            assert last is not None
            names = (*_product(taken), variable(last))
            needed[node.exponents] = Assignment(_product(node.exponents)[0], ((1.0, names),))
        for factor, branch in node.branches:
            visit(branch, node.exponents, factor)

    for node in nodes:
        visit(node, node.exponents, None)
    return tuple(needed.values())


def variables_of(nodes: Iterable[Node]) -> list[int]:
    """Positions of the factors that `nodes` depend on."""
    return sorted({factor for node in nodes for factor in _variables(node)})


def count(assignments: Iterable[Sequence[Product]]) -> tuple[int, int]:
    """Multiplications and additions that sums of products take."""
    times = plus = 0
    for products in assignments:
        plus += max(0, len(products) - 1)
        times += sum(max(0, len(names) - (coefficient == 1.0)) for coefficient, names in products)
    return times, plus


def _nest(rows: list[tuple[tuple[int, ...], int]], taken: tuple[int, ...]) -> Node:
    term, rest = None, []
    for left, row in rows:
        if any(left):
            rest.append((left, row))
        else:
            term = row
    branches = []
    while rest:
        counts = [sum(left[k] > 0 for left, _ in rest) for k in range(len(taken))]
        k = counts.index(max(counts))
        inner = [(_changed(left, k, -1), row) for left, row in rest if left[k]]
        branches.append((k, _nest(inner, _changed(taken, k, 1))))
        rest = [(left, row) for left, row in rest if not left[k]]
    return Node(taken, term, tuple(branches))


def _changed(exponents: tuple[int, ...], factor: int, by: int) -> tuple[int, ...]:
    return (*exponents[:factor], exponents[factor] + by, *exponents[factor + 1 :])


def _product(exponents: tuple[int, ...]) -> tuple[str, ...]:
    """The name of a product of variables; none for the empty product."""
    held = [(k, e) for k, e in enumerate(exponents) if e]
    if not held:
        return ()
    if len(held) == 1 and held[0][1] == 1:
        return (variable(held[0][0]),)
    return ("m" + "_".join(f"{k}" if e == 1 else f"{k}p{e}" for k, e in held),)


def _written(node: Node, coefficient: Callable[[int], Coefficient], slopes_for: tuple[int, ...]) -> Gradient:
    statements: list[Assignment] = []
    slopes: list[list[Product]] = [[] for _ in slopes_for]

    def sum_at(here: Node) -> tuple[Product, ...]:
        found: list[Product] = [] if here.term is None else [(coefficient(here.term), ())]
        for factor, branch in here.branches:
            times, names = sum_at(branch), ()
            if branch.branches:
                names = (f"v{len(statements)}",)
                statements.append(Assignment(names[0], times))
                times = ((1.0, ()),)
            found.append((times[0][0], (variable(factor), *names)))
            if slopes:
                slopes[factor].append((times[0][0], (*_product(here.exponents), *names)))
        return tuple(found)

    value = sum_at(node)
    return Gradient(tuple(statements), value, tuple(tuple(s) for s in slopes))


def _variables(node: Node) -> set[int]:
    return {k for factor, branch in node.branches for k in (factor, *_variables(branch))}

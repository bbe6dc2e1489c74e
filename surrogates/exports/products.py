"""The terms of a model as a chain of products: each is an earlier one times one more coded setting.

One multiplication a product, for all responses together; the terms that languages with tables and matrices take.
"""

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from experiments.terms import Terms

if TYPE_CHECKING:
    from ..model import Surrogate


class Term(NamedTuple):
    """A product of coded settings and what it is multiplied by.

    Parameters
    ----------
    positions : tuple of int
        Which settings the product has, in ascending order, one as often as its power; none for the constant.
    coefficients : tuple of float
        In each response, link units.
    label : str
        The same for people, such as ``"a^2:b"``.
    """

    positions: tuple[int, ...]
    coefficients: tuple[float, ...]
    label: str


def used_terms(model: "Surrogate") -> dict[tuple[int, ...], tuple[float, ...]]:
    """Coefficients by positions, of the terms that some response uses."""
    used = {}
    for row, coefficients in zip(model.terms.exponents, model.coefficients, strict=True):
        if np.any(coefficients):
            used[_positions(row)] = tuple(float(c) for c in coefficients)
    return used


def chain(model: "Surrogate", closed: bool = True) -> tuple[Term, ...]:
    """Terms by degree, the constant first.

    Parameters
    ----------
    model : Surrogate
    closed : bool
        Whether products that no response uses, but that a longer one is made from, are there with coefficients of
        zero, and the constant in any case: then all but the first are an earlier one times one setting.
    """
    used = used_terms(model)
    wanted = {term[:k] for term in (*used, ()) for k in range(len(term) + 1)} if closed else set(used)
    ordered = sorted(wanted, key=lambda term: (len(term), term))
    zeros = (0.0,) * len(model.responses)
    rows = tuple(tuple(term.count(j) for j in range(len(model.factors))) for term in ordered)
    labels = Terms(model.factors.names, rows).labels
    return tuple(Term(term, used.get(term, zeros), label) for term, label in zip(ordered, labels, strict=True))


def _positions(row: tuple[int, ...]) -> tuple[int, ...]:
    return tuple(j for j, power in enumerate(row) for _ in range(power))

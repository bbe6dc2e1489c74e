"""Hadamard matrices: square tables of ±1 with orthogonal rows, the source of two-level screening designs."""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from .finite_fields import conference_matrix, prime_power
from .williamson import williamson_blocks

MAX_ORDER = 1000
"""Orders beyond this are refused: no study here pays for so many runs."""


def construction(order: int) -> str | None:
    """How a Hadamard matrix of this order is built here; ``None`` if none of the constructions gives it.

    Notes
    -----
    `"trivial"` (orders 1 and 2); `"paley I"`, order − 1 a prime power ≡ 3 (mod 4), and `"paley II"`,
    order/2 − 1 a prime power ≡ 1 (mod 4): Paley (1933), J. Math. Phys. 12, 311–320, Lemmas 2 to 4;
    `"kronecker AxB"`: the product of the matrices of orders A and B, Sylvester (1867), Phil. Mag.
    34, 461–475, which for A = 2 is doubling; `"williamson"`: four symmetric circulants, Williamson
    (1944), Duke Math. J. 11, 65–81. Order 92 is of that last kind: Baumert, Golomb and Hall (1962),
    Bull. Amer. Math. Soc. 68, 237–238. Orders that exist, but by other
    constructions or longer searches only, are not built; 156 and 188 are the first.
    """
    if order < 1 or order > MAX_ORDER or (order > 2 and order % 4):
        return None
    if order <= 2:
        return "trivial"
    if prime_power(order - 1):
        return "paley I"
    if (order // 2) % 4 == 2 and order > 4 and prime_power(order // 2 - 1):
        return "paley II"
    for factor in range(2, int(order**0.5) + 1):
        if order % factor == 0 and construction(factor) and construction(order // factor):
            return f"kronecker {factor}x{order // factor}"
    return "williamson" if order % 8 == 4 and williamson_blocks(order // 4) is not None else None


def orders(at_most: int = 200) -> tuple[int, ...]:
    """Every order up to `at_most` that can be built."""
    return tuple(n for n in range(1, at_most + 1) if construction(n))


@lru_cache(maxsize=32)
def hadamard(order: int) -> NDArray[np.int64]:
    """A Hadamard matrix H with HᵀH = order · I, shape (order, order), entries ±1; first column all +1.

    Raises
    ------
    ValueError
        If no construction here gives that order; the nearest ones that exist are named.

    Notes
    -----
    The sources of each construction are those of :func:`construction`.
    """
    how = construction(order)
    if how is None:
        near = nearest(order)
        raise ValueError(
            f"no Hadamard matrix of order {order} can be built (orders are 1, 2 and multiples of 4 up to {MAX_ORDER}); "
            f"use {' or '.join(map(str, near))}"
        )
    if how == "trivial":
        matrix = np.array([[1, 1], [1, -1]])[:order, :order]
    elif how == "paley I":
        matrix = _conference(order) + np.eye(order, dtype=np.int64)
    elif how == "paley II":
        half = order // 2
        diagonal = np.array([[1, -1], [-1, -1]])
        matrix = np.kron(_conference(half), hadamard(2)) + np.kron(np.eye(half, dtype=np.int64), diagonal)
    elif how == "williamson":
        matrix = _four_circulants(order // 4)
    else:
        factor = int(how.split()[1].split("x")[0])
        matrix = np.kron(hadamard(factor), hadamard(order // factor))
    matrix = matrix * matrix[:, :1]
    matrix.setflags(write=False)
    return matrix


def nearest(order: int) -> tuple[int, ...]:
    """The orders that can be built, one below and one above `order` where there is one."""
    below = next((n for n in range(min(order, MAX_ORDER + 1) - 1, 0, -1) if construction(n)), None)
    above = next((n for n in range(max(order, 0) + 1, MAX_ORDER + 1) if construction(n)), None)
    return tuple(n for n in (below, above) if n is not None)


def _conference(order: int) -> NDArray[np.int64]:
    matrix = conference_matrix(order)
    if matrix is None:
        raise AssertionError(f"Paley's construction was chosen, so a conference matrix of order {order} exists")
    return matrix


def _four_circulants(length: int) -> NDArray[np.int64]:
    """Williamson's array of four symmetric circulant blocks of that length, shape (4 · length, 4 · length)."""
    rows = williamson_blocks(length)
    if rows is None:
        raise AssertionError(f"Williamson's array was chosen, so its blocks of length {length} exist")
    shift = (np.arange(length)[:, None] - np.arange(length)[None, :]) % length
    a, b, c, d = (row[shift] for row in rows)
    return np.block([[a, b, c, d], [-b, a, -d, c], [-c, d, a, -b], [-d, -c, b, a]])

"""Lower bounds of a model's responses on the faces of a box of factors: Bernstein coefficients, by subdivision."""

import heapq
from typing import TYPE_CHECKING

import numpy as np

from .derivatives import exponents_of, mixed
from .enclosures import ENLARGED, TINY, Ball, Floats, control

if TYPE_CHECKING:
    from .model import Surrogate

GAP = 1e-3
"""Bounds on the faces are sharpened until they are known to this part of the half-range."""

MOST_PARTS = 60
"""Parts of one face that are looked at."""

MOST_WORK = 250_000
"""Coefficients of all these parts together, where that is less."""


def moving_part(model: "Surrogate", left: Floats) -> Ball:
    """``left @ (f − f(0))``: slopes (n, n) of an affine model, else power coefficients (n, d₁ + 1, …, dₙ + 1)."""
    exponents, coefficients = exponents_of(model), mixed(model, left)
    moving = exponents.any(axis=1)
    exponents, parts = exponents[moving], [part[moving].T for part in coefficients]
    shape = (len(left), exponents.shape[1])
    at: tuple = (slice(None), exponents.argmax(axis=1))
    if not model.is_affine:
        shape = (len(left), *(exponents.max(axis=0, initial=0) + 1))
        at = (slice(None), *exponents.T)
    tables = [np.zeros(shape), np.zeros(shape)]
    for table, part in zip(tables, parts, strict=True):
        table[at] = part
    return Ball(*tables)


def lowest_affine(row: Ball, i: int, sign: float, reach: float) -> float:
    """Lower bound of a linear form on a face: its own factor at the end, every other at its worst."""
    others = np.abs(row.mid).sum() - abs(row.mid[i])
    loss = row.rad.sum() + 1e-15 * len(row.mid) * np.abs(row.mid).sum()
    return float(reach * (sign * row.mid[i] - others - loss * ENLARGED) - TINY)


def lowest_on_face(row: Ball, i: int, sign: float, reach: float) -> float:
    """Lower bound of a polynomial on the face xᵢ = sign · reach, its parts with the lowest bounds halved first."""
    n = row.mid.ndim
    low, high = np.full(n, -reach), np.full(n, reach)
    low[i] = high[i] = sign * reach
    bound, value, axis = _bounded(row, low, high)
    reached, waiting, count = value, [(bound, 0, axis, low, high)], 1
    most = min(MOST_PARTS, MOST_WORK // row.mid.size)
    while True:
        bound, _, axis, low, high = waiting[0]
        if count >= most or reached - bound <= GAP * reach:
            return bound
        heapq.heappop(waiting)
        middle = 0.5 * (low[axis] + high[axis])
        for part in (0, 1):
            ends = low.copy(), high.copy()
            ends[1 - part][axis] = middle
            lower, value, steepest = _bounded(row, *ends)
            reached = min(reached, value)
            # Exact arithmetic gives a part no lower bound than the whole: both are bounds, the higher one counts.
            heapq.heappush(waiting, (max(lower, bound), count, steepest, *ends))
            count += 1


def _bounded(row: Ball, low: Floats, high: Floats) -> tuple[float, float, int]:
    """Lower bound on a box, the lowest value at its corners (to rounding), and the factor that changes most there."""
    found = control(row, low, high)
    bound = float((found.mid - found.rad * ENLARGED - 1e-15 * np.abs(found.mid)).min() - TINY)
    if not np.isfinite(bound):
        return -np.inf, -np.inf, 0
    table = found.mid.reshape(row.mid.shape)
    corners = table[np.ix_(*([0, d - 1] if d > 1 else [0] for d in table.shape))]
    change = [
        float(np.abs(np.diff(table, axis=k)).sum(axis=k).max()) if d > 1 else -1.0 for k, d in enumerate(table.shape)
    ]
    return bound, float(corners.min()), int(np.argmax(change))

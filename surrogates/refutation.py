"""Proof that a polynomial map is not safely invertible in a box: witnesses, checked in exact rational arithmetic."""

from dataclasses import dataclass
from fractions import Fraction
from itertools import islice, product
from typing import TYPE_CHECKING

import numpy as np

from .derivatives import MOST_COEFFICIENTS, exponents_of, jacobian_tensor, tensor_size
from .enclosures import Floats, control
from .injectivity import contraction_rate

if TYPE_CHECKING:
    from .model import Surrogate

SAMPLES = 4000
"""Random points at which a witness is sought; what is found is proven, what is not found proves nothing."""

MOST_GRID = 3**6
"""Points of the grid of centre and faces that are looked at."""


@dataclass(frozen=True)
class Witness:
    """Points that show it.

    Parameters
    ----------
    points : ndarray, shape (n_points, n_factors)
        Coded: one point, or the two ends of a segment, or two points with one image (the second to 1e-6).
    reason : str
        What they show, in words that end a sentence.
    """

    points: Floats
    reason: str


def refute(model: "Surrogate") -> Witness | None:
    """A singular point or two points with one image, if one is found.

    The model has at least as many responses as factors.
    """
    n = len(model.factors)
    grid = np.array(list(islice(product((0.0, -1.0, 1.0), repeat=n), MOST_GRID)))
    rng = np.random.default_rng(0)
    points = np.vstack([grid, rng.uniform(-1.0, 1.0, (SAMPLES, n))])
    slopes = model.jacobian_coded(points) / model.scale[:, None]
    singular = np.linalg.svd(slopes, compute_uv=False)
    lost = np.flatnonzero(singular[:, -1] <= 1e-9 * np.maximum(singular[:, 0], 1e-300))
    for at in lost[:20]:
        if _rank(_slope(model, points[at])) < n:
            return Witness(points[at : at + 1], "the Jacobian is singular at the witness, in exact arithmetic")
    if len(model.responses) != n:
        return None
    if found := _sign_change(model, points, slopes):
        return found
    return None if tensor_size(model) > MOST_COEFFICIENTS else _same_image(model, rng)


def _sign_change(model: "Surrogate", points: Floats, slopes: Floats) -> Witness | None:
    """Two points at which the determinant has opposite signs: between them it is zero."""
    sizes = np.linalg.det(slopes)
    ends = [points[np.argmin(sizes)], points[np.argmax(sizes)]]
    if sizes.min() >= 0.0 or sizes.max() <= 0.0:
        side = 1.0 if sizes.min() >= 0.0 else -1.0
        ends = [points[np.argmax(side * sizes)], _descended(model, points[np.argsort(side * sizes)[:5]], side)]
    signs = [_determinant_sign(_slope(model, end)) for end in ends]
    if signs[0] * signs[1] >= 0:
        return None
    return Witness(
        np.array(ends),
        "the determinant of the Jacobian has opposite signs at the two witnesses, in exact arithmetic, so that it is "
        "singular between them",
    )


def _descended(model: "Surrogate", starts: Floats, side: float) -> Floats:
    """From the starts, the point of the box where `side` times the determinant gets lowest."""
    from scipy.optimize import minimize

    def size(x: Floats) -> float:
        return side * float(np.linalg.det(model.jacobian_coded(x[None])[0] / model.scale[:, None]))

    unit = max(abs(size(start)) for start in starts) or 1.0
    bounds = [(-1.0, 1.0)] * starts.shape[1]
    found = [minimize(lambda x: size(x) / unit, start, bounds=bounds, method="L-BFGS-B").x for start in starts]
    return np.clip(min(found, key=size), -1.0, 1.0)


def _same_image(model: "Surrogate", rng: np.random.Generator, tries: int = 400) -> Witness | None:
    """Two points with one image: the second by Newton's method, its existence by Krawczyk's test."""
    n = len(model.factors)
    first, second = (rng.uniform(-1.0, 1.0, (tries, n)) for _ in range(2))
    target = model.predict_coded(first)
    for _ in range(30):
        miss = (target - model.predict_coded(second)) / model.scale
        steps = np.linalg.pinv(model.jacobian_coded(second) / model.scale[:, None])
        second = np.clip(second + np.einsum("nkr,nr->nk", steps, miss), -1.0, 1.0)
    apart = np.abs(second - first).max(axis=1)
    close = (np.abs(target - model.predict_coded(second)) <= 1e-9 * model.scale).all(axis=1)
    inside = (np.abs(second) < 1.0 - 1e-5).all(axis=1)
    for at in np.flatnonzero((apart > 1e-3) & close & inside)[:20]:
        if _krawczyk(model, first[at], second[at]):
            return Witness(
                np.array([first[at], second[at]]),
                "the two witnesses have one image: Krawczyk's test proves a point within 1e-6 of the second whose "
                "responses are exactly those of the first",
            )
    return None


def _krawczyk(model: "Surrogate", first: Floats, near: Floats, reach: float = 1e-6) -> bool:
    """Whether the responses of `first` occur again within `reach` of `near` (Krawczyk, 1969, Computing 4, 187–201)."""
    left = np.linalg.pinv(model.jacobian_coded(near[None])[0])
    if not np.isfinite(left).all():
        return False
    there, here = _values(model, near), _values(model, first)
    step = [
        sum((Fraction(float(a)) * (t - h) for a, t, h in zip(row, there, here, strict=True)), Fraction(0))
        for row in left
    ]
    spread = contraction_rate(control(jacobian_tensor(model, left), near - reach, near + reach), np.ones(len(near)))
    if not spread < 1.0:
        return False
    # The box's faces are floats, off by a rounding of the reach; a thousandth of it is more than that.
    return all(abs(s) + Fraction(spread) * Fraction(reach) < Fraction(0.999 * reach) for s in step)


def _values(model: "Surrogate", point: Floats) -> list[Fraction]:
    """Exact responses at a coded point."""
    powers = _powers(model, point)
    used = model.coefficients[(model.coefficients != 0.0).any(axis=1)]
    return [_dot(column, powers) for column in used.T]


def _slope(model: "Surrogate", point: Floats) -> list[list[Fraction]]:
    """Exact Jacobian at a coded point, a list a response."""
    used = model.coefficients[(model.coefficients != 0.0).any(axis=1)]
    exponents = exponents_of(model)
    columns = []
    for k in range(len(point)):
        lowered = exponents - (np.arange(len(point)) == k)
        slopes = [
            int(e[k]) * _power(point, low) if e[k] else Fraction(0) for e, low in zip(exponents, lowered, strict=True)
        ]
        columns.append([_dot(column, slopes) for column in used.T])
    return [list(row) for row in zip(*columns, strict=True)]


def _dot(floats: Floats, exact: list[Fraction]) -> Fraction:
    return sum((Fraction(float(a)) * b for a, b in zip(floats, exact, strict=True)), Fraction(0))


def _powers(model: "Surrogate", point: Floats) -> list[Fraction]:
    return [_power(point, e) for e in exponents_of(model)]


def _power(point: Floats, exponents: np.ndarray) -> Fraction:
    value = Fraction(1)
    for x, e in zip(point, exponents, strict=True):
        value *= Fraction(float(x)) ** int(e)
    return value


def _eliminated(rows: list[list[Fraction]]) -> tuple[int, int]:
    """Rank, and for a square matrix the sign of its determinant, by exact elimination."""
    rows, rank, sign = [list(row) for row in rows], 0, 1
    for column in range(len(rows[0])):
        pivot = next((i for i in range(rank, len(rows)) if rows[i][column]), None)
        if pivot is None:
            sign = 0
            continue
        if pivot != rank:
            rows[rank], rows[pivot], sign = rows[pivot], rows[rank], -sign
        sign = sign if rows[rank][column] > 0 else -sign
        for i in range(rank + 1, len(rows)):
            factor = rows[i][column] / rows[rank][column]
            rows[i] = [a - factor * b for a, b in zip(rows[i], rows[rank], strict=True)]
        rank += 1
    return rank, sign


def _rank(rows: list[list[Fraction]]) -> int:
    return _eliminated(rows)[0]


def _determinant_sign(rows: list[list[Fraction]]) -> int:
    return _eliminated(rows)[1]

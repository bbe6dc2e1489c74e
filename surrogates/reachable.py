"""A box of responses that can be had one and all, by a theorem on the faces of the box of factors.

Let the coded factors vary in B = [−r, r]ⁿ and let aᵢ⁻ and aᵢ⁺ be rows, one per face xᵢ = ∓r. If

    aᵢ⁺ (f(x) − y) ≥ 0 on the face xᵢ = r,    aᵢ⁻ (f(x) − y) ≤ 0 on the face xᵢ = −r,    for every i,

then some x in B has f(x) = y. For with aᵢ(x) between the two rows as xᵢ is between the two faces, g(x) = A(x)(f(x) − y)
has components of opposite signs on opposite faces and so a zero (Poincaré–Miranda: Miranda, 1940, "Un'osservazione
su un teorema di Brouwer", Boll. Un. Mat. Ital. 3, 5–7; Kulpa, 1997, "The Poincaré–Miranda theorem", Amer. Math.
Monthly 104, 545–550). A(x) is regular if ‖I − A(x)S‖ < 1 for some matrix S; in a maximum norm that is a bound on
each row, convex in it, so that both rows of every factor are looked at and nothing between them.

Lower bounds on the faces (Bernstein coefficients, by subdivision) make the conditions linear in y: a polytope of
targets. In it lies the box of largest volume, a choice that does not depend on units. Floats propose it; that it
lies in the polytope is decided in rationals.

f and y are in link units: of a response that is given by its logarithm, the box is one of logarithms, whose ends become
responses at the very end, rounded inwards.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction
from typing import TYPE_CHECKING

import numpy as np

from .derivatives import MOST_COEFFICIENTS, inverse_of_mean_slope, tensor_size
from .enclosures import UNIT, Ball, Floats, product
from .faces import lowest_affine, lowest_on_face, moving_part
from .injectivity import contraction_rate, dominating
from .inscribed import largest_box
from .links import box_of_responses

if TYPE_CHECKING:
    from .model import Surrogate

Box = tuple[tuple[float, float], ...]
"""Low and high of each response, SI."""

SMALLER = 0.8
"""Ratio of the boxes of factors whose faces are tried: of a strongly curved map, a smaller one can give more."""

MOST_BOXES = 12

MOST_CONDITION = 1e13
"""Of matrices whose regularity is tried to prove."""

PROVEN = (
    "proven by the theorem of Poincaré and Miranda, with Bernstein enclosures on the faces of the box of factors and a "
    "check in exact arithmetic"
)


@dataclass(frozen=True)
class Polytope:
    """Targets y with ``sides @ (y − f(0)) ≤ room``: all of them can be had.

    Parameters
    ----------
    sides : ndarray, shape (2 n, n)
        Rows −aᵢ⁻, then rows aᵢ⁺; coded factors per SI unit.
    room : ndarray, shape (2 n,)
        Lower bounds of ``sides @ (f(x) − f(0))`` on the face of each row.
    """

    sides: Floats
    room: Floats


def response_box(model: "Surrogate", reach: float = 1.0) -> tuple[Box | None, str]:
    """A box of responses, each of which has a setting with coded factors in [−reach, reach]; or None; and why.

    Parameters
    ----------
    model : Surrogate
        Injective on that box of factors, which is proven elsewhere: a setting is then the only one in it.
    reach : float

    Returns
    -------
    Box or None
        SI.
    str
        How it was proven, or why there is none: words that end a sentence.
    """
    if against := _cannot(model):
        return None, against
    box = _largest(model, reach)
    if box is not None:
        box = box_of_responses(model.links, box)
    if box is None:
        return None, "the bounds on the faces of the box of factors leave room for no box of responses"
    return box, PROVEN


def _largest(model: "Surrogate", reach: float) -> Box | None:
    """The largest box of responses by the faces of centred boxes: halved until there is one, then by hill climbing."""
    at, tries = reach, 1
    box, size = _box_on(model, at)
    while box is None and tries < MOST_BOXES and not model.is_affine:
        at, tries = 0.5 * at, tries + 1
        box, size = _box_on(model, at)
    for ratio in () if box is None or model.is_affine else (1.0 / SMALLER, SMALLER):
        while ratio * at <= reach:
            other, other_size = _box_on(model, ratio * at)
            if not other_size > size:
                break
            at, box, size = ratio * at, other, other_size
    return box


def _cannot(model: "Surrogate") -> str:
    n_responses, n_factors = len(model.responses), len(model.factors)
    if n_responses > n_factors:
        return (
            f"{n_responses} responses follow from {n_factors} factor{'s' * (n_factors > 1)}: they cannot be chosen "
            "independently of each other, so that no box of responses can be had"
        )
    if n_responses < n_factors:
        return f"{n_factors} factors give {n_responses} responses, so that no target has exactly one setting"
    still = [r.name for r, s in zip(model.responses, _moves(model), strict=True) if not s]
    if still:
        return f"{' and '.join(still)} does not move, so that no box of responses can be had"
    if not model.is_affine and tensor_size(model) > MOST_COEFFICIENTS:
        return "the model has too many factors and powers for a box of responses to be sought"
    return ""


def _moves(model: "Surrogate") -> list[bool]:
    return (model.coefficients[model.terms.degrees > 0] != 0.0).any(axis=0).tolist()


def _box_on(model: "Surrogate", reach: float) -> tuple[Box | None, float]:
    """The largest box that the faces at `reach` prove, and its log volume, of responses divided by their scale."""
    for rows in _choices(model, reach):
        if _regular(rows * model.scale):
            polytope = Polytope(np.vstack([-rows[0], rows[1]]), _rooms(model, rows, reach))
            if box := _inscribed(model, polytope):
                return box, float(np.log(np.ptp(np.array(box), axis=1) / model.scale).sum())
    return None, -np.inf


def _choices(model: "Surrogate", reach: float) -> Iterator[Floats]:
    """Rows aᵢ⁻ and aᵢ⁺, shape (2, n, n), best first: of the inverse of each face's mean Jacobian, or the centre's."""
    n = len(model.factors)
    centre = inverse_of_mean_slope(model, np.zeros((1, n)))
    if not model.is_affine:
        half = np.random.default_rng(0).uniform(-reach, reach, (32, n))
        rows = np.empty((2, n, n))
        for side, sign in enumerate((-1.0, 1.0)):
            for i in range(n):
                points = np.vstack([half, -half])
                points[:, i] = sign * reach
                rows[side, i] = inverse_of_mean_slope(model, points)[i]
        yield rows
    yield np.stack([centre, centre])


def _regular(rows: Floats) -> bool:
    """Whether every matrix with rows between the two given, shape (2, n, n) and rounded, is proven to be regular."""
    middle = rows.mean(axis=0)
    if not np.isfinite(middle).all() or not np.linalg.cond(middle) < MOST_CONDITION:
        return False
    slope = np.linalg.inv(middle)
    balls = [product(side, Ball(slope, np.zeros_like(slope)), entries=2.0 * UNIT) for side in rows]
    both = Ball(*(np.stack(parts, axis=2) for parts in zip(*balls, strict=True)))
    if not (np.isfinite(both.mid).all() and np.isfinite(both.rad).all()):
        return False
    off = np.abs(np.eye(len(slope))[:, :, None] - both.mid).max(axis=2)
    return contraction_rate(both, dominating(np.clip(off, 0.0, 1e12))) < 1.0


def _rooms(model: "Surrogate", rows: Floats, reach: float) -> Floats:
    """Lower bounds of ∓aᵢ∓ (f(x) − f(0)) on the faces xᵢ = ∓r, shape (2 n,), the faces at −r first."""
    n = len(model.factors)
    found = []
    for sign, side in zip((-1.0, 1.0), rows, strict=True):
        power = moving_part(model, sign * side)
        for i in range(n):
            row = Ball(power.mid[i], power.rad[i])
            found.append(lowest_affine(row, i, sign, reach) if model.is_affine else lowest_on_face(row, i, sign, reach))
    return np.array(found)


def _inscribed(model: "Surrogate", polytope: Polytope) -> Box | None:
    """The largest box in the polytope, in floats that are proven to lie in it."""
    if not (np.isfinite(polytope.room).all() and np.isfinite(polytope.sides).all()):
        return None
    found = largest_box(polytope.sides * model.scale, polytope.room)
    if found is None:
        return None
    constant = model.predict_coded(np.zeros((1, len(model.factors))))[0]
    middle, half = (part * model.scale for part in found)
    for less in (1e-12, 1e-9, 1e-6, 1e-3):
        low, high = (constant + (middle + sign * (1.0 - less) * half) for sign in (-1.0, 1.0))
        if (low < high).all() and _inside(polytope, constant, low, high):
            return tuple((float(a), float(b)) for a, b in zip(low, high, strict=True))
    return None


def _inside(polytope: Polytope, constant: Floats, low: Floats, high: Floats) -> bool:
    """Whether every corner of the box lies in the polytope, in exact arithmetic."""
    start = [Fraction(float(c)) for c in constant]
    ends = [[Fraction(float(v)) - s for v, s in zip(end, start, strict=True)] for end in (low, high)]
    for row, room in zip(polytope.sides, polytope.room, strict=True):
        worst = [
            max(Fraction(float(a)) * lower, Fraction(float(a)) * upper)
            for a, lower, upper in zip(row, *ends, strict=True)
        ]
        if sum(worst, Fraction(0)) > Fraction(float(room)):
            return False
    return True

"""All roots of a square polynomial map in the box, with proof: branch and prune on Taylor expansions.

On a part of the box with centre c and half-widths h, x = c + h u with |uᵢ| ≤ 1, and f(x) − y = Σ_β t_β u^β. With A the
inverse of the linear coefficients, A (f − y) = u + r + Σ_β w_β u^β, where r is constant and the w_β (β ≠ 0) are what is
left. Sums of |w_β| bound what the higher terms can do on the part grown s times, |uᵢ| ≤ s:

- no root in the part itself if |rᵢ| > 1 + Σ |w_βi| for some i; or if a constant t₀ outweighs all other t_β before A;
- exactly one in the grown part if u ↦ u − A (f − y) maps it into itself, |rᵢ| + Σ |w_βi| s^|β| < s, and is a
  contraction there, Σ |β| |w_βi| s^(|β|−1) < 1, for every i (Banach; Krawczyk, 1969, Computing 4, 187–201; Neumaier,
  1990, Interval Methods for Systems of Equations, ch. 5);
- else the part is halved along the factor that the w_β depend on most.

Growing the part (s = 1.5) is what makes the method end: a root on the border of two parts is found from both, and
counted once. Near regular roots one of the two tests succeeds when the parts are small enough; a singular root, such as
at a fold, stays undecided. Any A whatever is sound. Rounding is bounded as in :mod:`.enclosures`. Expanding a sparse
polynomial costs far less than a tensor of Bernstein coefficients where the factors are many.
"""

from dataclasses import dataclass
from itertools import product
from math import comb
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .derivatives import exponents_of
from .enclosures import ENLARGED, TINY, UNIT, Ball, Floats
from .multistart import inverses, newton

if TYPE_CHECKING:
    from .model import Surrogate

REACH = 1.0 + 2.0**-29
"""Half-width of the box that is searched: the domain and its tolerance of 1e-9, of few bits, to be halved exactly."""

GROWN = 1.5
"""Size of the part on which a root is proven, in that of the part that is searched."""

SMALLEST = 2.0**-20
"""Parts are not made smaller; centres and halves up to here are floats without rounding."""

PINNED = 2.0**-26
"""Half-width of the box in which a root is shut in, once it is found."""

ACCURACY = 1e-9
"""How well a root must be known, in coded units: as well as the border of the domain."""

MOST_TERMS = 2_000_000
"""Size of the matrix that expands the polynomial on one part, for which the search is tried."""

LARGEST = 4_000_000
"""Numbers in the largest array of one round."""


@dataclass(frozen=True)
class Roots:
    """Roots in the domain, and what is left open.

    Parameters
    ----------
    coded : ndarray, shape (n_found, n_factors)
        Each within 1e-9 of exactly one root that lies in the domain, to 1e-9; no two of the same.
    parts : int
        Parts of the box that were looked at.
    small : int
        Parts as small as they may be that stay undecided.
    left : int
        Parts that were not looked at when the search ended.
    """

    coded: Floats
    parts: int
    small: int
    left: int

    @property
    def complete(self) -> bool:
        """Whether it is proven that the domain holds no other root."""
        return self.small == 0 and self.left == 0


class _System(NamedTuple):
    """Σ_α coefficients_α x^α − target, responses scaled by powers of two, and the β ≤ α that expansions need.

    `lower` (n_lower, n_factors) begins with 0 and the n unit vectors; `wanted` is the target in SI.
    """

    exponents: NDArray[np.int64]
    lower: NDArray[np.int64]
    coefficients: Floats
    target: Floats
    wanted: Floats


class _Preconditioned(NamedTuple):
    """Constants r, a ball (n_parts, n), and sizes of the other coefficients w_β, (n_parts, n, n_lower), 0 for β = 0."""

    constant: Ball
    size: Floats


class _Tests(NamedTuple):
    """Per part: no root in it; exactly one in it grown; the factor to halve along, first choice last."""

    empty: NDArray[np.bool_]
    single: NDArray[np.bool_]
    order: NDArray[np.int64]


def size_of_expansion(model: "Surrogate") -> float:
    """Numbers in the matrix that expands the model on one part; an upper bound that costs nothing to compute."""
    exponents = exponents_of(model)
    return float(len(exponents)) * float(np.prod(exponents + 1.0, axis=1).sum())


def find_roots(model: "Surrogate", target: Floats, most_parts: int) -> Roots:
    """The settings in the domain whose responses are exactly `target`, of the model as its floats stand.

    Parameters
    ----------
    model : Surrogate
        As many responses as factors, all of which act; not larger than :data:`MOST_TERMS`.
    target : ndarray, shape (n_responses,)
        SI.
    most_parts : int
        Parts that are looked at before the search is given up.
    """
    system = _system(model, target)
    n = system.exponents.shape[1]
    batch = max(1, min(1024, LARGEST // (len(system.lower) * max(len(system.exponents), n))))
    middles, halves = np.zeros((1, n)), np.full((1, n), REACH)
    found, parts, small = np.empty((0, n)), 0, 0
    while len(middles) and parts < most_parts:
        take = min(batch, len(middles), most_parts - parts)
        # The last parts first: memory stays small, and roots are found early.
        middle, half, middles, halves = middles[-take:], halves[-take:], middles[:-take], halves[:-take]
        parts += take
        tests = _tested(system, middle, half)
        found, settled = _with_pinned(model, system, found, middle, half, tests.single & ~tests.empty)
        open_ = ~(tests.empty | settled)
        more, final = _halved(middle[open_], half[open_], tests.order[open_])
        small += final
        middles, halves = np.vstack([middles, more[0]]), np.vstack([halves, more[1]])
    inside = (np.abs(found) <= 1.0 + ACCURACY).all(axis=1)
    return Roots(found[inside], parts, small, len(middles))


def _system(model: "Surrogate", target: Floats) -> _System:
    exponents = exponents_of(model)
    n = exponents.shape[1]
    lower = {beta for alpha in exponents.tolist() for beta in product(*(range(a + 1) for a in alpha))}
    units = [tuple(row) for row in np.eye(n, dtype=int).tolist()]
    first = [(0,) * n, *units]
    rows = np.array(first + sorted(lower - set(first)), dtype=np.int64)
    power = np.exp2(-np.round(np.log2(model.scale)))
    used = model.coefficients[(model.coefficients != 0.0).any(axis=1)] * power
    with np.errstate(over="ignore"):
        scaled = target * power
    # Infinity proves nothing; this is as much out of reach as what overflowed.
    far = np.isinf(scaled) & (np.abs(used).sum(axis=0) < 1e299)
    return _System(exponents, rows, used, np.where(far, np.sign(scaled) * 1e300, scaled), target)


def _expanded(system: _System, middle: Floats, half: Floats) -> Ball:
    """Coefficients t_β on parts with centres and half-widths (n_parts, n); shape (n_parts, n_lower, n)."""
    parts, n = middle.shape
    matrix = np.ones((parts, len(system.lower), len(system.exponents)))
    for k in range(n):
        degree = int(system.exponents[:, k].max(initial=0))
        by_middle, by_half = (_powers(v[:, k], degree) for v in (middle, half))
        change = np.zeros((parts, degree + 1, degree + 1))
        for b in range(degree + 1):
            for a in range(b, degree + 1):
                change[:, b, a] = comb(a, b) * by_middle[a - b] * by_half[b]
        matrix *= change[:, system.lower[:, k, None], system.exponents[None, :, k]]
    mid = matrix @ system.coefficients
    size = np.abs(matrix) @ np.abs(system.coefficients)
    mid[:, 0] -= system.target
    size[:, 0] += np.abs(system.target)
    # An entry of the matrix is a product of at most as many factors as its term has degree, and of n binomials.
    steps = int(system.exponents.sum(axis=1).max(initial=0)) + 3 * n + len(system.exponents) + 2
    return Ball(mid, 2.0 * steps * UNIT * ENLARGED * size + TINY)


def _powers(values: Floats, degree: int) -> list[Floats]:
    powers = [np.ones_like(values)]
    for _ in range(degree):
        powers.append(powers[-1] * values)
    return powers


def _preconditioned(system: _System, taylor: Ball) -> _Preconditioned:
    n = system.exponents.shape[1]
    left = inverses(taylor.mid[:, 1 : n + 1].transpose(0, 2, 1))
    # Where there is no inverse, the system stays as it is.
    left[~(np.isfinite(left).all(axis=(1, 2)) & left.any(axis=(1, 2)))] = np.eye(n)
    spread = taylor.rad + 2.0 * (n + 2) * UNIT * np.abs(taylor.mid)
    mid = left @ taylor.mid.transpose(0, 2, 1)
    rad = (np.abs(left) @ spread.transpose(0, 2, 1)) * ENLARGED + TINY
    constant = Ball(mid[:, :, 0], rad[:, :, 0])
    mid[:, :, 1 : n + 1] -= np.eye(n)
    size = (np.abs(mid) * (1.0 + UNIT) + rad) * ENLARGED
    size[:, :, 0] = 0.0
    return _Preconditioned(constant, size)


def _tested(system: _System, middle: Floats, half: Floats) -> _Tests:
    with np.errstate(over="ignore", invalid="ignore"):  # what is not finite passes no test
        taylor = _expanded(system, middle, half)
        found = _preconditioned(system, taylor)
        others = (np.abs(taylor.mid) + taylor.rad)[:, 1:].sum(axis=1) * ENLARGED
        away = np.abs(taylor.mid[:, 0]) - taylor.rad[:, 0] * ENLARGED > others * ENLARGED
        outside = np.abs(found.constant.mid) - found.constant.rad * ENLARGED > (1.0 + found.size.sum(axis=2)) * ENLARGED
        single, _ = _one_root(system, found, GROWN)
        curved = found.size * (system.lower.sum(axis=1) > 1)
        pull = np.einsum("pib,bk->pik", curved, system.lower).max(axis=1)
    pull = np.where(np.isfinite(pull), pull, np.inf)
    return _Tests((away | outside).any(axis=1), single, np.lexsort((half, pull), axis=1))


def _one_root(system: _System, found: _Preconditioned, reach: float) -> tuple[NDArray[np.bool_], Floats]:
    """Whether exactly one root has |uᵢ| ≤ `reach`, and then a bound on its |uᵢ|, shape (n_parts, n)."""
    degree = system.lower.sum(axis=1)
    grown = float(reach) ** degree
    bound = (np.abs(found.constant.mid) + found.constant.rad + found.size @ grown) * ENLARGED
    rate = found.size @ (degree * float(reach) ** np.maximum(degree - 1, 0)) * ENLARGED
    return ((bound < reach) & (rate < 1.0)).all(axis=1), bound


def _with_pinned(
    model: "Surrogate", system: _System, found: Floats, middle: Floats, half: Floats, single: NDArray[np.bool_]
) -> tuple[Floats, NDArray[np.bool_]]:
    """Roots of the parts that hold one, added to those found before; and of which parts that succeeded.

    A root is accepted if boxes of half-width ``PINNED`` and four times that about its float hold exactly one, the
    former lies in the grown part, and the root is known to ``ACCURACY``. Of two such floats at most 2 ``PINNED`` apart,
    the box of the second is within the larger box of the first: the root is the same. Of others the boxes are disjoint.
    """
    settled = single.copy()
    at = np.flatnonzero(single)
    if not at.size:
        return found, settled
    coded = newton(model, np.tile(system.wanted, (at.size, 1)), middle[at])
    usable = np.isfinite(coded).all(axis=1)
    coded[~usable] = 0.0
    pinned = _preconditioned(system, _expanded(system, coded, np.full_like(coded, PINNED)))
    tight, bound = _one_root(system, pinned, 1.0)
    alone, _ = _one_root(system, pinned, 4.0)
    within = (np.abs(coded - middle[at]) + PINNED <= GROWN * half[at] / ENLARGED).all(axis=1)
    known = (bound * PINNED <= ACCURACY).all(axis=1)
    good = usable & tight & alone & within & known
    settled[at] = good
    for row in coded[good]:
        if not (np.abs(found - row).max(axis=1, initial=0.0) <= 2.0 * PINNED * ENLARGED).any():
            found = np.vstack([found, row])
    return found, settled


def _halved(middle: Floats, half: Floats, order: NDArray[np.int64]) -> tuple[tuple[Floats, Floats], int]:
    """The parts, each in two halves; and how many were too small to be halved."""
    if not len(middle):
        return (middle, half), 0
    rows = np.arange(len(middle))
    can = np.take_along_axis(half, order, axis=1) > SMALLEST
    pick = order.shape[1] - 1 - np.argmax(can[:, ::-1], axis=1)
    axis, possible = order[rows, pick], can.any(axis=1)
    middle, half, axis, rows = middle[possible], half[possible].copy(), axis[possible], np.arange(int(possible.sum()))
    half[rows, axis] *= 0.5
    lower, upper = middle.copy(), middle.copy()
    lower[rows, axis] -= half[rows, axis]
    upper[rows, axis] += half[rows, axis]
    return (np.vstack([lower, upper]), np.vstack([half, half])), int((~possible).sum())

"""Proof that a polynomial map takes no value twice in a box, by subdivision; no sampling decides anything.

With a constant matrix A and M(x) = A J(x), the map is injective on the box if one of these holds:

- ``contraction``: in one norm max |xᵢ|/vᵢ, ‖I − M(x)‖ ≤ q < 1 for every x. Then A f is the identity less a
  contraction.
- ``positive definite``: M(x) + M(x)ᵀ, in coordinates scaled by powers of two, is positive definite for every x (the
  box being convex).
- ``P-matrix``: every principal minor of every M(x) is positive (Gale and Nikaido, 1965, "The Jacobian matrix
  and global univalence of mappings", Math. Ann. 159, 81–93). Both conditions above imply it, also each on a
  part of the box and with a norm of its own, and that is how it is checked.

On a part of the box, M(x) is a convex combination of its control matrices (Bernstein coefficients), and the
first two conditions pass from matrices to their convex combinations: it suffices to look at those.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from .enclosures import ENLARGED, TINY, UNIT, Ball, Floats, control

MOST_PARTS = 2000
"""Parts of the box that are looked at before a proof is given up."""


@dataclass(frozen=True)
class Proof:
    """Why a map is injective.

    Parameters
    ----------
    method : str
        ``"contraction"``, ``"positive definite"`` or ``"P-matrix"``.
    rate : float or None
        q, for a contraction.
    weights : ndarray or None, shape (n,)
        v, for a contraction.
    parts : int
        Parts of the box that were looked at.
    """

    method: str
    rate: float | None
    weights: Floats | None
    parts: int


def prove(matrix: Ball, reach: float = 1.0, most_parts: int = MOST_PARTS) -> Proof | None:
    """Proof that the map with derivative A⁻¹ `matrix` is injective on the box |xᵢ| ≤ `reach`; None if none is found.

    Parameters
    ----------
    matrix : Ball, shape (n, n, d₁ + 1, …)
        Power coefficients of M(x).
    reach : float
    most_parts : int
    """
    n = matrix.mid.shape[0]
    box = np.full(n, -reach), np.full(n, reach)
    whole = control(matrix, *box)
    if not (np.isfinite(whole.mid).all() and np.isfinite(whole.rad).all()):
        return None
    weights = dominating(_largest(whole))
    rates, parts = _subdivided(matrix, box, lambda part: contraction_rate(part, weights), most_parts)
    if rates is not None:
        return Proof("contraction", max(rates), weights, parts)
    matrix = _balanced(matrix, weights)
    found, parts = _subdivided(matrix, box, lambda part: 0.0 if is_definite(part) else 1.0, most_parts)
    if found is not None:
        return Proof("positive definite", None, None, parts)
    found, parts = _subdivided(matrix, box, _p_matrix, most_parts)
    return None if found is None else Proof("P-matrix", None, None, parts)


def contraction_rate(part: Ball, weights: Floats) -> float:
    """Bound on ‖I − M‖ in the norm with `weights` over the convex hull of control matrices, shape (n, n, n_control)."""
    rows = np.einsum("ijb,j->ib", _off_identity(part), weights)
    return float((rows.max(axis=1) / weights).max() * ENLARGED)


def is_definite(part: Ball) -> bool:
    """Whether the symmetric part of every control matrix is proven to be positive definite.

    A congruence QᵀSQ brings it near a diagonal; there Gershgorin's circles decide.
    """
    symmetric = 0.5 * (part.mid + part.mid.transpose(1, 0, 2))
    rad = ENLARGED * (0.5 * (part.rad + part.rad.transpose(1, 0, 2)) + UNIT * np.abs(symmetric)) + TINY
    if not (np.isfinite(symmetric).all() and np.isfinite(rad).all()):
        return False
    n = len(symmetric)
    turn = np.linalg.eigh(symmetric.mean(axis=2))[1]
    near = np.einsum("ki,klb,lj->ijb", turn, symmetric, turn, optimize=True)
    sizes = np.einsum(
        "ki,klb,lj->ijb", np.abs(turn), rad + 4.0 * (n + 2) * UNIT * np.abs(symmetric), np.abs(turn), optimize=True
    )
    sizes = sizes * ENLARGED + TINY
    circles = (np.abs(near) + sizes).sum(axis=1) * ENLARGED
    own = np.einsum("iib->ib", near), np.einsum("iib->ib", np.abs(near) + sizes), np.einsum("iib->ib", sizes)
    # Lower bound of the diagonal less all else in its row; the row's own entry is in the sum of sizes.
    return bool((own[0] - own[2] - (circles - own[1] / ENLARGED) * ENLARGED > TINY).all())


def dominating(deviation: Floats) -> Floats:
    """Positive weights that make the row sums of a non-negative matrix about as even as can be (Perron's vector)."""
    values, vectors = np.linalg.eig(deviation + 1e-6 * (deviation.max() + 1e-3))
    weights = np.abs(np.real(vectors[:, np.argmax(np.real(values))]))
    return np.maximum(weights / weights.max(), 1e-6)


def _balanced(matrix: Ball, weights: Floats) -> Ball:
    """M in coordinates x/w, w the powers of two nearest to `weights`: exact, as only exponents of the floats change."""
    w = np.exp2(np.round(np.log2(weights)))
    change = (w[None, :] / w[:, None]).reshape(*matrix.mid.shape[:2], *([1] * (matrix.mid.ndim - 2)))
    return Ball(matrix.mid * change, matrix.rad * change + TINY)


def _p_matrix(part: Ball) -> float:
    if not (np.isfinite(part.mid).all() and np.isfinite(part.rad).all()):
        return 1.0
    weights = dominating(_largest(part))
    return 0.0 if contraction_rate(part, weights) < 1.0 or is_definite(part) else 1.0


def _off_identity(part: Ball) -> Floats:
    return (np.abs(np.eye(len(part.mid))[:, :, None] - part.mid) + part.rad) * ENLARGED + TINY


def _largest(part: Ball) -> Floats:
    return np.clip(_off_identity(part).max(axis=2), 0.0, 1e12)


def _subdivided(
    matrix: Ball, box: tuple[Floats, Floats], bound: Callable[[Ball], float], most_parts: int
) -> tuple[list[float] | None, int]:
    """`bound` on parts of the box, all below 1; None if a part fails that cannot be mended, or there are too many."""
    waiting, rates, parts = [box], [], 0
    while waiting:
        low, high = waiting.pop()
        parts += 1
        part = control(matrix, low, high)
        rate = bound(part)
        if rate < 1.0:
            rates.append(rate)
            continue
        middle = 0.5 * (low + high)
        if parts >= most_parts or not bound(control(matrix, middle, middle)) < 1.0:
            return None, parts
        axis = _steepest(matrix, part)
        lower, upper = high.copy(), low.copy()
        lower[axis] = upper[axis] = middle[axis]
        waiting += [(low, lower), (upper, high)]
    return rates, parts


def _steepest(matrix: Ball, part: Ball) -> int:
    """The factor along which the control matrices change most."""
    degrees = matrix.mid.shape[2:]
    table = part.mid.reshape(*part.mid.shape[:2], *degrees)
    change = [
        float(np.abs(np.diff(table, axis=2 + k)).sum(axis=2 + k).max()) if d > 1 else -1.0
        for k, d in enumerate(degrees)
    ]
    return int(np.argmax(change))

"""How fast the inverse of a certified model converges, for every target that the domain can give."""

from dataclasses import dataclass
from math import ceil, log
from typing import TYPE_CHECKING

import numpy as np

from .derivatives import curvature_bound, inverse_of_mean_slope
from .enclosures import ENLARGED, Floats
from .injectivity import Proof

if TYPE_CHECKING:
    from .model import Surrogate

TOLERANCE = 1e-9
"""Distance in coded settings at which the steps are counted to."""

MOST_STEPS = 60


@dataclass(frozen=True)
class Convergence:
    """Steps that suffice for every reachable target.

    Parameters
    ----------
    chord : int or None
        Steps x ← x − A (f(x) − y) with A the (pseudo-)inverse of the Jacobian at the centre; None if the proof
        took another matrix, which a reader of the certificate would not have.
    newton : int or None
        Newton steps; None if the bounds promise no convergence from the centre, or the map is not square.
    condition : float or None
        Bound on the condition number of the scaled map in the maximum norm, on the whole domain; None if the map
        is not square.
    """

    chord: int | None
    newton: int | None
    condition: float | None


def convergence(model: "Surrogate", left: Floats, proof: Proof) -> Convergence | None:
    """Bounds that follow from a proof by contraction with the matrix `left`; None from any other proof.

    Notes
    -----
    Let ‖x‖ = max |xᵢ|/vᵢ, e the distance from the solution x*, which lies in the domain, and q the rate of the
    proof. A chord step multiplies e by q at most. A Newton step leaves (A J(x))⁻¹ ∫ (A J(x) − A J(x* + t(x − x*)))
    (x − x*) dt, at most L/(2(1 − q)) e² and at most 2q/(1 − q) e, with L a Lipschitz constant of A J. Clipping x to
    the domain moves no setting away from x*. At the centre e is at most max 1/vᵢ.
    """
    if proof.rate is None or proof.weights is None:
        return None
    q, v = proof.rate, proof.weights
    start = float((1.0 / v).max() * ENLARGED)
    wanted = TOLERANCE / float(v.max())
    chord: int | None = 1 if q == 0.0 else max(1, ceil(log(wanted / start) / log(q) * ENLARGED))
    if not np.array_equal(left, inverse_of_mean_slope(model, np.zeros((1, len(model.factors))))):
        chord = None
    if len(model.responses) != len(model.factors):
        return Convergence(chord, None, None)
    square = curvature_bound(model, left, v) / (2.0 * (1.0 - q)) * ENLARGED
    slow = 2.0 * q / (1.0 - q) * ENLARGED
    error, newton = start, 0
    while wanted < error <= start and newton < MOST_STEPS:
        error = min(square * error**2, slow * error) * ENLARGED
        newton += 1
    return Convergence(chord, newton if error <= wanted else None, _condition(model, left, proof))


def _condition(model: "Surrogate", left: Floats, proof: Proof) -> float:
    """‖J‖ ‖J⁺‖ in the maximum norm, responses divided by their scale; A of the proof bounds J⁺ = (A J)⁻¹ A."""
    assert proof.rate is not None
    assert proof.weights is not None
    exponents = np.array(model.terms.exponents).reshape(len(model.terms), len(model.factors))
    slopes = (exponents.sum(axis=1)[:, None] * np.abs(model.coefficients)).sum(axis=0) / model.scale
    inverse = float(np.abs(left * model.scale).sum(axis=1).max()) / (1.0 - proof.rate)
    return float(slopes.max() * inverse * proof.weights.max() / proof.weights.min() * ENLARGED)

"""What may be claimed of a model's inverse, and why."""

from dataclasses import dataclass, replace
from enum import StrEnum
from typing import TYPE_CHECKING

import numpy as np

from .convergence import TOLERANCE, Convergence, convergence
from .derivatives import MOST_COEFFICIENTS, exponents_of, inverse_of_mean_slope, jacobian_tensor, tensor_size
from .enclosures import Floats
from .injectivity import Proof, prove
from .inversion import obstacle
from .reachable import Box, response_box
from .refutation import refute

if TYPE_CHECKING:
    from .model import Surrogate

MARGIN = 1e-10
"""Smallest ratio of singular values that is called full rank: far above rounding, far below use."""

FINEST = 2.0**-7
"""To this fraction of the box the largest certified sub-box is sought."""

FEW_PARTS = 40
"""Parts that the proof on one sub-box may take."""

CLAIM = (
    "no two settings in the domain have the same responses (the model is injective there), and the Jacobian is of full "
    "rank everywhere in it"
)


class Verdict(StrEnum):
    """Whether the claim holds on the whole domain."""

    CERTIFIED = "certified"
    REFUTED = "refuted"
    UNDECIDED = "undecided"


@dataclass(frozen=True)
class Certificate:
    """A stated claim about a surrogate, with its verdict.

    Parameters
    ----------
    claim : str
        What is claimed, on the box of the factors' ranges.
    verdict : Verdict
    method : str
        How it was checked.
    condition : float or None
        Condition number of the map from coded factors to scaled responses: in the Euclidean norm where the
        map is affine; else a bound in the maximum norm, on the whole domain, if a contraction was proven.
    witness : tuple of float
        For ``refuted``, of an affine model: a direction in coded factors along which no response changes. Of any
        other: the coded points that show it, one after the other.
    reason : str
        One sentence for a reader.
    contraction : float or None
        Rate of a contraction that is the same as inverting: every chord step brings the settings nearer by it.
    chord_iterations, newton_iterations : int or None
        Steps that suffice for every reachable target, from the centre of the domain and each step clipped to the
        domain, until every coded setting is within 1e-9 of the exact one. Chord steps are with the (pseudo-)inverse
        of the Jacobian at the centre.
    sub_box : float or None
        Where the claim is not certified: it is on the centred box of this fraction of the ranges.
    factor_box : tuple of (float, float) or None
        Low and high of each factor, in its unit, of the box on which the claim is proven: the whole domain or that
        fraction of it; None where it is proven on none.
    response_box : tuple of (float, float) or None
        Low and high of each response, SI: every target in here has exactly one setting in `factor_box`. None where
        no such box was found.
    box_reason : str
        How that was proven, or why there is no such box. Empty in models written before there were any.
    """

    claim: str
    verdict: Verdict
    method: str
    condition: float | None
    witness: tuple[float, ...]
    reason: str
    contraction: float | None = None
    chord_iterations: int | None = None
    newton_iterations: int | None = None
    sub_box: float | None = None
    factor_box: Box | None = None
    response_box: Box | None = None
    box_reason: str = ""


def certify(model: "Surrogate") -> Certificate:
    """Whether no two settings in the domain have the same responses.

    For an affine model this is a question of rank. For any other it is proven by subdivision with bounds on
    every rounding error (:mod:`.injectivity`), or refuted by a witness that was checked in exact arithmetic
    (:mod:`.refutation`), or left undecided. Sampling proves nothing and decides nothing. Where the claim is
    proven, a box of responses is sought in which every target can be had (:mod:`.reachable`).
    """
    found = _certify_affine(model) if model.is_affine else _certify_curved(model)
    if found.verdict is not Verdict.CERTIFIED and (against := obstacle(model)):
        found = replace(found, reason=f"{found.reason}; it has no inverse: {against}")
    return _with_boxes(model, found)


def _with_boxes(model: "Surrogate", found: Certificate) -> Certificate:
    reach = 1.0 if found.verdict is Verdict.CERTIFIED else found.sub_box
    if reach is None:
        return replace(found, box_reason="the claim is proven on no box of factors")
    half = reach * model.factors.half_range
    ends = np.column_stack([model.factors.centre - half, model.factors.centre + half])
    if reach == 1.0:  # the ranges themselves, not what is left of them by rounding
        ends = np.array([(f.low, f.high) for f in model.factors])
    box, reason = response_box(model, reach)
    return replace(found, factor_box=tuple((float(a), float(b)) for a, b in ends), response_box=box, box_reason=reason)


def _certify_curved(model: "Surrogate") -> Certificate:
    acting = exponents_of(model).max(axis=0, initial=0) > 0
    if not acting.all():
        inert = [name for name, acts in zip(model.factors.names, acting, strict=True) if not acts]
        return _refuted(
            "terms of the model",
            np.eye(len(acting))[~acting][:1],
            f"no response depends on {' or '.join(inert)}, so that many settings give one response",
        )
    if len(model.responses) < len(model.factors):
        slope = model.jacobian_coded(np.zeros((1, len(model.factors))))[0] / model.scale[:, None]
        return _refuted(
            "invariance of domain",
            np.linalg.svd(slope)[2][-1:],
            "there are fewer responses than factors, so that many settings give one response; along the witness "
            "direction none changes at the centre",
        )
    if found := refute(model):
        part = _largest_sub_box(model)
        return _refuted("exact rational arithmetic", found.points, found.reason + _within(part), part)
    if tensor_size(model) > MOST_COEFFICIENTS:
        return _undecided("the model has too many factors and powers for the proof to be tried", None)
    left, proof = _proof(model)
    if proof is None:
        part = _largest_sub_box(model)
        return _undecided(f"neither a proof nor a witness against it was found{_within(part)}", part)
    return _certified(proof, convergence(model, left, proof))


def _certify_affine(model: "Surrogate") -> Certificate:
    scaled = model.jacobian_coded(np.zeros((1, len(model.factors))))[0] / model.scale[:, None]
    _, singular, directions = np.linalg.svd(scaled)
    method = "singular values of the constant Jacobian"
    if len(singular) < scaled.shape[1] or singular[-1] <= MARGIN * singular[0]:
        return _refuted(
            method,
            directions[-1:],
            "responses do not change along the witness direction, so many settings give one response; "
            "the inverse returns one of them",
        )
    condition = float(singular[0] / singular[-1])
    of_what = "" if model.is_affine_map else " in the logarithms of responses"
    reason = (
        f"the model is affine{of_what} with full column rank (condition number {condition:.3g}): "
        f"its inverse is one matrix product{of_what and ' of them'}"
    )
    return Certificate(CLAIM, Verdict.CERTIFIED, method, condition, (), reason)


def _certified(proof: Proof, found: Convergence | None) -> Certificate:
    parts = "the whole box" if proof.parts == 1 else f"{proof.parts} parts of the box"
    reason = f"the derivative, made near the identity by a constant matrix, was enclosed on {parts} and is "
    if found is None:
        kind = "positive definite" if proof.method == "positive definite" else "a P-matrix"
        return Certificate(
            CLAIM, Verdict.CERTIFIED, f"Bernstein enclosure, {proof.method}", None, (), f"{reason}{kind} everywhere"
        )
    steps = (("Newton", found.newton), ("chord", found.chord))
    counted = " or ".join(f"{count} {kind} steps" for kind, count in steps if count is not None)
    told = [f"{reason}within {proof.rate:.3g} of it everywhere"]
    if counted:
        told.append(f"from the centre, {counted} give every reachable target to {TOLERANCE:g} of the half-ranges")
    if found.condition is not None:
        told.append(f"the condition number is at most {found.condition:.3g}")
    return Certificate(
        CLAIM,
        Verdict.CERTIFIED,
        f"Bernstein enclosure, {proof.method}",
        found.condition,
        (),
        "; ".join(told),
        proof.rate,
        found.chord,
        found.newton,
    )


def _refuted(method: str, points: Floats, reason: str, part: float | None = None) -> Certificate:
    witness = tuple(float(v) for v in np.ravel(points))
    return Certificate(CLAIM, Verdict.REFUTED, method, None, witness, reason, sub_box=part)


def _undecided(reason: str, part: float | None) -> Certificate:
    return Certificate(CLAIM, Verdict.UNDECIDED, "Bernstein enclosure", None, (), reason, sub_box=part)


def _within(part: float | None) -> str:
    return "" if part is None else f"; on the centred box of {part:.3g} of the ranges the claim is proven"


def _proof(model: "Surrogate", reach: float = 1.0, **limit: int) -> tuple[Floats, Proof | None]:
    """A proof with the inverse of the centre's Jacobian as constant matrix, or that of the mean Jacobian."""
    left = np.zeros((len(model.factors), len(model.responses)))
    corners = np.random.default_rng(0).uniform(-reach, reach, (64, len(model.factors)))
    for points in (np.zeros((1, len(model.factors))), np.vstack([corners, -corners])):
        left = inverse_of_mean_slope(model, points)
        if np.isfinite(left).all() and (proof := prove(jacobian_tensor(model, left), reach, **limit)):
            return left, proof
    return left, None


def _largest_sub_box(model: "Surrogate") -> float | None:
    """Fraction of the ranges of the largest centred box, to a grid, on which the claim can be proven."""
    if tensor_size(model) > MOST_COEFFICIENTS:
        return None
    low, high = 0.0, 1.0
    while high - low > FINEST:
        middle = 0.5 * (low + high)
        if _proof(model, middle, most_parts=FEW_PARTS)[1]:
            low = middle
        else:
            high = middle
    return low or None

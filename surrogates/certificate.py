"""What may be claimed of a model's inverse, and why."""

from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING

import numpy as np

from .inversion import obstacle

if TYPE_CHECKING:
    from .model import Surrogate

MARGIN = 1e-10
"""Smallest ratio of singular values that is called full rank: far above rounding, far below use."""


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
        Condition number of the map from coded factors to scaled responses, if it is constant.
    witness : tuple of float
        For ``refuted``: a direction in coded factors along which no response changes.
    reason : str
        One sentence for a reader.
    """

    claim: str
    verdict: Verdict
    method: str
    condition: float | None
    witness: tuple[float, ...]
    reason: str


def certify(model: "Surrogate") -> Certificate:
    """Whether no two settings in the domain have the same responses.

    For an affine model this is a question of rank and is decided. For any other model this version
    decides nothing and says so: sampling would not be a proof.
    """
    claim = "no two settings in the domain have the same responses (the model is injective there)"
    if not model.is_affine:
        against = obstacle(model)
        how = (
            f"it has no inverse: {against}"
            if against
            else ("its inverse is iterative and every answer is checked against the model")
        )
        return Certificate(
            claim,
            Verdict.UNDECIDED,
            "none",
            None,
            (),
            f"the model has terms above degree one, for which injectivity is not proven here; {how}",
        )
    scaled = model.jacobian_coded(np.zeros((1, len(model.factors))))[0] / model.scale[:, None]
    _, singular, directions = np.linalg.svd(scaled)
    method = "singular values of the constant Jacobian"
    if len(singular) < scaled.shape[1] or singular[-1] <= MARGIN * singular[0]:
        return Certificate(
            claim,
            Verdict.REFUTED,
            method,
            None,
            tuple(float(v) for v in directions[-1]),
            "responses do not change along the witness direction, so many settings give one response; "
            "the inverse returns one of them",
        )
    condition = float(singular[0] / singular[-1])
    return Certificate(
        claim,
        Verdict.CERTIFIED,
        method,
        condition,
        (),
        f"the model is affine with full column rank (condition number {condition:.3g}): "
        "its inverse is one matrix product",
    )

"""Targets of an inverse that it must reach: settings of least norm that give them lie in the domain."""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from .base import Reference

if TYPE_CHECKING:
    from ...model import Surrogate


def targets(model: "Surrogate", known: Reference) -> NDArray[np.float64]:
    """Responses at the reference points, shape (n, n_responses), SI.

    Where several settings give one response an affine inverse takes those of least coded norm, and refuses if they lie
    outside. There the points are first drawn into the ball in the box: what is shorter lies in it, too.
    """
    if not model.is_affine:
        return known.responses
    centre = np.zeros((1, len(model.factors)))
    slope = model.jacobian_coded(centre)[0] / model.scale[:, None]
    if np.linalg.matrix_rank(slope) == len(model.factors):
        return known.responses
    coded = model.factors.code(known.settings)
    norm = np.linalg.norm(coded, axis=1, keepdims=True)
    return model.predict(model.factors.decode(coded / np.maximum(norm, 1.0)))

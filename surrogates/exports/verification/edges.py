"""Settings just inside and just outside the domain's faces: where a wrong domain check shows."""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from ...model import Surrogate

NEAR = 1e-6
"""How far from a face, in coded units: well beyond the tolerance of the check."""


def at_faces(model: "Surrogate") -> NDArray[np.float64]:
    """Centres of all faces moved in and out by :data:`NEAR`, shape (4 n_factors, n_factors), the factors' units."""
    k = len(model.factors)
    reach = np.array([1.0 - NEAR, 1.0 + NEAR, -1.0 + NEAR, -1.0 - NEAR])
    return model.factors.decode(np.vstack([r * np.eye(k) for r in reach]))

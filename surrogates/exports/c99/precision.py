"""What differs between the double and the single-precision C: types, and how near is near enough."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ...inversion import BOX_TOLERANCE, TARGET_TOLERANCE
from ..inverse_plan import STILL, STILL_CERTIFIED
from .printing import DOUBLE as DOUBLE_TEXT
from .printing import SINGLE as SINGLE_TEXT
from .printing import Printer

if TYPE_CHECKING:
    from ...model import Surrogate

EPS = float(np.finfo(np.float32).eps)


@dataclass(frozen=True)
class Precision:
    """Tolerances of one precision.

    Parameters
    ----------
    printer : Printer
    ending : str
        Of the prefix, so that both variants can be linked into one program.
    box : float
        How far beyond ±1 a coded setting counts as inside.
    target : float
        Largest mismatch of a reached target, in units of the scale.
    still, still_certified : float
        Coded steps that count as none; the latter where convergence is known to be quadratic.
    near : float
        Coded Newton step after which one more step with the same slope leaves no more than rounding, where convergence
        is known to be quadratic.
    dependent : float
        Rows of the Jacobian whose square is less than this fraction of the longest are taken for combinations of
        others.
    lanes : tuple of int
        Numbers in a vector of SSE2 or NEON, and of AVX.
    agreement : float
        Largest difference from ``model.json``, relative to what the terms add up to.
    """

    printer: Printer
    ending: str
    box: float
    target: float
    still: float
    still_certified: float
    near: float
    dependent: float
    lanes: tuple[int, int]
    agreement: float


DOUBLE = Precision(DOUBLE_TEXT, "", BOX_TOLERANCE, TARGET_TOLERANCE, STILL, STILL_CERTIFIED, 1e-4, 1e-24, (2, 4), 1e-12)
SINGLE = Precision(SINGLE_TEXT, "_float", 1e-6, 1e-5, 1e-5, 1e-4, 3e-3, 1e-10, (4, 8), 1e-5)


def reach(model: "Surrogate") -> float:
    """Largest setting over half-range: what rounding of a setting is multiplied by in coded units."""
    factors = model.factors
    ends = np.maximum(np.abs([f.low for f in factors]), np.abs([f.high for f in factors]))
    return float((ends / factors.half_range).max())


def box(model: "Surrogate", precision: Precision) -> float:
    """How far from 0 a coded setting counts as inside; in single precision the ranges' own rounding may be more."""
    return 1.0 + max(precision.box, 4.0 * EPS * reach(model) if precision.ending else 0.0)


def tolerance(model: "Surrogate", precision: Precision) -> NDArray[np.float64]:
    """Largest mismatch of a reached target, link units, shape (n_responses,).

    In single precision no less than what rounding the settings and the target does.
    """
    rounding = np.zeros(len(model.responses))
    if precision.ending:
        constant = model.predict_coded(np.zeros((1, len(model.factors))))[0]
        rounding = 4.0 * EPS * (np.abs(constant) + reach(model) * model.scale)
    return precision.target * model.scale + rounding

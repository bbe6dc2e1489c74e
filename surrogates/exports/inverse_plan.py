"""The inverse as a controller runs it, in numbers: the same few steps in every language, none of them unbounded."""

from dataclasses import dataclass
from math import ceil, log
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..certificate import Verdict
from ..convergence import TOLERANCE
from ..inversion import BOX_TOLERANCE, TARGET_TOLERANCE, pseudo_inverse

if TYPE_CHECKING:
    from ..model import Surrogate

STILL = 1e-12
"""Largest coded step that counts as none. The error left is its square where the Jacobian is of full rank."""

STILL_CERTIFIED = 1e-8
"""The same where the certificate proves a contraction: convergence is quadratic, so that 1e-8 leaves some 1e-16."""

TRIED = 6
"""Newton steps that are tried before the chord steps, where the certificate counts only these."""

WELL = 1e6
"""Condition up to which answers come from the gain alone; beyond, steps on the residual correct its rounding."""

MOST_CHORDS = 1000
"""More are of no use in a controller: such a model is exported as one without certificate."""

CHORD_LEAVES = 1e-12
"""Coded error after the chord steps."""


@dataclass(frozen=True, eq=False)
class InversePlan:
    """What an exported inverse does with targets in link units (logarithms taken).

    1. Coded settings x = gain · (target − constant). If the plan is `affine`, these are the answer.
    2. Otherwise x is clipped to [−1, 1], and at most `steps` times: x moves by the Newton step (the Gauss–Newton step
       of least norm where the map is not square) and is clipped to [−limit, limit]; the iteration ends once no coded
       setting moved by `still`.
    3. If it did not end and there are `chords`: x begins again as in 2, and so many times moves by
       gain · (target − value at x) and is clipped.
    4. The answer must lie in the domain to `box`. Rounding beyond the ranges is taken off; it is good if the
       polynomials then give the target to `tolerance`. Anything else is refused with a status.

    Step 1 is the Newton step from the centre of the domain. C ends 2 sooner where the plan is `contracting`: after a
    small step with one more of the same slope, whose error is the product of both steps'.

    Parameters
    ----------
    affine : bool
        Whether step 1 is the answer: the model is affine and not nearly singular.
    gain : ndarray, shape (n_factors, n_responses)
        Pseudo-inverse of the Jacobian at the centre: coded settings per link unit.
    constant : ndarray, shape (n_responses,)
        Values at the centre, link units.
    steps : int
        Most steps after the first.
    limit : float
        Coded bound on the iterates: 1 where the certificate's count of steps asks for it.
    still : float
        In coded units.
    chords : int
        Chord steps after Newton steps that did not end; 0 where there is no need or no proof that they help.
    certified : bool
        Whether the steps suffice for every target that the domain can give, by the certificate's count.
    contracting : bool
        Whether also `gain` times the Jacobian is within a contraction of the identity on the whole domain, by the
        certificate: it is strictly diagonally dominant in weighted coordinates, and elimination needs no pivoting
        (Golub and Van Loan, 2013, "Matrix Computations", 4th ed., section 4.1.1).
    box : float
        How far beyond ±1 a coded setting may lie and count as inside.
    tolerance : ndarray, shape (n_responses,)
        Largest mismatch, link units.
    """

    affine: bool
    gain: NDArray[np.float64]
    constant: NDArray[np.float64]
    steps: int
    chords: int
    limit: float
    still: float
    certified: bool
    contracting: bool
    box: float
    tolerance: NDArray[np.float64]


def inverse_plan(model: "Surrogate", max_iterations: int) -> InversePlan:
    """The plan for `model`; `max_iterations` bounds the steps where no certificate does.

    A certificate counts the steps from the centre to 1e-9 of the half-ranges: there is one Newton step more than it
    counts, or chord steps to 1e-12.
    """
    centre = np.zeros((1, len(model.factors)))
    constant, slope = model.predict_coded(centre)[0], model.jacobian_coded(centre)[0]
    inverse, condition = pseudo_inverse(slope / model.scale[:, None])
    well = condition <= WELL
    newton, chords = _counted(model)
    affine, contracting = model.is_affine and (well or not np.isfinite(condition)), well and chords > 0
    return InversePlan(
        affine=affine,
        gain=inverse / model.scale,
        constant=constant,
        steps=0 if affine else newton or (TRIED if contracting else max_iterations),
        chords=chords if contracting and not newton else 0,
        limit=1.0 if newton or contracting else 2.0,
        still=STILL_CERTIFIED if contracting else STILL,
        certified=affine or (well and newton > 0) or contracting,
        contracting=contracting,
        box=BOX_TOLERANCE,
        tolerance=TARGET_TOLERANCE * model.scale,
    )


def _counted(model: "Surrogate") -> tuple[int, int]:
    """Newton steps and chord steps that the certificate counts for a curved square model; 0 where it counts none."""
    known = model.certificate
    if known is None or known.verdict is not Verdict.CERTIFIED:
        return 0, 0
    if model.is_affine or len(model.factors) != len(model.responses):
        return 0, 0
    chords = 0
    if known.chord_iterations and known.contraction is not None:
        further = log(CHORD_LEAVES / TOLERANCE) / log(known.contraction) if known.contraction else 1.0
        chords = known.chord_iterations + ceil(further)
    chords = chords if chords <= MOST_CHORDS else 0
    return known.newton_iterations or 0, chords

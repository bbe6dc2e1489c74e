"""How many settings may give one target: at most one, a continuum, or nobody knows without a search."""

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .enclosures import Floats

if TYPE_CHECKING:
    from .model import Surrogate

MARGIN = 1e-10
"""Ratio of singular values of a scaled map above which it has not lost rank: far above rounding, far below use."""

AT_END = 1e-9
"""Coded settings nearer than this to an end of their range are taken to lie on it."""

INWARD = 1e-6
"""Smallest component of a direction, itself of about length 1, that leads into the box."""


class Shape(NamedTuple):
    """Responses that move, those of them that are linearly independent as polynomials, and factors that act."""

    n_moving: int
    n_independent: int
    n_acting: int


def shape_of(model: "Surrogate") -> Shape:
    """How many responses follow from how many factors."""
    varying = model.terms.degrees > 0
    moving = model.coefficients[varying] / model.scale
    used = moving != 0.0
    exponents = np.array(model.terms.exponents).reshape(len(model.terms), len(model.factors))[varying]
    n_acting = int(exponents[used.any(axis=1)].any(axis=0).sum())
    return Shape(int(used.any(axis=0).sum()), int(_rank(moving[None])[0]), n_acting)


def at_most_one(model: "Surrogate") -> bool:
    """Whether no two settings in the domain are known to have the same responses: affine of full rank, or certified."""
    n = len(model.factors)
    # Factors may have been added since the certificate was given.
    if len(model.responses) < n or shape_of(model).n_acting < n:
        return False
    if model.is_affine:
        return bool(_rank(model.jacobian_coded(np.zeros((1, n))) / model.scale[:, None])[0] == n)
    # Named by its value: the module of certificates imports the inversion.
    return model.certificate is not None and model.certificate.verdict == "certified"


def in_continuum(model: "Surrogate", coded: Floats) -> NDArray[np.bool_]:
    """Where the settings with the same responses form a curve or a surface, by the theorem of implicit functions.

    That is so along a factor which does not act; and where fewer responses are independent than there are
    factors, are so to first order, and a direction that changes none of them leads into the box.

    Parameters
    ----------
    model : Surrogate
    coded : ndarray, shape (n, n_factors)

    Returns
    -------
    ndarray of bool, shape (n,)
        False where it could not be shown.
    """
    shape, n = shape_of(model), coded.shape[1]
    if shape.n_acting < n:
        return np.ones(len(coded), dtype=bool)
    if shape.n_independent >= n:
        return np.zeros(len(coded), dtype=bool)
    slopes = model.jacobian_coded(coded) / model.scale[:, None]
    inward = np.where(np.abs(coded) < 1.0 - AT_END, 0.0, -np.sign(coded))
    across = np.einsum("nkr,nrj,nj->nk", np.linalg.pinv(slopes, rcond=MARGIN), slopes, inward)
    leads = ((inward - across) * inward > INWARD) | (inward == 0.0)
    return (_rank(slopes) == shape.n_independent) & leads.all(axis=1)


def _rank(matrices: Floats) -> NDArray[np.int64]:
    singular = np.linalg.svd(matrices, compute_uv=False)
    largest = singular.max(axis=1, initial=0.0)
    return (singular > MARGIN * largest[:, None]).sum(axis=1)

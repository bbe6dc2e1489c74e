"""Polynomial surrogates: fitted from runs, checked on fresh ones, inverted, and taken elsewhere.

=====================  ================================================================
:mod:`.polynomial`     the scikit-learn estimator that fits one
:mod:`.selection`      penalty and terms by exact leave-one-out
:mod:`.model`          the frozen surrogate: predict, Jacobian, inverse
:mod:`.inversion`      from wanted responses to settings, or a refusal
:mod:`.certificate`    what may be claimed of the inverse
:mod:`.validation`     errors against fresh runs
:mod:`.round_trip`     wanted responses through the inverse and back through the oracle
:mod:`.artefact`       ``model.json``, read and written
:mod:`.exports`        code generated from the artefact alone
=====================  ================================================================

A surrogate loads and predicts with NumPy alone: no JAX, no pickle. The estimator is imported when
it is first asked for, so that :func:`load` costs no scikit-learn.
"""

from typing import TYPE_CHECKING, Any

from .artefact import dumps, load, loads
from .certificate import Certificate, Verdict, certify
from .inversion import AffineInverse, Inversion, InversionStatus, affine_inverse, affine_map, obstacle
from .model import Surrogate
from .round_trip import RoundTrip, round_trip
from .validation import ResponseError, errors

if TYPE_CHECKING:
    from .polynomial import PolynomialRegressor

__all__ = [
    "AffineInverse",
    "Certificate",
    "Inversion",
    "InversionStatus",
    "PolynomialRegressor",
    "ResponseError",
    "RoundTrip",
    "Surrogate",
    "Verdict",
    "affine_inverse",
    "affine_map",
    "certify",
    "dumps",
    "errors",
    "load",
    "loads",
    "obstacle",
    "round_trip",
]


def __getattr__(name: str) -> Any:
    if name == "PolynomialRegressor":
        from .polynomial import PolynomialRegressor

        return PolynomialRegressor
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")

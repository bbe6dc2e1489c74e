"""Polynomial surrogates: fitted from runs, checked on fresh ones, inverted, and taken elsewhere.

=======================================  =============================================================
:mod:`.polynomial`                       the scikit-learn estimator that fits one
:mod:`.choosing`, :mod:`.candidates`     one response: way of choosing terms, basis, degree
:mod:`.selection`, :mod:`.stepwise`,     terms by elimination, by entering, by other orders
:mod:`.paths`
:mod:`.evidence`, :mod:`.evidence_fit`   all terms at once, sized by maximum evidence
:mod:`.gradient_fit`                     derivatives taught on the forward path
:mod:`.basis`                            Legendre's and Chebyshev's polynomials, and back to monomials
:mod:`.model`                            the frozen surrogate: predict, Jacobian, inverse
:mod:`.domain`, :mod:`.intervals`        where settings lie; how far predictions may be off
:mod:`.inversion`, :mod:`.preimages`     from wanted responses to settings: one, or all with proof
:mod:`.certificate`, :mod:`.reachable`   what may be claimed of the inverse, and for which responses
:mod:`.commanding`                       a square model whose loads are given, for more responses than factors
:mod:`.validation`,                      errors against fresh runs, and against runs left out
:mod:`.cross_validation`
:mod:`.learning_curve`                   how an error falls with the runs, and how many would do
:mod:`.comparison`                        two models beside each other, and beside runs
:mod:`.round_trip`                       wanted responses through the inverse and back through the oracle
:mod:`.artefact`                         ``model.json``, read and written
:mod:`.exports`                          code generated from the artefact alone
=======================================  =============================================================

A surrogate loads and predicts with NumPy alone: no JAX, no pickle. The estimator is imported when
it is first asked for, so that :func:`load` costs no scikit-learn.
"""

from typing import TYPE_CHECKING, Any

from .artefact import dumps, load, loads
from .certificate import Certificate, Verdict, certify
from .commanding import commanding
from .cross_validation import cross_validate, leave_one_out
from .domain import Place
from .intervals import Interval
from .inversion import AffineInverse, Inversion, InversionStatus, affine_inverse, affine_map, obstacle
from .model import Surrogate
from .preimages import Preimages, preimages
from .round_trip import RoundTrip, round_trip
from .validation import ResponseError, errors

if TYPE_CHECKING:
    from .polynomial import PolynomialRegressor

__all__ = [
    "AffineInverse",
    "Certificate",
    "Interval",
    "Inversion",
    "InversionStatus",
    "Place",
    "PolynomialRegressor",
    "Preimages",
    "ResponseError",
    "RoundTrip",
    "Surrogate",
    "Verdict",
    "affine_inverse",
    "affine_map",
    "certify",
    "commanding",
    "cross_validate",
    "dumps",
    "errors",
    "leave_one_out",
    "load",
    "loads",
    "obstacle",
    "preimages",
    "round_trip",
]


def __getattr__(name: str) -> Any:
    if name == "PolynomialRegressor":
        from .polynomial import PolynomialRegressor

        return PolynomialRegressor
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")

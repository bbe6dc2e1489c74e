"""The frozen surrogate: polynomials in coded factors that predict, differentiate and invert."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from experiments.factors import FactorSpace
from experiments.runs import Response
from experiments.terms import Terms, model_matrix, model_matrix_gradient

from .certificate import Certificate
from .inversion import Inversion, invert
from .validation import ResponseError


@dataclass(frozen=True, eq=False)
class Surrogate:
    """A polynomial model of an oracle, valid in the box of its factors.

    Parameters
    ----------
    factors : FactorSpace
        n_factors factors with the ranges that bound the domain.
    responses : tuple of Response
        Length n_responses.
    terms : Terms
        Terms in coded factors, the union over the responses.
    coefficients : ndarray, shape (n_terms, n_responses)
        In the responses' SI units; zero where a response does not use a term.
    validation : tuple of ResponseError
        Errors on fresh runs, one per response; empty before validation.
    certificate : Certificate, optional
        What is claimed of the inverse.
    provenance : mapping
        Plain values that say where the model comes from.

    Raises
    ------
    ValueError
        If shapes or names disagree, or a coefficient is not finite.
    """

    factors: FactorSpace
    responses: tuple[Response, ...]
    terms: Terms
    coefficients: NDArray[np.float64]
    validation: tuple[ResponseError, ...] = ()
    certificate: Certificate | None = None
    provenance: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        coefficients = np.array(self.coefficients, dtype=np.float64)
        expected = (len(self.terms), len(self.responses))
        if coefficients.shape != expected:
            raise ValueError(f"coefficients must have shape {expected} (terms, responses); got {coefficients.shape}")
        if not np.isfinite(coefficients).all():
            raise ValueError("coefficients must be finite")
        if self.terms.names != self.factors.names:
            raise ValueError(f"the terms use the factors {self.terms.names}, the model has {self.factors.names}")
        coefficients.setflags(write=False)
        object.__setattr__(self, "coefficients", coefficients)

    @property
    def is_affine(self) -> bool:
        """Whether no term has a degree above one."""
        return bool((self.terms.degrees <= 1).all())

    @property
    def scale(self) -> NDArray[np.float64]:
        """Bound on how far each response moves from its constant, shape (n_responses,), SI; 1 where it does not move.

        The sum of the absolute coefficients: makes responses of different units comparable.
        """
        spread = np.abs(self.coefficients[self.terms.degrees > 0]).sum(axis=0)
        return np.where(spread > 0.0, spread, 1.0)

    def predict(self, X: ArrayLike) -> NDArray[np.float64]:
        """Responses at settings `X` (n, n_factors) in the factors' units, shape (n, n_responses), SI."""
        return self.predict_coded(self.factors.code(X))

    def jacobian(self, X: ArrayLike) -> NDArray[np.float64]:
        """d response / d factor at `X` (n, n_factors), shape (n, n_responses, n_factors), SI per factor unit."""
        return self.jacobian_coded(self.factors.code(X)) / self.factors.half_range

    def invert(self, Y: ArrayLike) -> Inversion:
        """Settings that give the responses `Y` (n, n_responses), each found or refused; see :func:`.invert`."""
        return invert(self, Y)

    def contains(self, X: ArrayLike) -> NDArray[np.bool_]:
        """Which settings lie in the domain, shape (n,)."""
        return self.factors.contains(X)

    def embed(self, space: FactorSpace) -> "Surrogate":
        """The same polynomial as a model of all factors of a larger `space`; those it adds have no terms.

        Raises
        ------
        ValueError
            If `space` lacks one of the factors, or has it in another unit or range: coded units would differ.
        """
        columns = [space.index(name) for name in self.factors.names]
        for factor, j in zip(self.factors, columns, strict=True):
            there = space.factors[j]
            if (there.unit, there.low, there.high) != (factor.unit, factor.low, factor.high):
                raise ValueError(f"factor {factor.name!r} has another unit or range in the larger space")
        exponents = np.zeros((len(self.terms), len(space)), dtype=int)
        exponents[:, columns] = np.reshape(self.terms.exponents, (len(self.terms), len(columns)))
        terms = Terms(space.names, tuple(map(tuple, exponents.tolist())))
        return replace(self, factors=space, terms=terms)

    def predict_coded(self, coded: ArrayLike) -> NDArray[np.float64]:
        """As :meth:`predict`, from coded settings."""
        with np.errstate(over="ignore", invalid="ignore"):  # far outside the domain a power may overflow
            return model_matrix(self.terms, coded) @ self.coefficients

    def jacobian_coded(self, coded: ArrayLike) -> NDArray[np.float64]:
        """As :meth:`jacobian`, from and by coded settings."""
        with np.errstate(over="ignore", invalid="ignore"):
            return np.einsum("npk,pr->nrk", model_matrix_gradient(self.terms, coded), self.coefficients)

    def terms_of(self, response: int) -> tuple[str, ...]:
        """Labels of the terms that the response at that position uses."""
        used = self.coefficients[:, response] != 0.0
        return tuple(label for label, u in zip(self.terms.labels, used, strict=True) if u)

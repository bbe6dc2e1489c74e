"""The frozen surrogate: polynomials in coded factors that predict, differentiate and invert.

A polynomial gives a response or its logarithm; the methods named ``…_coded``, `coefficients` and `scale` are in these
*link units* (:mod:`.links`), everything else is in the responses' SI units.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from experiments.factors import FactorSpace
from experiments.runs import Response
from experiments.terms import Terms, model_matrix, model_matrix_gradient

from .certificate import Certificate
from .domain import ROUNDING, guard, outside_sentence
from .intervals import half_widths
from .inversion import Inversion, invert
from .links import IDENTITY, chained, check_links, to_responses
from .preimages import MOST_PARTS, Preimages, preimages
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
        In link units: the responses' SI units, where they are not given by their logarithm; zero where a response
        does not use a term.
    validation : tuple of ResponseError
        Errors on fresh runs, one per response; empty before validation.
    certificate : Certificate, optional
        What is claimed of the inverse.
    provenance : mapping
        Plain values that say where the model comes from.
    standard_errors : ndarray, shape (n_terms, n_responses), optional
        Of the coefficients, in their units, the residuals of the fit being taken for noise; NaN where there were too
        few runs to tell. None where nothing is known, as in models written before they were kept.
    links : tuple of str
        ``"identity"`` or ``"log"`` for each response: whether the polynomial gives the response or
        ln(response / SI unit). All identity if not given.

    Raises
    ------
    ValueError
        If shapes or names disagree, a coefficient is not finite, a standard error is negative or infinite, or a link
        is unknown.
    """

    factors: FactorSpace
    responses: tuple[Response, ...]
    terms: Terms
    coefficients: NDArray[np.float64]
    validation: tuple[ResponseError, ...] = ()
    certificate: Certificate | None = None
    provenance: Mapping[str, Any] = field(default_factory=dict)
    standard_errors: NDArray[np.float64] | None = None
    links: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        coefficients = np.array(self.coefficients, dtype=np.float64, order="C")  # sums in one order: bit for bit
        expected = (len(self.terms), len(self.responses))
        if coefficients.shape != expected:
            raise ValueError(f"coefficients must have shape {expected} (terms, responses); got {coefficients.shape}")
        if not np.isfinite(coefficients).all():
            raise ValueError("coefficients must be finite")
        if self.terms.names != self.factors.names:
            raise ValueError(f"the terms use the factors {self.terms.names}, the model has {self.factors.names}")
        coefficients.setflags(write=False)
        object.__setattr__(self, "coefficients", coefficients)
        object.__setattr__(self, "links", check_links(self.links, len(self.responses)))
        if self.standard_errors is not None:
            object.__setattr__(self, "standard_errors", _checked_errors(self.standard_errors, expected))

    @property
    def is_affine(self) -> bool:
        """Whether no term has a degree above one; of responses given by their logarithm, these are affine."""
        return bool((self.terms.degrees <= 1).all())

    @property
    def is_affine_map(self) -> bool:
        """Whether the responses themselves are affine in the settings: no higher terms and no logarithms."""
        return self.is_affine and not self.has_logs

    @property
    def has_logs(self) -> bool:
        """Whether some response is given by its logarithm."""
        return any(link != IDENTITY for link in self.links)

    @property
    def scale(self) -> NDArray[np.float64]:
        """Bound on how far each polynomial moves from its constant, shape (n_responses,); 1 where it does not move.

        In link units. The sum of the absolute coefficients: makes responses of different units comparable.
        """
        spread = np.abs(self.coefficients[self.terms.degrees > 0]).sum(axis=0)
        return np.where(spread > 0.0, spread, 1.0)

    def predict(
        self, X: ArrayLike, outside: Literal["extrapolate", "nan", "refuse"] = "extrapolate"
    ) -> NDArray[np.float64]:
        """Responses at settings, shape (n, n_responses), SI.

        Parameters
        ----------
        X : array_like, shape (n, n_factors)
            Settings in the factors' units.
        outside : str
            What becomes of settings outside the domain, see :meth:`guard`. ``"extrapolate"``: the polynomial's
            value, of which no validation says anything. ``"nan"``: NaN in that row. ``"refuse"``: an error.

        Raises
        ------
        ValueError
            If `outside` is another word, or ``"refuse"`` and a setting lies outside: which, by what factor.
        """
        if outside not in ("extrapolate", "nan", "refuse"):
            raise ValueError(f"outside must be 'extrapolate', 'nan' or 'refuse', got {outside!r}")
        if outside == "refuse" and (why := outside_sentence(self.factors, X)):
            raise ValueError(f"{why}; keep to the ranges, or leave such rows out by outside='nan'")
        predicted = to_responses(self.links, self.predict_coded(self.factors.code(X)))
        if outside == "nan":
            predicted[~self.contains(X)] = np.nan
        return predicted

    def interval(
        self, X: ArrayLike, level: float = 0.95, outside: Literal["nan", "refuse"] = "refuse"
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Where each response lies with probability `level`, as (low, high), each (n, n_responses), SI.

        Predicted ± the half-width that fresh runs gave, the same everywhere in the domain: the probability is
        over settings drawn as those of the validation (uniform in the box, where the pipeline drew them) and for each
        response alone. It is not promised for one setting: near the corners errors tend to be larger.
        ``validation[j].intervals`` say on how many other fresh runs it held.

        Parameters
        ----------
        X : array_like, shape (n, n_factors)
            Settings in the factors' units.
        level : float
            One of the levels calibrated: 0.9, 0.95, 0.99, as far as there were runs enough.
        outside : str
            As in :meth:`predict`; nothing is known of errors outside the domain, so there is no extrapolation.

        Raises
        ------
        ValueError
            If no interval of that level was calibrated, `outside` is another word, or ``"refuse"`` and a setting lies
            outside.
        """
        if outside not in ("nan", "refuse"):
            raise ValueError(f"outside must be 'nan' or 'refuse' for an interval, got {outside!r}")
        half = half_widths([(e.response, e.n_runs, e.intervals) for e in self.validation], level)
        predicted = self.predict(X, outside)
        return predicted - half, predicted + half

    def jacobian(self, X: ArrayLike) -> NDArray[np.float64]:
        """d response / d factor at `X` (n, n_factors), shape (n, n_responses, n_factors), SI per factor unit."""
        coded = self.factors.code(X)
        slopes = self.jacobian_coded(coded) / self.factors.half_range
        return chained(self.links, self.predict(X), slopes) if self.has_logs else slopes

    def invert(self, Y: ArrayLike) -> Inversion:
        """Settings that give the responses `Y` (n, n_responses), each found or refused; see :func:`.invert`."""
        return invert(self, Y)

    def preimages(self, y: ArrayLike, most: int = MOST_PARTS) -> Preimages:
        """All settings that give the responses `y` (n_responses,), and whether that is proven: :func:`.preimages`."""
        return preimages(self, y, most)

    def contains(self, X: ArrayLike) -> NDArray[np.bool_]:
        """Which settings lie in the domain, shape (n,)."""
        return self.factors.contains(X)

    def guard(self, X: ArrayLike, margin: float = ROUNDING) -> NDArray[np.str_]:
        """Where settings lie, shape (n,): ``"inside"``, ``"edge"`` or ``"outside"``; see :func:`.guard`."""
        return guard(self.factors, X, margin)

    def embed(self, space: FactorSpace) -> "Surrogate":
        """The same polynomial as a model of all factors of a larger `space`; those it adds have no terms.

        Errors are kept, but not where the largest lay: the settings of the added factors are not known. A certificate
        is not: with a factor that does not act, many settings give one response.

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
        validation = tuple(replace(e, worst_point=()) for e in self.validation)
        certificate = self.certificate if space.names == self.factors.names else None
        return replace(self, factors=space, terms=terms, validation=validation, certificate=certificate)

    def predict_coded(self, coded: ArrayLike) -> NDArray[np.float64]:
        """Values in link units from coded settings, shape (n, n_responses): :meth:`predict` where no link is a log."""
        with np.errstate(over="ignore", invalid="ignore"):  # far outside the domain a power may overflow
            return model_matrix(self.terms, coded) @ self.coefficients

    def jacobian_coded(self, coded: ArrayLike) -> NDArray[np.float64]:
        """d value in link units / d coded setting, at coded settings, shape (n, n_responses, n_factors)."""
        with np.errstate(over="ignore", invalid="ignore"):
            return np.einsum("npk,pr->nrk", model_matrix_gradient(self.terms, coded), self.coefficients)

    def terms_of(self, response: int) -> tuple[str, ...]:
        """Labels of the terms that the response at that position uses."""
        used = self.coefficients[:, response] != 0.0
        return tuple(label for label, u in zip(self.terms.labels, used, strict=True) if u)


def _checked_errors(given: ArrayLike, expected: tuple[int, int]) -> NDArray[np.float64]:
    """Standard errors of the shape of the coefficients, read-only."""
    errors = np.array(given, dtype=np.float64)
    if errors.shape != expected:
        raise ValueError(f"standard_errors must have shape {expected} (terms, responses); got {errors.shape}")
    if np.isinf(errors).any() or (errors < 0.0).any():
        raise ValueError("standard_errors must be 0 or positive, or NaN where they are not known")
    errors.setflags(write=False)
    return errors

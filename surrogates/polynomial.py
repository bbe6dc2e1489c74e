"""The estimator: scikit-learn's contract outside, a frozen :class:`Surrogate` as its result."""

from collections.abc import Sequence
from numbers import Real
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from sklearn.base import BaseEstimator, MultiOutputMixin, RegressorMixin
from sklearn.utils.validation import check_is_fitted, validate_data

from experiments.factors import Factor, FactorSpace
from experiments.runs import Response
from experiments.terms import Terms

from .basis import check_basis
from .candidates import Scope, check_degree
from .choosing import TAUGHT, Choice, Chosen, check_selection, check_transform, natural_basis, transformed_fit
from .links import check_positive
from .model import Surrogate


class PolynomialRegressor(MultiOutputMixin, RegressorMixin, BaseEstimator):
    """Multi-response polynomial with the penalty and the terms chosen by exact leave-one-out.

    Every response gets its own terms, and its own degree if that is to be chosen.

    Parameters
    ----------
    degree : int or ``"auto"``
        Highest total degree of the candidates. ``"auto"``: each response gets the lowest whose leave-one-out error
        a higher one does not lower by a tenth; where all terms would be too many, high degrees come without
        most products (:mod:`.candidates`).
    highest_degree : int
        Up to which ``"auto"`` looks.
    interactions : bool
        Whether products of different factors are candidates.
    penalty : float or None
        Relative ridge penalty; chosen by leave-one-out if None. For backward selection.
    trim : bool
        Whether terms that the data do not support are removed; without it the fit is one of all candidates by ridge
        regression.
    selection : str
        ``"evidence"``: all candidates at once, each as large as the smoothness that the runs show allows
        (:func:`.evidence_fit`). ``"backward"``: the weakest term leaves next, from a fit of all candidates.
        ``"forward"``: the term that helps most enters next. ``"lars"``, ``"adaptive_lasso"``: terms enter in the
        order of that method. All but backward take more candidates than runs.
    heredity : str
        For forward selection: ``"none"``, ``"weak"`` or ``"strong"``, see :func:`.forward_fit`.
    basis : str or None
        Polynomials among which terms are chosen: ``"monomial"``, ``"legendre"`` or ``"chebyshev"``; the result is
        written in monomials. None: Legendre's for evidence, which needs them, else monomials.
    resolution : float
        Leave-one-out errors below this fraction of a response's largest value count as none.
    space : FactorSpace, optional
        Factors with the ranges that define the coded units; from the data's own range if not given.
    responses : sequence of Response, optional
        Names and units of the responses; ``y1``, ``y2``, … if not given.
    response_transform : str
        ``"none"``: polynomials of the responses. ``"log"``: of their logarithms, all of which must be positive.
        ``"auto"``: for each positive response that varies by a factor of two or more, what predicts runs left out
        better. Predictions are responses again; nothing is added to them for the mean of exp(noise), see
        `log_bias_`.

    Attributes
    ----------
    surrogate_ : Surrogate
        The model itself.
    terms_ : tuple of tuple of str
        Labels of each response's terms.
    coef_ : ndarray, shape (n_terms, n_responses)
        Coefficients of ``surrogate_.terms``, in coded units; of the logarithm where ``surrogate_.links`` say so.
    standard_errors_ : ndarray, shape (n_terms, n_responses)
        Of `coef_`, the residuals being taken for noise (a simulator without noise has none: then they measure what
        the polynomial leaves out); zero for terms that a response does not use, NaN where too few runs are left.
    penalty_, loo_rmse_ : ndarray, shape (n_responses,)
        The penalty chosen and the leave-one-out error, per response; errors are those of the response itself.
    log_bias_ : ndarray, shape (n_responses,)
        Where a logarithm was fitted: by what fraction predictions would have to be raised to be means instead of
        medians, were the residuals noise: mean(exp(leave-one-out residuals)) − 1 (Duan, 1983, J. Am. Stat. Assoc.
        78, 605–610, who takes plain residuals). Not applied. 0 elsewhere, NaN where a run could not be left out.
    n_features_in_ : int
    """

    def __init__(
        self,
        degree: int | str = 2,
        highest_degree: int = 5,
        interactions: bool = True,
        penalty: float | None = None,
        trim: bool = True,
        selection: str = "backward",
        heredity: str = "none",
        basis: str | None = None,
        resolution: float = 1e-12,
        space: FactorSpace | None = None,
        responses: Sequence[Response] | None = None,
        response_transform: str = "none",
    ) -> None:
        self.degree = degree
        self.highest_degree = highest_degree
        self.interactions = interactions
        self.penalty = penalty
        self.trim = trim
        self.selection = selection
        self.heredity = heredity
        self.basis = basis
        self.resolution = resolution
        self.space = space
        self.responses = responses
        self.response_transform = response_transform

    def fit(self, X: ArrayLike, y: ArrayLike, jacobian: ArrayLike | None = None) -> "PolynomialRegressor":
        """Fit to settings `X` (n_runs, n_factors) and responses `y` (n_runs,) or (n_runs, n_responses).

        Parameters
        ----------
        X, y : array_like
        jacobian : array_like, shape (n_runs, n_responses, n_factors), optional
            d response / d factor at each run, in the units of `y` and `X`: taught along with the values, see
            :func:`.evidence_fit` and :func:`.gradient_fit`. Needs ``selection="evidence"`` or ``"forward"``.

        Raises
        ------
        ValueError
            If a setting is out of range, `X`, `y`, `jacobian`, `space` and `responses` do not fit together, or
            `response_transform` is ``"log"`` and a response is not positive.
        """
        checked: Any = validate_data(
            self, X, y, multi_output=True, y_numeric=True, dtype=np.float64, ensure_min_samples=2
        )
        X, y = np.asarray(checked[0]), checked[1]
        choice = self._choice()
        space = self.space if self.space is not None else _space_of(X, getattr(self, "feature_names_in_", None))
        table = np.asarray(y, dtype=np.float64).reshape(len(X), -1)
        responses = _responses_for(table.shape[1], self.responses)
        if self.response_transform == "log":
            check_positive(table, [r.name for r in responses])
        coded = space.code(X)
        levels = np.array([len(np.unique(column)) for column in coded.T])
        scope = Scope(space.names, self.degree, self.highest_degree, self.interactions, levels)
        slopes = self._slopes(jacobian, (*table.shape, len(space)))
        fits = []
        for j, column in enumerate(table.T):
            own = None if slopes is None else slopes[:, j] * space.half_range
            fits.append(transformed_fit(self.response_transform, choice, scope, coded, column, own, self.resolution))

        terms, (self.standard_errors_, coefficients) = _together(fits)
        self.surrogate_ = Surrogate(
            space,
            responses,
            terms,
            coefficients,
            # Squares of residuals may overflow: then nothing is known.
            standard_errors=np.where(np.isfinite(self.standard_errors_), self.standard_errors_, np.nan),
            links=tuple(fit.link for fit in fits),
        )
        self.terms_ = tuple(fit.terms.labels for fit in fits)
        self.coef_ = self.surrogate_.coefficients
        self.penalty_ = np.array([fit.penalty for fit in fits])
        self.loo_rmse_ = np.array([fit.loo_rmse for fit in fits])
        self.log_bias_ = np.array([fit.log_bias for fit in fits])
        self._one_response = np.ndim(y) == 1
        return self

    def predict(self, X: ArrayLike) -> NDArray[np.float64]:
        """Responses at `X` (n_runs, n_factors), with the shape of the `y` fitted."""
        check_is_fitted(self)
        X = validate_data(self, X, reset=False, dtype=np.float64)
        predicted = self.surrogate_.predict(X)
        return predicted[:, 0] if self._one_response else predicted

    def _slopes(self, jacobian: ArrayLike | None, shape: tuple[int, ...]) -> NDArray[np.float64] | None:
        if jacobian is None:
            return None
        if self.selection not in TAUGHT or not self.trim:
            named = " or ".join(repr(name) for name in TAUGHT)
            raise ValueError(f"a Jacobian is taught by some selections only: set selection to {named}, and trim=True")
        slopes = np.asarray(jacobian, dtype=np.float64)
        if slopes.shape != shape or not np.isfinite(slopes).all():
            raise ValueError(
                f"jacobian must be finite and of shape {shape} (runs, responses, factors); got {slopes.shape}"
            )
        return slopes

    def _choice(self) -> Choice:
        """The settings of the choice of terms, checked."""
        check_degree(self.degree, self.highest_degree)
        check_selection(self.selection, self.heredity)
        check_transform(self.response_transform)
        if self.penalty is not None and not _is_number_from_zero(self.penalty):
            raise ValueError(f"penalty must be None, 0 or a positive number, got {self.penalty!r}")
        if not _is_number_from_zero(self.resolution):
            raise ValueError(f"resolution must be 0 or a positive number, got {self.resolution!r}")
        basis = natural_basis(self.selection) if self.basis is None else self.basis
        check_basis(basis)
        return Choice(self.selection, basis, self.heredity, self.penalty, self.trim)


def _together(fits: Sequence[Chosen]) -> tuple[Terms, NDArray[np.float64]]:
    """Terms that some response uses, by degree, and standard errors and coefficients, (2, n_terms, n_responses)."""
    rows = {row for fit in fits for row in fit.terms.exponents}
    order = sorted(rows, key=lambda row: (sum(row), tuple(-e for e in row)))
    position = {row: i for i, row in enumerate(order)}
    values = np.zeros((2, len(order), len(fits)))
    for j, fit in enumerate(fits):
        at = [position[row] for row in fit.terms.exponents]
        values[:, at, j] = fit.standard_errors, fit.coefficients
    return Terms(fits[0].terms.names, tuple(order)), values


def _is_number_from_zero(value: Any) -> bool:
    return isinstance(value, Real) and not isinstance(value, bool) and 0.0 <= float(value) < np.inf


def _space_of(X: NDArray[np.float64], names: Any) -> FactorSpace:
    low, high = X.min(axis=0), X.max(axis=0)
    width = np.where(high > low, high - low, 2.0 * np.maximum(1.0, np.abs(low)))
    low = np.where(high > low, low, low - width / 2.0)
    known = [str(n) for n in names] if names is not None else [f"x{i + 1}" for i in range(X.shape[1])]
    try:
        return FactorSpace(
            tuple(Factor(n, "1", float(a), float(a + w)) for n, a, w in zip(known, low, width, strict=True))
        )
    except ValueError:
        if names is None:
            raise
        return _space_of(X, None)


def _responses_for(count: int, given: Sequence[Response] | None) -> tuple[Response, ...]:
    if given is None:
        return tuple(Response(f"y{j + 1}", "1") for j in range(count))
    if len(given) != count:
        raise ValueError(f"need one Response for each of {count} columns of y, got {len(given)}")
    return tuple(given)

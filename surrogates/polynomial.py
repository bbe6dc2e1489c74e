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
from experiments.terms import Terms, model_matrix, model_matrix_gradient

from .gradient_fit import gradient_fit
from .model import Surrogate
from .selection import PENALTIES, Fit, penalised_fit, trimmed_fit
from .stepwise import check_selection, forward_fit


class PolynomialRegressor(MultiOutputMixin, RegressorMixin, BaseEstimator):
    """Multi-response polynomial with the penalty and the terms chosen by exact leave-one-out.

    Every response gets its own terms: candidates are all monomials up to `degree`, fitted by
    penalised least squares and trimmed to what the data support.

    Parameters
    ----------
    degree : int
        Highest total degree of the candidates.
    interactions : bool
        Whether products of different factors are candidates.
    penalty : float or None
        Relative ridge penalty; chosen by leave-one-out if None.
    trim : bool
        Whether terms that the data do not support are removed.
    selection : str
        ``"backward"``: the weakest term leaves next, from a fit of all candidates. ``"forward"``: the term
        that helps most enters next, also where there are more candidates than runs; no penalty.
    heredity : str
        For forward selection: ``"none"``, ``"weak"`` or ``"strong"``, see :func:`.forward_fit`.
    resolution : float
        Leave-one-out errors below this fraction of a response's largest value count as none.
    space : FactorSpace, optional
        Factors with the ranges that define the coded units; from the data's own range if not given.
    responses : sequence of Response, optional
        Names and units of the responses; ``y1``, ``y2``, … if not given.

    Attributes
    ----------
    surrogate_ : Surrogate
        The model itself.
    terms_ : tuple of tuple of str
        Labels of each response's terms.
    coef_ : ndarray, shape (n_terms, n_responses)
        Coefficients of ``surrogate_.terms``, in coded units.
    penalty_, loo_rmse_ : ndarray, shape (n_responses,)
        The penalty chosen and the leave-one-out error, per response.
    n_features_in_ : int
    """

    def __init__(
        self,
        degree: int = 2,
        interactions: bool = True,
        penalty: float | None = None,
        trim: bool = True,
        selection: str = "backward",
        heredity: str = "none",
        resolution: float = 1e-12,
        space: FactorSpace | None = None,
        responses: Sequence[Response] | None = None,
    ) -> None:
        self.degree = degree
        self.interactions = interactions
        self.penalty = penalty
        self.trim = trim
        self.selection = selection
        self.heredity = heredity
        self.resolution = resolution
        self.space = space
        self.responses = responses

    def fit(self, X: ArrayLike, y: ArrayLike, jacobian: ArrayLike | None = None) -> "PolynomialRegressor":
        """Fit to settings `X` (n_runs, n_factors) and responses `y` (n_runs,) or (n_runs, n_responses).

        Parameters
        ----------
        X, y : array_like
        jacobian : array_like, shape (n_runs, n_responses, n_factors), optional
            d response / d factor at each run, in the units of `y` and `X`: taught along with the values, see
            :func:`.gradient_fit`. Needs ``selection="forward"``.

        Raises
        ------
        ValueError
            If a setting is out of range, or `X`, `y`, `jacobian`, `space` and `responses` do not fit together.
        """
        checked: Any = validate_data(
            self, X, y, multi_output=True, y_numeric=True, dtype=np.float64, ensure_min_samples=2
        )
        X, y = np.asarray(checked[0]), checked[1]
        self._check_settings()
        space = self.space if self.space is not None else _space_of(X, getattr(self, "feature_names_in_", None))
        table = np.asarray(y, dtype=np.float64).reshape(len(X), -1)
        responses = _responses_for(table.shape[1], self.responses)
        candidates = Terms.polynomial(space.names, self.degree, self.interactions)
        matrix = model_matrix(candidates, space.code(X))
        exponents = np.array(candidates.exponents, dtype=np.int64).reshape(len(candidates), -1)
        slopes = self._slopes(jacobian, (*table.shape, len(space)))
        if slopes is None:
            fits = [self._fit_one(matrix, exponents, column) for column in table.T]
        else:
            gradient = model_matrix_gradient(candidates, space.code(X))
            coded = slopes * space.half_range
            fits = [
                gradient_fit(matrix, column, gradient, coded[:, j], exponents, self.heredity, self._floor(column))
                for j, column in enumerate(table.T)
            ]

        used = np.unique(np.concatenate([fit.columns for fit in fits])).astype(np.int64)
        coefficients = np.zeros((len(candidates), len(fits)))
        for j, fit in enumerate(fits):
            coefficients[fit.columns, j] = fit.coefficients
        self.surrogate_ = Surrogate(space, responses, candidates.select(used), coefficients[used])
        self.terms_ = tuple(candidates.select(fit.columns).labels for fit in fits)
        self.coef_ = self.surrogate_.coefficients
        self.penalty_ = np.array([fit.penalty for fit in fits])
        self.loo_rmse_ = np.array([fit.loo_rmse for fit in fits])
        self._one_response = np.ndim(y) == 1
        return self

    def predict(self, X: ArrayLike) -> NDArray[np.float64]:
        """Responses at `X` (n_runs, n_factors), with the shape of the `y` fitted."""
        check_is_fitted(self)
        X = validate_data(self, X, reset=False, dtype=np.float64)
        predicted = self.surrogate_.predict(X)
        return predicted[:, 0] if self._one_response else predicted

    def _fit_one(self, matrix: NDArray[np.float64], exponents: NDArray[np.int64], y: NDArray[np.float64]) -> Fit:
        floor = self._floor(y)
        penalties = PENALTIES if self.penalty is None else (float(self.penalty),)
        if self.trim and self.selection == "forward":
            return forward_fit(matrix, y, exponents, self.heredity, floor)
        if self.trim:
            return trimmed_fit(matrix, y, penalties, floor)
        return penalised_fit(matrix, y, np.arange(matrix.shape[1]), penalties, floor)

    def _floor(self, y: NDArray[np.float64]) -> float:
        """Error that counts as none; an all-zero response has no scale, and any positive floor then keeps no term."""
        return self.resolution * float(np.abs(y).max()) or np.finfo(float).tiny

    def _slopes(self, jacobian: ArrayLike | None, shape: tuple[int, ...]) -> NDArray[np.float64] | None:
        if jacobian is None:
            return None
        if self.selection != "forward" or not self.trim:
            raise ValueError("a Jacobian is taught by forward selection only: set selection='forward' and trim=True")
        slopes = np.asarray(jacobian, dtype=np.float64)
        if slopes.shape != shape or not np.isfinite(slopes).all():
            raise ValueError(
                f"jacobian must be finite and of shape {shape} (runs, responses, factors); got {slopes.shape}"
            )
        return slopes

    def _check_settings(self) -> None:
        if isinstance(self.degree, bool) or not isinstance(self.degree, (int, np.integer)) or self.degree < 1:
            raise ValueError(f"degree must be a whole number of at least 1, got {self.degree!r}")
        check_selection(self.selection, self.heredity)
        if self.selection == "forward" and self.penalty:
            raise ValueError(f"selection 'forward' takes no penalty, got {self.penalty!r}; leave it out")
        if self.penalty is not None and not _is_number_from_zero(self.penalty):
            raise ValueError(f"penalty must be None, 0 or a positive number, got {self.penalty!r}")
        if not _is_number_from_zero(self.resolution):
            raise ValueError(f"resolution must be 0 or a positive number, got {self.resolution!r}")


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

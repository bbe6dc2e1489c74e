"""One response fitted from its runs: the way of choosing terms, the basis, and the degree where that is open."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from experiments.terms import Terms

from .basis import as_monomials, basis_gradient, basis_matrix
from .candidates import BETTER, MOST_TAUGHT, MOST_TERMS, Scope
from .evidence import Scales
from .evidence_fit import evidence_fit
from .fits import Fit, root_mean_square
from .gradient_fit import gradient_fit
from .links import IDENTITY, LOG
from .selection import PENALTIES, penalised_fit, trimmed_fit
from .stepwise import HEREDITIES, PATHS, forward_fit

Floats = NDArray[np.float64]

SELECTIONS = ("backward", *PATHS, "evidence")
TAUGHT = ("forward", "evidence")
"""Selections that gradients can teach."""

TRANSFORMS = ("none", "log", "auto")
LEAST_RATIO = 2.0
"""Largest value over smallest, below which ``"auto"`` tries no logarithm: it is nearly a straight line there."""


@dataclass(frozen=True)
class Choice:
    """How terms are chosen; see :class:`.PolynomialRegressor` for what each means.

    Raises
    ------
    ValueError
        If a name is not known, or the settings do not go together.
    """

    selection: str
    basis: str
    heredity: str = "none"
    penalty: float | None = None
    trim: bool = True

    def __post_init__(self) -> None:
        check_selection(self.selection, self.heredity)
        if self.selection != "backward" and self.penalty:
            raise ValueError(f"selection {self.selection!r} takes no penalty, got {self.penalty!r}; leave it out")
        if self.selection == "evidence" and self.basis != "legendre":
            raise ValueError(f"selection 'evidence' needs basis 'legendre', got {self.basis!r}")

    def fit(self, matrix: Floats, y: Floats, exponents: NDArray[np.int64], floor: float) -> tuple[Fit, Scales | None]:
        """From values alone; scales where they are learned."""
        if self.selection == "evidence" and self.trim:
            return evidence_fit(matrix, y, exponents, floor=floor)
        if self.selection in PATHS and self.trim:
            return forward_fit(matrix, y, exponents, self.heredity, floor, self.selection), None
        penalties = PENALTIES if self.penalty is None else (float(self.penalty),)
        if self.trim:
            return trimmed_fit(matrix, y, penalties, floor), None
        return penalised_fit(matrix, y, np.arange(matrix.shape[1]), penalties, floor), None

    def fit_taught(
        self, matrix: Floats, y: Floats, gradient: Floats, slopes: Floats, exponents: NDArray[np.int64], floor: float
    ) -> tuple[Fit, Scales | None]:
        """From values and derivatives by the coded factors."""
        if self.selection == "evidence":
            return evidence_fit(matrix, y, exponents, gradient, slopes, floor)
        return gradient_fit(matrix, y, gradient, slopes, exponents, self.heredity, floor), None


@dataclass(frozen=True, eq=False)
class Chosen:
    """One response's polynomial.

    Parameters
    ----------
    terms : Terms
        Monomials in coded factors.
    coefficients, standard_errors : ndarray, shape (n_terms,)
        Standard errors take the residuals for noise; NaN where too few runs are left to tell.
    penalty : float
    loo : ndarray, shape (n_runs,)
        Leave-one-out residuals of the response itself, in its unit.
    scales : Scales, optional
        What was learned of the sizes of coefficients.
    link : str
        Whether the polynomial gives the response or its logarithm.
    log_bias : float
        Of a polynomial that gives the logarithm: mean of exp(leave-one-out residuals of the logarithm) − 1.
    """

    terms: Terms
    coefficients: Floats
    standard_errors: Floats
    penalty: float
    loo: Floats
    scales: Scales | None
    link: str = IDENTITY
    log_bias: float = 0.0

    @property
    def loo_rmse(self) -> float:
        """Root mean square of the leave-one-out residuals."""
        return root_mean_square(self.loo)


def transformed_fit(
    transform: str, choice: Choice, scope: Scope, coded: Floats, y: Floats, slopes: Floats | None, resolution: float
) -> Chosen:
    """:func:`chosen_fit` of a response, of its logarithm, or of that which predicts runs left out better.

    Parameters
    ----------
    transform : str
        ``"none"``, ``"log"`` (of a positive response) or ``"auto"``: both are tried where all values are positive and
        the largest is :data:`LEAST_RATIO` times the smallest; errors of both are those of the response itself.
    choice, scope, coded, y, slopes
        As for :func:`chosen_fit`.
    resolution : float
        Errors below this fraction of the largest value count as none.
    """
    floor = resolution * float(np.abs(y).max()) or np.finfo(float).tiny  # an all-zero response has no scale
    as_it_is = chosen_fit(choice, scope, coded, y, slopes, floor) if transform != "log" else None
    if as_it_is is not None:
        spread = bool(y.min() > 0.0) and float(y.max()) >= LEAST_RATIO * float(y.min())
        if transform == "none" or not spread or as_it_is.loo_rmse <= floor:
            return as_it_is
    by_log = _fit_of_log(choice, scope, coded, y, slopes, resolution)
    return by_log if as_it_is is None or by_log.loo_rmse < as_it_is.loo_rmse else as_it_is


def _fit_of_log(
    choice: Choice, scope: Scope, coded: Floats, y: Floats, slopes: Floats | None, resolution: float
) -> Chosen:
    """The logarithm fitted; residuals go back to the response without a correction of their mean."""
    logs = np.log(y)
    # A small relative error is the same small error of the logarithm, whose own rounding grows with its size.
    floor = resolution * max(1.0, float(np.abs(logs).max())) or np.finfo(float).tiny
    fit = chosen_fit(choice, scope, coded, logs, None if slopes is None else slopes / y[:, None], floor)
    known = np.isfinite(fit.loo)
    left_out = np.where(known, fit.loo, 0.0)
    with np.errstate(over="ignore"):
        loo = np.where(known, y - np.exp(logs - left_out), np.inf)
        bias = float(np.mean(np.expm1(left_out))) if known.all() else np.nan
    return replace(fit, loo=loo, link=LOG, log_bias=bias)


def chosen_fit(choice: Choice, scope: Scope, coded: Floats, y: Floats, slopes: Floats | None, floor: float) -> Chosen:
    """The fit from the set of candidates that predicts runs left out best; a larger set must be clearly better.

    Parameters
    ----------
    choice : Choice
    scope : Scope
        The sets.
    coded, y : ndarray, shape (n_runs, n_factors) and (n_runs,)
    slopes : ndarray, shape (n_runs, n_factors), optional
        Derivatives of `y` by the coded factors.
    floor : float
        Error that counts as none.
    """
    best: Chosen | None = None
    sets = scope.sets(MOST_TERMS if slopes is None else MOST_TAUGHT, only_seen=choice.selection == "evidence")
    for terms in sets:
        if best is not None and (best.loo_rmse <= floor or not _can_be_judged(choice, terms, len(y))):
            continue
        found = _fitted(choice, terms, coded, y, slopes, floor)
        if best is None or found.loo_rmse <= floor or _is_better(found, best, taught=slopes is not None):
            best = found
    assert best is not None
    tried = {row for terms in sets for row in terms.exponents}
    while scope.open and best.scales is not None and best.loo_rmse > floor:
        terms = scope.likeliest(best.scales.log_variance_of)
        if tried.issuperset(terms.exponents):
            break
        found = _fitted(choice, terms, coded, y, slopes, floor)
        if not _is_better(found, best, taught=slopes is not None):
            break
        best, tried = found, set(terms.exponents)
    return best


def check_selection(selection: object, heredity: object) -> None:
    """``ValueError`` if there is no such selection or heredity, or they do not go together."""
    if selection not in SELECTIONS:
        raise ValueError(f"selection must be one of {', '.join(SELECTIONS)}, got {selection!r}")
    if heredity not in HEREDITIES:
        raise ValueError(f"heredity must be one of {', '.join(HEREDITIES)}, got {heredity!r}")
    if selection != "forward" and heredity != "none":
        raise ValueError(f"heredity {heredity!r} needs selection 'forward'")


def check_transform(transform: object) -> None:
    """``ValueError`` if there is no such transform."""
    if transform not in TRANSFORMS:
        raise ValueError(f"response_transform must be one of {', '.join(TRANSFORMS)}, got {transform!r}")


def natural_basis(selection: str) -> str:
    """The basis that goes with a selection where none is asked for."""
    return "legendre" if selection == "evidence" else "monomial"


def _is_better(larger: Chosen, smaller: Chosen, taught: bool) -> bool:
    """Whether a larger set is worth it: by evidence where all rows gave it, by leaving out points elsewhere.

    Leave-one-out errors of fits whose scales were learned on the same few runs are too small, most of all with few
    candidates, which can follow them closely; evidence counts that in.
    """
    if larger.scales is None or smaller.scales is None or taught:
        return larger.loo_rmse < BETTER * smaller.loo_rmse
    return larger.scales.evidence > smaller.scales.evidence


def _can_be_judged(choice: Choice, terms: Terms, n_runs: int) -> bool:
    """Whether runs are left to judge the fit by: one of all candidates needs a run for each."""
    return choice.selection != "backward" or len(terms) < 0.9 * n_runs


def _fitted(choice: Choice, terms: Terms, coded: Floats, y: Floats, slopes: Floats | None, floor: float) -> Chosen:
    matrix = basis_matrix(choice.basis, terms, coded)
    exponents = np.array(terms.exponents, dtype=np.int64).reshape(len(terms), -1)
    if slopes is None:
        fit, scales = choice.fit(matrix, y, exponents, floor)
    else:
        gradient = basis_gradient(choice.basis, terms, coded)
        fit, scales = choice.fit_taught(matrix, y, gradient, slopes, exponents, floor)
    monomials, change = as_monomials(choice.basis, terms, fit.columns)
    root = change @ fit.root
    size = float(np.abs(root).max(initial=0.0)) or 1.0
    errors = size * np.sqrt(((root / size) ** 2).sum(axis=1))
    return Chosen(monomials, change @ fit.coefficients, errors, fit.penalty, fit.loo, scales)

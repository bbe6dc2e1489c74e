"""Inversion: the settings that give wanted responses, or a refusal with the nearest reachable ones."""

from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .links import LOG, to_link_units, to_responses
from .multiplicity import at_most_one, in_continuum, shape_of
from .multistart import distinct, search, starts

if TYPE_CHECKING:
    from .model import Surrogate

BOX_TOLERANCE = 1e-9
"""How far outside [−1, 1] a coded setting may lie and still count as inside."""

TARGET_TOLERANCE = 1e-9
"""Largest mismatch of a reached target, as a fraction of the response's scale."""

MAX_ITERATIONS = 50

HARMLESS = 1e-11
"""Coded error that leaving out one entry of an inverse may make."""

FITTED_ROUNDING = 64
"""Relative rounding error of a fitted coefficient, in units of eps."""

FAR = 1e6
"""Targets farther from the centre than this many scales are searched for at this distance."""

EXTRA_STARTS = 4
"""Random starts of the bounded search, beside its two good ones, where those miss the target."""


class InversionStatus(StrEnum):
    """What became of one target: reached, or no setting in the domain was found that reaches it.

    For an affine model the search is exact, so that `OUTSIDE` means that there is none.
    """

    OK = "ok"
    OUTSIDE = "outside"


@dataclass(frozen=True, eq=False)
class Inversion:
    """Answers to an inversion, one row per target.

    Parameters
    ----------
    settings : ndarray, shape (n, n_factors)
        Settings in the factors' units; NaN where the target was refused.
    status : tuple of InversionStatus
        ``ok``, or ``outside``: refused.
    nearest_settings : ndarray, shape (n, n_factors)
        The settings that come nearest to the target; equal to `settings` where it was reached.
    nearest : ndarray, shape (n, n_responses)
        The model's responses there, SI: for a refused target the nearest reachable one, distance
        measured with each response divided by its scale; of a response that is given by its logarithm, its logarithm.
    distance : ndarray, shape (n,)
        That distance, dimensionless; infinite where a target is not positive and its logarithm is wanted.
    count : ndarray of int, shape (n,)
        Settings found in the domain that give the target: 0 where it was refused, more than 1 where other starts
        led elsewhere (`settings` holds one); of a continuum, 1. :func:`.preimages` finds and lists them all.
    complete : ndarray of bool, shape (n,)
        Proven that there are no others: a certified model, or an affine one of full rank. Of a reached target, that no
        other setting in the domain has the responses `nearest`; of a refused one, that none gives the target.
    continuum : ndarray of bool, shape (n,)
        Shown that the settings that give the target form a curve or a surface through the one given: more factors act
        than responses follow independently, or one does not act.
    """

    settings: NDArray[np.float64]
    status: tuple[InversionStatus, ...]
    nearest_settings: NDArray[np.float64]
    nearest: NDArray[np.float64]
    distance: NDArray[np.float64]
    count: NDArray[np.int64]
    complete: NDArray[np.bool_]
    continuum: NDArray[np.bool_]

    @property
    def unique(self) -> NDArray[np.bool_]:
        """Which targets have one setting in the domain, by proof, shape (n,)."""
        return self.ok & self.complete

    @property
    def ok(self) -> NDArray[np.bool_]:
        """Which targets were reached, shape (n,)."""
        return np.array([s is InversionStatus.OK for s in self.status], dtype=bool)

    def __array__(self, dtype: Any = None, copy: Any = None) -> NDArray[np.float64]:
        return np.array(self.settings, dtype=dtype)


@dataclass(frozen=True, eq=False)
class AffineInverse:
    """Closed-form inverse of an affine model: ``settings = gain @ responses + offset``.

    Parameters
    ----------
    gain : ndarray, shape (n_factors, n_responses)
        Factor unit per SI response unit. A least-squares inverse when there are more responses than
        factors; the smallest change in coded units when there are fewer.
    offset : ndarray, shape (n_factors,)
        In the factors' units.
    condition : float
        Condition number of the map from coded factors to responses divided by their scale;
        infinite if the map has lost rank.
    """

    gain: NDArray[np.float64]
    offset: NDArray[np.float64]
    condition: float


def obstacle(model: "Surrogate") -> str:
    """Why wanted responses cannot be inverted in practice, in words that end a sentence; empty where they can.

    A curved model whose responses outnumber the factors that act on them reaches a surface that nothing
    measured or simulated lies on exactly: off it by the fit's own error, every target would be refused.
    """
    n_moving, _, n_acting = shape_of(model)
    if model.is_affine_map or n_moving <= n_acting:
        return ""
    factors = "1 factor" if n_acting == 1 else f"{n_acting} factors"
    return f"{n_moving} responses follow from {factors}, so that they cannot be chosen independently of each other"


def affine_map(model: "Surrogate") -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Matrix (n_responses, n_factors) and offset (n_responses,) of an affine model, in physical units.

    Raises
    ------
    ValueError
        If the model has terms above degree one, or gives a logarithm.
    """
    _check_affine(model)
    centre = model.factors.centre[None]
    matrix = model.jacobian(centre)[0]
    return matrix, model.predict(centre)[0] - matrix @ centre[0]


def affine_inverse(model: "Surrogate") -> AffineInverse:
    """The closed-form inverse of an affine model.

    Raises
    ------
    ValueError
        If the model has terms above degree one, or gives a logarithm.
    """
    _check_affine(model)
    centre, half = model.factors.centre, model.factors.half_range
    constant, slope = _affine_part(model)
    scaled = slope / model.scale[:, None]
    inverse, condition = pseudo_inverse(scaled)
    gain = half[:, None] * inverse / model.scale
    return AffineInverse(gain, centre - gain @ constant, condition)


def pseudo_inverse(scaled: NDArray[np.floating]) -> tuple[NDArray[np.floating], float]:
    """Pseudo-inverse of a slope in coded factors and scaled responses, with its condition number; infinite if singular.

    Fitted coefficients carry rounding errors of some tens of eps. An entry of the inverse that is no larger than what
    they make of it is a structural zero, and a controller need not multiply by it; but only while all that it does to
    a coded setting is far below what an answer is checked to.
    """
    singular = np.linalg.svd(scaled, compute_uv=False)
    eps = float(np.finfo(float).eps)
    if singular[-1] <= max(scaled.shape) * eps * singular[0]:
        return np.linalg.pinv(scaled), np.inf
    # Elimination keeps zeros of blocks and small rows beside large ones; singular values mix them.
    inverse = np.linalg.inv(scaled) if scaled.shape[0] == scaled.shape[1] else np.linalg.pinv(scaled)
    condition = float(singular[0] / singular[-1])
    carried = FITTED_ROUNDING * eps * condition * np.abs(inverse).max()
    felt = np.abs(inverse) * np.abs(scaled).max(axis=1)
    inverse[felt <= min(carried, HARMLESS)] = 0.0
    return inverse, condition


def invert(model: "Surrogate", targets: ArrayLike) -> Inversion:
    """Find settings in the domain whose predicted responses are `targets`.

    An affine model is inverted in closed form; any other by Gauss–Newton steps of least norm on the
    polynomial with its analytic Jacobian, all targets at once. Where that leaves the box, the
    nearest point of the box is sought; a target is refused only if even that misses it.

    Where a curved model is not certified, Newton's method from more starts looks for other settings that give the
    same target: they are counted, not proven to be all.

    Parameters
    ----------
    model : Surrogate
    targets : array_like, shape (n, n_responses)
        Wanted responses, SI. A response that is given by its logarithm is always positive: a target that is not is
        refused, and what is nearest has this response as small as it gets.

    Raises
    ------
    ValueError
        If `targets` has the wrong shape or a value that is not finite.

    Notes
    -----
    All is done in link units, logarithms of targets where the model gives logarithms: a target counts as reached, and
    is near, by them.

    Where there is an :func:`obstacle`, only targets that are consistent to rounding are reached; of any
    other, the nearest settings are a local least-squares answer.
    """
    targets = np.asarray(targets, dtype=np.float64)
    if targets.ndim != 2 or targets.shape[1] != len(model.responses):
        names = ", ".join(r.name for r in model.responses)
        raise ValueError(
            f"targets must have shape (n, {len(model.responses)}), one column per response ({names}); "
            f"got {targets.shape}"
        )
    if not np.isfinite(targets).all():
        raise ValueError("targets must be finite")
    wanted = to_link_units(model.links, targets)
    near = _brought_near(model, wanted)
    coded, single = _gauss_newton(model, near), at_most_one(model)
    others = [] if single else _others(model, near, coded)
    for i in np.flatnonzero(~reached(model, coded, near)):
        coded[i] = others[i][0] if others and len(others[i]) else _nearest_in_box(model, near[i], coded[i])
    ok = reached(model, coded, wanted)
    count = ok.astype(np.int64)
    for i in np.flatnonzero(ok if others else ()):
        count[i] = len(distinct(np.vstack([coded[i], others[i]])))
    coded = np.clip(coded, -1.0, 1.0)
    nearest = model.predict_coded(coded)
    settings = model.factors.decode(coded)
    with np.errstate(over="ignore"):
        distance = _distance(nearest / model.scale, wanted / model.scale)
    distance[np.isneginf(wanted).any(axis=1)] = np.inf
    return Inversion(
        np.where(ok[:, None], settings, np.nan),
        tuple(InversionStatus.OK if k else InversionStatus.OUTSIDE for k in ok),
        settings,
        to_responses(model.links, nearest),
        distance,
        count,
        single & (ok | model.is_affine),
        ok & in_continuum(model, coded),
    )


def _check_affine(model: "Surrogate") -> None:
    if not model.is_affine:
        raise ValueError(
            "only an affine model has a closed-form inverse and a constant matrix; this one has terms above degree one"
        )
    if model.has_logs:
        raise ValueError(
            "only an affine model has a closed-form inverse and a constant matrix; this one gives the logarithm of "
            f"{' and '.join(r.name for r, link in zip(model.responses, model.links, strict=True) if link == LOG)}; "
            "use model.invert and model.jacobian"
        )


def _affine_part(model: "Surrogate") -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Value (n_responses,) and slope by coded factors (n_responses, n_factors) at the centre of the domain."""
    centre = np.zeros((1, len(model.factors)))
    return model.predict_coded(centre)[0], model.jacobian_coded(centre)[0]


def _brought_near(model: "Surrogate", targets: NDArray[np.float64]) -> NDArray[np.float64]:
    """Targets beyond all reach, moved in along the line to the centre's response: what is nearest stays nearest.

    Sums of squares of a target at 1e300 would overflow.
    """
    constant, _ = _affine_part(model)
    with np.errstate(over="ignore"):
        offset = np.clip((targets - constant) / model.scale, -1e300, 1e300)
    farthest = np.abs(offset).max(axis=1, keepdims=True)
    far = farthest[:, 0] > FAR
    moved = constant + np.divide(offset, farthest, where=farthest > 0.0, out=np.zeros_like(offset)) * FAR * model.scale
    return np.where(far[:, None], moved, targets)


def _distance(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    """Euclidean distance of rows, without overflow on the way."""
    apart = np.minimum(np.abs(a - b), np.finfo(float).max)
    largest = apart.max(axis=1)
    unit = apart / np.where(largest > 0.0, largest, 1.0)[:, None]
    return largest * np.sqrt((unit**2).sum(axis=1))


def reached(model: "Surrogate", coded: NDArray[np.float64], targets: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Which coded settings lie in the domain and give their targets, in link units, each to 1e-9, shape (n,)."""
    inside = (np.abs(coded) <= 1.0 + BOX_TOLERANCE).all(axis=1)
    with np.errstate(over="ignore"):
        miss = np.abs(model.predict_coded(coded) - targets) / model.scale
    return np.logical_and(inside, (miss <= TARGET_TOLERANCE).all(axis=1))


def _others(model: "Surrogate", targets: NDArray[np.float64], coded: NDArray[np.float64]) -> list[NDArray[np.float64]]:
    """Settings that other starts find, a list per target; no list where it is affine or no setting stands alone."""
    n, k = coded.shape
    shape = shape_of(model)
    if not n or model.is_affine or min(shape.n_independent, shape.n_acting) < k:
        return []
    ends = search(model, targets, starts(k))
    good = reached(model, ends.reshape(-1, k), np.repeat(targets, ends.shape[1], axis=0)).reshape(n, -1)
    return [distinct(some[hit]) for some, hit in zip(ends, good, strict=True)]


def _gauss_newton(model: "Surrogate", targets: NDArray[np.float64]) -> NDArray[np.float64]:
    """Coded settings after undamped least-norm steps from the centre; the first step of an affine model is exact."""
    constant, slope = _affine_part(model)
    first = np.linalg.pinv(slope / model.scale[:, None])
    coded = (targets - constant) / model.scale @ first.T
    if model.is_affine:
        return coded
    coded = np.clip(coded, -1.0, 1.0)
    moving = np.arange(len(coded))
    for _ in range(MAX_ITERATIONS):
        miss = (targets[moving] - model.predict_coded(coded[moving])) / model.scale
        steps = np.linalg.pinv(model.jacobian_coded(coded[moving]) / model.scale[:, None])
        step = np.einsum("nkr,nr->nk", steps, miss)
        # Far outside the box the polynomial means nothing: keep the search near it.
        coded[moving] = np.clip(coded[moving] + step, -2.0, 2.0)
        # Each target stops for itself, so that its answer does not depend on the others.
        moving = moving[np.abs(step).max(axis=1) >= 1e-14]
        if not moving.size:
            break
    return coded


def _nearest_in_box(model: "Surrogate", target: NDArray[np.float64], start: NDArray[np.float64]) -> NDArray[np.float64]:
    """The coded settings in the box whose responses come nearest to one target (locally, if not affine).

    Gauss–Newton with the box kept in every linear step, which bounded-variable least squares solves
    exactly; steps are halved until they help. Started where the free iteration ended, and from the
    centre and random points if that does not reach the target.
    """
    starts = [start]
    if not model.is_affine:
        starts += [np.zeros_like(start), *np.random.default_rng(0).uniform(-1.0, 1.0, (EXTRA_STARTS, len(start)))]
    best, best_miss = start, np.inf
    for begin in starts:
        found = _bounded_gauss_newton(model, target, np.clip(begin, -1.0, 1.0))
        miss = float(np.linalg.norm(_miss(model, found, target)))
        if miss < best_miss:
            best, best_miss = found, miss
        if best_miss <= 0.1 * TARGET_TOLERANCE:
            break
    return best


def _bounded_gauss_newton(
    model: "Surrogate", target: NDArray[np.float64], coded: NDArray[np.float64]
) -> NDArray[np.float64]:
    from scipy.optimize import lsq_linear

    miss = _miss(model, coded, target)
    for _ in range(MAX_ITERATIONS):
        slope = model.jacobian_coded(coded[None])[0] / model.scale[:, None]
        room = np.finfo(float).eps  # the solver wants the bounds apart
        wanted = lsq_linear(slope, miss, bounds=(-1.0 - coded - room, 1.0 - coded + room), method="bvls").x
        length = 1.0
        while length > 1e-6:
            trial = np.clip(coded + length * wanted, -1.0, 1.0)
            trial_miss = _miss(model, trial, target)
            if np.linalg.norm(trial_miss) < np.linalg.norm(miss):
                break
            length *= 0.5
        else:
            return coded
        moved = np.abs(trial - coded).max()
        coded, miss = trial, trial_miss
        if moved < 1e-14:
            break
    return coded


def _miss(model: "Surrogate", coded: NDArray[np.float64], target: NDArray[np.float64]) -> NDArray[np.float64]:
    """Target minus prediction at one coded point, in units of the scale, shape (n_responses,)."""
    return (target - model.predict_coded(coded[None])[0]) / model.scale

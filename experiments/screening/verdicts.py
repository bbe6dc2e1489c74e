"""From a standard error to a judgement: floor, crowding, margins and advice, the same for every method."""

import numpy as np
from numpy.typing import NDArray

from .crowding import FEWEST_DUMMIES, dummy_error, is_crowded
from .judgement import COLLAPSED, Judgement, Scale
from .standard_errors import ESTIMATORS, first_estimate

GIVE_FLOOR = "most contrasts are zero to rounding, so no error can be estimated: give a noise_floor"
TOO_MANY = (
    "half or more of the contrasts act, so they tell nothing about the error: take a larger design, whose dummy "
    "columns do, or keep all factors"
)


def verdict(
    method: str,
    contrasts: NDArray[np.float64],
    names: tuple[str, ...],
    alpha: float,
    noise_floor: float,
    freedom: float,
    simulated: str = "",
    dummies: NDArray[np.bool_] | None = None,
    seed: int = 0,
) -> Judgement:
    """Judge contrasts by the standard error of `method`, or by one that must stand in for it.

    Parameters
    ----------
    method : str
        Key of :data:`~.standard_errors.ESTIMATORS`.
    contrasts, names, alpha, noise_floor, dummies, seed
        As :func:`~.lenth.lenth` takes them, already checked.
    freedom : float
        Degrees of freedom of t.
    simulated : str
        The estimator whose reference distribution replaces t; empty for t.
    """
    sizes, m = np.abs(contrasts), len(contrasts)
    ordered = np.sort(sizes)
    estimate = float(ESTIMATORS[method](ordered))
    scale, source, advice = Scale(m, freedom, simulated, seed), "contrasts", ""
    found_nothing = not (sizes > scale.margins(alpha)[0] * max(estimate, noise_floor)).any()
    crowded = bool(found_nothing and sizes.any() and is_crowded(sizes, dummies, noise_floor))
    if crowded and dummies is not None and dummies.sum() >= FEWEST_DUMMIES:
        spare = dummy_error(sizes, dummies)
        if spare < estimate:
            estimate, source = spare, "dummies"
            scale = Scale(m, float(dummies.sum()))
    if crowded and source == "contrasts":
        advice = TOO_MANY
    if sizes.any() and noise_floor == 0.0 and estimate <= COLLAPSED * sizes.max():
        advice = GIVE_FLOOR
    pse = max(estimate, noise_floor)
    one, all_of_them = (ratio * pse for ratio in scale.margins(alpha))
    with np.errstate(divide="ignore", invalid="ignore"):
        ratios = np.nan_to_num(sizes / pse, nan=0.0, posinf=np.inf)
    floored = noise_floor > estimate
    return Judgement(
        names,
        contrasts,
        float(first_estimate(ordered)),
        pse,
        one,
        all_of_them,
        alpha,
        noise_floor,
        floored,
        advice,
        method,
        "floor" if floored else source,
        crowded,
        *scale.p_values(ratios),
    )

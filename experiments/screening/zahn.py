"""Zahn's method: the slope of the half-normal plot through its smallest two thirds."""

from collections.abc import Sequence

from numpy.typing import ArrayLike

from .judgement import Judgement, checked
from .verdicts import verdict


def zahn(
    contrasts: ArrayLike,
    names: Sequence[str] | None = None,
    alpha: float = 0.05,
    noise_floor: float = 0.0,
    *,
    seed: int = 0,
) -> Judgement:
    """Judge the contrasts of one response by simulated critical values: no t is known for the slope.

    Parameters
    ----------
    contrasts : array_like, shape (m,)
        Effects of mutually orthogonal columns, the dummies included.
    names : sequence of str, optional
        Length m; ``c1``, ``c2``, … if not given.
    alpha, noise_floor, seed
        As for :func:`~.lenth.lenth`.

    Raises
    ------
    ValueError
        If there are fewer than three contrasts, one is not finite, or a setting is out of range.

    Notes
    -----
    Zahn (1975), "Modifications of and revised critical values for the half-normal plot", Technometrics 17,
    189–200: least-squares line through the origin and the smallest 68.3 % of the absolute contrasts. Plotting
    positions (i − 3/8)/(m + 1/4), with which R package unrepx prints its numbers.
    """
    contrasts, names = checked(contrasts, names, alpha, noise_floor, "Zahn's")
    return verdict("zahn", contrasts, names, alpha, noise_floor, 0.0, "zahn", seed=seed)

"""Links: whether a response is a polynomial itself, or its logarithm is; and the border between the two units.

A polynomial gives values in *link units*: the response in SI, or ln(response / SI unit), which has no unit. Both links
are strictly increasing, so that what is true of the polynomials' injectivity is true of the responses'.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

IDENTITY, LOG = "identity", "log"
LINKS = (IDENTITY, LOG)

LEAST = float(np.finfo(float).tiny)
"""Smallest response that a box may hold: below it floats lose their digits."""

INWARD = 8.0 * float(np.finfo(float).eps)
"""By this fraction the ends of a box move in: several times what exp() and the product may be wrong by."""


class NotPositive(ValueError):
    """A response that has no logarithm."""


def check_links(links: Sequence[str], n_responses: int) -> tuple[str, ...]:
    """The links as given, all identity if there are none; ``ValueError`` if one is unknown or the count is wrong."""
    found = tuple(links) or (IDENTITY,) * n_responses
    if len(found) != n_responses or any(link not in LINKS for link in found):
        raise ValueError(f"links must be one of {', '.join(LINKS)} for each of {n_responses} responses; got {links!r}")
    return found


def check_positive(values: NDArray[np.float64], names: Sequence[str]) -> None:
    """:class:`NotPositive` unless all `values` (n_runs, n_responses) have a logarithm."""
    for name, lowest in zip(names, values.min(axis=0), strict=True):
        if not lowest > 0.0:
            raise NotPositive(
                f"'log' needs responses that are positive in every run: the smallest value of {name!r} is "
                f"{lowest:.6g}; 'auto' takes logarithms only of responses that have them, 'none' takes none"
            )


def logarithmic(links: Sequence[str]) -> NDArray[np.bool_]:
    """Which responses are given by their logarithm, shape (n_responses,)."""
    return np.array([link == LOG for link in links], dtype=bool)


def to_responses(links: Sequence[str], values: ArrayLike) -> NDArray[np.float64]:
    """Responses in SI from values in link units, shape (…, n_responses)."""
    found = np.array(values, dtype=np.float64)
    logs = logarithmic(links)
    with np.errstate(over="ignore"):  # far outside the domain
        found[..., logs] = np.exp(found[..., logs])
    return found


def to_link_units(links: Sequence[str], responses: ArrayLike) -> NDArray[np.float64]:
    """Link units from responses in SI, shape (…, n_responses); −∞ for what is not positive and has no logarithm."""
    found = np.array(responses, dtype=np.float64)
    logs = logarithmic(links)
    with np.errstate(divide="ignore"):
        found[..., logs] = np.log(np.maximum(found[..., logs], 0.0))
    return found


def chained(links: Sequence[str], responses: NDArray[np.float64], slopes: NDArray[np.float64]) -> NDArray[np.float64]:
    """Jacobian of the responses from that in link units, shape (n, n_responses, n_factors): dy = y d(ln y)."""
    with np.errstate(over="ignore", invalid="ignore"):
        return slopes * np.where(logarithmic(links), responses, 1.0)[..., None]


def box_of_responses(
    links: Sequence[str], box: Sequence[tuple[float, float]]
) -> tuple[tuple[float, float], ...] | None:
    """A box in SI within the image of a box in link units, low and high per response: rounded inwards.

    None if nothing is left of it in floats.
    """
    found = []
    for link, (low, high) in zip(links, box, strict=True):
        if link == LOG:
            with np.errstate(over="ignore", under="ignore"):
                low = max(float(np.exp(low)) * (1.0 + INWARD), LEAST)
                high = min(float(np.exp(high)) * (1.0 - INWARD), float(np.finfo(float).max))
        if not low < high:
            return None
        found.append((low, high))
    return tuple(found)


def unit_of(link: str, name: str, unit: str) -> str:
    """What a value in link units is, for people: ``"m"`` or ``"ln(x / m)"``."""
    if link != LOG:
        return unit
    return f"ln {name}" if unit == "1" else f"ln({name} / {unit})"

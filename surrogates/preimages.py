"""All settings that give one target, with a word on whether the list is proven to be complete."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .enclosures import Floats
from .inversion import Inversion, invert, reached
from .links import to_link_units
from .multiplicity import shape_of
from .multistart import distinct, search, starts
from .roots import MOST_TERMS, Roots, find_roots, size_of_expansion

if TYPE_CHECKING:
    from .model import Surrogate

MOST_PARTS = 20_000
"""Parts of the box that are looked at for one target: seconds at most."""


@dataclass(frozen=True, eq=False)
class Preimages:
    """The settings in the domain that give one target.

    Parameters
    ----------
    settings : ndarray, shape (n_found, n_factors)
        In the factors' units, the nearest to the centre of the domain (in coded units) first.
    complete : bool
        Proven that there are no others in the domain.
    continuum : bool
        The settings form a curve or a surface, of which one is given.
    reason : str
        One sentence for a reader.
    """

    settings: NDArray[np.float64]
    complete: bool
    continuum: bool
    reason: str

    def __len__(self) -> int:
        return len(self.settings)


def preimages(model: "Surrogate", target: ArrayLike, most: int = MOST_PARTS) -> Preimages:
    """Find all settings in the domain whose predicted responses are `target`.

    Where there are as many responses as factors, the box is searched with proof (:mod:`.roots`): each part of it
    is shown to hold no such setting, or exactly one. A target at a fold, where two settings meet, cannot be decided so;
    then, and when the search ends early, what is found from many starts is given and the list is not called complete.

    Parameters
    ----------
    model : Surrogate
    target : array_like, shape (n_responses,)
        Wanted responses, SI.
    most : int
        Parts of the box that are looked at before the search is given up.

    Raises
    ------
    ValueError
        If `target` has the wrong shape or a value that is not finite, or `most` is below 1.

    Notes
    -----
    The proof is about the model in exact arithmetic, its coefficients and the target taken as the floats that they
    are; of a response that is given by its logarithm, the logarithm of the target is rounded to a float first. Each
    setting is within 1e-9 in coded units of an exact one, which lies in the domain to 1e-9.
    """
    target = np.asarray(target, dtype=np.float64)
    if target.ndim != 1:
        raise ValueError(
            f"target must have shape ({len(model.responses)},), the responses wanted at once; got {target.shape}; "
            "for many targets, call this for each"
        )
    if most < 1:
        raise ValueError(f"most must be at least 1 part of the box, got {most}")
    answer = invert(model, target[None])
    target = to_link_units(model.links, target)
    if np.isneginf(target).any():
        reason = "no setting: a response that is given by its logarithm is positive everywhere, and this target is not"
        return Preimages(answer.settings[answer.ok], True, False, reason)
    against = _not_searchable(model)
    if against:
        return _as_found(model, target, answer, against)
    return _searched(model, target, answer, find_roots(model, target, most))


def _not_searchable(model: "Surrogate") -> str:
    """Why the search with proof cannot be tried, in words that end a sentence; empty if it can."""
    shape = shape_of(model)
    if shape.n_acting < len(model.factors):
        return "some factor acts on no response"
    if shape.n_independent < len(model.factors):
        return "there are more factors than responses that can be chosen independently of each other"
    if len(model.responses) > len(model.factors):
        return "there are more responses than factors"
    if size_of_expansion(model) > MOST_TERMS:
        return "the model has too many terms"
    return ""


def _as_found(model: "Surrogate", target: Floats, answer: Inversion, against: str) -> Preimages:
    """What the inversion gave, and other starts: without a search, only a certificate can make it complete."""
    if answer.continuum[0]:
        reason = f"{against}: the settings form a continuum, of which one is given"
        return Preimages(answer.settings, False, True, reason)
    if answer.complete[0]:
        return Preimages(answer.settings[answer.ok], True, False, _by_theorem(model))
    coded = _from_starts(model, target, answer)
    told = "these were found from several starts" if len(coded) else "none was found from several starts"
    return _listed(model, coded, False, f"{told}; the box was not searched with proof: {against}")


def _searched(model: "Surrogate", target: Floats, answer: Inversion, roots: Roots) -> Preimages:
    n, parts = len(roots.coded), "1 part" if roots.parts == 1 else f"{roots.parts} parts"
    if roots.complete and (n or not answer.ok[0]):
        told = f"exactly {n} setting{'s' if n > 1 else ''} of the domain" if n else "no setting of the domain"
        return _listed(model, roots.coded, True, f"{told}, proven on {parts} of the box")
    if roots.complete:
        # An answer counts that gives the target to 1e-9 of the scale; exactly, at an edge or a fold, there is none.
        reason = f"proven on {parts} of the box: no setting gives the target exactly; this one does to rounding"
        return Preimages(answer.settings, False, False, reason)
    if answer.complete[0]:
        return Preimages(answer.settings[answer.ok], True, False, _by_theorem(model))
    coded = distinct(np.vstack([roots.coded, _from_starts(model, target, answer)]))
    if roots.left:
        why = f"the search ended after {parts} of the box with {roots.left + roots.small} undecided"
    else:
        why = f"{roots.small} parts of the box, as small as they may be, stay undecided: settings meet there, or nearly"
    return _listed(model, coded, False, f"{why}; there may be others")


def _by_theorem(model: "Surrogate") -> str:
    how = "the model is affine and of full rank" if model.is_affine else "the model is certified"
    return f"{how}: no two settings of the domain have the same responses"


def _from_starts(model: "Surrogate", target: Floats, answer: Inversion) -> Floats:
    """Coded settings that are found but not proven; the inversion's answer first."""
    given = model.factors.code(answer.settings[answer.ok])
    shape = shape_of(model)
    if min(shape.n_independent, shape.n_acting) < len(model.factors):
        return given
    ends = search(model, target[None], starts(len(model.factors)))[0]
    return distinct(np.vstack([given, ends[reached(model, ends, target)]]))


def _listed(model: "Surrogate", coded: Floats, complete: bool, reason: str) -> Preimages:
    coded = np.clip(coded, -1.0, 1.0)
    # Rounded, so that settings as far from the centre as each other stay in one order on every machine.
    keys = np.round(np.column_stack([np.linalg.norm(coded, axis=1), coded]), 6)
    order = np.lexsort(keys.T[::-1])
    return Preimages(model.factors.decode(coded[order]), complete, False, reason)

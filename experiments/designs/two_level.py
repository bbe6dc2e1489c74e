"""What all orthogonal two-level designs share: dummies, foldover and centre points."""

import numpy as np
from numpy.typing import NDArray

from ..factors import FactorSpace
from .base import Design, check_count

FOLDOVER = "repeats every run with all signs turned: main effects become clear of two-factor interactions"
CENTRE = "runs at the centre of all ranges, on top of n_runs; a deterministic simulator learns nothing from a second"

MOST_CENTRES = 1000


def check_additions(what: str, foldover: object, n_centre: object) -> None:
    """Raise ``ValueError`` unless `foldover` is a truth value and `n_centre` a whole number of at least 0."""
    if not isinstance(foldover, (bool, np.bool_)):
        raise ValueError(f"foldover of a {what} must be true or false, got {foldover!r}")
    check_count(f"n_centre of a {what}", n_centre, 0, MOST_CENTRES)


def assemble(
    space: FactorSpace, columns: NDArray[np.float64], method: str, foldover: bool = False, n_centre: int = 0
) -> Design:
    """The design whose factors take the first of the orthogonal `columns`; the others become dummies.

    Parameters
    ----------
    space : FactorSpace
    columns : ndarray, shape (n, n − 1)
        Orthogonal, balanced ±1 columns: with the column of ones, a Hadamard matrix H.
    method : str
    foldover : bool
        Append the runs −H. The 2n − 1 columns of the result are, in this order: the folded ones
        (h, −h), then the fold itself (1, −1), then the even ones (h, h). Odd columns carry no
        two-factor interaction; the even ones carry no main effect, and all the interactions.
    n_centre : int
        Append so many runs at coded 0, last. Dummies are 0 there too: a contrast is a sum over the
        two-level runs only, and centre runs weigh nothing in it.

    Notes
    -----
    Box and Wilson (1951), J. R. Stat. Soc. B 13, 1–45 (foldover and centre points of two-level designs);
    the columns are those of Sylvester's doubling [[H, H], [H, −H]].
    """
    if foldover:
        fold = np.repeat([[1.0], [-1.0]], len(columns), axis=0)
        even = np.vstack([columns, columns])
        columns = np.hstack([even * fold, fold, even])
    columns = np.vstack([columns, np.zeros((n_centre, columns.shape[1]))])
    return Design(space, columns[:, : len(space)], method, columns[:, len(space) :])

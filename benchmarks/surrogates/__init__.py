"""Polynomial surrogates beside peers: one set of designs, test functions from the literature, one score.

Modules
-------
functions, scoring
    What is approximated, from which points, and how the error is measured.
methods, roster
    What a method is, and all of them.
ours, regression, expansions, kriging
    Ours; scikit-learn; OpenTURNS and chaospy; smt.
running, tables
    The fits, with what is known kept in a file, and their tables.
"""

from pathlib import Path


def table(seeds: int = 3, sizes: tuple[int, ...] = (30,), cache: Path | None = None) -> str:
    """A short version for ``python -m benchmarks``; ``python -m benchmarks.surrogates`` makes all."""
    from .functions import FUNCTIONS
    from .report import report
    from .roster import METHODS

    return report(METHODS, FUNCTIONS, sizes, seeds, cache)

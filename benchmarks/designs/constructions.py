"""What can be constructed at all, beside pyDOE3 and pydoe."""

import importlib
from collections.abc import Callable
from importlib.util import find_spec
from typing import Any

import numpy as np

from experiments.designs import DefinitiveScreening, PlackettBurman

from .search import space

MOST_RUNS, MOST_FACTORS = 200, 60


def table() -> str:
    peers = [name for name in ("pyDOE3", "pydoe") if find_spec(name)]
    sizes = range(4, MOST_RUNS + 1, 4)
    ours = [_possible(lambda n=n: PlackettBurman(n_runs=n).generate(space(n - 1)).coded, n, n - 1) for n in sizes]
    lines = [
        "### What can be constructed\n",
        f"Two-level orthogonal designs of n runs for n − 1 factors, n up to {MOST_RUNS}, checked for balance and "
        f"orthogonality; definitive screening designs for 3 to {MOST_FACTORS} factors, main effects checked to be free "
        "of each other and of squares.\n",
        f"| | ours | {' | '.join(peers)} |",
        "|---|---" + "|---" * len(peers) + "|",
    ]
    theirs = []
    for name in peers:
        peer = importlib.import_module(name)
        theirs.append([_possible(lambda n=n, peer=peer: peer.pbdesign(n - 1), n, n - 1) for n in sizes])
    cells = [_named(list(sizes), made) for made in (ours, *theirs)]
    lines.append(f"| Plackett–Burman, n | {' | '.join(cells)} |")
    factors = range(3, MOST_FACTORS + 1)
    ours = [_screened(lambda k=k: DefinitiveScreening().generate(space(k)).coded, k) for k in factors]
    theirs = []
    for name in peers:
        make = getattr(importlib.import_module(name), "definitive_screening_design", None)
        theirs.append([make is not None and _screened(lambda k=k, make=make: make(k), k) for k in factors])
    cells = [_named(list(factors), made) for made in (ours, *theirs)]
    lines.append(f"| definitive screening, factors | {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


def _screened(make: Callable[[], Any], k: int) -> bool:
    """Whether a three-level design for k factors comes out with main effects free of each other and of squares."""
    try:
        design = np.asarray(make(), dtype=float)
    except Exception:  # whatever a package raises, it did not make one
        return False
    gram = design.T @ design
    orthogonal = np.allclose(gram, np.diag(np.diag(gram))) and np.allclose(design.T @ design**2, 0.0)
    return design.shape[1] == k and orthogonal


def _possible(make: Callable[[], Any], n: int, k: int) -> bool:
    """Whether a design of n runs and k columns comes out balanced and orthogonal."""
    try:
        design = np.asarray(make(), dtype=float)
    except Exception:  # whatever a package raises, it did not make one
        return False
    full = np.column_stack([np.ones(len(design)), design])
    return design.shape == (n, k) and bool(np.allclose(full.T @ full, n * np.eye(k + 1)))


def _named(sizes: list[int], made: list[bool]) -> str:
    missing = [str(n) for n, is_made in zip(sizes, made, strict=True) if not is_made]
    if not missing:
        return "all"
    if len(missing) == len(sizes):
        return "–"
    if len(missing) < len(sizes) / 2:
        return f"all but {', '.join(missing)}"
    return ", ".join(str(n) for n, is_made in zip(sizes, made, strict=True) if is_made)


if __name__ == "__main__":
    print(table())

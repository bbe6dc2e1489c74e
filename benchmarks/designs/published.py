"""Uniform designs against the best published ones: ``python -m benchmarks.designs.published [SECONDS [PART PARTS]]``.

Seconds are processor seconds of one core; the budget is found from a short trial, so that each row
spends about what it may.
"""

import csv
import sys
from collections.abc import Iterator
from pathlib import Path

from .search import best_in

PUBLISHED = Path(__file__).parents[2] / "tests" / "reference" / "designs" / "published_cd2.csv"

MATCHED = 1e-9
"""Relative difference that rounding explains."""


def published() -> list[tuple[int, int, int, float]]:
    """Runs, factors, levels and the best published CD₂²."""
    with PUBLISHED.open(encoding="utf-8") as file:
        return [
            (*(int(row[k]) for k in ("n_runs", "n_factors", "n_levels")), float(row["best_published_cd2_squared"]))
            for row in csv.DictReader(file)
        ]


def lines(seconds: float, part: int = 0, parts: int = 1) -> Iterator[str]:
    rows, reached = published()[part::parts], 0
    yield "### Uniform designs against the best published\n"
    yield f"Squared centred discrepancy; each row may spend {seconds:g} processor seconds of one core.\n"
    yield "| runs, factors, levels | best published | ours | ours / published | seconds | exchanges tried |"
    yield "|---|---|---|---|---|---|"
    for n, s, q, best in rows:
        ours, spent, budget = best_in(n, s, q, seconds)
        reached += ours <= best * (1.0 + MATCHED)
        yield f"| {n}, {s}, {q} | {best:.8g} | {ours:.8g} | {ours / best:.5f} | {spent:.1f} | {budget} |"
    yield f"\n{reached} of {len(rows)} matched or beaten.\n"


def table(seconds: float) -> str:
    return "\n".join(lines(seconds))


if __name__ == "__main__":
    for line in lines(*(kind(text) for kind, text in zip((float, int, int), sys.argv[1:] or ["30"], strict=False))):
        print(line, flush=True)

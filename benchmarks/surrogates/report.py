"""From a choice of methods, functions, sizes and seeds to Markdown."""

from collections.abc import Sequence
from pathlib import Path

from .functions import Function
from .methods import Method
from .running import PROCESSES, Task, run
from .scoring import N_TEST
from .tables import NOTE, sizes_table, sources


def report(
    methods: Sequence[Method],
    functions: Sequence[Function],
    sizes: Sequence[int],
    seeds: int,
    cache: Path | None = None,
    processes: int = PROCESSES,
    known_only: bool = False,
) -> str:
    """Run what is not known and tell all; methods whose package is not installed are named and left out."""
    absent = [m for m in methods if m.missing]
    methods = [m for m in methods if not m.missing]
    # Seeds outermost: a run that is stopped leaves whole rows of the first seeds.
    tasks = [Task(f.name, n, seed, m.label) for seed in range(seeds) for n in sizes for f in functions for m in methods]
    outcomes = run(tasks, cache, processes, known_only)
    note = NOTE.format(n_test=N_TEST, seeds=seeds, last=seeds - 1)
    missing = [f"{m.label} is left out: {m.missing} is not installed.\n" for m in absent]
    parts = [sizes_table(outcomes, methods, functions, n, seeds) for n in sizes]
    return "\n".join(["### Surrogates beside peers\n", note + "\n", *missing, *parts, sources(functions, methods)])

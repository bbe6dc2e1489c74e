"""``python -m benchmarks.surrogates``: the tables; see ``--help``."""

import argparse
from collections.abc import Sequence
from pathlib import Path

from .functions import FUNCTIONS, Function
from .methods import Method
from .report import report
from .roster import METHODS, is_ours
from .running import PROCESSES

CACHE = Path("/tmp/bench_surrogates/peers.json")


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.surrogates", description=__doc__)
    parser.add_argument("--only", help="'ours', 'peers', or labels (or parts of them), separated by commas")
    parser.add_argument("--functions", help=f"of {', '.join(f.name for f in FUNCTIONS)}, separated by commas")
    parser.add_argument("--n", default="30,100", help="runs of a design, separated by commas (default: %(default)s)")
    parser.add_argument("--seeds", type=int, default=10, help="designs of each size (default: %(default)s)")
    parser.add_argument("--cache", type=Path, default=CACHE, help="peers' results, kept (default: %(default)s)")
    parser.add_argument("--processes", type=int, default=PROCESSES, choices=range(1, PROCESSES + 1))
    parser.add_argument("--known-only", action="store_true", help="run ours, but of the peers tell only what is kept")
    given = parser.parse_args(arguments)
    try:
        sizes = [int(n) for n in given.n.split(",")]
        if given.seeds < 1 or min(sizes) < 2:
            raise ValueError(f"need --seeds of at least 1 and --n of at least 2, got {given.seeds} and {given.n}")
        methods, functions = _methods(given.only), _functions(given.functions)
    except ValueError as wrong:
        parser.error(str(wrong))
    print(report(methods, functions, sizes, given.seeds, given.cache, given.processes, given.known_only))


def _methods(only: str | None) -> list[Method]:
    if only is None:
        return list(METHODS)
    if only in ("ours", "peers"):
        return [m for m in METHODS if is_ours(m.label) == (only == "ours")]
    return [m for m in METHODS if m.label in {label for part in only.split(",") for label in _labels(part.strip())}]


def _labels(part: str) -> list[str]:
    """The label that is `part`, or those that hold it."""
    labels = {m.label.lower(): m.label for m in METHODS}
    if part.lower() in labels:
        return [labels[part.lower()]]
    found = [label for low, label in labels.items() if part.lower() in low]
    if not found:
        raise ValueError(f"no method is called {part!r}; there are {', '.join(labels.values())}")
    return found


def _functions(names: str | None) -> list[Function]:
    known = {f.name: f for f in FUNCTIONS}
    wanted = list(known) if names is None else [name.strip() for name in names.split(",")]
    for name in wanted:
        if name not in known:
            raise ValueError(f"no function is called {name!r}; there are {', '.join(known)}")
    return [known[name] for name in wanted]


if __name__ == "__main__":
    main()

"""``python -m benchmarks.pushing``: the tables; see ``--help``."""

import argparse
from collections.abc import Sequence

from . import family
from .cases import CASES
from .tables import DEGREES, table


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.pushing", description=__doc__)
    parser.add_argument("--case", choices=list(CASES), help="one mechanism (default: all)")
    parser.add_argument("--degrees", default="2,3,4", help="separated by commas (default: %(default)s; 5 takes longer)")
    given = parser.parse_args(arguments)
    try:
        degrees = [int(d) for d in given.degrees.split(",")]
        if not set(degrees) <= set(DEGREES):
            raise ValueError(f"--degrees are of {', '.join(map(str, DEGREES))}; got {given.degrees}")
    except ValueError as wrong:
        parser.error(str(wrong))
    for name in [given.case] if given.case else CASES:
        print(table(CASES[name](), degrees), flush=True)
    if not given.case:
        print(family.table())


if __name__ == "__main__":
    main()

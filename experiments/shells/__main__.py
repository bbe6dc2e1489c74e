"""Prints the files of the study: ``python -m experiments.shells model > configs/hexflex_calculix/model.inp``."""

import argparse

from .hexflex import MODEL, POINT, Divisions, hexflex_files, placeholders

PARTS = ("model", "linear", "nonlinear")


def part(name: str, refine: int = 1) -> str:
    """The text of one of :data:`PARTS`: the model, or the template of a point for one kind of analysis."""
    files = hexflex_files(placeholders(), divisions=Divisions().refined(refine), nonlinear=name == "nonlinear")
    return files[MODEL if name == "model" else POINT]


def main() -> None:
    """Read the command line and print."""
    parser = argparse.ArgumentParser(prog="python -m experiments.shells", description=__doc__)
    parser.add_argument("part", choices=PARTS)
    parser.add_argument("--refine", type=int, default=1, help="every element of the beams into so many times so many")
    chosen = parser.parse_args()
    if chosen.refine < 1:
        parser.error(f"--refine must be 1 or more, got {chosen.refine}")
    print(part(chosen.part, chosen.refine), end="")


if __name__ == "__main__":
    main()

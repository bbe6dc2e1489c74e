"""Track trajectories with the nonlinear HexFlex: the exported C inverse against linear ones."""

import argparse
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

from pipeline.compilation import keep_compiled
from pipeline.errors import FlexdoceError

OUT = Path("runs/control")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run, print, write; 2 if something is missing or wrong that a user can mend."""
    given = _parser().parse_args(arguments)
    keep_compiled()
    # JAX is imported with these, and must find where compiled programs are kept.
    from . import figures, loading, results
    from .campaign import FULL, SMALL, track

    console = Console(highlight=False, width=None if sys.stdout.isatty() else 130)
    try:
        model = loading.given(given.model) if given.model else loading.fitted(given.out / "study")
        with _progress() as told:
            campaign = track(model, loading.plant_of(model), given.out / "c", SMALL if given.small else FULL, told)
    except (ValueError, RuntimeError, FlexdoceError) as wrong:
        print(f"error: {wrong}", file=sys.stderr)
        return 2
    console.print(results.errors_table(campaign))
    for sentence in results.ratios(campaign):
        console.print(sentence)
    console.print(results.timing_table(campaign))
    console.print(f"Compiler: {campaign.timing.compiler}.")
    for path in (*results.write(campaign, given.out), *figures.draw(campaign, given.out)):
        console.print(f"Written: [bold]{path}[/bold]", soft_wrap=True)
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m examples.control", description=__doc__)
    parser.add_argument("--model", type=Path, help="model.json of the nonlinear HexFlex (default: run the study first)")
    parser.add_argument(
        "--out", type=Path, default=OUT, help="folder for code, tables and figures (default: %(default)s)"
    )
    parser.add_argument("--small", action="store_true", help="a tenth of the samples, fewer seeds and timed calls")
    return parser


@contextmanager
def _progress() -> Iterator:
    """A bar on standard error; nothing where that is no terminal."""
    console = Console(stderr=True)
    columns = (TextColumn("integral loops"), BarColumn(bar_width=32), MofNCompleteColumn(), TimeElapsedColumn())
    with Progress(*columns, console=console, disable=not console.is_terminal) as bars:
        task = bars.add_task("samples", total=None)
        yield lambda done, total: bars.update(task, completed=done, total=total)


if __name__ == "__main__":
    sys.exit(main())

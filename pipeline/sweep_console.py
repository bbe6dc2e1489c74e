"""What a person sees of a sweep in a terminal: a line per member, the grid before, the comparison after."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager

from rich.box import SIMPLE_HEAD
from rich.markup import escape
from rich.table import Table

from .console import console, progress_bars
from .executors import Progress
from .grid import Axis, Member, shown
from .store import PAGE, TABLE
from .sweep_rows import Row
from .sweeping import Planned, Sweep, Watch


class Bars(Watch):
    """A line for each member, above the usual bars of its stages."""

    @contextmanager
    def begin(self, member: Member, number: int, total: int) -> Iterator[Progress]:
        """The line, and the bars below it."""
        console.print(f"[bold]{number} of {total}[/bold]  {escape(member.name)}", soft_wrap=True)
        with progress_bars() as bars:
            yield bars

    def end(self, row: Row) -> None:
        """What became of a member that fell short; the others are in the table."""
        if row.code:
            console.print(f"{row.outcome}: {row.reason}", style="yellow", markup=False, soft_wrap=True)


def print_plan(grid: Sequence[Axis], chosen: Sequence[Planned]) -> None:
    """The grid, with the most runs that each member may ask for."""
    table = Table(title=f"{len(chosen)} members", title_justify="left", header_style="bold", box=SIMPLE_HEAD)
    table.add_column("member", overflow="fold")
    for key in (key for axis in grid for key in axis.keys):
        table.add_column(key.replace("[", "\\["), justify="right", overflow="fold")
    table.add_column("runs at most", justify="right")
    for one in chosen:
        values = [escape(shown(value)) for _, value in one.member.settings]
        table.add_row(escape(one.member.name), *values, str(one.most_runs))
    console.print(table)
    console.print(f"At most {sum(one.most_runs for one in chosen)} runs in all; what members have in common is run "
                  "once. All members were checked; nothing was run.", soft_wrap=True)  # fmt: skip


def sweep_summary(found: Sweep) -> None:
    """One row per member, and where everything is."""
    title = f"{found.config.name}: {len(found.rows)} members"
    table = Table(header_style="bold", title_justify="left", title=title, box=SIMPLE_HEAD, padding=(0, 1))
    longest = max(len(row.member.name) for row in found.rows)
    table.add_column("member", overflow="fold", min_width=min(longest, 22))
    for heading in ("new runs", "largest error", "box", "inverse", "outcome"):
        is_text = heading in ("inverse", "outcome")
        table.add_column(heading, justify="left" if is_text else "right", no_wrap=heading != "outcome")
    for row in found.rows:
        table.add_row(escape(row.member.name), str(row.new), *_results(row), row.outcome)
    console.print(table)
    console.print("Box: side of the box on which the inverse is certified, over the ranges.", style="dim")
    asked = sum(row.asked for row in found.rows)
    console.print(f"The oracle was asked for {asked} runs this time; the rest was known or shared.")
    for what, name in {"Page": PAGE, "Table": TABLE}.items():
        console.print(f"{what + ':':<8}[bold]{escape(str(found.path / name))}[/bold]", soft_wrap=True)


def _results(row: Row) -> list[str]:
    found = row.found
    return [f"{100 * found.worst:.2g} %", f"{100 * found.side:.3g} %", found.verdict] if found else ["–", "–", "–"]

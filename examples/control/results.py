"""The numbers: tables for a terminal, CSV files for everything else."""

import csv
from collections.abc import Iterable
from pathlib import Path

from rich.box import SIMPLE_HEAD
from rich.table import Table

from .campaign import LINEAR, OURS, Campaign

COORDINATES = ("x", "y", "z", "theta_x", "theta_y", "theta_z")
UNITS = ("m", "m", "m", "rad", "rad", "rad")
FOUR = ("position_rms[m]", "position_max[m]", "rotation_rms[rad]", "rotation_max[rad]")


def errors_table(campaign: Campaign) -> Table:
    """Errors in µm and µrad, and the least of the four over those of the certified feed-forward."""
    table = Table(box=SIMPLE_HEAD, padding=(0, 1), header_style="bold")
    for heading in ("trajectory", "plant", "controller"):
        table.add_column(heading, no_wrap=True)
    for heading in ("RMS µm", "max µm", "RMS µrad", "max µrad", "÷ certified", "refused"):
        table.add_column(heading, justify="right", no_wrap=True)
    before = ("", "")
    for e in campaign.errors:
        ours = campaign.of(e.trajectory, e.disturbance, OURS)
        ratio = float((e.four / ours.four).min())
        here = (e.trajectory, e.disturbance)
        shown = tuple("" if a == b and here[0] == before[0] else a for a, b in zip(here, before, strict=True))
        if before[0] and here[0] != before[0]:
            table.add_section()
        table.add_row(*shown, e.controller, *(_short(1e6 * v) for v in e.four), _short(ratio), str(e.refused))
        before = here
    return table


def timing_table(campaign: Campaign) -> Table:
    """Time of one call of the exported inverse."""
    table = Table(box=SIMPLE_HEAD, padding=(0, 1), header_style="bold")
    table.add_column("one call of the exported inverse", no_wrap=True)
    table.add_column("µs", justify="right", no_wrap=True)
    for what, time in campaign.timing.summary().items():
        table.add_row(what, f"{time:.3g}")
    return table


def _short(value: float) -> str:
    """Three digits, and no power of ten for what is large."""
    return f"{value:.0f}" if value >= 100.0 else f"{value:.3g}"


def ratios(campaign: Campaign) -> list[str]:
    """One sentence per linear inverse."""
    return [
        f"Feed-forward, plant as modelled: '{linear}' errs at least {campaign.ratio(linear):.0f} times as much as the "
        "certified inverse, in every coordinate of every trajectory, RMS and largest."
        for linear in LINEAR
    ]


def write(campaign: Campaign, folder: Path) -> list[Path]:
    """``errors.csv`` (SI) and ``timing.csv`` (µs)."""
    measures = [f"{q}_{m}[{u}]" for m in ("rms", "max") for q, u in zip(COORDINATES, UNITS, strict=True)]
    heads = ["trajectory", "plant", "controller", "runs", "refused", *FOUR, *measures]
    rows = [
        [e.trajectory, e.disturbance, e.controller, e.runs, e.refused, *e.four, *e.rms, *e.largest]
        for e in campaign.errors
    ]
    times = [[what, time] for what, time in campaign.timing.summary().items()]
    return [
        _csv(folder / "errors.csv", heads, rows),
        _csv(folder / "timing.csv", ["what", "time[us]"], times),
    ]


def _csv(path: Path, heads: list[str], rows: Iterable[list]) -> Path:
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(heads)
        writer.writerows([[v if isinstance(v, str | int) else repr(float(v)) for v in row] for row in rows])
    return path

"""Plots of what the response does over the two levels: main effects and interactions."""

from typing import TYPE_CHECKING

import numpy as np

from ..runs import Runs
from .contrasts import completed_values, contrast_columns, effects
from .labels import SMALLEST, tick_size

if TYPE_CHECKING:
    from matplotlib.axes import Axes

LINE, CENTRE, LOW, HIGH = "#1d4ed8", "#c2410c", "#64748b", "#c2410c"
SIGNED = "RdBu_r"
WRITTEN = 12
"""Up to so many factors the number is written into each cell."""


def main_effects_plot(ax: "Axes", runs: Runs, response: int) -> "Axes":
    """Mean response at the low and the high level of every factor, side by side; dashed: the centre points.

    Where runs failed the means are those of least squares.
    """
    found = effects(runs)
    shown = runs.responses[response]
    corner = np.abs(contrast_columns(runs.design)).any(axis=1)
    mean = completed_values(runs)[corner, response].mean() * shown.shown_scale
    half = 0.5 * found.values[: found.n_factors, response] * shown.shown_scale
    at = np.arange(found.n_factors)
    font = tick_size(ax, len(at), "x")
    ax.axhline(mean, color=LOW, lw=0.7)
    marker = 3.0 if len(at) <= 15 else 1.5
    for i, h in zip(at, half, strict=True):
        ax.plot([i - 0.3, i + 0.3], [mean - h, mean + h], "o-", color=LINE, ms=marker, lw=1.2)
    if found.centre is not None:
        centre = runs.values[~corner & runs.ok, response].mean() * shown.shown_scale
        ax.axhline(centre, color=CENTRE, lw=0.8, ls="--")
        above = "bottom" if centre >= mean else "top"
        ax.text(
            0.995, centre, "centre", transform=ax.get_yaxis_transform(), color=CENTRE, fontsize=6, ha="right", va=above
        )
    ticks = at if font >= SMALLEST else at[:: int(np.ceil(SMALLEST / font))]
    turned = 90 if len(at) > 6 else 0
    ax.set_xticks(ticks, [found.names[i] for i in ticks], rotation=turned, fontsize=max(font, SMALLEST))
    ax.set_xlim(-0.6, len(at) - 0.4)
    ax.set(ylabel=f"mean {shown.symbol} [{shown.shown_unit}]", title="Main effects, low to high" + _failed(runs))
    return ax


def interaction_plot(ax: "Axes", runs: Runs, response: int, first: str, second: str) -> "Axes":
    """Mean response against the `first` factor, a line for each level of the `second`: parallel without interaction.

    Failed runs are left out of the means, which other factors then shift a little.

    Raises
    ------
    ValueError
        If a factor is unknown, both are the same, or no run of one of their four combinations has an answer.
    """
    space, shown = runs.design.space, runs.responses[response]
    if first == second:
        raise ValueError(f"an interaction needs two factors, got {first!r} twice")
    a, b = (runs.design.coded[:, space.index(name)] for name in (first, second))
    levels = (-1.0, 1.0)
    cells = [[(np.sign(a) == i) & (np.sign(b) == j) & runs.ok for i in levels] for j in levels]
    if not all(cell.any() for row in cells for cell in row):
        if not runs.ok.all():
            raise ValueError(f"no run with one of the four combinations of {first} and {second} has an answer")
        raise ValueError(f"the design never tries all four combinations of {first} and {second}")
    mean = [[runs.values[cell, response].mean() * shown.shown_scale for cell in row] for row in cells]
    for j, color in ((0, LOW), (1, HIGH)):
        ax.plot(levels, mean[j], "o-", color=color, ms=3.5, lw=1.3)
    ends = np.array([mean[0][1], mean[1][1]])
    low, high = np.min(mean), np.max(mean)
    pad = 0.15 * (high - low) or 1.0
    ax.set_xlim(-1.25, 2.1)
    ax.set_ylim(low - pad, high + pad)
    # Where the lines end together their names would: keep them a line apart.
    box = ax.get_window_extent().height * 72.0 / ax.figure.dpi
    apart = 9.0 * (high - low + 2.0 * pad) / max(box, 1.0)
    gap = max(apart - abs(ends[1] - ends[0]), 0.0) * 0.5 * (1.0 if ends[1] >= ends[0] else -1.0)
    for end, shift, sign, color in ((ends[0], -gap, "−", LOW), (ends[1], gap, "+", HIGH)):
        ax.text(1.1, end + shift, f"{second} {sign}", color=color, fontsize=7, va="center")
    ax.set_xticks(levels, [f"{first} −", f"{first} +"], fontsize=7)
    ax.set(ylabel=f"mean {shown.symbol} [{shown.shown_unit}]", title=f"{first}:{second}{_failed(runs)}")
    return ax


def interaction_map(ax: "Axes", runs: Runs, response: int) -> "Axes":
    """Main effects (diagonal) and two-factor interaction contrasts of all pairs as a heat map.

    In a design where interactions are aliased with other effects a cell shows what all its aliases sum to. For a
    failed run stands what the main effects predict there, so that interactions come out a little too small.
    """
    found = effects(runs)
    shown, k = runs.responses[response], found.n_factors
    factors = contrast_columns(runs.design)[:, :k]
    weighed = factors * (completed_values(runs)[:, [response]] * shown.shown_scale)
    # A centre point weighs nothing, its columns being zero.
    matrix = 2.0 / found.n_runs * factors.T @ weighed
    np.fill_diagonal(matrix, found.values[:k, response] * shown.shown_scale)
    top = np.abs(matrix).max() or 1.0
    image = ax.imshow(matrix, cmap=SIGNED, vmin=-top, vmax=top, aspect="auto")
    font = tick_size(ax, k, "y")
    step = 1 if font >= SMALLEST else int(np.ceil(SMALLEST / font))
    at, font = np.arange(0, k, step), max(font, SMALLEST)
    ax.set_xticks(at, [found.names[i] for i in at], rotation=90, fontsize=font)
    ax.set_yticks(at, [found.names[i] for i in at], fontsize=font)
    if k <= WRITTEN:
        for i, j in np.ndindex(k, k):
            color = "white" if abs(matrix[i, j]) > 0.6 * top else "black"
            ax.text(j, i, f"{matrix[i, j]:.2g}", ha="center", va="center", fontsize=0.8 * font, color=color)
    bar = ax.figure.colorbar(image, ax=ax, fraction=0.05)
    bar.set_label(f"effect [{shown.shown_unit}]", fontsize=7)
    bar.ax.tick_params(labelsize=6)
    ax.set_title("Effects and interactions" + _failed(runs))
    return ax


def _failed(runs: Runs) -> str:
    """For a title: how many runs failed, if any."""
    n = int((~runs.ok).sum())
    return f" ({n} of {len(runs)} runs failed)" if n else ""

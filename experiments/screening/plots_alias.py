"""A heat map of what each column of a two-level design also measures."""

from typing import TYPE_CHECKING

import numpy as np

from ..designs.base import Design
from .aliasing import alias_matrix, interaction_columns, named_columns
from .contrasts import completing_columns, contrast_columns
from .labels import SMALLEST, tick_size

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SHADES = "magma_r"
GRID = "#94a3b8"


def alias_map(ax: "Axes", design: Design) -> "Axes":
    """How much of each two-factor interaction (across) every column (down) carries, from 0 to 1.

    Of the whole design: runs that fail blur it, as ``Holes`` says.

    Raises
    ------
    ValueError
        If the design is not an orthogonal two-level design of two or more factors.
    """
    factors = design.space.names
    if len(factors) < 2:
        raise ValueError("an alias map needs two factors or more: one has no interactions")
    columns = contrast_columns(design)
    more, labels = completing_columns(columns, factors)
    columns, names, _ = named_columns(np.hstack([columns, more]), factors, design.dummy_names + labels)
    pairs, _ = interaction_columns(columns[:, : len(factors)])
    matrix = np.abs(alias_matrix(columns, len(factors)))
    image = ax.imshow(matrix, cmap=SHADES, vmin=0.0, vmax=1.0, aspect="auto", interpolation="nearest")
    font = tick_size(ax, len(names), "y")
    down = np.arange(0, len(names), max(int(np.ceil(SMALLEST / font)), 1))
    ax.set_yticks(down, [names[i] for i in down], fontsize=max(font, SMALLEST))
    _ticks_across(ax, pairs, factors)
    ax.axhline(len(factors) - 0.5, color=GRID, lw=0.8)
    bar = ax.figure.colorbar(image, ax=ax, fraction=0.04)
    bar.set_label("|alias|", fontsize=7)
    bar.ax.tick_params(labelsize=6)
    ax.set_title("What each column also measures")
    return ax


def _ticks_across(ax: "Axes", pairs: list[tuple[int, int]], factors: tuple[str, ...]) -> None:
    """Every interaction by name if that can be read, else where the interactions of each first factor begin."""
    font = tick_size(ax, len(pairs), "x")
    if font >= SMALLEST:
        labels = [f"{factors[i]}:{factors[j]}" for i, j in pairs]
        ax.set_xticks(np.arange(len(pairs)), labels, rotation=90, fontsize=font)
        return
    first = np.array([i for i, _ in pairs])
    starts = np.flatnonzero(np.diff(first, prepend=-1))
    room = tick_size(ax, 1, "x", np.inf) / len(pairs)
    kept, last = [], -np.inf
    for start in starts:
        if (start - last) * room >= SMALLEST:
            kept.append(start)
            last = start
    ax.set_xticks(kept, [f"{factors[first[s]]}:…" for s in kept], rotation=90, fontsize=SMALLEST + 0.5)
    for start in kept[1:]:
        ax.axvline(start - 0.5, color=GRID, lw=0.3)

"""A picture of a design: matplotlib figure in, figure out."""

from typing import TYPE_CHECKING

import numpy as np

from .base import Design

if TYPE_CHECKING:
    from matplotlib.figure import Figure

POINT, LINE = "#1d4ed8", "#cbd5e1"


def pairs(figure: "Figure", design: Design, names: tuple[str, ...] | None = None) -> "Figure":
    """Every pair of the named factors (all, if not given) as a scatter in coded units: holes and clumps show."""
    names = names or design.space.names
    columns = [design.space.index(name) for name in names]
    n = len(columns)
    axes = np.atleast_2d(figure.subplots(n, n, sharex=True, sharey=True, squeeze=False))
    for row, i in enumerate(columns):
        for column, j in enumerate(columns):
            ax = axes[row, column]
            ax.set(xticks=[], yticks=[], xlim=(-1.2, 1.2), ylim=(-1.2, 1.2))
            ax.set_aspect("equal")
            for spine in ax.spines.values():
                spine.set_color(LINE)
            if row == column:
                ax.text(0.0, 0.0, names[row], ha="center", va="center", fontsize=8)
            elif row > column:
                ax.plot(design.coded[:, j], design.coded[:, i], ".", color=POINT, ms=3.0)
            else:
                ax.axis("off")
    return figure

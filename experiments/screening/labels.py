"""Labels that do not collide, and tick labels that fit."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from matplotlib.axes import Axes

WIDTH, HEIGHT = 0.7, 1.25
"""Size of a letter in units of the font size, about."""
SHRINK = 0.85
"""Layouts with tick labels leave about this much of the axes that were there when the labels were placed."""
SMALLEST = 4.5
"""Font size, points, below which nothing can be read."""
FAR = 8.0
"""A label this many points off its point gets a leader line."""
PLACES = [(0, 1), (0, -1), (-1, 0), (1, 0), (-1, 1), (1, 1), (-1, -1), (1, -1),
          (-0.5, 1), (0.5, 1), (-0.5, -1), (0.5, -1), (-1, 0.5), (1, 0.5), (-1, -0.5), (1, -0.5)]  # fmt: skip
"""Directions tried for a label, in this order."""
DISTANCES = (0.0, 5.0, 11.0, 18.0, 26.0, 36.0, 48.0, 62.0)
"""How far off a label is tried, points."""


def place_labels(
    ax: "Axes",
    x: NDArray[np.float64],
    y: NDArray[np.float64],
    labels: Sequence[str],
    color: str,
    size: float = 7.0,
    others: NDArray[np.float64] | None = None,
) -> None:
    """Write each label beside its point, clear of the points and of labels already there; drop none.

    Parameters
    ----------
    ax : Axes
        With its limits already set.
    x, y : ndarray, shape (n_labels,)
        Points in data units.
    labels : sequence of str
        One per point.
    color : str
        Of the text.
    size : float
        Font size in points.
    others : ndarray, shape (n_points, 2), optional
        More points, in data units, that must stay uncovered.
    """
    points = 72.0 / ax.figure.dpi * SHRINK
    extra = np.empty((0, 2)) if others is None else others
    data = np.vstack([np.column_stack([x, y]), extra])
    at = ax.transData.transform(data) * points
    frame = ax.transAxes.transform([(0, 0), (1, 1)]) * points
    taken = [(px - 2.5, py - 2.5, px + 2.5, py + 2.5) for px, py in at]
    for i in np.argsort(-np.asarray(y), kind="stable"):
        half = np.array([0.5 * WIDTH * size * len(labels[i]), 0.5 * HEIGHT * size])
        offset = _offset(at[i], half, np.array(taken), frame)
        leader = _leader(at[i], half, offset)
        taken += [(*(at[i] + offset - half), *(at[i] + offset + half)), *(tuple(box) for box in leader)]
        line = {"arrowstyle": "-", "color": color, "lw": 0.4, "shrinkB": 2.0} if len(leader) else None
        ax.annotate(str(labels[i]), tuple(data[i]), tuple(offset), textcoords="offset points", ha="center", va="center",
                    fontsize=size, color=color, annotation_clip=False, arrowprops=line)  # fmt: skip


def _offset(at, half, taken, frame) -> NDArray[np.float64]:
    """Offset of the nearest free place inside the frame, in points; if there is none, leader lines may cross labels."""
    for with_leader in (True, False):
        for far in DISTANCES:
            for place in PLACES:
                offset = np.array(place) * (half + 4.0 + far)
                box = np.concatenate([at + offset - half, at + offset + half])
                inside = (box[:2] >= frame[0] - 1.0).all() and (box[2:] <= frame[1] + 1.0).all()
                mine = np.vstack([box, _leader(at, half, offset)]) if with_leader else box[None]
                if inside and not _overlap(mine, taken).any():
                    return offset
    return np.array([0.0, half[1] + 4.0])


def _leader(at, half, offset) -> NDArray[np.float64]:
    """Small boxes along the line from a point to its label, shape (n, 4); none where the label is beside its point."""
    if np.hypot(*np.maximum(np.abs(offset) - half, 0.0)) <= FAR:
        return np.empty((0, 4))
    way = at + np.linspace(0.0, 1.0, 24)[:, None] * offset
    clear = (np.abs(way - at - offset) > half).any(axis=1) & (np.hypot(*(way - at).T) > 5.0)
    return np.hstack([way[clear] - 0.5, way[clear] + 0.5])


def _overlap(boxes: NDArray[np.float64], others: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Which boxes (x0, y0, x1, y1) overlap which others, shape (n, m)."""
    one, other = boxes[:, None], others[None]
    return np.all((one[..., :2] < other[..., 2:]) & (one[..., 2:] > other[..., :2]), axis=-1)


def tick_size(ax: "Axes", n: int, along: str, largest: float = 7.0) -> float:
    """Font size in points at which `n` one-line tick labels fit along axis ``"x"`` (turned) or ``"y"``."""
    box = ax.get_window_extent()
    length = (box.width if along == "x" else box.height) * 72.0 / ax.figure.dpi * SHRINK
    return min(largest, length / (HEIGHT * max(n, 1)))

"""A mechanism at rest and displaced, in 3D: matplotlib axes in, axes out."""

from typing import TYPE_CHECKING, Any

import numpy as np

from .base import Shape

if TYPE_CHECKING:
    from mpl_toolkits.mplot3d.axes3d import Axes3D

STRETCH = 0.15
"""Of a rigid part in a drawing with multiplied displacements."""

REST, MOVED, RIGID, LOAD, ANCHOR = "#94a3b8", "#1d4ed8", "#0f172a", "#c2410c", "#475569"


def size(shape: Shape) -> float:
    """Largest extent of the mechanism at rest, m."""
    points = np.vstack([line.points for line in shape.lines])
    return float(np.ptp(points, axis=0).max())


def is_planar(shape: Shape) -> bool:
    """Whether the mechanism lies in a plane of constant z and moves in it."""
    lines = shape.lines
    return bool(np.ptp(np.vstack([line.points for line in lines])[:, 2]) == 0.0) and not any(
        line.displacement[:, 2].any() for line in lines
    )


def exaggeration(shape: Shape, visible: float = 0.25) -> float:
    """A round factor (1, 2 or 5 times a power of ten) that shows the largest displacement as `visible` of the size.

    Smaller, down to 1, where it would stretch what is rigid by more than :data:`STRETCH`, as large
    rotations do that are multiplied.
    """
    largest = max(float(np.linalg.norm(line.displacement, axis=1).max()) for line in shape.lines)
    if largest == 0.0:
        return 1.0
    wanted = visible * size(shape) / largest
    power = 10.0 ** np.floor(np.log10(wanted))
    steps = [m * p for p in (power / 10.0, power) for m in (1.0, 2.0, 5.0) if m * p <= wanted * (1.0 + 1e-9)]
    fair = [f for f in steps if f <= 1.0 or _stretch(shape, f) <= STRETCH]
    return float(fair[-1] if fair else steps[0])


def _stretch(shape: Shape, factor: float) -> float:
    """Largest relative change of length of what is rigid, where displacements are multiplied by `factor`."""
    found = 0.0
    for line in shape.lines:
        if line.rigid:
            rest, moved = (np.linalg.norm(np.diff(p, axis=0), axis=1) for p in (
                line.points, line.points + factor * line.displacement))  # fmt: skip
            found = max(found, float((np.abs(moved - rest) / np.where(rest > 0.0, rest, np.inf)).max()))
    return found


def draw_shape(ax: "Axes3D", shape: Shape, factor: float | None = None) -> "Axes3D":
    """Draw the displaced mechanism, displacements times `factor`, over the mechanism at rest (in mm).

    A planar mechanism is seen from above.
    """
    factor = exaggeration(shape) if factor is None else factor
    for line in shape.lines:
        ax.plot(*(1e3 * line.points.T), color=REST, lw=1.0, ls=(0, (4, 2)), zorder=1)
    for line in shape.lines:
        color, width = (RIGID, 2.2) if line.rigid else (MOVED, 1.8)
        ax.plot(*(1e3 * (line.points + factor * line.displacement).T), color=color, lw=width, zorder=2)
    if len(shape.anchors):
        ax.plot(*(1e3 * shape.anchors.T), "s", color=ANCHOR, ms=5, zorder=3)
    reach = 0.12 * size(shape)
    for arrow in shape.arrows:
        foot = 1e3 * (arrow.point + factor * arrow.displacement)
        ax.quiver(*foot, *(1e3 * reach * arrow.direction), color=LOAD, lw=1.2, arrow_length_ratio=0.25)
        ax.text(*(foot + 1.15e3 * reach * arrow.direction), arrow.label, color=LOAD, fontsize=7)
    _equal_axes(ax, shape, factor)
    ax.set(xlabel="x [mm]", ylabel="y [mm]", zlabel="z [mm]")
    if is_planar(shape):
        ax.view_init(elev=90.0, azim=-90.0)
        ax.set_proj_type("ortho")
        ax.set(zticks=[], zlabel="")
    return ax


def _equal_axes(ax: Any, shape: Shape, factor: float) -> None:
    points = 1e3 * np.vstack(
        [p for line in shape.lines for p in (line.points, line.points + factor * line.displacement)]
    )
    span = np.maximum(np.ptp(points, axis=0), 0.2 * np.ptp(points, axis=0).max())
    middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
    ax.set_xlim(middle[0] - span[0] / 2, middle[0] + span[0] / 2)
    ax.set_ylim(middle[1] - span[1] / 2, middle[1] + span[1] / 2)
    ax.set_zlim(middle[2] - span[2] / 2, middle[2] + span[2] / 2)
    ax.set_box_aspect(span)

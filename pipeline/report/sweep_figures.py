"""Figures of a sweep: error, certified box and slopes against one swept key."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..grid import Axis, shown
from ..sweep_rows import Found, Row
from ..sweeping import Sweep
from .figures import uri

COLOURS = ("#1d4ed8", "#c2410c", "#15803d", "#a21caf", "#0891b2", "#a16207", "#475569", "#be123c")
MARKS = "osD^vP*X"
DECADE = 10.0
"""From this ratio of largest to smallest on, an axis is logarithmic."""

MOST_CURVES = 12
"""More curves than these carry no names: they would not be read."""

MOST_TICKS = 7
"""More steps than these get the ticks of any axis."""

WIDTH, HEIGHT = 9.6, 2.9


@dataclass(frozen=True, eq=False)
class Curve:
    """One line of a panel: a value, or NaN, at each step of the axis."""

    name: str
    values: NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Panel:
    """One plot: what it shows, and its curves."""

    title: str
    curves: tuple[Curve, ...]
    is_share: bool = False


def dominant(found: Found) -> list[int]:
    """Position of the factor that moves each response most over its range, at the centre."""
    return [int(i) for i in np.abs(found.slopes * found.factors.half_range).argmax(axis=1)]


def axis_figure(found: Sweep, which: int) -> str:
    """All quantities against one axis of the grid, as a data URI.

    With one axis, a curve for each response; with more, a curve for each combination of the other axes' values.
    """
    panels = _of_responses(found.rows) if len(found.grid) == 1 else _of_combinations(found, which)
    n_rows = -(-len(panels) // 3)

    def draw(figure: Any) -> None:
        places = np.ravel(figure.subplots(n_rows, 3, squeeze=False))
        for place, panel in zip(places, panels, strict=False):
            _draw(place, panel, found.grid[which], found.units)
        for place in places[len(panels) :]:
            place.set_axis_off()
        named = {text: line for place in places for line, text in zip(*place.get_legend_handles_labels(), strict=True)}
        if 1 < len(named) <= MOST_CURVES:
            figure.legend(list(named.values()), list(named), loc="outside lower center", ncols=min(len(named), 7),
                          frameon=False)  # fmt: skip

    return uri(draw, (WIDTH, HEIGHT * n_rows + 0.3))


def _of_responses(rows: Sequence[Row]) -> list[Panel]:
    first = next(row.found for row in rows if row.found)
    errors, shares, slopes = [], [], []
    for response, j in zip(first.responses, dominant(first), strict=True):
        name = response.symbol
        errors.append(Curve(name, _along(rows, lambda f, r=response: 100.0 * f.error(r.name))))
        shares.append(Curve(name, _along(rows, lambda f, r=response: f.shares.get(r.name))))
        slopes.append(Curve(name, _relative(_along(rows, _slope_of(first, response.name, j)))))
    side = Curve("of the factors", _along(rows, lambda f: f.side))
    return [
        Panel("largest error, % of the range", tuple(errors)),
        Panel("certified box, share of the range", (side, *shares), is_share=True),
        Panel(f"slope at the centre ÷ {_first_named(rows)}", tuple(slopes)),
    ]


def _of_combinations(found: Sweep, which: int) -> list[Panel]:
    groups = _groups(found, which)
    first = next(row.found for row in found.rows if row.found)

    def panel(title: str, value: Any, is_share: bool = False) -> Panel:
        return Panel(title, tuple(Curve(name, _along(rows, value)) for name, rows in groups.items()), is_share)

    panels = [
        panel("largest error, % of the range", lambda f: 100.0 * f.worst),
        panel("certified box, share of the ranges", lambda f: f.side, is_share=True),
        panel("box of targets, smallest share of a range", lambda f: min(f.shares.values(), default=None), True),
    ]
    start = _first_named(found.rows)
    for response, j in zip(first.responses, dominant(first), strict=True):
        slope = _slope_of(first, response.name, j)
        base = slope(first)
        panels.append(panel(f"slope of {response.symbol} ÷ {start}",
                            lambda f, s=slope, b=base: None if not b or s(f) is None else s(f) / b))  # fmt: skip
    return panels


def _groups(found: Sweep, which: int) -> dict[str, list[Row]]:
    """Rows in the order of one axis, by what the others are."""
    varied = set(found.grid[which].keys)
    groups: dict[str, list[Row]] = {}
    for row in found.rows:
        others = [
            f"{key.rpartition('.')[2]} = {shown(value)}" for key, value in row.member.settings if key not in varied
        ]
        groups.setdefault(", ".join(others), []).append(row)
    return groups


def _slope_of(first: Found, response: str, factor: int) -> Any:
    name = first.factors.names[factor]
    return lambda found: found.slope(response, name)


def _along(rows: Sequence[Row], value: Any) -> NDArray[np.float64]:
    found = [None if row.found is None else value(row.found) for row in rows]
    return np.array([np.nan if v is None else v for v in found], dtype=np.float64)


def _relative(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Over the first that is known."""
    known = values[np.isfinite(values) & (values != 0.0)]
    return values / known[0] if len(known) else np.full_like(values, np.nan)


def _first_named(rows: Sequence[Row]) -> str:
    index = next(i for i, row in enumerate(rows) if row.found)
    return "that of the first member" if index == 0 else f"that of member {index + 1}"


def _draw(axes: Any, panel: Panel, axis: Axis, units: Any) -> None:
    x, labels = _positions(axis)
    colours = _colours(len(panel.curves), panel.is_share and panel.curves[0].name == "of the factors")
    few = len(panel.curves) <= MOST_CURVES
    for i, curve in enumerate(panel.curves):
        axes.plot(x, curve.values, color=colours[i], marker=MARKS[i % len(MARKS)], markersize=3.5, linewidth=1.2,
                  label=curve.name if few else None, linestyle="-" if labels is None else ":")  # fmt: skip
    axes.set_title(panel.title)
    axes.set_xlabel(_label(axis, units))
    if labels is not None:
        axes.set_xticks(x, labels, rotation=0 if max(map(len, labels)) <= 10 else 20)
        axes.set_xlim(-0.5, len(x) - 0.5)
    else:
        _scale_steps(axes, x)
    values = np.concatenate([curve.values for curve in panel.curves])
    if panel.is_share:
        # The box may be larger than the range on the fresh runs, which do not reach the ends.
        axes.set_ylim(-0.03, 1.05 * max(1.0, np.nanmax(values, initial=0.0)))
    else:
        _scale_values(axes, values)


def _positions(axis: Axis) -> tuple[NDArray[np.float64], list[str] | None]:
    """Where each step lies, and its label where steps are no numbers."""
    firsts = [step[0] for step in axis.values]
    is_number = all(isinstance(v, int | float) and not isinstance(v, bool) for v in firsts)
    if is_number and len(set(firsts)) == len(firsts):
        return np.array(firsts, dtype=np.float64), None
    return np.arange(float(len(firsts))), [_shortened(", ".join(shown(v) for v in step)) for step in axis.values]


def _shortened(text: str, most: int = 18) -> str:
    return text if len(text) <= most else text[: most - 1] + "…"


def _label(axis: Axis, units: Any) -> str:
    first, *others = axis.keys
    unit = f" [{units[first]}]" if first in units else ""
    beside = f" (with {', '.join(k.rpartition('.')[2] for k in others)})" if others else ""
    return f"{first.removeprefix('oracle.parameters.')}{unit}{beside}".replace("$", r"\$")


def _scale_steps(axes: Any, x: NDArray[np.float64]) -> None:
    """Logarithmic where positive steps span a decade; ticks at the steps themselves, if they are few."""
    is_log = x.min() > 0.0 and x.max() >= DECADE * x.min()
    if is_log:
        axes.set_xscale("log")
    if len(x) <= MOST_TICKS:
        axes.set_xticks(x, [f"{v:.4g}" for v in x])
        axes.set_xticks([], minor=True)


def _scale_values(axes: Any, values: NDArray[np.float64]) -> None:
    """Logarithmic where positive values span a decade; else from zero, where none is negative."""
    known = values[np.isfinite(values)]
    if not len(known) or known.min() < 0.0:
        return
    if known.min() > 0.0 and known.max() >= DECADE * known.min():
        axes.set_yscale("log")
        axes.set_ylim(known.min() / 1.5, known.max() * 1.5)
        return
    axes.set_ylim(0.0, 1.08 * known.max() or 1.0)


def _colours(n: int, black_first: bool) -> list[str]:
    rest = [COLOURS[i % len(COLOURS)] for i in range(n)]
    return ["#0f172a", *rest[: n - 1]] if black_first else rest

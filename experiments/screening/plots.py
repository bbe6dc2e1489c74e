"""Screening plots: matplotlib axes in, axes out. Numbers are shown in the response's unit for people.

Give an axes its final size before it is drawn on: labels are placed for the size it has then.
"""

from typing import TYPE_CHECKING

import numpy as np

from ..naming import drawn
from ..runs import Response
from .daniel import half_normal_fit
from .judgement import Judgement
from .labels import SMALLEST, place_labels, tick_size
from .plots_alias import alias_map
from .plots_effects import interaction_map, interaction_plot, main_effects_plot

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = [
    "alias_map",
    "half_normal",
    "interaction_map",
    "interaction_plot",
    "lenth_plot",
    "main_effects_plot",
    "pareto",
]

ACTIVE, QUIET, MARGIN = "#c2410c", "#64748b", "#0f766e"


def half_normal(ax: "Axes", result: Judgement, response: Response) -> "Axes":
    """Absolute effects against half-normal quantiles; what leaves the line through the origin acts.

    Daniel (1959), "Use of half-normal plots in interpreting factorial two-level experiments",
    Technometrics 1, 311–341. The line is fitted to the smallest 68.3 %: Zahn (1975), Technometrics 17, 189–200.
    """
    order = np.argsort(np.abs(result.contrasts), kind="stable")
    fit = half_normal_fit(result.contrasts, result.names)
    size = fit.sizes * response.shown_scale
    active = result.active[order]
    top = size.max(initial=0.0)
    reach = fit.quantiles[-1] * 1.12
    ax.set_xlim(0.0, reach)
    ax.set_ylim(-0.03 * top, 1.18 * top or 1.0)
    ax.plot([0.0, reach], [0.0, fit.slope * reach * response.shown_scale], color=QUIET, lw=0.7, zorder=0.5)
    ax.plot(fit.quantiles[~active], size[~active], "o", color=QUIET, ms=4)
    ax.plot(fit.quantiles[active], size[active], "o", color=ACTIVE, ms=5)
    _margin_lines(ax.axhline, result, response, 1.15 * top)
    ax.set(xlabel="half-normal quantile", ylabel=f"|{_what(result)}| [{drawn(response.shown_unit)}]")
    ax.set(title="Half-normal")
    # Where nothing acts the largest are named all the same: they are what one asks for.
    named = active if active.any() else np.arange(len(size)) >= len(size) - 3
    labels = [fit.names[i] for i in np.flatnonzero(named)]
    rest = np.column_stack([fit.quantiles[~named], size[~named]])
    color, font = ACTIVE if active.any() else QUIET, 7.0 if len(labels) <= 20 else 6.0
    place_labels(ax, fit.quantiles[named], size[named], labels, color, font, rest)
    return ax


def pareto(ax: "Axes", result: Judgement, response: Response) -> "Axes":
    """Absolute effects, the largest on top, with the margins; the smallest are left out where there is no room."""
    order = np.argsort(np.abs(result.contrasts), kind="stable")
    room = max(int(tick_size(ax, 1, "y", np.inf) / SMALLEST), 5)
    left_out = max(len(order) - room, 0)
    order = order[left_out:]
    size = np.abs(result.contrasts[order]) * response.shown_scale
    colors = [ACTIVE if a else QUIET for a in result.active[order]]
    ax.barh(np.arange(len(order)), size, color=colors, height=0.7)
    ax.set_yticks(np.arange(len(order)), [result.names[i] for i in order], fontsize=tick_size(ax, len(order), "y"))
    ax.set_ylim(-0.7, len(order) - 0.3)
    top = size.max(initial=0.0)
    _margin_lines(ax.axvline, result, response, top)
    more = f"; {left_out} smaller not shown" if left_out else ""
    ax.set(xlabel=f"|{_what(result)}| [{drawn(response.shown_unit)}]{more}", title="Pareto")
    ax.set_xlim(0.0, top * 1.12 or 1.0)
    return ax


def lenth_plot(ax: "Axes", result: Judgement, response: Response) -> "Axes":
    """Signed effects in design order, between the margins; Lenth (1989), figure 1.

    Where not every name fits, only those of active contrasts are written.
    """
    size = result.contrasts * response.shown_scale
    colors = [ACTIVE if a else QUIET for a in result.active]
    at = np.arange(len(size))
    ax.bar(at, size, color=colors, width=0.65)
    ax.axhline(0.0, color="black", lw=0.6)
    ax.set_xlim(-0.7, len(size) - 0.3)
    top = np.abs(size).max(initial=0.0)
    _margin_lines(ax.axhline, result, response, top, both=True)
    font = tick_size(ax, len(size), "x")
    shown = at if font >= SMALLEST else np.flatnonzero(result.active)
    ax.set_xticks(shown, [result.names[i] for i in shown], rotation=90, fontsize=max(font, SMALLEST))
    ax.set(ylabel=f"{_what(result)} [{drawn(response.shown_unit)}]", title="Lenth")
    ax.set_ylim(-1.12 * top or -1.0, 1.12 * top or 1.0)
    return ax


def _what(result: Judgement) -> str:
    """What is drawn; where runs failed, effects over the root of their inflation, for which the margins hold."""
    return "effect/√inflation" if result.scaled else "effect"


def _margin_lines(line, result: Judgement, response: Response, top: float, both: bool = False) -> None:
    """ME (dashed) and SME (dotted), named, where they can be told from zero at the plot's scale."""
    ax = line.__self__
    upright = line.__name__ == "axvline"
    for margin, style, name in ((result.me, "--", "ME"), (result.sme, ":", "SME")):
        at = margin * response.shown_scale
        if not 1e-3 * top < at < 1.08 * top:
            continue
        for sign in (1.0, -1.0) if both else (1.0,):
            line(sign * at, color=MARGIN, ls=style, lw=1.0)
        # The two are often close: ME is written inside of its line and SME outside, or one above the other.
        side = "top" if name == "ME" else "bottom"
        place = {"x": at, "y": 0.01 if name == "ME" else 0.1} if upright else {"x": 0.995, "y": at}
        transform = ax.get_xaxis_transform() if upright else ax.get_yaxis_transform()
        ax.text(**place, s=name, transform=transform, color=MARGIN, fontsize=6, ha="left" if upright else "right",
                va="bottom" if upright else side, rotation=90 if upright else 0)  # fmt: skip

"""Screening plots: matplotlib axes in, axes out. Numbers are shown in the response's unit for people."""

from typing import TYPE_CHECKING

import numpy as np
from scipy.stats import norm

from ..runs import Response
from .lenth import LenthResult

if TYPE_CHECKING:
    from matplotlib.axes import Axes

ACTIVE, QUIET, MARGIN = "#c2410c", "#64748b", "#0f766e"


def half_normal(ax: "Axes", result: LenthResult, response: Response) -> "Axes":
    """Absolute effects against half-normal quantiles; what leaves the line through the origin acts.

    Daniel (1959), "Use of half-normal plots in interpreting factorial two-level experiments",
    Technometrics 1, 311–341.
    """
    order = np.argsort(np.abs(result.contrasts), kind="stable")
    size = np.abs(result.contrasts[order]) * response.shown_scale
    m = len(order)
    quantile = norm.ppf(0.5 + 0.5 * (np.arange(1, m + 1) - 0.5) / m)
    active = result.active[order]
    ax.plot(quantile[~active], size[~active], "o", color=QUIET, ms=4)
    ax.plot(quantile[active], size[active], "o", color=ACTIVE, ms=5)
    top = size.max(initial=0.0)
    crowded = 0
    for before, i in zip([-1, *np.flatnonzero(active)], np.flatnonzero(active), strict=False):
        # Symmetric mechanisms have equal effects side by side: stack the labels that would collide.
        letters = len(result.names[order[i]]) + len(result.names[order[before]])
        near = quantile[i] - quantile[before] < 0.03 + 0.025 * letters and size[i] - size[before] < 0.06 * top
        close = before >= 0 and near
        crowded = crowded + 1 if close else 0
        ax.annotate(result.names[order[i]], (quantile[i], size[i]), (0, 5 + 8 * crowded), textcoords="offset points",
                    ha="center", fontsize=7, color=ACTIVE)  # fmt: skip
    _margin_lines(ax.axhline, result, response, top)
    ax.set(xlabel="half-normal quantile", ylabel=f"|effect| [{response.shown_unit}]", title="Half-normal")
    ax.set_xlim(0.0, quantile[-1] * 1.12)
    ax.set_ylim(0.0, 1.18 * top or 1.0)
    return ax


def pareto(ax: "Axes", result: LenthResult, response: Response) -> "Axes":
    """Absolute effects, the largest on top, with the margins."""
    order = np.argsort(np.abs(result.contrasts), kind="stable")
    size = np.abs(result.contrasts[order]) * response.shown_scale
    colors = [ACTIVE if a else QUIET for a in result.active[order]]
    ax.barh(np.arange(len(order)), size, color=colors, height=0.7)
    ax.set_yticks(np.arange(len(order)), [result.names[i] for i in order], fontsize=7)
    top = size.max(initial=0.0)
    _margin_lines(ax.axvline, result, response, top)
    ax.set(xlabel=f"|effect| [{response.shown_unit}]", title="Pareto")
    ax.set_xlim(0.0, top * 1.06 or 1.0)
    return ax


def lenth_plot(ax: "Axes", result: LenthResult, response: Response) -> "Axes":
    """Signed effects in design order, between the margins; Lenth (1989), figure 1."""
    size = result.contrasts * response.shown_scale
    colors = [ACTIVE if a else QUIET for a in result.active]
    ax.bar(np.arange(len(size)), size, color=colors, width=0.65)
    ax.axhline(0.0, color="black", lw=0.6)
    top = np.abs(size).max(initial=0.0)
    _margin_lines(ax.axhline, result, response, top, both=True)
    ax.set_xticks(np.arange(len(size)), result.names, rotation=90, fontsize=7)
    ax.set(ylabel=f"effect [{response.shown_unit}]", title="Lenth")
    ax.set_ylim(-1.12 * top or -1.0, 1.12 * top or 1.0)
    return ax


def _margin_lines(line, result: LenthResult, response: Response, top: float, both: bool = False) -> None:
    """ME (dashed) and SME (dotted), where they can be told from zero at the plot's scale."""
    for margin, style in ((result.me, "--"), (result.sme, ":")):
        at = margin * response.shown_scale
        if 1e-3 * top < at < 1.2 * top:
            for sign in (1.0, -1.0) if both else (1.0,):
                line(sign * at, color=MARGIN, ls=style, lw=1.0)

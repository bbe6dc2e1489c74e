"""Figures of the report as data URIs. What they show is drawn below, in the packages that own it."""

import base64
import io
from collections.abc import Callable
from typing import Any

import matplotlib

from experiments.designs.plots import pairs
from experiments.oracles import Shape
from experiments.oracles.plots import draw_shape
from experiments.screening.plots import half_normal, lenth_plot, pareto
from surrogates.plots import parity, residuals

from ..runner import Outcome

STYLE: dict[Any, Any] = {
    "svg.fonttype": "none",
    "svg.hashsalt": "flexdoce",
    "font.family": "sans-serif",
    "font.sans-serif": ["Helvetica", "Arial", "DejaVu Sans"],
    "font.size": 8.0,
    "axes.titlesize": 9.0,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.formatter.limits": (-3, 4),
    "axes.formatter.use_mathtext": True,
    "figure.facecolor": "none",
    "savefig.dpi": 160,
}


def screening_figure(outcome: Outcome, response: int) -> str:
    """Half-normal, Pareto and Lenth plots of one response, side by side."""
    result, shown = outcome.screening.lenth[response], outcome.model.responses[response]

    def draw(figure) -> None:
        left, middle, right = figure.subplots(1, 3)
        half_normal(left, result, shown)
        pareto(middle, result, shown)
        lenth_plot(right, result, shown)

    return uri(draw, (9.6, 2.7))


def validation_figure(outcome: Outcome, response: int) -> str:
    """Parity and residual plots of one response, side by side."""

    def draw(figure) -> None:
        left, right = figure.subplots(1, 2)
        parity(left, outcome.model, outcome.validation_runs, response)
        residuals(right, outcome.model, outcome.validation_runs, response)

    return uri(draw, (4.7, 2.2))


def design_figure(outcome: Outcome) -> str:
    """Scatter of every pair of the factors that were filled; at most eight, so that it can be read."""
    shown = outcome.kept[:8]
    side = 0.72 * len(shown) + 0.4
    return uri(lambda figure: pairs(figure, outcome.fit_runs.design, shown), (side, side))


def shape_figure(shape: Shape) -> str:
    """The displaced mechanism over the one at rest, for readers without scripts."""

    def draw(figure) -> None:
        draw_shape(figure.add_subplot(projection="3d"), shape)

    return uri(draw, (7.0, 4.4))


def uri(draw: Callable[..., object], size: tuple[float, float]) -> str:
    """What `draw` puts into a figure of that size in inches, as a data URI."""
    from matplotlib.figure import Figure

    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=size, layout="constrained")
        draw(figure)
        buffer = io.BytesIO()
        figure.savefig(buffer, format="svg", metadata={"Date": None})
    return "data:image/svg+xml;base64," + base64.b64encode(buffer.getvalue()).decode()

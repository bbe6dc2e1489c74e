"""Validation plots: matplotlib axes in, axes out. Numbers are shown in the response's unit for people."""

from typing import TYPE_CHECKING

import numpy as np

from experiments.naming import drawn
from experiments.runs import Runs

from .model import Surrogate

if TYPE_CHECKING:
    from matplotlib.axes import Axes

POINT, LINE = "#1d4ed8", "#475569"


def parity(ax: "Axes", model: Surrogate, runs: Runs, response: int) -> "Axes":
    """Predicted against true responses; a perfect model lies on the diagonal."""
    done, shown = runs.completed(), model.responses[response]
    truth = done.values[:, response] * shown.shown_scale
    predicted = model.predict(done.design.physical)[:, response] * shown.shown_scale
    low, high = min(truth.min(), predicted.min()), max(truth.max(), predicted.max())
    ax.plot([low, high], [low, high], color=LINE, lw=0.8)
    ax.plot(truth, predicted, ".", color=POINT, ms=2.5, alpha=0.6, rasterized=True)
    unit = drawn(shown.shown_unit)
    ax.set(xlabel=f"oracle [{unit}]", ylabel=f"model [{unit}]", title=f"{drawn(shown.symbol)}: parity")
    return ax


def residuals(ax: "Axes", model: Surrogate, runs: Runs, response: int) -> "Axes":
    """Prediction minus truth against truth; structure means that a term is missing."""
    done, shown = runs.completed(), model.responses[response]
    truth = done.values[:, response] * shown.shown_scale
    error = model.predict(done.design.physical)[:, response] * shown.shown_scale - truth
    ax.axhline(0.0, color=LINE, lw=0.8)
    ax.plot(truth, error, ".", color=POINT, ms=2.5, alpha=0.6, rasterized=True)
    top = 1.15 * np.abs(error).max(initial=0.0)
    ax.set_ylim(-top or -1.0, top or 1.0)
    unit = drawn(shown.shown_unit)
    ax.set(xlabel=f"oracle [{unit}]", ylabel=f"error [{unit}]", title=f"{drawn(shown.symbol)}: residuals")
    return ax

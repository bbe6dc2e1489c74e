"""Figures: what the paths look like, how large the errors are, what the loop does, how long a call takes."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numpy.typing import NDArray

from .campaign import AFFINE, AT_REST, LOOP, OURS, THESIS, Campaign
from .controllers import NOISE, Tracked
from .tracking import deviation

if TYPE_CHECKING:
    from matplotlib.axes import Axes

COLOURS = {
    THESIS: "#7f1d1d",
    AT_REST: "#d97706",
    AFFINE: "#94a3b8",
    OURS: "#1d4ed8",
    AT_REST + LOOP: "#d97706",
    OURS + LOOP: "#15803d",
}
INK, SOFT = "#0f172a", "#475569"


def draw(campaign: Campaign, folder: Path) -> list[Path]:
    """All figures as PNG."""
    pictures = {"feed_forward": feed_forward, "loop": loop, "timing": timing}
    return [_saved(picture(campaign), folder / f"{name}.png") for name, picture in pictures.items()]


def feed_forward(campaign: Campaign) -> Figure:
    """Paths of the plant as modelled, and errors of position and rotation sample by sample; a column a trajectory."""
    names = _names(campaign, "trajectory")
    plant = _names(campaign, "disturbance")[0]
    figure = Figure(figsize=(11.5, 9.4), layout="constrained")
    axes = figure.subplots(3, len(names))
    shown = (AFFINE, AT_REST, THESIS, OURS)
    for column, name in enumerate(names):
        runs = {c: _run(campaign, name, plant, c) for c in shown}
        _path(axes[0, column], runs)
        for row, (part, unit) in enumerate(((slice(0, 3), "µm"), (slice(3, 6), "µrad")), start=1):
            for controller, run in runs.items():
                error = 1e6 * np.linalg.norm(deviation(run)[:, part], axis=1)
                axes[row, column].semilogy(error, color=COLOURS[controller], ls=_forward_dashes(controller), lw=1.2)
            axes[row, column].set_xlabel("sample")
            axes[row, 0].set_ylabel(f"{'position' if row == 1 else 'rotation'} error [{unit}]")
    for row in (1, 2):
        _same_range(axes[row])
    figure.suptitle("Feed-forward, plant as modelled: nonlinear FEA under forces from four inverses", color=INK)
    lines = [axes[1, 0].plot([], [], color=COLOURS[c], ls=_forward_dashes(c), lw=2.0)[0] for c in shown]
    figure.legend(lines, shown, loc="outside lower center", ncols=len(shown), frameon=False)
    return _dressed(figure)


def loop(campaign: Campaign) -> Figure:
    """Errors of position on each plant (rows) and trajectory (columns), with the loop and without, of one seed."""
    names, plants = _names(campaign, "trajectory"), _names(campaign, "disturbance")
    shown = (AT_REST, OURS, AT_REST + LOOP, OURS + LOOP)
    figure = Figure(figsize=(11.5, 9.4), layout="constrained")
    axes = figure.subplots(len(plants), len(names), sharey=True)
    for row, plant in enumerate(plants):
        for column, name in enumerate(names):
            ax = axes[row, column]
            for controller in shown:
                error = 1e6 * np.linalg.norm(deviation(_run(campaign, name, plant, controller))[:, :3], axis=1)
                ax.semilogy(error, color=COLOURS[controller], ls=_dashes(controller), lw=1.1)
            ax.axhline(1e6 * np.linalg.norm(NOISE[:3]), color=SOFT, lw=0.9, ls=":")
            ax.set_title(f"{name}, {plant}", fontsize=10)
            ax.set_xlabel("sample" if row == len(plants) - 1 else "")
        axes[row, 0].set_ylabel("position error [µm]")
    figure.suptitle("Integral loop on a noisy sensor (dotted: RMS noise of one reading)", color=INK)
    lines = [axes[0, 0].plot([], [], color=COLOURS[c], ls=_dashes(c), lw=2.0)[0] for c in shown]
    figure.legend(lines, shown, loc="outside lower center", ncols=len(shown), frameon=False)
    return _dressed(figure)


def timing(campaign: Campaign) -> Figure:
    """How the times of single calls are spread, the poses' own times and the clock's beside them."""
    took, summary = campaign.timing, campaign.timing.summary()
    top = 1.6 * summary["worst pose"]
    bins = np.linspace(0.0, top, 160).tolist()
    figure = Figure(figsize=(8.6, 3.9), layout="constrained")
    ax = figure.subplots()
    for times, colour, label in (
        (took.empty, "#94a3b8", "the clock alone"),
        (took.calls, COLOURS[OURS], "one call of the inverse"),
    ):
        shares = np.full(times.size, 100.0 / times.size)
        ax.hist(np.minimum(1e-3 * times.ravel(), top), bins=bins, weights=shares, color=colour, label=label)
    ax.set_yscale("log")
    for what, colour in (("median", INK), ("worst pose", COLOURS[THESIS])):
        ax.axvline(summary[what], color=colour, lw=1.2, ls="--", label=f"{what}: {summary[what]:.2f} µs")
    over = 100.0 * float((1e-3 * took.calls > top).mean())
    last = f"last bar: all that took longer ({over:.2g} %), at most {summary['worst call']:.0f} µs"
    ax.set(xlabel=f"µs ({last})", ylabel="% of calls", title="Time of the exported C inverse, timed in C")
    ax.legend(frameon=False, loc="upper right")
    return _dressed(figure)


def _path(ax: "Axes", runs: dict[str, Tracked]) -> None:
    """The path in x and y; of steps, x by sample."""
    wanted = runs[OURS].lane.trajectory
    steps = wanted.name.startswith("step")
    for controller in (AT_REST, OURS):
        poses = 1e6 * runs[controller].poses
        ax.plot(*_across(poses, steps), color=COLOURS[controller], lw=1.1)
    ax.plot(*_across(1e6 * wanted.poses, steps), color=INK, lw=0.8, ls=(0, (1, 2)))
    ax.set_title(f"{wanted.name} (dotted: wanted)", fontsize=10)
    ax.set(xlabel="sample" if steps else "x [µm]", ylabel="x [µm]" if steps else "y [µm]")


def _across(poses: NDArray[np.float64], steps: bool) -> tuple[NDArray[Any], NDArray[Any]]:
    """Abscissa and ordinate of a path."""
    return (np.arange(len(poses)), poses[:, 0]) if steps else (poses[:, 0], poses[:, 1])


def _run(campaign: Campaign, trajectory: str, plant: str, controller: str) -> Tracked:
    """The first run of that kind."""
    for run in campaign.tracked:
        lane = run.lane
        if (lane.trajectory.name, lane.disturbance.name, lane.controller.name) == (trajectory, plant, controller):
            return run
    raise KeyError((trajectory, plant, controller))


def _names(campaign: Campaign, what: str) -> list[str]:
    return list(dict.fromkeys(getattr(e, what) for e in campaign.errors))


def _forward_dashes(controller: str) -> str | tuple:
    """The thesis's inverse and that at rest are hard to tell apart: one is drawn over the other."""
    return (0, (3, 3)) if controller == THESIS else "-"


def _dashes(controller: str) -> str | tuple:
    return "-" if controller.endswith(LOOP) else (0, (4, 2))


def _same_range(axes: "Sequence[Axes]") -> None:
    """One range of the ordinate for a row, by its smallest and largest."""
    ends = np.array([ax.get_ylim() for ax in axes])
    for ax in axes:
        ax.set_ylim(ends[:, 0].min(), ends[:, 1].max())


def _dressed(figure: Figure) -> Figure:
    for ax in figure.axes:
        ax.grid(visible=True, which="major", color="#e2e8f0", lw=0.7)
        ax.set_axisbelow(True)
        ax.spines[["top", "right"]].set_visible(False)
        ax.tick_params(colors=SOFT, labelsize=9)
    return figure


def _saved(figure: Figure, path: Path) -> Path:
    FigureCanvasAgg(figure)
    figure.savefig(path, dpi=110, metadata={"Software": None})
    return path

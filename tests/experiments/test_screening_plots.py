"""Plots of screening: what is drawn, that labels stay apart and inside, at six and at forty factors."""

from itertools import combinations

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.text import Text

from experiments import Response, Runs, Status
from experiments.screening import effects, screen
from experiments.screening.labels import SMALLEST, place_labels, tick_size
from experiments.screening.plots import (
    alias_map,
    half_normal,
    interaction_map,
    interaction_plot,
    lenth_plot,
    main_effects_plot,
    pareto,
)

from .screening_cases import answered, plackett_burman

MICRO = Response("x", "m", "µm", 1e6)


def case(n_factors: int, n_runs: int, n_active: int) -> Runs:
    design = plackett_burman(n_runs, n_factors, n_centre=2)
    rng = np.random.default_rng(1)
    slopes = np.r_[3.0 + rng.normal(size=n_active), np.zeros(n_factors - n_active)]
    slopes[1] = slopes[0]
    y = 1e-6 * (design.coded @ slopes + 0.05 * rng.normal(size=len(design)))
    return Runs(design, (MICRO,), y[:, None], (Status.OK,) * len(y), ("",) * len(y))


CASES = {"six": case(6, 12, 3), "forty": case(40, 48, 12)}


def axes(width: float = 3.2, height: float = 2.7):
    figure = Figure(figsize=(width, height), layout="constrained")
    return figure.subplots()


def drawn(ax):
    FigureCanvasAgg(ax.figure).draw()
    return ax


def boxes(ax, texts):
    renderer = FigureCanvasAgg(ax.figure).get_renderer()
    # An annotation's own extent would include its leader line.
    return [Text.get_window_extent(t, renderer) for t in texts if t.get_text()]


@pytest.fixture(params=list(CASES))
def runs(request) -> Runs:
    return CASES[request.param]


class TestHalfNormal:
    def test_names_exactly_the_active_and_marks_the_margins(self, runs):
        (result,) = screen(runs).lenth
        ax = half_normal(axes(), result, MICRO)
        names = {t.get_text() for t in ax.texts}
        assert names - {"ME", "SME"} == set(result.active_names)
        assert "µm" in ax.get_ylabel()
        top = max(np.max(line.get_ydata()) for line in ax.lines if line.get_marker() == "o" and len(line.get_ydata()))
        assert top == pytest.approx(1e6 * np.abs(result.contrasts).max())

    def test_labels_do_not_collide_and_stay_inside(self, runs):
        (result,) = screen(runs).lenth
        ax = drawn(half_normal(axes(4.5, 3.4), result, MICRO))
        found = boxes(ax, [t for t in ax.texts if t.get_text() not in ("ME", "SME")])
        assert len(found) == len(result.active_names)
        for one, other in combinations(found, 2):
            assert not one.overlaps(other)
        frame = ax.get_window_extent()
        assert all(frame.x0 - 2 <= b.x0 and b.x1 <= frame.x1 + 2 and b.y1 <= frame.y1 + 2 for b in found)

    def test_equal_effects_are_told_apart(self):
        ax = axes(4.5, 3.4)
        ax.set(xlim=(0, 1), ylim=(0, 1))
        place_labels(ax, np.full(9, 0.5), np.full(9, 0.5), [f"T{i}D1" for i in range(9)], "black")
        found = boxes(drawn(ax), ax.texts)
        assert len(found) == 9
        assert not any(a.overlaps(b) for a, b in combinations(found, 2))

    def test_the_largest_are_named_where_nothing_acts(self):
        noise = 1e-6 * np.random.default_rng(4).normal(size=12)
        (result,) = screen(answered(plackett_burman(12, 6), noise)).lenth
        assert not result.active.any()
        ax = half_normal(axes(), result, MICRO)
        largest = np.argsort(-np.abs(result.contrasts))[:3]
        assert {t.get_text() for t in ax.texts} - {"ME", "SME"} == {result.names[i] for i in largest}

    def test_a_response_that_never_changes(self):
        (result,) = screen(answered(plackett_burman(12, 6), np.zeros(12))).lenth
        for plot in (half_normal, pareto, lenth_plot):
            drawn(plot(axes(), result, MICRO))


class TestBars:
    def test_pareto_shows_the_largest_on_top_and_counts_the_rest(self, runs):
        (result,) = screen(runs).lenth
        ax = pareto(axes(), result, MICRO)
        widths = [bar.get_width() for bar in ax.patches]
        assert widths == sorted(widths)
        assert widths[-1] == pytest.approx(1e6 * np.abs(result.contrasts).max())
        missing = len(result.names) - len(widths)
        assert (f"{missing} smaller not shown" in ax.get_xlabel()) == (missing > 0)
        assert all(t.get_fontsize() >= SMALLEST - 0.01 for t in ax.get_yticklabels())

    def test_tick_labels_of_the_bars_do_not_collide(self, runs):
        (result,) = screen(runs).lenth
        ax = drawn(pareto(axes(), result, MICRO))
        found = boxes(ax, ax.get_yticklabels())
        assert not any(a.overlaps(b) for a, b in combinations(found, 2))

    def test_lenth_keeps_signs_and_order(self, runs):
        (result,) = screen(runs).lenth
        ax = lenth_plot(axes(), result, MICRO)
        assert [bar.get_height() for bar in ax.patches] == pytest.approx(list(1e6 * result.contrasts))
        labels = [t.get_text() for t in ax.get_xticklabels()]
        assert set(result.active_names) <= set(labels) <= set(result.names)

    def test_the_margins_are_where_the_result_says(self):
        (result,) = screen(CASES["six"]).lenth
        ax = lenth_plot(axes(), result, MICRO)
        drawn_at = {round(float(line.get_ydata()[0]), 9) for line in ax.lines}
        assert {round(s * m * 1e6, 9) for m in (result.me, result.sme) for s in (1, -1)} <= drawn_at


class TestEffects:
    def test_main_effects_rise_by_the_effect(self, runs):
        ax = drawn(main_effects_plot(axes(6.0, 3.0), runs, 0))
        found = effects(runs)
        lines = [line for line in ax.lines if len(line.get_xdata()) == 2 and line.get_marker() == "o"]
        rises = [line.get_ydata()[1] - line.get_ydata()[0] for line in lines]
        assert rises == pytest.approx(list(1e6 * found.values[: found.n_factors, 0]))
        assert [t.get_text() for t in ax.texts] == ["centre"]

    def test_interaction_lines_join_the_four_means(self):
        a, b, *_ = (design := plackett_burman(12, 4)).coded.T
        ax = drawn(interaction_plot(axes(), answered(design, a + 2 * b + 3 * a * b), 0, "A", "B"))
        means = [list(line.get_ydata()) for line in ax.lines]
        assert means == [pytest.approx([0.0, -4.0]), pytest.approx([-2.0, 6.0])]
        assert [t.get_text() for t in ax.texts] == ["B −", "B +"]

    def test_names_of_lines_that_meet_stay_apart(self):
        a, b, *_ = (design := plackett_burman(12, 4)).coded.T
        ax = drawn(interaction_plot(axes(), answered(design, a + b - a * b), 0, "A", "B"))
        one, other = boxes(ax, ax.texts)
        assert not one.overlaps(other)

    def test_interaction_refuses(self):
        runs = CASES["six"]
        with pytest.raises(ValueError, match="an interaction needs two factors, got 'A' twice"):
            interaction_plot(axes(), runs, 0, "A", "A")
        with pytest.raises(ValueError, match="unknown factor 'Z'"):
            interaction_plot(axes(), runs, 0, "A", "Z")

    def test_map_of_interactions(self, runs):
        ax = drawn(interaction_map(axes(5.0, 4.0), runs, 0))
        matrix = np.asarray(ax.images[0].get_array())
        factors = runs.design.coded
        n = effects(runs).n_runs
        expected = 2e6 / n * (factors[:, 0] * factors[:, 2]) @ runs.values[:, 0]
        assert matrix[0, 2] == pytest.approx(expected, rel=1e-9)
        assert matrix[1, 1] == pytest.approx(1e6 * effects(runs).values[1, 0])
        assert len(ax.texts) == (36 if len(matrix) == 6 else 0)

    def test_map_of_aliases(self, runs):
        ax = drawn(alias_map(axes(5.0, 4.0), runs.design))
        k = len(runs.design.space)
        assert ax.images[0].get_array().shape == (len(effects(runs).names), k * (k - 1) // 2)
        found = boxes(ax, ax.get_yticklabels())
        assert not any(a.overlaps(b) for a, b in combinations(found, 2))

    def test_map_of_aliases_refuses_one_factor(self):
        with pytest.raises(ValueError, match="two factors or more"):
            alias_map(axes(), plackett_burman(4, 1))


def test_tick_labels_shrink_with_their_number():
    ax = axes()
    assert tick_size(ax, 5, "y") == 7.0
    assert tick_size(ax, 200, "y") < tick_size(ax, 100, "y") < SMALLEST

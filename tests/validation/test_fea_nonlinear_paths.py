"""Verification of paths past limit points: a closed form, and classical frames by an independent solver."""

import json
from collections.abc import Callable
from functools import cache, partial
from pathlib import Path

import numpy as np
import pytest

from experiments.fea import Frame, Load, Material, Member, Section, Support, condense, load_array
from experiments.fea.nonlinear import NonlinearSolver

REFERENCE = json.loads((Path(__file__).parents[1] / "reference" / "opensees_frames.json").read_text())


@cache
def condensed(build: Callable[[], Frame], n_steps: int) -> NonlinearSolver:
    """Once for all paths of a frame, so that it is compiled once."""
    return condense(build(), planar=True, n_steps=n_steps)


def followed(build, node, force, n_steps, **settings):
    solver = condensed(build, n_steps)
    return solver.follow(load_array(solver.frame, [[Load(node, (0.0, force, 0.0))]]), **settings)


SPAN, RISE, STIFFNESS = 1.0, 0.2, 1e5  # m, m, E A in N


@pytest.fixture(scope="module")
def truss():
    section, material = Section(1e-4, 1e-4, 1e-4, 1e-4), Material(1e9, 0.3)
    frame = Frame(
        {"pin": (0.0, 0.0, 0.0), "apex": (SPAN, RISE, 0.0)},
        [Member("bar", "pin", "apex", section, material)],
        supports=[Support("pin", ("x", "y")), Support("apex", ("x",))],
    )
    return condense(frame, planar=True, n_steps=4)


@pytest.fixture(scope="module")
def path(truss):
    return truss.follow(load_array(truss.frame, [[Load("apex", (0.0, -1.0, 0.0))]]), step=0.05, most=30)


class TestTwoBarTruss:
    """Half of von Mises' truss: a bar that cannot bend, from a pin to a slide.

    With the strain of a Reissner rod, l/l₀ − 1, its end at the height y carries P = −E A (l/l₀ − 1) y / l
    (Crisfield, Non-linear Finite Element Analysis of Solids and Structures, vol. 1 (1991), §1.1, has the
    same with another measure of strain). dP/dy = 0 at l³ = l₀ x².
    """

    def load(self, height):
        length, rest = np.hypot(SPAN, height), np.hypot(SPAN, RISE)
        return -STIFFNESS * (length / rest - 1) * height / length

    def test_every_point_lies_on_the_curve(self, path):
        height = RISE + path.equilibria.at("apex")[:, 1]
        assert height.min() < -2 * RISE  # it went through
        np.testing.assert_allclose(path.level, self.load(height), atol=1e-9 * np.abs(path.level).max())

    def test_limit_points(self, path):
        rest = np.hypot(SPAN, RISE)
        height = np.sqrt(np.cbrt(rest * SPAN**2) ** 2 - SPAN**2) * np.array([1, -1])
        found = RISE + path.equilibria.at("apex")[path.is_limit, 1]
        np.testing.assert_allclose(found, height, rtol=1e-6)
        np.testing.assert_allclose(path.level[path.is_limit], self.load(height), rtol=1e-12)

    def test_between_the_limit_points_it_is_unstable_in_one_mode(self, path):
        height = RISE + path.equilibria.at("apex")[:, 1]
        first, last = np.flatnonzero(path.is_limit)
        inside = np.arange(len(path))[first + 1 : last]
        outside = np.setdiff1d(np.arange(len(path)), np.arange(first, last + 1))
        assert len(inside) > 3
        assert (path.equilibria.unstable[inside] == 1).all()
        assert (path.equilibria.unstable[outside] == 0).all()
        assert (np.diff(height) < 0).all()

    def test_levels_end_the_path(self, truss):
        load = load_array(truss.frame, [[Load("apex", (0.0, -1.0, 0.0))]])
        path = truss.follow(load, step=0.05, levels=(0.0, 100.0))
        assert path.level[-1] > 100.0 > path.level[-2]
        assert "outside" in path.ended


def lee_frame():
    section, material = Section(6.0, 2.0, 2.0, 1.0), Material(7.2e6, 0.3)
    nodes = {"foot": (0, 0, 0), "corner": (0, 120, 0), "load": (24, 120, 0), "end": (120, 120, 0)}
    pairs = [("foot", "corner"), ("corner", "load"), ("load", "end")]
    members = [Member(f"{a} {b}", a, b, section, material) for a, b in pairs]
    return Frame(nodes, members, supports=[Support("foot", ("x", "y")), Support("end", ("x", "y"))])


def toggle():
    section, material = Section(1.885e6 / 9.27e3, 1.0, 1.0, 1.0), Material(9.27e3, 0.0)
    nodes = {"left": (0, 0, 0), "load": (12.936, 0.386, 0), "right": (25.872, 0, 0)}
    members = [Member("1", "left", "load", section, material), Member("2", "load", "right", section, material)]
    return Frame(nodes, members, clamps=["left", "right"])


def deep_arch(axial):
    def point(degrees):
        return 100 * np.sin(np.radians(degrees)), 100 * np.cos(np.radians(degrees)), 0.0

    section, material = Section(axial / 1e6, 1.0, 1.0, 1.0), Material(1e6, 0.0)
    nodes = {"left": point(-107.5), "load": point(0.0), "right": point(107.5)}
    members = [
        Member("1", "left", "load", section, material, through=point(-53.75)),
        Member("2", "load", "right", section, material, through=point(53.75)),
    ]
    return Frame(nodes, members, clamps=["left"], supports=[Support("right", ("x", "y"))])


class TestClassicalFrames:
    """Limit points against OpenSeesPy, extrapolated in its mesh; its errors are below 1e-7.

    Lee, Manuel and Rossow (1968); Williams (1964); DaDeppo and Schmidt (1975). The tolerance is the
    error of our law at the number of steps, which falls with its fourth power.
    """

    CASES = (
        pytest.param("lee_frame", lee_frame, 16, 1000.0, dict(step=0.2, most=70), 1e-4, id="Lee"),
        pytest.param("williams_toggle_12.936", toggle, 16, 10.0, dict(step=0.01, most=80), 1e-4, id="Williams"),
        pytest.param("deep_arch", partial(deep_arch, 1e8), 32, 100.0, dict(step=0.1, most=60), 2e-5, id="arch"),
    )

    @pytest.mark.parametrize(("name", "build", "n_steps", "force", "settings", "tolerance"), CASES)
    def test_limit_points(self, name, build, n_steps, force, settings, tolerance):
        path = followed(build, "load", -force, n_steps, **settings)
        expected = np.array(REFERENCE[name]["limit_points"]["values"])
        found = path.is_limit.nonzero()[0][: len(expected)]
        np.testing.assert_allclose(path.level[found] * force, expected[:, 0], rtol=tolerance)
        # At an extremum of the load the place is known to the root of what the load is.
        size = np.abs(expected[:, 1:3]).max()
        place = path.equilibria.at("load")[found][:, :2]
        np.testing.assert_allclose(place, expected[:, 1:3], atol=np.sqrt(tolerance) * 0.1 * size)
        assert path.equilibria.ok.all()

    def test_the_curve_of_lee(self):
        curve = REFERENCE["lee_frame"]["curve"]
        values = np.array(curve["values"] if isinstance(curve, dict) else curve)
        path = followed(lee_frame, "load", -1000.0, 16, step=0.1, most=60)
        last = path.is_limit.nonzero()[0][0]
        down = -path.equilibria.at("load")[: last + 1, 1]
        before = -values[:, 2] < down[-1]
        level = np.interp(-values[before, 2], down, path.level[: last + 1] * 1000)
        # Linear interpolation between points 0.1 apart costs about the square of that over eight.
        np.testing.assert_allclose(level, values[before, 0], atol=2e-3 * values[:, 0].max())


class TestRefusals:
    def test_of_settings(self):
        frame = toggle()
        solver = condense(frame, planar=True, n_steps=4)
        load = load_array(frame, [[Load("load", (0.0, -1.0, 0.0))]])
        with pytest.raises(ValueError, match="step must be a positive arc length, got 0"):
            solver.follow(load, step=0.0)
        with pytest.raises(ValueError, match="most must be at least one point, got 0"):
            solver.follow(load, most=0)
        with pytest.raises(ValueError, match="levels must enclose 0"):
            solver.follow(load, levels=(0.5, 1.0))
        with pytest.raises(ValueError, match="a path is that of one case, got 2"):
            solver.follow(np.repeat(load, 2, axis=0))

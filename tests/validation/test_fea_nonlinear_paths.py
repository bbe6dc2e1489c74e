"""Verification of paths past limit points: a closed form, and classical frames by an independent solver.

One planar frame of parts that do not touch, since it is compiled once: a path loads one of them and leaves the others
at rest. Every part is in units of its own, with members about one long and EI one. Williams' toggle is by itself, for
its steep path wants another scale of the step.
"""

import json
from pathlib import Path

import numpy as np
import pytest

from experiments.fea import Frame, Load, Material, Member, Section, Support, condense, load_array
from experiments.fea.nonlinear import NonlinearSolver
from experiments.fea.path import LIMIT, PathPoint, _Walk

REFERENCE = json.loads((Path(__file__).parents[1] / "reference" / "opensees_frames.json").read_text())

SPAN, RISE, STIFFNESS = 1.0, 0.2, 1.0  # E A in EI / SPAN²: a stocky bar, but nothing bends it
UNITS = {"Lee": (80.0, 7.2e6 * 2.0), "Williams": (1.0, 1.0), "arch": (200.0, 1e6)}
"""Length and EI in the units of the file: in and lb, or none."""


def parts() -> Frame:
    """Half of von Mises' truss, the frame of Lee and the deep arch of DaDeppo and Schmidt."""

    def on_the_arch(degrees: float) -> tuple[float, float, float]:
        radius = 100 / UNITS["arch"][0]
        return 10 + radius * np.sin(np.radians(degrees)), radius * np.cos(np.radians(degrees)), 0.0

    nodes = {"pin": (0.0, 0.0, 0.0), "apex": (SPAN, RISE, 0.0)}
    lee = {"foot": (0, 0), "corner": (0, 120), "Lee": (24, 120), "end": (120, 120)}
    nodes |= {name: (4 + x / UNITS["Lee"][0], y / UNITS["Lee"][0], 0.0) for name, (x, y) in lee.items()}
    nodes |= {"clamp": on_the_arch(-107.5), "arch": on_the_arch(0.0), "hinge": on_the_arch(107.5)}

    def members(axial: float, *pairs: tuple[str, str], **through: tuple[float, float, float]) -> list[Member]:
        section, material = Section(axial, 1.0, 1.0, 1.0), Material(1.0, 0.0)
        return [Member(f"{a} {b}", a, b, section, material, through=through.get(a)) for a, b in pairs]

    def axial(name: str, area: float, young: float) -> float:
        length, bending = UNITS[name]
        return young * area * length**2 / bending

    return Frame(
        nodes,
        [
            *members(STIFFNESS, ("pin", "apex")),
            *members(axial("Lee", 6.0, 7.2e6), ("foot", "corner"), ("corner", "Lee"), ("Lee", "end")),
            *members(
                axial("arch", 1e8, 1.0), ("clamp", "arch"), ("arch", "hinge"),
                clamp=on_the_arch(-53.75), arch=on_the_arch(53.75),
            ),
        ],
        clamps=["clamp"],
        supports=[Support("apex", ("x",)), *(Support(n, ("x", "y")) for n in ("pin", "foot", "end", "hinge"))],
    )  # fmt: skip


def toggle() -> Frame:
    section, material = Section(1.885e6 / 9.27e3, 1.0, 1.0, 1.0), Material(9.27e3, 0.0)
    nodes = {"left": (0, 0, 0), "Williams": (12.936, 0.386, 0), "right": (25.872, 0, 0)}
    members = [Member("1", "left", "Williams", section, material), Member("2", "Williams", "right", section, material)]
    return Frame(nodes, members, clamps=["left", "right"])


@pytest.fixture(scope="module")
def solver() -> NonlinearSolver:
    return condense(parts(), planar=True, n_steps=32)


@pytest.fixture(scope="module")
def toggled() -> NonlinearSolver:
    return condense(toggle(), planar=True, n_steps=32)


def followed(solver, node, force, **settings):
    return solver.follow(load_array(solver.frame, [[Load(node, (0.0, force, 0.0))]]), **settings)


@pytest.fixture(scope="module")
def path(solver):
    return followed(solver, "apex", -1.0, step=0.05, most=30)


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

    def test_one_within_the_first_step(self, solver, path):
        first = followed(solver, "apex", -1.0, step=0.2, most=1)
        assert first.is_limit.tolist() == [False, True, False]
        np.testing.assert_allclose(first.level[1], path.level[path.is_limit][0], rtol=1e-9)

    def test_levels_end_the_path(self, solver):
        path = followed(solver, "apex", -1.0, step=0.05, levels=(0.0, 1e-3))
        assert path.level[-1] > 1e-3 > path.level[-2]
        assert "outside" in path.ended


class TestClassicalFrames:
    """Limit points against OpenSeesPy, extrapolated in its mesh; its errors are below 1e-7.

    Lee, Manuel and Rossow (1968); Williams (1964); DaDeppo and Schmidt (1975). The tolerance is the
    error of our law at 32 steps or fewer, which falls with the fourth power of their number.
    """

    CASES = (
        pytest.param("lee_frame", "Lee", 1000.0, dict(step=0.2, most=70), 1e-4, id="Lee"),
        pytest.param("williams_toggle_12.936", "Williams", 10.0, dict(step=0.01, most=80), 1e-4, id="Williams"),
        pytest.param("deep_arch", "arch", 100.0, dict(step=0.1, most=60), 2e-5, id="arch"),
    )

    @pytest.mark.parametrize(("name", "node", "force", "settings", "tolerance"), CASES)
    def test_limit_points(self, solver, toggled, name, node, force, settings, tolerance):
        length, bending = UNITS[node]
        path = followed(toggled if node == "Williams" else solver, node, -force * length**2 / bending, **settings)
        expected = np.array(REFERENCE[name]["limit_points"]["values"])
        found = path.is_limit.nonzero()[0][: len(expected)]
        np.testing.assert_allclose(path.level[found] * force, expected[:, 0], rtol=tolerance)
        # At an extremum of the load the place is known to the root of what the load is.
        size = np.abs(expected[:, 1:3]).max()
        place = length * path.equilibria.at(node)[found][:, :2]
        np.testing.assert_allclose(place, expected[:, 1:3], atol=np.sqrt(tolerance) * 0.1 * size)
        assert path.equilibria.ok.all()

    def test_the_curve_of_lee(self, solver):
        curve = REFERENCE["lee_frame"]["curve"]
        values = np.array(curve["values"] if isinstance(curve, dict) else curve)
        length, bending = UNITS["Lee"]
        path = followed(solver, "Lee", -1000.0 * length**2 / bending, step=0.1, most=60)
        last = path.is_limit.nonzero()[0][0]
        down = -length * path.equilibria.at("Lee")[: last + 1, 1]
        before = -values[:, 2] < down[-1]
        level = np.interp(-values[before, 2], down, path.level[: last + 1] * 1000)
        # Linear interpolation between points 0.1 apart costs about the square of that over eight.
        np.testing.assert_allclose(level, values[before, 0], atol=2e-3 * values[:, 0].max())


class TestRefusals:
    def test_of_settings(self, solver):
        load = load_array(solver.frame, [[Load("apex", (0.0, -1.0, 0.0))]])
        with pytest.raises(ValueError, match="step must be a positive arc length, got 0"):
            solver.follow(load, step=0.0)
        with pytest.raises(ValueError, match="most must be at least one point, got 0"):
            solver.follow(load, most=0)
        with pytest.raises(ValueError, match="levels must enclose 0"):
            solver.follow(load, levels=(0.5, 1.0))
        with pytest.raises(ValueError, match="a path is that of one case, got 2"):
            solver.follow(np.repeat(load, 2, axis=0))


class TestNearALimitPoint:
    """Where the level is out of reach, corrections at a constant level cannot finish a point."""

    def test_it_is_found_and_not_only_approached(self, toggled, monkeypatch):
        slopes, found = [], _Walk.limit

        def noting(walk: _Walk, before: PathPoint, after: PathPoint, heading) -> PathPoint | None:
            limit = found(walk, before, after, heading)
            slopes.append((abs(limit.slope), max(abs(before.slope), abs(after.slope))) if limit else None)
            return limit

        monkeypatch.setattr(_Walk, "limit", noting)
        path = followed(toggled, "Williams", -10.0, step=0.01, most=80)
        assert path.is_limit.sum() == len(slopes) == 2
        assert all(slope < LIMIT * scale for slope, scale in slopes)
        assert path.missed == ()

    def test_one_that_is_not_found_is_told(self, toggled, monkeypatch):
        whole, looking = _Walk.advance, []

        def failing(walk, base, step, heading):
            return (None, False, None) if looking else whole(walk, base, step, heading)

        def limit(walk, before, after, heading, found=_Walk.limit):
            looking.append(True)
            try:
                return found(walk, before, after, heading)
            finally:
                looking.clear()

        monkeypatch.setattr(_Walk, "advance", failing)
        monkeypatch.setattr(_Walk, "limit", limit)
        path = followed(toggled, "Williams", -10.0, step=0.01, most=80)
        assert not path.is_limit.any()
        assert len(path.missed) == 2
        assert "between the levels 3.39" in path.missed[0]
        assert "extremum" in path.missed[0]

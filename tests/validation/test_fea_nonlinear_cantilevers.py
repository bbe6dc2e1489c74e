"""Verification of the nonlinear FEA by cantilevers, each test with its source.

The law of a member is integrated to the fourth order, so next to a bound every test asserts the order: the bounds are
those of the step, h⁴, and not of float64. The cases of one solve differ in geometry and section.
"""

import json
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation
from scipy.special import ellipe, ellipeinc, ellipk, ellipkinc

from experiments.fea import Frame, Material, Member, RigidBody, Section, condense
from experiments.fea.elements import Properties
from experiments.fea.equilibria import Equilibria
from experiments.fea.nonlinear import NonlinearSolver
from experiments.fea.scaling import Geometry
from tests.rod_equations import Rod, loaded_end

Floats = NDArray[np.float64]

REFERENCE = Path(__file__).parents[1] / "reference"
BEAMS = json.loads((REFERENCE / "beams.json").read_text(encoding="utf-8"))
BEND = json.loads((REFERENCE / "opensees_cantilevers.json").read_text(encoding="utf-8"))["bend_45"]

RIGID = 1e12
"""Stretching and shear stiffness over EI/L² of what counts as inextensible: strains of 1e-11."""

ORDER = (3.5, 4.6)
"""Where the order of a method of the fourth order may lie while h is not small; for the finest steps of a sequence."""


# ---- Cantilevers of length, EI and therefore forces of order one, several in one frame ----


@dataclass(frozen=True)
class Case:
    """One cantilever and what acts on its tip; the force `dead[:3]` acts at `arm` from the tip, carried rigidly."""

    name: str
    curve: Callable[[float], Floats] = lambda s: np.array([s, 0.0, 0.0])
    stiffness: Sequence[float] = (RIGID, RIGID, RIGID, 1.0, 1.0, 1.0)  # EA, GA_y, GA_z, GJ, EI_y, EI_z
    dead: Sequence[float] = field(default=(0.0,) * 6)
    follower: Sequence[float] = field(default=(0.0,) * 6)
    arm: Sequence[float] = (0.0, 0.0, 0.0)

    @property
    def rod(self) -> tuple[Rod, Floats]:
        """The equations of the cantilever, and the directors of its tip at rest."""
        start, middle, end = (self.curve(s) for s in (0.0, 0.5, 1.0))
        chord, seen = end - start, np.cross(middle - start, end - middle)
        half = math.atan2(np.linalg.norm(seen), (middle - start) @ (end - middle))
        normal = seen / np.linalg.norm(seen) if half > 1e-12 else np.zeros(3)
        tangent = Rotation.from_rotvec(-half * normal).apply(chord / np.linalg.norm(chord))
        z = np.array([0.0, 0.0, 1.0]) - tangent * tangent[2]
        z /= np.linalg.norm(z)
        turn = np.stack([tangent, np.cross(z, tangent), z], axis=1)
        length = np.linalg.norm(chord) * (half / math.sin(half) if half > 1e-12 else 1.0)
        rod = Rod(start, turn, length, 1 / np.array(self.stiffness), turn.T @ normal * 2 * half / length)
        return rod, Rotation.from_rotvec(2 * half * normal).as_matrix() @ turn

    def solved(self, guess: Floats) -> tuple[Floats, Rotation]:
        """Translation and rotation of the tip by SciPy; `guess` is the wrench at the clamp."""
        rod, rest = self.rod
        conditions = loaded_end(rest, self.dead, self.follower, self.arm)
        _, place, turn = rod.shoot(conditions, guess)
        return place - self.curve(1.0), Rotation.from_matrix(turn @ rest.T)


def arc(radius: float, angle: float, turn: Rotation | None = None) -> Callable[[float], Floats]:
    """From the origin along y, bending towards x, all of it turned."""
    turn = turn or Rotation.identity()

    def place(s: float) -> Floats:
        return turn.apply([radius * (1 - math.cos(s * angle)), radius * math.sin(s * angle), 0.0])

    return place


def geometry(cases: Sequence[Case]) -> Geometry:
    """One member of its own curve and section for every case."""
    coordinates = [[case.curve(0.0), case.curve(1.0), case.curve(1.0) + case.arm] for case in cases]
    ea, gy, gz, gj, ey, ez = np.transpose([case.stiffness for case in cases])[:, None]
    one = np.ones_like(ea)
    through = np.transpose([[case.curve(0.5)] for case in cases])
    up = np.array([0.0, 0.0, 1.0])[:, None, None]
    return Geometry(np.transpose(coordinates), through, up, Properties(one, one, ea, ey, ez, gj, gy, gz))


@dataclass(frozen=True)
class Tips:
    """Tips of all cases on each number of steps."""

    cases: tuple[Case, ...]
    found: dict[int, Equilibria]

    @property
    def steps(self) -> list[int]:
        return list(self.found)

    def all_found(self, name: str) -> tuple[int, list[Equilibria]]:
        """Number of the case, and the equilibria on each number of steps."""
        i = [case.name for case in self.cases].index(name)
        for steps, found in self.found.items():
            assert found.ok[i], f"{steps} steps: {found.reasons[i]}"
        return i, list(self.found.values())

    def motion(self, name: str) -> Floats:
        """Translation and rotation vector on each number of steps, (n, 6)."""
        i, found = self.all_found(name)
        return np.stack([one.at("tip")[i] for one in found])

    def errors(self, name: str, translation: Floats, rotation: Rotation) -> Floats:
        """Largest error of a translation or angle on each number of steps, (n,)."""
        i, found = self.all_found(name)
        turned = [(one.rotation("tip")[i] * rotation.inv()).magnitude() for one in found]
        return np.maximum(np.abs(self.motion(name)[:, :3] - translation).max(1), turned)

    def errors_by_scipy(self, name: str) -> Floats:
        """The same, beside the equations of the rod; what the clamp exerts is the guess."""
        i, found = self.all_found(name)
        return self.errors(name, *self.cases[i].solved(-found[-1].reactions[i, 0]))


def solvers(steps: Sequence[int], planar: bool) -> dict[int, NonlinearSolver]:
    """The frame is of any shape: all cases bring their own."""
    nodes = {"root": (0, 0, 0), "tip": (1, 0, 0), "arm": (1, 0.5, 0)}
    member = Member("m", "root", "tip", Section(1.0, 1.0, 1.0, 1.0), Material(1.0, 0.0), (0, 0, 1), (0.5, 0.1, 0))
    frame = Frame(nodes, [member], [RigidBody("lever", "tip", ("arm",))], clamps=["root"])
    return {n: condense(frame, planar=planar, n_steps=n) for n in steps}


def run(solvers: dict[int, NonlinearSolver], cases: Sequence[Case], only_stable: bool = True) -> Tips:
    dead, follower = np.zeros((2, len(cases), 3, 6))
    dead[:, 1, 3:] = [case.dead[3:] for case in cases]
    for row, case in zip(dead, cases, strict=True):
        row[2 if any(case.arm) else 1, :3] = case.dead[:3]
    follower[:, 1] = [case.follower for case in cases]
    where = geometry(cases)
    return Tips(tuple(cases), {n: s.solve(dead, None, follower, where, only_stable) for n, s in solvers.items()})


def assert_order(steps: Sequence[int], errors: Floats, floor: float = 1e-11) -> None:
    """Fourth order in the end, and better than second before h is small; down to what float64 leaves."""
    kept = errors > floor
    steps, errors = np.array(steps)[kept], errors[kept]
    seen = np.log(errors[:-1] / errors[1:]) / np.log(steps[1:] / steps[:-1])
    assert ORDER[0] < seen[-1] < ORDER[1], (errors, seen)
    assert np.all(seen > 2), (errors, seen)


# ---- The cases ----

ALPHAS = (0.1, 1.0, 2.0, 5.0, 10.0, 20.0)
UNEVEN = (RIGID, RIGID, RIGID, 0.6, 0.5, 1.0)
SOFT = (400.0, 150.0, 120.0, 0.6, 0.5, 1.3)  # stretches and shears by per cents
SKEW = Rotation.from_rotvec([0.5, -0.3, 0.4])
BEND_SIZE, BEND_EI = 100.0, 1e7 / 12  # what the lengths and EI of the bend are divided by
BEND_STIFFNESS = (1e7 * BEND_SIZE**2 / BEND_EI, *(1e7 / 2.4 * BEND_SIZE**2 / BEND_EI,) * 2, 1.0, 1.0, 1.0)


def elastica(name: str, alpha: float, stiffness: Sequence[float] = Case.stiffness, axis: int = 1) -> Case:
    """Under a tip force α EI/L² along y or z."""
    force = np.zeros(6)
    force[axis] = alpha * stiffness[6 - axis]
    return Case(name, stiffness=stiffness, dead=tuple(force))


def moment(turns: float) -> Case:
    return Case(f"{turns} turns", dead=(0, 0, 0, 0, 0, 2 * math.pi * turns))


IN_PLANE = [
    *(elastica(f"y {alpha}", alpha) for alpha in ALPHAS),
    *(moment(turns) for turns in (0.5, 1, 2)),
    *(Case(f"follower {p}", follower=(0, p, 0, 0, 0, 0)) for p in (2.0, 5.0, 10.0)),
    Case("follower moment", follower=(0, 0, 0, 0, 0, 3.0)),
    Case("lever", dead=(1.0, 2.0, 0, 0, 0, -0.5), arm=(0.3, 0.4, 0)),
    Case("soft", stiffness=SOFT, dead=(-1.0, 3.0, 0, 0, 0, 0.5)),
    Case("arc", arc(0.5, 2.0), dead=(-2.0, 1.5, 0, 0, 0, 0.7)),
    Case("ring", arc(0.2, 5.0), SOFT, dead=(3.0, -4.0, 0, 0, 0, 0.3)),
]

IN_SPACE = [
    *(elastica(f"y {alpha}", alpha, UNEVEN, 1) for alpha in ALPHAS),
    *(elastica(f"z {alpha}", alpha, UNEVEN, 2) for alpha in ALPHAS),
    *(
        Case(f"bend {f[2]:g}", arc(1.0, math.pi / 4), BEND_STIFFNESS, (0, 0, f[2] * BEND_SIZE**2 / BEND_EI, 0, 0, 0))
        for f in BEND["loads"]
    ),
    Case("follower", stiffness=UNEVEN, follower=(0.2, 2.0, -1.0, 0, 0, 0)),
    Case("follower wrench", stiffness=SOFT, follower=(1.0, 2.0, -1.0, 0.4, -0.5, 0.3)),
    Case("both", stiffness=SOFT, dead=(0.5, -1.0, 1.0, 0, 0, 0), follower=(0, 0, 1.0, 0.3, 0.2, 0)),
    Case("lever", stiffness=UNEVEN, dead=(1.0, 1.0, -1.5, 0, 0, 0), arm=(0.2, 0.3, -0.4)),
    Case("soft", stiffness=SOFT, dead=(-0.4, 2.0, 1.0, 0, 0, 0)),
    Case("arc", arc(0.5, 2.0, SKEW), SOFT, (1.0, 2.0, -1.0, 0, 0, 0)),
    Case("ring", arc(0.2, 5.0, SKEW), SOFT, (2.0, -3.0, 4.0, 0, 0, 0), (0, 0, 0, 0.1, 0.2, -0.1), (0.1, 0.0, 0.1)),
]


@pytest.fixture(scope="module")
def planar() -> Tips:
    return run(solvers((4, 8, 16, 32), planar=True), IN_PLANE)


@pytest.fixture(scope="module")
def in_space() -> dict[int, NonlinearSolver]:
    return solvers((10, 40), planar=False)


@pytest.fixture(scope="module")
def spatial(in_space) -> Tips:
    return run(in_space, IN_SPACE)


# ---- The elastica: Mattiasson, Int. J. Numer. Methods Eng. 17 (1981), 145–153 ----


def elliptic(alpha: float) -> tuple[float, float, float]:
    """(L − x)/L, y/L and θ of the tip under a force α EI/L² across the cantilever, by elliptic integrals.

    With k² = (1 + sin θ)/2 and sin φ = 1/(k √2): √α = K(k) − F(φ, k), y/L = 1 − 2 (E(k) − E(φ, k))/√α and
    x/L = √(2 sin θ/α). Frisch-Fay, Flexible Bars (1962), §2.
    """

    def integrals(theta: float) -> tuple[float, float]:
        m = (1 + math.sin(theta)) / 2
        phi = math.asin(min(1.0, 1 / math.sqrt(2 * m)))
        return ellipk(m) - ellipkinc(phi, m), ellipe(m) - ellipeinc(phi, m)

    theta = brentq(lambda t: integrals(t)[0] - math.sqrt(alpha), 1e-9, math.pi / 2 - 1e-9, xtol=1e-15)
    x = math.sqrt(2 * math.sin(theta) / alpha)
    return 1 - x, 1 - 2 * integrals(theta)[1] / math.sqrt(alpha), theta


@pytest.mark.parametrize("alpha", ["1", "2", "5", "10"])
def test_mattiasson_1981_table_and_the_elliptic_integrals_agree(alpha):
    """The table prints five digits; the integrals in the file are of another program."""
    row = BEAMS["mattiasson_elastica"]["values"][alpha]
    assert_allclose([row[f"mattiasson_{name}"] for name in ("u_L", "w_L", "theta")], elliptic(float(alpha)), atol=6e-6)
    assert_allclose([row[f"exact_{name}"] for name in ("u_L", "w_L", "theta")], elliptic(float(alpha)), atol=1e-12)


def expected(alpha: float, axis: int = 1) -> tuple[Floats, Rotation]:
    u, w, theta = elliptic(alpha)
    translation = np.array([-u, 0.0, 0.0])
    translation[axis] = w
    return translation, Rotation.from_rotvec([0.0, 0.0, theta] if axis == 1 else [0.0, -theta, 0.0])


@pytest.mark.parametrize("alpha", ALPHAS)
def test_mattiasson_1981_elastica_in_the_plane_is_of_fourth_order(planar, alpha):
    """4, 8, 16 and 32 steps. At α = 20 the curvature decays within √(EI/P) = 0.22 L of the clamp: from 8 on."""
    some = planar if alpha < 20 else Tips(planar.cases, {n: f for n, f in planar.found.items() if n >= 8})
    assert_order(some.steps, some.errors(f"y {alpha}", *expected(alpha)))


@pytest.mark.parametrize("axis", [1, 2])
@pytest.mark.parametrize("alpha", ALPHAS)
def test_mattiasson_1981_elastica_in_space(spatial, alpha, axis):
    """About either principal axis, of unequal stiffness: as promised, 10 steps put the tip to 1e-4 of the length
    where the table has its numbers, α ≤ 10. To the fourth order from 10 to 40 steps."""
    name, (translation, rotation) = f"{' yz'[axis]} {alpha}", expected(alpha, axis)
    if alpha <= 10:
        assert_allclose(spatial.motion(name)[0, :3], translation, atol=1e-4)
    assert_order(spatial.steps, spatial.errors(name, translation, rotation))


# ---- Roll-up: θ = M L/EI, a circle of radius EI/M; exact, for Magnus' step is at constant strain ----


@pytest.mark.parametrize("turns", [0.5, 1, 2])
def test_roll_up_into_circles_is_exact_in_the_plane(planar, turns):
    angle = 2 * math.pi * turns
    x, y = math.sin(angle) / angle, (1 - math.cos(angle)) / angle
    for row in planar.motion(f"{turns} turns"):
        assert_allclose(row, [x - 1, y, 0, 0, 0, angle], atol=1e-10)  # what Newton leaves undone
    i, found = planar.all_found(f"{turns} turns")
    assert_allclose([one.energy[i] for one in found], angle**2 / 2, rtol=1e-12)


def test_roll_up_in_space_is_an_equilibrium_though_not_a_stable_one(in_space):
    """A moment of constant direction and a section of equal stiffnesses: the same circles."""
    tips = run({10: in_space[10]}, [moment(turns) for turns in (0.5, 1, 2)], only_stable=False)
    for turns in (0.5, 1, 2):
        angle = 2 * math.pi * turns
        translation = np.array([math.sin(angle) / angle - 1, (1 - math.cos(angle)) / angle, 0])
        assert np.all(tips.errors(f"{turns} turns", translation, Rotation.from_rotvec([0, 0, angle])) < 1e-10)


# ---- The 45° bend: Bathe and Bolourchi, Int. J. Numer. Methods Eng. 14 (1979), 961–986 ----


@pytest.mark.parametrize("load", [150, 300, 450, 600, 900])
def test_bathe_and_bolourchi_1979_bend_against_opensees(spatial, load):
    """Straight corotational elements, extrapolated to zero size. What 40 steps leave is 1/4⁴ of what 10 leave, to
    which OpenSees adds three of its estimated errors."""
    i = [int(f[2]) for f in BEND["loads"]].index(load)
    reference = np.array(BEND["timoshenko"]["tip_displacement"][i]) / BEND_SIZE
    errors = np.linalg.norm(spatial.motion(f"bend {load}")[:, :3] - reference, axis=1)
    estimated = np.linalg.norm(BEND["timoshenko"]["estimated_error"][i]) / BEND_SIZE
    assert errors[0] < 3e-4 * np.linalg.norm(reference)
    assert errors[1] < errors[0] / 4 ** ORDER[0] + 3 * estimated


@pytest.mark.parametrize("load", ["300", "600"])
def test_bathe_and_bolourchi_1979_bend_against_the_published_tips(spatial, load):
    """Bathe and Bolourchi, and Simo and Vu-Quoc (1986), print places from few elements: three digits of the radius.
    Against the boundary value problem of Reissner's rod in the file, the numbers that those converge to."""
    bend = BEAMS["bathe_bolourchi_bend"]
    tip = BEND_SIZE * (spatial.motion(f"bend {load}")[-1, :3] + arc(1.0, math.pi / 4)(1.0))
    x, y, z = tip
    for printed in bend["published"][load].values():
        assert_allclose([x, y, z], printed, atol=0.01 * BEND_SIZE)
    converged = next(value for key, value in bend.items() if key.startswith("converged_reissner_bvp"))[load]
    assert_allclose([x, y, z], converged, atol=1e-6 * BEND_SIZE)


# ---- Against the equations of the rod, integrated by SciPy ----


@pytest.mark.parametrize("p", [2.0, 5.0, 10.0])
def test_follower_force_is_an_initial_value_problem_from_the_free_end(planar, p):
    """With φ the angle back from the tip, φ'' = (P L²/EI) cos φ and φ = φ' = 0 there: Bolotin, Nonconservative
    Problems of the Theory of Elastic Stability (1963), §2.2, the problem of Argyris and Symeonidis (1981)."""

    def slope(_, state):
        angle, bend, _, _ = state
        return [bend, p * math.cos(angle), math.cos(angle), math.sin(angle)]

    theta, _, ahead, aside = solve_ivp(slope, (0, 1), np.zeros(4), "DOP853", rtol=1e-13, atol=1e-13).y[:, -1]
    c, s = math.cos(theta), math.sin(theta)
    translation = np.array([c * ahead + s * aside - 1, s * ahead - c * aside, 0])
    assert_order(planar.steps, planar.errors(f"follower {p}", translation, Rotation.from_rotvec([0, 0, theta])))


def test_follower_moment_is_the_dead_one_in_the_plane(planar):
    """Both are M about z."""
    assert_allclose(planar.motion("follower moment")[:, 5], 3.0, rtol=1e-12)


@pytest.mark.parametrize("name", ["lever", "soft", "arc", "ring"])
def test_in_the_plane_against_the_equations_of_the_rod(planar, name):
    assert_order(planar.steps, planar.errors_by_scipy(name))


@pytest.mark.parametrize("name", ["follower", "follower wrench", "both", "lever", "soft", "arc", "ring"])
def test_in_space_against_the_equations_of_the_rod(spatial, name):
    assert_order(spatial.steps, spatial.errors_by_scipy(name))

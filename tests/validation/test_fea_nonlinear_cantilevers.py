"""Verification of the nonlinear FEA by cantilevers, each test with its source.

The law of a member is integrated to the fourth order, so next to a bound every test asserts the order: the bounds are
those of the step, h⁴, and not of float64. The cases of one solve differ in geometry and section.
"""

import json
import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation
from scipy.special import ellipe, ellipeinc, ellipk, ellipkinc

from experiments.fea import Material, Member, Section, condense
from experiments.fea.equilibria import Equilibria
from experiments.fea.nonlinear import NonlinearSolver
from tests.rod_cases import DRIVE, ORDER, RIGID, Case, Tips, arc, assert_order, frame, geometries, run
from tests.rod_equations import Rod, driven_end

Floats = NDArray[np.float64]

REFERENCE = Path(__file__).parents[1] / "reference"
BEAMS = json.loads((REFERENCE / "beams.json").read_text(encoding="utf-8"))
BEND = json.loads((REFERENCE / "opensees_cantilevers.json").read_text(encoding="utf-8"))["bend_45"]

# ---- The cases ----

ALPHAS = (0.1, 1.0, 2.0, 5.0, 10.0, 20.0)
UNEVEN = (RIGID, RIGID, RIGID, 0.6, 0.5, 1.0)
SOFT = (400.0, 150.0, 120.0, 0.6, 0.5, 1.3)  # stretches and shears by per cents
DRIVEN = Member(
    "driven", "base", "drive", Section(60.0, 0.7, 1.0, 0.8, 40.0, 50.0), Material(1.0, -0.5), (0.3, 1.0, 0.0)
)
"""Gives way along itself, so that an end that turns in its place does not tear it; the shear modulus is one too."""
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
    """On steps of three sizes, since each is another program that takes 20 s to compile."""
    return run({n: condense(frame(), planar=True, n_steps=n) for n in (4, 16, 32)}, IN_PLANE)


@pytest.fixture(scope="module")
def in_space() -> dict[int, NonlinearSolver]:
    """With the driven member of the end of this file."""
    return {n: condense(frame(DRIVEN), n_steps=n) for n in (10, 40)}


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
    """4, 16 and 32 steps."""
    assert_order(planar.steps, planar.errors(f"y {alpha}", *expected(alpha)))


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


# ---- Cantilevers that point elsewhere than the frame that was condensed ----


def test_a_geometry_may_be_turned_far_from_the_frame(in_space):
    """They move as one along the frame does, seen from their own axes: x ahead, z towards the global y."""
    towards = np.array([(1.0, 0.0, 0.0), (-1.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, -0.6, 0.8), (-0.6, 0.0, -0.8)])
    up, force = np.array([0.0, 1.0, 0.0]), np.array([0.3, 0.6, 0.9])

    def axes(x: Floats) -> Floats:
        z = up - (up @ x) * x
        z /= np.linalg.norm(z)
        return np.array([x, np.cross(z, x), z])

    def leaf(name: str, x: Floats, force: Floats) -> Case:
        return Case(name, lambda s: s * x, SOFT, dead=(*force, 0, 0, 0), up=tuple(up))

    turns = [axes(x).T @ axes(towards[0]) for x in towards]
    pulled = [leaf(f"global {i}", x, force) for i, x in enumerate(towards)]
    carried = [leaf(f"own {i}", towards[0], turn.T @ force) for i, turn in enumerate(turns)]
    tips = run({10: in_space[10]}, [*pulled, *carried])
    for i, turn in enumerate(turns):
        found, expected = (tips.motion(f"{kind} {i}").reshape(2, 3) for kind in ("global", "own"))
        assert_allclose(found, expected @ turn.T, atol=1e-11)


# ---- Prescribed motions of a clamped end ----

MOTIONS = {
    "a right angle": (np.zeros(3), [0.0, math.pi / 2, 0.0]),
    "about a skew axis": (np.zeros(3), [0.6, -0.8, 1.0]),
    "moved and turned": (np.array([-0.1, 0.2, 0.3]), [-0.7, 0.5, 0.4]),
    "twisted": (np.zeros(3), 0.8 * np.array(DRIVE)),
}
T, WEIGHTS = (np.polynomial.legendre.leggauss(12)[0] + 1) / 2, np.polynomial.legendre.leggauss(12)[1] / 2


@pytest.fixture(scope="module")
def driven(in_space) -> dict[int, Equilibria]:
    """For every motion all of it and its fractions T."""
    rows = np.concatenate([np.outer([1.0, *T], np.concatenate(motion)) for motion in MOTIONS.values()])
    motions = np.zeros((len(rows), len(in_space[10].frame.nodes), 6))
    motions[:, in_space[10].frame.index("drive")] = rows
    return {n: s.solve(motions=motions, geometry=geometries(s, len(rows))) for n, s in in_space.items()}


@pytest.mark.parametrize("name", MOTIONS)
def test_driven_end_against_the_equations_of_the_rod(driven, name):
    """The end where it is put, and what it takes to the fourth order; a twist alone is exact."""
    translation, rotation = MOTIONS[name]
    i, errors = list(MOTIONS).index(name) * (1 + len(T)), []
    for found in driven.values():
        assert found.ok[i], found.reasons[i]
        assert_allclose(found.at("drive")[i, :3], translation, atol=1e-12)
        left = found.rotation("drive")[i] * Rotation.from_rotvec(rotation).inv()
        assert_allclose(left.magnitude(), 0, atol=1e-12)
        directors, clamp = found.arrays.axes[1].T, found.reactions[i, 1]
        rod = Rod(np.zeros(3), directors, 1.0, 1 / np.array([60.0, 40.0, 50.0, 0.8, 0.7, 1.0]), np.zeros(3))
        wrench, _, _ = rod.shoot(driven_end(directors, DRIVE + translation, rotation), -clamp)
        errors.append(np.abs(clamp + wrench).max() / np.abs(wrench).max())
        assert_allclose(found.support_reactions[i, 0, :3], -clamp[:3], atol=1e-9)
    if name == "twisted":
        assert max(errors) < 1e-9
    else:
        assert_order(list(driven), np.array(errors))


@pytest.mark.parametrize("name", MOTIONS)
def test_work_of_a_drive_in_space_is_the_strain_energy(driven, name):
    """∫ (F·d + M·θ) dt along t d and exp(t θ), whose spin is θ all along; to the fourth order, or better."""
    start, left = list(MOTIONS).index(name) * (1 + len(T)), []
    for found in driven.values():
        rows = slice(start + 1, start + 1 + len(T))
        assert found.ok[rows].all(), found.reasons[rows]
        work = WEIGHTS @ (found.support_reactions[rows, 0] @ np.concatenate(MOTIONS[name]))
        left.append(abs(work / found.energy[start] - 1))
    if name == "twisted":
        assert max(left) < 1e-9
    else:
        assert left[0] / left[1] > 4 ** ORDER[0]
        assert left[0] < 4e-4  # 1e-3 on 8 steps

"""Verification of circular members of the linear FEA against closed forms, each with its source.

The flexibility of an arc is integrated to rounding, so the tolerances are those of float64 arithmetic.
"""

import math
from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from experiments.fea import (
    Frame,
    Load,
    Material,
    Member,
    Support,
    centrelines,
    circle,
    factorise,
    load_array,
    rectangle,
)
from experiments.fea.arrays import frame_arrays
from experiments.fea.assembly import assemble
from experiments.fea.elements import Properties, arc_stiffness, straight_stiffness
from experiments.fea.shapes import Shapes, shapes

STEEL = Material(young=207e9, poisson=0.29)
E, G = STEEL.young, STEEL.shear
STOCKY = replace(rectangle(width=0.03, thickness=0.02), shear_area_y=4e-4)  # no two stiffnesses alike
R = 0.3


def arc(angle: float, n: int = 1, section=STOCKY, curved: bool = True, turn=None, material=STEEL, radius=R) -> Frame:
    """n members from the clamp n0 at (r, 0, 0) anticlockwise about z through `angle`; chords, if not curved."""
    turn = turn or Rotation.identity()

    def place(at: float) -> tuple[float, float, float]:
        return tuple(turn.apply([radius * math.cos(at), radius * math.sin(at), 0.0]))

    at = np.linspace(0.0, angle, n + 1)
    up = tuple(turn.apply([0.0, 0.0, 1.0]))
    members = [
        Member(f"m{i}", f"n{i}", f"n{i + 1}", section, material, up, place((at[i] + at[i + 1]) / 2) if curved else None)
        for i in range(n)
    ]
    return Frame({f"n{i}": place(a) for i, a in enumerate(at)}, members, clamps=("n0",))


def unit_loads(frame: Frame, angle: float, turn=None) -> tuple[np.ndarray, np.ndarray]:
    """Unit forces and moments on the last node along its radius, tangent and normal, and these axes as rows."""
    c, s = math.cos(angle), math.sin(angle)
    axes = np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])
    axes = axes if turn is None else turn.apply(axes)
    loads = np.zeros((6, len(frame.nodes), 6))
    loads[:3, -1, :3] = loads[3:, -1, 3:] = axes
    return loads, axes


def end_flexibility(frame: Frame, angle: float, turn=None) -> np.ndarray:
    """Motion of the last node per unit load upon it, along and about its radius, tangent and normal, (6, 6)."""
    loads, axes = unit_loads(frame, angle, turn)
    u = factorise(frame).solve(loads).displacements[:, -1]
    return np.concatenate([u[:, :3] @ axes.T, u[:, 3:] @ axes.T], axis=1)


# ---- Castigliano's theorem along a circular cantilever of any angle ----


@pytest.mark.parametrize("turn", [None, Rotation.from_rotvec([0.4, -1.1, 2.0])], ids=["flat", "skew"])
@pytest.mark.parametrize("angle", [0.1, math.pi / 2, math.pi, 5.0])
def test_circular_cantilever_by_castigliano(angle, turn):
    """With φ from the free end, C = ∫ cos² φ, S = ∫ sin² φ, V = ∫ (1 − cos φ)² over the angle:

    radial force R³S/EI + RS/EA + RC/GA_s, tangential force R³V/EI + RC/EA + RS/GA_s, normal force
    R³(S/EI + V/GJ) + Rα/GA_s; moments Rα/EI about the normal, R(S/GJ + C/EI) about the radius and
    R(C/GJ + S/EI) about the tangent. A moment about the normal moves the end by R²(1 − cos α)/EI
    along the radius, inwards if anticlockwise, and by R²(α − sin α)/EI forwards.
    """
    s, c = math.sin(angle), math.cos(angle)
    C, S, V = (angle + s * c) / 2, (angle - s * c) / 2, 1.5 * angle - 2 * s + s * c / 2
    EA, EIy, EIz = E * STOCKY.area, E * STOCKY.second_moment_y, E * STOCKY.second_moment_z
    GJ, GAy, GAz = G * STOCKY.torsion_constant, G * STOCKY.shear_area_y, G * STOCKY.shear_area_z
    expected = [
        R**3 * S / EIz + R * S / EA + R * C / GAy,
        R**3 * V / EIz + R * C / EA + R * S / GAy,
        R**3 * (S / EIy + V / GJ) + R * angle / GAz,
        R * (S / GJ + C / EIy),
        R * (C / GJ + S / EIy),
        R * angle / EIz,
    ]
    f = end_flexibility(arc(angle, turn=turn), angle, turn)
    assert_allclose(np.diag(f), expected, rtol=1e-10)
    assert_allclose(f[5, :2], np.array([-R * R * (1 - c), R * R * (angle - s)]) / EIz, rtol=1e-9)
    assert_allclose(f, f.T, atol=1e-12 * np.abs(f).max())


def test_timoshenko_strength_of_materials_part_1_3rd_ed_page_412_eq_241():
    """Quarter ring, normal to whose plane an end force acts: δ = P r³ (π/4 / EI + (3π/4 − 2)/GJ).

    The numbers are those of ANSYS's verification case VM18 after the book, in pounds and inches:
    r = 100, d = 2, E = 30e6, ν = 0.3, P = 50 give 2.648 in and, at the clamp, M c/I = 6366 psi.
    """
    section = circle(2.0, shear_coefficient=math.inf)
    frame = arc(math.pi / 2, section=section, material=Material(30e6, 0.3), radius=100.0)
    solution = factorise(frame).solve(load_array(frame, [[Load("n1", force=(0, 0, -50.0))]]))
    EI, GJ = 30e6 * math.pi / 4, 30e6 / 2.6 * math.pi / 2
    exact = 50 * 100**3 * (math.pi / 4 / EI + (3 * math.pi / 4 - 2) / GJ)
    assert_allclose(solution.at("n1")[0, 2], -exact, rtol=1e-11)
    assert_allclose(exact, 2.648, rtol=1e-3)
    assert_allclose(solution.stress().bending[0], 6366, atol=0.5)
    assert solution.stress().place[0] == 0


def test_macneal_and_harder_1985_curved_beam():
    """Finite Elements in Analysis and Design 1, 3–20: radii 4.12 and 4.32, thickness 0.1, a quarter ring.

    E = 1e7, ν = 0.25, unit shear at the tip; 0.08734 in the plane and 0.5022 across it. Their values
    are of a thick ring (depth 0.2, radius 4.22), which no beam is; 2 % is the paper's best grade.
    """
    section = rectangle(width=0.2, thickness=0.1)
    frame = arc(math.pi / 2, section=section, material=Material(1e7, 0.25), radius=4.22)
    f = end_flexibility(frame, math.pi / 2)
    assert_allclose(np.diag(f)[[0, 2]], [0.08734, 0.5022], rtol=0.02)


# ---- One arc, many arcs, and polygons ----


@pytest.mark.parametrize("n", [2, 5])
@pytest.mark.parametrize("angle", [0.5, 3.0, 6.2])
def test_one_arc_is_as_exact_as_many(angle, n):
    one, many = end_flexibility(arc(angle), angle), end_flexibility(arc(angle, n), angle)
    assert_allclose(many, one, atol=1e-11 * np.abs(one).max(), rtol=0)


def test_inscribed_polygons_converge_to_the_arc_at_rate_two():
    angle = 2.5
    exact = end_flexibility(arc(angle), angle)
    scale = np.sqrt(np.outer(np.diag(exact), np.diag(exact)))
    errors = [np.abs((end_flexibility(arc(angle, n, curved=False), angle) - exact) / scale) for n in (8, 16, 32)]
    clear = errors[0] > 1e-4  # leaves out the couplings that are zero but for rounding
    assert clear.sum() >= 12
    assert_allclose(np.log2(errors[0][clear] / errors[1][clear]), 2, atol=0.05)
    assert_allclose(np.log2(errors[1][clear] / errors[2][clear]), 2, atol=0.015)


def test_an_arc_without_bend_is_the_straight_beam():
    bending = jax.jit(arc_stiffness)  # one program instead of one for each operation
    with jax.enable_x64(True):
        p = Properties(*(jnp.asarray(v) for v in (E, G, *properties(STOCKY))))
        for length in (0.02, 0.3, 10.0):
            straight = Shapes(jnp.asarray(length), jnp.eye(3), jnp.zeros(3))
            bent, exact = np.asarray(bending(straight, p)), np.asarray(straight_stiffness(straight.length, p))
            scale = 1 / np.sqrt(np.diag(exact))
            assert_allclose(scale[:, None] * bent * scale, scale[:, None] * exact * scale, atol=1e-13)


def properties(section) -> tuple[float, ...]:
    return (
        section.area,
        section.second_moment_y,
        section.second_moment_z,
        section.torsion_constant,
        section.shear_area_y,
        section.shear_area_z,
    )


# ---- Laws ----


def test_rigid_motion_of_arcs_gives_no_force():
    frame = arc(4.0, 5, turn=Rotation.from_rotvec([0.4, -1.1, 2.0]))
    a = frame_arrays(frame)
    K = factorise(frame).stiffness
    modes = np.zeros((6, len(frame.nodes), 6))
    for mode, motion in zip(modes, np.eye(6), strict=True):
        mode[:, :3] = motion[:3] + np.cross(motion[3:], a.coordinates)
        mode[:, 3:] = motion[3:]
    assert np.abs(modes.reshape(6, -1) @ K).max() < 1e-13 * np.abs(K).max()
    assert np.linalg.matrix_rank(K, hermitian=True) == len(K) - 6
    assert_allclose(K, K.T, atol=1e-14 * np.abs(K).max())


def test_end_forces_of_an_arc_are_in_the_axes_of_each_end():
    """By statics: the end carries the load in its own axes, the start minus the load and minus its moment."""
    angle, F, M = 2.0, np.array([5.0, -3.0, 2.0]), np.array([0.4, 0.1, -0.3])
    frame = arc(angle)
    solution = factorise(frame).solve(load_array(frame, [[Load("n1", force=tuple(F), moment=tuple(M))]]))
    start, end = solution.end_forces[0, 0]
    c, s = math.cos(angle), math.sin(angle)
    # Local x is the tangent, local z the normal, so y = z × x points at the centre.
    at_end, at_start = np.array([[-s, c, 0], [-c, -s, 0], [0, 0, 1]]), np.array([[0, 1, 0], [-1, 0, 0], [0, 0, 1]])
    assert_allclose(end, np.r_[at_end @ F, at_end @ M], atol=1e-10)
    lever = R * np.array([c - 1, s, 0])
    assert_allclose(start, -np.r_[at_start @ F, at_start @ (M + np.cross(lever, F))], atol=1e-10)


def test_centreline_of_an_arc_is_that_of_its_parts():
    """At the node that splits it, and on the circle; the ends meet their nodes."""
    angle = 3.0
    one, two = arc(angle), arc(angle, 2)
    load = {"force": (3.0, -8.0, 5.0), "moment": (0.3, 0.1, -0.2)}
    whole = factorise(one).solve(load_array(one, [[], [Load("n1", **load)]]))
    parts = factorise(two).solve(load_array(two, [[Load("n2", **load)]]))
    (line,) = centrelines(whole, case=1, n_points=9)
    size = np.abs(whole.displacements).max()
    assert_allclose(np.linalg.norm(line.points, axis=1), R, rtol=1e-14)
    assert_allclose(line.points[[0, -1]], list(one.nodes.values()), atol=1e-15)
    assert_allclose(line.displacement[4], parts.at("n1")[0, :3], atol=1e-12 * size)
    assert_allclose(line.displacement[-1], whole.at("n1")[1, :3], atol=1e-12 * size)
    first, second = centrelines(parts, n_points=5)
    assert_allclose(np.concatenate([first.displacement, second.displacement[1:]]), line.displacement, atol=1e-12 * size)


def test_centrelines_of_arcs_and_straight_members_stand_side_by_side():
    """A straight leaf on an arc: its centreline is the one that it has without any arc beside it, moved along."""
    frame = arc(1.0)
    tip = (0.1, 0.5, 0.2)
    frame = Frame(
        dict(frame.nodes) | {"tip": tip},
        [*frame.members, Member("leaf", "n1", "tip", STOCKY, STEEL)],
        supports=[Support("n0", ("x", "y", "z", "rx", "ry", "rz")), Support("n1", ("x", "y", "z", "rx", "ry", "rz"))],
    )
    load = Load("tip", force=(1.0, 2.0, 3.0))
    alone = Frame({"n1": frame.nodes["n1"], "tip": tip}, [frame.members[1]], clamps=("n1",))
    both = centrelines(factorise(frame).solve(load_array(frame, [[load]])))
    (expected,) = centrelines(factorise(alone).solve(load_array(alone, [[load]])))
    assert_allclose(both[1].displacement, expected.displacement, rtol=1e-12, atol=1e-20)
    assert_allclose(both[1].points, expected.points, rtol=1e-14)
    assert_allclose(both[0].displacement, 0, atol=0)


def test_stress_of_an_arc_peaks_where_its_moment_does():
    """A radial end force P has M = P R sin φ with φ from the free end: at φ = π/2 it is P R."""
    angle, P = 2.5, 7.0
    frame = arc(angle)
    radial = np.array([math.cos(angle), math.sin(angle), 0.0])
    stress = factorise(frame).solve(load_array(frame, [[Load("n1", force=tuple(P * radial))]])).stress()
    peak = P * R * 0.015 / STOCKY.second_moment_z
    assert peak * (1 - (angle / 128) ** 2 / 8) <= stress.bending[0, 0] <= peak * (1 + 1e-12)
    assert_allclose(stress.place[0, 0], 1 - math.pi / 2 / angle, atol=0.5 / 128)


def test_stiffness_of_an_arc_is_differentiable_in_its_geometry():
    """Without shear and stretch δ = P R³ S/(E I): dδ/dR = 3δ/R; the shape is traced with the radius."""
    a = frame_arrays(arc(2.0))
    p = Properties(*(np.array([v]) for v in (E, G, 1e6, *properties(STOCKY)[1:4], math.inf, math.inf)))

    def deflection(radius):
        x, through = a.coordinates / R * radius, a.through / R * radius
        rest = shapes(jnp, x[:1].T, x[1:].T, through.T, a.up.T)
        stiffness = assemble(rest, a.ends, p, 2)[0][6:, 6:]
        radial = jnp.array([math.cos(2.0), math.sin(2.0), 0, 0, 0, 0])
        return radial @ jnp.linalg.solve(stiffness, radial)

    with jax.enable_x64(True):
        value, gradient = jax.jit(jax.value_and_grad(deflection))(R)
    delta = R**3 * (2.0 - math.sin(2.0) * math.cos(2.0)) / 2 / (E * STOCKY.second_moment_z)
    assert_allclose([value, gradient], [delta, 3 * delta / R], rtol=1e-7)

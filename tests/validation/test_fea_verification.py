"""Verification of the linear beam FEA against closed forms, each with its source.

A single element is exact for loads at its ends, so the tolerances are those of float64 arithmetic.
"""

import math
from collections.abc import Sequence

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from experiments.fea import (
    Frame,
    Load,
    Material,
    Member,
    RigidBody,
    Section,
    centrelines,
    circle,
    factorise,
    load_array,
    rectangle,
)
from experiments.fea.arrays import frame_arrays

STEEL = Material(young=207e9, poisson=0.29)
E, G = STEEL.young, STEEL.shear
SLENDER = rectangle(width=0.02, thickness=0.01, shear_coefficient=math.inf)
STOCKY = rectangle(width=0.03, thickness=0.02)


def straight(section: Section, stations: Sequence[float], clamp: int = 0, along=(1.0, 0.0, 0.0), up=None) -> Frame:
    """Nodes n0, n1, … at `stations` along a line, one member between neighbours, one of them clamped."""
    nodes = {f"n{i}": tuple(s * np.array(along)) for i, s in enumerate(stations)}
    members = [Member(f"m{i}", f"n{i}", f"n{i + 1}", section, STEEL, up) for i in range(len(stations) - 1)]
    return Frame(nodes, members, clamps=(f"n{clamp}",))


def solve(frame: Frame, *loads: Load):
    """The solution of one load case."""
    return factorise(frame).solve(load_array(frame, [loads]))


# ---- Roark's Formulas for Stress and Strain, 7th ed., Table 8.1: left end A free, right end fixed ----


@pytest.mark.parametrize("a", [0.0, 0.3])
def test_roark_7th_table_8_1_case_1a_cantilever_with_concentrated_force(a):
    """y_A = −W (2l³ − 3l²a + a³)/(6EI), θ_A = W (l − a)²/(2EI); W downward at a from the free end."""
    W, length, EI = 30.0, 0.8, E * SLENDER.second_moment_z
    stations = [0.0, length] if a == 0 else [0.0, a, length]
    frame = straight(SLENDER, stations, clamp=len(stations) - 1)
    tip = solve(frame, Load("n0" if a == 0 else "n1", force=(0, -W, 0))).at("n0")[0]
    assert_allclose(tip[1], -W * (2 * length**3 - 3 * length**2 * a + a**3) / (6 * EI), rtol=1e-11)
    assert_allclose(tip[5], W * (length - a) ** 2 / (2 * EI), rtol=1e-11)


@pytest.mark.parametrize("a", [0.0, 0.3])
def test_roark_7th_table_8_1_case_3a_cantilever_with_concentrated_moment(a):
    """y_A = M₀ (l² − a²)/(2EI), θ_A = −M₀ (l − a)/(EI); M₀ clockwise at a from the free end."""
    M, length, EI = 12.0, 0.8, E * SLENDER.second_moment_z
    stations = [0.0, length] if a == 0 else [0.0, a, length]
    frame = straight(SLENDER, stations, clamp=len(stations) - 1)
    tip = solve(frame, Load("n0" if a == 0 else "n1", moment=(0, 0, -M))).at("n0")[0]
    assert_allclose(tip[1], M * (length**2 - a**2) / (2 * EI), rtol=1e-11)
    assert_allclose(tip[5], -M * (length - a) / EI, rtol=1e-11)


# ---- Timoshenko & Goodier, Theory of Elasticity, 3rd ed., §109: torsion of rectangular bars ----

K1 = {
    1.0: 0.1406,
    1.2: 0.166,
    1.5: 0.196,
    2.0: 0.229,
    2.5: 0.249,
    3.0: 0.263,
    4.0: 0.281,
    5.0: 0.291,
    10.0: 0.312,
    1e9: 0.333,  # the table's ∞
}


@pytest.mark.parametrize(("ratio", "k1"), K1.items())
@pytest.mark.parametrize("upright", [False, True])
def test_timoshenko_goodier_3rd_section_109_table_of_k1(ratio, k1, upright):
    """J = k₁ a³ b, b ≥ a; the tolerance is half a unit in the last printed place."""
    a = 0.004
    sides = (a, ratio * a) if upright else (ratio * a, a)
    printed = 0.5e-4 if ratio == 1.0 else 0.5e-3
    assert_allclose(rectangle(*sides).torsion_constant / (a**3 * ratio * a), k1, atol=printed, rtol=0)


@pytest.mark.parametrize("ratio", [1.0, 1.3, 4.0])
def test_timoshenko_goodier_3rd_section_109_series(ratio):
    """k₁ = (1/3) (1 − (192/π⁵) (a/b) Σ_{n odd} tanh(nπb/2a)/n⁵), summed as printed to 20 000 terms."""
    n = np.arange(40_001, 0, -2, dtype=float)
    k1 = (1 - 192 / np.pi**5 / ratio * np.sum(np.tanh(n * np.pi * ratio / 2) / n**5)) / 3
    assert_allclose(rectangle(ratio, 1.0).torsion_constant, k1 * ratio, rtol=1e-13)


# ---- Przemieniecki, Theory of Matrix Structural Analysis (1968), §5.6; closed forms by Castigliano ----


def test_axial_and_torsion_of_a_bar():
    """u = P L/(E A), θ = T L/(G J); the solid circle has J = π d⁴/32."""
    P, T, length, d = 500.0, 7.0, 0.6, 0.012
    tip = solve(straight(circle(d), [0, length]), Load("n1", force=(P, 0, 0), moment=(T, 0, 0))).at("n1")[0]
    assert_allclose(tip[0], P * length / (E * math.pi * d**2 / 4), rtol=1e-13)
    assert_allclose(tip[3], T * length / (G * math.pi * d**4 / 32), rtol=1e-13)
    assert_allclose(tip[[1, 2, 4, 5]], 0, atol=1e-18)


@pytest.mark.parametrize("axis", [1, 2])
def test_cantilever_with_shear_flexibility(axis):
    """δ = P L³/(3EI) + P L/(κ G A), κ = 5/6; the slope P L²/(2EI) has no share of shear."""
    P, length, b, t = 100.0, 0.1, 0.03, 0.02  # b along local y, t along local z
    second_moment = {1: t * b**3 / 12, 2: b * t**3 / 12}[axis]
    slope_axis, sign = {1: (5, 1), 2: (4, -1)}[axis]
    frame = straight(rectangle(b, t), [0, length])
    tip = solve(frame, Load("n1", force=tuple(P * np.eye(3)[axis]))).at("n1")[0]
    bending, shear = P * length**3 / (3 * E * second_moment), P * length / (5 / 6 * G * b * t)
    assert_allclose(tip[axis], bending + shear, rtol=1e-12)
    assert_allclose(tip[slope_axis], sign * P * length**2 / (2 * E * second_moment), rtol=1e-12)


def test_euler_bernoulli_is_the_limit_at_the_rate_of_slenderness_squared():
    """The relative difference is 3EI/(κ G A L²) = (1 + ν)/(2κ) (t/L)²: halving t divides it by four."""
    length, differences = 1.0, []
    for t in (0.08, 0.04, 0.02):
        load = Load("n1", force=(0, 0, 1.0))
        thick = solve(straight(rectangle(0.05, t), [0, length]), load).at("n1")[0, 2]
        thin = solve(straight(rectangle(0.05, t, math.inf), [0, length]), load).at("n1")[0, 2]
        differences.append(thick / thin - 1)
        assert_allclose(thin, length**3 / (3 * E * 0.05 * t**3 / 12), rtol=1e-12)
        assert_allclose(differences[-1], (1 + STEEL.poisson) / (2 * 5 / 6) * t**2, rtol=1e-9)
    rates = np.log2(np.divide(differences[:-1], differences[1:]))
    assert_allclose(rates, 2, atol=1e-8)


def test_skew_cantilever_bends_about_both_axes_and_twists():
    """All six end loads at once; the closed forms of the principal axes, rotated into space."""
    length, s = 0.15, STOCKY
    x = np.array([2.0, -1.0, 2.0]) / 3
    up = np.array([1.0, 1.0, 1.0])
    z = up - x * (up @ x)
    z /= np.linalg.norm(z)
    axes = np.stack([x, np.cross(z, x), z])  # rows
    (Fx, Fy, Fz), (Mx, My, Mz) = F, M = np.array([900.0, 40.0, -70.0]), np.array([5.0, -3.0, 2.0])
    EIy, EIz = E * s.second_moment_y, E * s.second_moment_z
    translation = [
        Fx * length / (E * s.area),
        Fy * length**3 / (3 * EIz) + Fy * length / (G * s.shear_area_y) + Mz * length**2 / (2 * EIz),
        Fz * length**3 / (3 * EIy) + Fz * length / (G * s.shear_area_z) - My * length**2 / (2 * EIy),
    ]
    turn = [
        Mx * length / (G * s.torsion_constant),
        My * length / EIy - Fz * length**2 / (2 * EIy),
        Mz * length / EIz + Fy * length**2 / (2 * EIz),
    ]
    frame = straight(s, [0, length], along=x, up=tuple(up))
    solution = solve(frame, Load("n1", force=tuple(F @ axes), moment=tuple(M @ axes)))
    tip = solution.at("n1")[0]
    assert_allclose(tip[:3], np.array(translation) @ axes, rtol=1e-11)
    assert_allclose(tip[3:], np.array(turn) @ axes, rtol=1e-11)
    assert_allclose(solution.end_forces[0, 0, 1], [*F, *M], rtol=1e-9)
    root = [-Fx, -Fy, -Fz, -Mx, -My + Fz * length, -Mz - Fy * length]
    assert_allclose(solution.end_forces[0, 0, 0], root, rtol=1e-9)


# ---- Kleinlogel, Rigid Frame Formulas: rectangular portal with fixed bases, lateral load at the knee ----


def test_kleinlogel_fixed_base_portal_with_lateral_load():
    """With k = I_b h/(I_c L), for inextensible Euler–Bernoulli members:

    sway P h³/(12 E I_c) (3k + 2)/(6k + 1), base moment (P h/2) (3k + 1)/(6k + 1),
    knee moment (P h/2) 3k/(6k + 1).

    Real members stretch; the difference falls as 1/A, and Richardson's extrapolation removes it.
    """
    P, h, span, I_c, I_b = 1000.0, 3.0, 5.0, 2e-5, 3e-5
    k = I_b * h / (I_c * span)
    expected = np.array(
        [
            P * h**3 / (12 * E * I_c) * (3 * k + 2) / (6 * k + 1),
            P * h / 2 * (3 * k + 1) / (6 * k + 1),
            P * h / 2 * 3 * k / (6 * k + 1),
        ]
    )

    def portal(area: float) -> np.ndarray:
        column, beam = (Section(area, i, i, 2 * i) for i in (I_c, I_b))
        frame = Frame(
            {"A": (0, 0, 0), "B": (0, 0, h), "C": (span, 0, h), "D": (span, 0, 0)},
            [
                Member("AB", "A", "B", column, STEEL),
                Member("BC", "B", "C", beam, STEEL),
                Member("DC", "D", "C", column, STEEL),
            ],
            clamps=("A", "D"),
        )
        solution = solve(frame, Load("B", force=(P, 0, 0)))
        return np.array([solution.at("B")[0, 0], -solution.reactions[0, 0, 4], solution.end_forces[0, 1, 0, 4]])

    coarse, middle, fine = (portal(area) for area in (0.1, 1.0, 10.0))
    assert_allclose((coarse - expected) / (middle - expected), 10, rtol=1e-3)
    assert_allclose((middle - expected) / (fine - expected), 10, rtol=1e-3)
    assert_allclose((10 * fine - middle) / 9, expected, rtol=1e-9)


# ---- Rigid bodies: statics and the kinematics u = u_ref + θ × r, with the cantilever's closed forms ----


@pytest.mark.parametrize("reference", ["tip", "arm", "elsewhere"])
def test_rigid_arm_on_a_cantilever(reference):
    """Arm a across the tip: u_z = P L³/(3EI_y) + P L/(G A_sz) + P a² L/(G J) under a load along z,

    u_x = P L/(E A) + P a² L/(E I_z) under one along x.
    """
    P, length, a, s = 20.0, 0.2, 0.07, STOCKY
    frame = Frame(
        {"root": (0, 0, 0), "tip": (length, 0, 0), "arm": (length, a, 0), "elsewhere": (-0.3, 0.2, 0.5)},
        [Member("beam", "root", "tip", s, STEEL)],
        [RigidBody("arm", reference, ("tip", "arm", "elsewhere"))],
        clamps=("root",),
    )
    cases = [[Load("arm", force=(0, 0, P))], [Load("arm", force=(P, 0, 0))]]
    across, along = factorise(frame).solve(load_array(frame, cases)).at("arm")
    EIy, EIz, GJ = E * s.second_moment_y, E * s.second_moment_z, G * s.torsion_constant
    deflection = P * length**3 / (3 * EIy) + P * length / (G * s.shear_area_z) + P * a**2 * length / GJ
    assert_allclose(across[2], deflection, rtol=1e-11)
    assert_allclose(across[3:5], [P * a * length / GJ, -P * length**2 / (2 * EIy)], rtol=1e-11)
    assert_allclose(along[0], P * length / (E * s.area) + P * a**2 * length / EIz, rtol=1e-11)
    assert_allclose(along[1], -P * a * length**2 / (2 * EIz), rtol=1e-11)
    assert_allclose(along[5], -P * a * length / EIz, rtol=1e-11)


def test_rigid_block_between_two_guided_beams():
    """Block of half length c between clamped beams of length L, by the slope-deflection equations:

    force/translation = 24EI/L³, moment/rotation = 2EI (4/L + 12c/L² + 12c²/L³).
    """
    length, c, P, M, EI = 0.3, 0.05, 11.0, 2.0, E * SLENDER.second_moment_y
    frame = Frame(
        {
            "a": (0, 0, 0),
            "b": (length, 0, 0),
            "middle": (length + c, 0, 0),
            "d": (length + 2 * c, 0, 0),
            "e": (2 * (length + c), 0, 0),
        },
        [Member("left", "a", "b", SLENDER, STEEL), Member("right", "d", "e", SLENDER, STEEL)],
        [RigidBody("block", "middle", ("b", "d"))],
        clamps=("a", "e"),
    )
    middle = solve(frame, Load("middle", force=(0, 0, P), moment=(0, M, 0))).at("middle")[0]
    assert_allclose(middle[2], P * length**3 / (24 * EI), rtol=1e-11)
    stiffness = 2 * EI * (4 / length + 12 * c / length**2 + 12 * c**2 / length**3)
    assert_allclose(middle[4], M / stiffness, rtol=1e-11)


# ---- Laws that any linear elastic frame obeys ----


def space_frame(turn: Rotation | None = None) -> Frame:
    """A random frame with a rigid body, two clamps and a loop, turned as a whole if asked."""
    rng = np.random.default_rng(20240607)
    turn = turn or Rotation.identity()
    nodes = {f"n{i}": tuple(turn.apply(x)) for i, x in enumerate(rng.uniform(-0.2, 0.2, (7, 3)))}
    joined = [(0, 1), (1, 2), (2, 3), (3, 0), (2, 4), (5, 6)]
    members = [
        Member(f"m{i}{j}", f"n{i}", f"n{j}", STOCKY, STEEL, tuple(turn.apply(rng.normal(size=3)))) for i, j in joined
    ]
    return Frame(nodes, members, [RigidBody("body", "n1", ("n5",))], clamps=("n0", "n6"))


def random_loads(frame: Frame, n_cases: int) -> np.ndarray:
    return np.random.default_rng(5).normal(size=(n_cases, len(frame.nodes), 6)) * [50, 50, 50, 4, 4, 4]


def test_rigid_motion_gives_no_force_in_any_orientation():
    """K u = 0 for u = t + θ × x, beside the forces that a strain of the same size would give."""
    frame = space_frame()
    a = frame_arrays(frame)
    K = factorise(frame).stiffness
    modes = np.zeros((6, len(frame.nodes), 6))
    for mode, motion in zip(modes, np.eye(6), strict=True):
        mode[:, :3] = motion[:3] + np.cross(motion[3:], a.coordinates)
        mode[:, 3:] = motion[3:]
    forces = modes.reshape(6, -1) @ K
    assert np.abs(forces).max() < 1e-13 * np.abs(K).max()
    assert np.linalg.matrix_rank(K, hermitian=True) == len(K) - 2 * 6  # n5 – n6 is a part of its own
    assert_allclose(K, K.T, atol=1e-14 * np.abs(K).max())


def test_maxwell_betti_reciprocity():
    """The work of loads 1 on displacements 2 is that of loads 2 on displacements 1."""
    frame = space_frame()
    loads = random_loads(frame, 6)
    work = np.einsum("ind,jnd->ij", loads, factorise(frame).solve(loads).displacements)
    assert np.abs(work - np.diag(np.diag(work))).max() > 1e-3 * work.max()
    assert_allclose(work, work.T, atol=1e-12 * work.max(), rtol=0)


def test_reactions_balance_the_loads():
    frame = space_frame()
    loads = random_loads(frame, 4)
    reactions = factorise(frame).solve(loads).reactions
    x = np.array(list(frame.nodes.values()))
    at = x[[frame.index(n) for n in frame.clamps]]
    for applied, reaction in zip(loads, reactions, strict=True):
        assert_allclose(reaction[:, :3].sum(0), -applied[:, :3].sum(0), atol=1e-9)
        moment = (applied[:, 3:] + np.cross(x, applied[:, :3])).sum(0)
        assert_allclose((reaction[:, 3:] + np.cross(at, reaction[:, :3])).sum(0), -moment, atol=1e-9)


def test_member_ends_are_in_equilibrium_with_each_other_and_with_the_node():
    frame = space_frame()
    loads = random_loads(frame, 1)
    forces = factorise(frame).solve(loads).end_forces[0]
    for member, (start, end) in zip(frame.members, forces, strict=True):
        length = math.dist(frame.nodes[member.start], frame.nodes[member.end])
        assert_allclose(start[:3], -end[:3], atol=1e-9)
        lever = np.cross([length, 0, 0], end[:3])
        assert_allclose(start[3:] + end[3:] + lever, 0, atol=1e-9)
    # Member m24 alone ends at n4: its end force is the load there, whose size no rotation changes.
    applied = loads[0, 4]
    assert_allclose(np.linalg.norm(forces[4, 1, :3]), np.linalg.norm(applied[:3]), rtol=1e-10)
    assert_allclose(np.linalg.norm(forces[4, 1, 3:]), np.linalg.norm(applied[3:]), rtol=1e-10)


def test_turning_the_whole_model_turns_the_answer():
    turn = Rotation.from_rotvec([0.4, -1.1, 2.0])
    frame, turned = space_frame(), space_frame(turn)
    loads = random_loads(frame, 3)
    turned_loads = turn.apply(loads.reshape(-1, 3)).reshape(loads.shape)
    one, other = factorise(frame).solve(loads), factorise(turned).solve(turned_loads)
    expected = turn.apply(one.displacements.reshape(-1, 3).copy()).reshape(loads.shape)
    assert_allclose(other.displacements, expected, atol=1e-12 * np.abs(expected).max(), rtol=0)
    assert_allclose(other.end_forces, one.end_forces, atol=1e-9)


@pytest.mark.parametrize("n", [2, 7, 20])
def test_one_element_is_as_exact_as_many(n):
    length = 0.2
    along, up = np.array([2.0, 3.0, 6.0]) / 7, (1.0, 0.0, 0.2)
    load = {"force": (3.0, -8.0, 5.0), "moment": (0.3, 0.1, -0.2)}
    one = solve(straight(STOCKY, [0, length], along=along, up=up), Load("n1", **load)).at("n1")
    stations = np.linspace(0, length, n + 1)
    many = solve(straight(STOCKY, stations, along=along, up=up), Load(f"n{n}", **load)).at(f"n{n}")
    assert_allclose(many, one, rtol=1e-10)


# ---- Centrelines ----


@pytest.mark.parametrize("section", [SLENDER, STOCKY], ids=["Euler-Bernoulli", "Timoshenko"])
def test_centreline_is_the_closed_form_cubic(section):
    """w(x) = P x² (3L − x)/(6EI) + P x/(G A_s) under an end force; M x²/(2EI) under an end moment."""
    P, Q, M, length = 10.0, 6.0, 0.7, 0.2
    x_axis, up = (
        np.array([2.0, -1.0, 2.0]) / 3,
        np.array([1.0, 0.0, -1.0]) / math.sqrt(2),
    )  # normal to each other
    y_axis = np.cross(up, x_axis)
    EIy, EIz = E * section.second_moment_y, E * section.second_moment_z
    size = P * length**3 / (3 * EIy)
    stations = [0.0, 0.3 * length, length]  # the second member starts on a slope
    frame = straight(section, stations, along=x_axis, up=tuple(up))
    solution = solve(frame, Load("n2", force=tuple(P * up + Q * y_axis), moment=tuple(M * y_axis)))
    for line, start, end in zip(centrelines(solution, n_points=9), stations[:-1], stations[1:], strict=True):
        x = np.linspace(start, end, 9)
        cubic = x**2 * (3 * length - x) / 6
        w = P * (cubic / EIy + x / (G * section.shear_area_z)) - M * x**2 / (2 * EIy)
        v = Q * (cubic / EIz + x / (G * section.shear_area_y))
        assert_allclose(line.points, x[:, None] * x_axis, atol=1e-15)
        assert_allclose(line.displacement @ up, w, atol=1e-12 * size, rtol=0)
        assert_allclose(line.displacement @ y_axis, v, atol=1e-12 * size, rtol=0)
        assert_allclose(line.displacement @ x_axis, 0, atol=1e-12 * size)


def test_centrelines_meet_the_nodes():
    frame = space_frame()
    solution = factorise(frame).solve(random_loads(frame, 2))
    size = np.abs(solution.displacements[1, :, :3]).max()
    for member, line in zip(frame.members, centrelines(solution, case=1), strict=True):
        assert line.member == member.name
        assert_allclose(line.points[[0, -1]], [frame.nodes[member.start], frame.nodes[member.end]], atol=1e-15)
        ends = [solution.at(member.start)[1, :3], solution.at(member.end)[1, :3]]
        assert_allclose(line.displacement[[0, -1]], ends, atol=1e-13 * size, rtol=0)

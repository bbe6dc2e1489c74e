"""Verification of supports, prescribed motions and stresses of the linear FEA, each with its source.

A single element is exact for loads at its ends, so the tolerances are those of float64 arithmetic.
"""

import math

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
    Motion,
    RigidBody,
    Section,
    Support,
    circle,
    factorise,
    load_array,
    rectangle,
)
from experiments.fea.loads import motion_array
from experiments.fea.stress import Fibres, bending_stress, normal_stress

STEEL = Material(young=207e9, poisson=0.29)
E, G = STEEL.young, STEEL.shear
SLENDER = rectangle(width=0.02, thickness=0.01, shear_coefficient=math.inf)
STOCKY = rectangle(width=0.03, thickness=0.02)
L, W = 0.8, 30.0
PIN = ("x", "y", "z", "rx")  # a ball joint that keeps a straight beam along x from spinning


def beam(supports=(), clamps=(), section: Section = SLENDER) -> Frame:
    """Nodes a, b, c at 0, L/2, L along x."""
    nodes = {"a": (0, 0, 0), "b": (L / 2, 0, 0), "c": (L, 0, 0)}
    members = [Member("ab", "a", "b", section, STEEL), Member("bc", "b", "c", section, STEEL)]
    return Frame(nodes, members, clamps=clamps, supports=supports)


def solve(frame: Frame, loads=(), motions=()):
    """The solution of one case."""
    return factorise(frame).solve(load_array(frame, [loads]), motion_array(frame, [motions]))


# ---- Young & Budynas, Roark's Formulas for Stress and Strain, 7th ed. (2002), Table 8.1 ----


def test_roark_7th_table_8_1_case_1e_both_ends_simply_supported():
    """y_max = −W l³/(48EI), θ_A = −W l²/(16EI), R = W/2; the peak stress M c/I, M = W l/4, is at the load."""
    frame = beam([Support("a", PIN), Support("c", ("y", "z"))])
    solution = solve(frame, [Load("b", force=(0, -W, 0))])
    EI = E * SLENDER.second_moment_z
    assert_allclose(solution.at("b")[0, 1], -W * L**3 / (48 * EI), rtol=1e-11)
    assert_allclose(solution.at("a")[0, 5], -W * L**2 / (16 * EI), rtol=1e-11)
    assert_allclose(solution.support_reactions[0, :, 1], W / 2, rtol=1e-11)
    stress = solution.stress()
    assert_allclose(stress.bending[0], W * L / 4 * 0.01 / SLENDER.second_moment_z, rtol=1e-11)
    assert_allclose(stress.place[0], [1.0, 0.0], atol=0)


def test_roark_7th_table_8_1_case_1c_propped_cantilever():
    """W at a = l/2 of a beam on a simple support A and clamped at B:

    R_A = 5W/16, M_B = −3W l/16, θ_A = −W l²/(32EI), y(l/2) = −7W l³/(768EI).
    """
    frame = beam([Support("a", ("y",))], clamps=["c"])
    solution = solve(frame, [Load("b", force=(0, -W, 0))])
    EI = E * SLENDER.second_moment_z
    assert_allclose(solution.support_reactions[0, 0, 1], 5 * W / 16, rtol=1e-11)
    assert_allclose(solution.reactions[0, 0, 5], -3 * W * L / 16, rtol=1e-11)
    assert_allclose(solution.at("a")[0, 5], -W * L**2 / (32 * EI), rtol=1e-11)
    assert_allclose(solution.at("b")[0, 1], -7 * W * L**3 / (768 * EI), rtol=1e-11)


def test_roark_7th_table_8_1_case_5d_fixed_ends_one_displaced():
    """A lateral displacement Δ of an end: R = 12EI Δ/l³ and M = 6EI Δ/l²; half of Δ in the middle."""
    delta, EI = 2e-3, E * SLENDER.second_moment_y
    frame = beam([Support("c", ("x", "y", "z", "rx", "ry", "rz"))], clamps=["a"])
    solution = solve(frame, motions=[Motion("c", translation=(0, 0, delta))])
    assert_allclose(
        solution.support_reactions[0, 0, [2, 4]], [12 * EI * delta / L**3, 6 * EI * delta / L**2], rtol=1e-11
    )
    assert_allclose(solution.reactions[0, 0, [2, 4]], [-12 * EI * delta / L**3, 6 * EI * delta / L**2], rtol=1e-11)
    assert_allclose(solution.at("b")[0, 2], delta / 2, rtol=1e-11)
    assert_allclose(solution.at("c")[0], [0, 0, delta, 0, 0, 0], atol=0)


def test_roark_7th_table_8_1_case_4d_fixed_ends_one_turned():
    """A rotation θ of an end: M = 4EI θ/l there, 2EI θ/l at the other, R = 6EI θ/l²."""
    theta, EI = 0.03, E * SLENDER.second_moment_z
    frame = beam([Support("c", ("x", "y", "z", "rx", "ry", "rz"))], clamps=["a"])
    solution = solve(frame, motions=[Motion("c", rotation=(0, 0, theta))])
    assert_allclose(solution.support_reactions[0, 0, [1, 5]], EI * theta * np.array([-6 / L**2, 4 / L]), rtol=1e-11)
    assert_allclose(solution.reactions[0, 0, [1, 5]], EI * theta * np.array([6 / L**2, 2 / L]), rtol=1e-11)


def test_przemieniecki_1968_section_5_6_displaced_end_with_shear():
    """With Φ = 12EI/(G A_s l²): force 12EI δ/((1 + Φ) l³) and, for a turned end, (4 + Φ)EI θ/((1 + Φ) l)."""
    frame = beam([Support("c", ("x", "y", "z", "rx", "ry", "rz"))], clamps=["a"], section=STOCKY)
    EI = E * STOCKY.second_moment_y
    phi = 12 * EI / (G * STOCKY.shear_area_z * L**2)
    held = solve(frame, motions=[Motion("c", (0, 0, 1e-3), (0, 0.02, 0))]).support_reactions[0, 0]
    force = 12 * EI * 1e-3 / L**3 + 6 * EI * 0.02 / L**2
    moment = 6 * EI * 1e-3 / L**2 + (4 + phi) * EI * 0.02 / L
    assert_allclose(held[[2, 4]], np.array([force, moment]) / (1 + phi), rtol=1e-11)


# ---- Statics ----


def tripod(turn: Rotation | None = None) -> Frame:
    """A rigid plate with a leaf on it, held in a statically determinate way: three, two and one motions."""
    nodes = {"a": (0, 0, 0), "b": (0.3, 0, 0), "c": (0, 0.4, 0), "tip": (0.2, 0.3, 0.25), "foot": (0.1, 0.1, 0)}
    if turn is not None:
        nodes = {name: tuple(turn.apply(x)) for name, x in nodes.items()}
    members = [
        Member("ab", "a", "b", STOCKY, STEEL),
        Member("bc", "b", "c", STOCKY, STEEL),
        Member("ca", "c", "foot", STOCKY, STEEL),
        Member("leaf", "foot", "tip", STOCKY, STEEL),
    ]
    supports = [Support("c", ("z",)), Support("a", ("x", "y", "z")), Support("b", ("y", "z"))]
    return Frame(nodes, members, supports=supports)


def test_statically_determinate_supports_take_what_statics_says():
    """A force F at r: the six reactions from the six equations of equilibrium alone."""
    F = np.array([3.0, -5.0, 7.0])
    reactions = solve(tripod(), [Load("tip", force=tuple(F))]).support_reactions[0]
    moment = np.cross([0.2, 0.3, 0.25], F)
    z_b, z_c, y_b = moment[1] / 0.3, -moment[0] / 0.4, -moment[2] / 0.3
    expected = [[0, 0, z_c, 0, 0, 0], [-F[0], -F[1] - y_b, -F[2] - z_b - z_c, 0, 0, 0], [0, y_b, z_b, 0, 0, 0]]
    assert_allclose(reactions, expected, atol=1e-12 * np.abs(moment).max() / 0.3)
    assert np.all(reactions[np.array(expected) == 0] == 0)


def test_determinate_supports_move_the_frame_without_a_force():
    """Supports that follow a rigid motion carry the frame along; no member feels it."""
    frame = tripod()
    x = np.array(list(frame.nodes.values()))
    shift, turn = np.array([1e-3, 2e-3, -1e-3]), np.array([0.01, -0.02, 0.03])
    rigid = np.concatenate([shift + np.cross(turn, x), np.tile(turn, (len(x), 1))], axis=1)
    motions = np.zeros((1, *rigid.shape))
    for support in frame.supports:
        node = frame.index(support.node)
        motions[0, node] = rigid[node] * support.held
    solution = factorise(frame).solve(np.zeros_like(motions), motions)
    assert_allclose(solution.displacements[0], rigid, atol=1e-13)
    stiff = E * STOCKY.area * np.abs(rigid).max()  # the force that an axial strain of this size would take
    assert_allclose(solution.end_forces, 0, atol=1e-13 * stiff)
    assert_allclose(solution.motions, motions, atol=0)


@pytest.mark.parametrize("reference", ["hub", "arm"])
def test_pinned_lever_is_a_rigid_body_whose_support_is_its_master(reference):
    """A load P in the middle of a lever of length 2a, pinned at one end and on a column of length h at the other.

    Turned by θ, the lever presses the column by 2aθ and turns its head: P a = (4a² EA/h + 4EI/h) θ.
    """
    P, h, arm = 40.0, 0.5, 0.3
    frame = Frame(
        {"pin": (0, 0, 0), "hub": (arm, 0, 0), "arm": (2 * arm, 0, 0), "foot": (2 * arm, 0, -h)},
        [Member("column", "foot", "arm", SLENDER, STEEL)],
        [RigidBody("lever", reference, ("pin", "hub", "arm"))],
        clamps=("foot",),
        supports=[Support("pin", ("x", "y", "z", "rx", "rz"))],
    )
    solution = solve(frame, [Load("hub", force=(0, 0, -P))])
    EI, EA = E * SLENDER.second_moment_z, E * SLENDER.area  # local z of an upright member is global y
    theta = P * arm / (EA / h * (2 * arm) ** 2 + 4 * EI / h)
    assert_allclose(solution.at("pin")[0], [0, 0, 0, 0, theta, 0], rtol=1e-10, atol=1e-18)
    assert_allclose(solution.at("arm")[0, 2], -2 * arm * theta, rtol=1e-10)
    assert_allclose(solution.support_reactions[0, 0, 2] + solution.reactions[0, 0, 2], P, rtol=1e-11)
    assert_allclose(solution.support_reactions[0, 0, 2], P - EA / h * 2 * arm * theta, rtol=1e-9)
    assert solution.support_reactions[0, 0, 4] == 0


# ---- Laws that any linear elastic frame obeys ----


def space_frame(turn: Rotation | None = None, clamps=("n0",), held=("x", "y", "z")) -> Frame:
    """A random frame with an arc, a rigid body and a loop, turned as a whole if asked; n4 and n6 are supported."""
    rng = np.random.default_rng(20240607)
    turn = turn or Rotation.identity()
    x = rng.uniform(-0.2, 0.2, (7, 3))
    nodes = {f"n{i}": tuple(turn.apply(place)) for i, place in enumerate(x)}
    joined = [(0, 1), (1, 2), (2, 3), (3, 0), (2, 4), (5, 6)]
    members = []
    for i, j in joined:
        up, bulge = rng.normal(size=3), rng.normal(size=3) * 0.05
        through = tuple(turn.apply((x[i] + x[j]) / 2 + bulge)) if (i, j) in [(0, 1), (2, 4)] else None
        members.append(Member(f"m{i}{j}", f"n{i}", f"n{j}", STOCKY, STEEL, tuple(turn.apply(up)), through))
    supports = [Support("n6", held), Support("n4", ("rx", "ry", "rz") if turn.magnitude() else ("z", "ry"))]
    return Frame(nodes, members, [RigidBody("body", "n1", ("n5",))], clamps=clamps, supports=supports)


def random_case(frame: Frame, n_cases: int) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(5)
    loads = rng.normal(size=(n_cases, len(frame.nodes), 6)) * [50, 50, 50, 4, 4, 4]
    motions = np.zeros_like(loads)
    for support in frame.supports:
        node = frame.index(support.node)
        motions[:, node] = rng.normal(size=(n_cases, 6)) * support.held * 1e-4
    return loads, motions


def test_betti_reciprocity_with_prescribed_motions():
    """The work of loads and reactions 1 on the displacements 2 is that of 2 on 1 (Betti 1872)."""
    frame = space_frame()
    loads, motions = random_case(frame, 6)
    solution = factorise(frame).solve(loads, motions)
    forces = loads.copy()
    for i, support in enumerate(frame.supports):
        forces[:, frame.index(support.node)] += solution.support_reactions[:, i]
    work = np.einsum("ind,jnd->ij", forces, solution.displacements)
    assert np.abs(work - np.diag(np.diag(work))).max() > 1e-3 * work.max()
    assert_allclose(work, work.T, atol=1e-12 * work.max(), rtol=0)


def test_reactions_of_clamps_and_supports_balance_the_loads():
    frame = space_frame()
    loads, motions = random_case(frame, 3)
    solution = factorise(frame).solve(loads, motions)
    x = np.array(list(frame.nodes.values()))
    forces = loads.copy()
    for name, reaction in (
        *zip([s.node for s in frame.supports], solution.support_reactions.transpose(1, 0, 2), strict=True),
        *zip(frame.clamps, solution.reactions.transpose(1, 0, 2), strict=True),
    ):
        forces[:, frame.index(name)] += reaction
    size = np.abs(forces).max()
    assert_allclose(forces[..., :3].sum(axis=1), 0, atol=1e-10 * size)
    assert_allclose((forces[..., 3:] + np.cross(x, forces[..., :3])).sum(axis=1), 0, atol=1e-10 * size)


def test_loads_and_motions_superpose_and_motions_are_met():
    frame = space_frame()
    solver, (loads, motions) = factorise(frame), random_case(frame, 3)
    both, load, motion = solver.solve(loads, motions), solver.solve(loads), solver.solve(0 * loads, motions)
    for name in ("displacements", "reactions", "support_reactions", "end_forces"):
        parts = getattr(load, name) + getattr(motion, name)
        assert_allclose(getattr(both, name), parts, atol=1e-12 * np.abs(parts).max(), rtol=0)
    for support in frame.supports:
        held = np.array(support.held)
        assert_allclose(both.at(support.node)[:, held], motions[:, frame.index(support.node), held], atol=0)
        assert np.abs(both.at(support.node)[:, ~held]).min() > 0
        assert_allclose(load.at(support.node)[:, held], 0, atol=0)


def test_a_support_of_all_six_motions_at_rest_is_a_clamp():
    everything = ("x", "y", "z", "rx", "ry", "rz")
    as_support, as_clamp = space_frame(held=everything), space_frame()
    as_clamp = Frame(dict(as_clamp.nodes), as_clamp.members, as_clamp.bodies, ("n0", "n6"), [as_clamp.supports[1]])
    loads, _ = random_case(as_clamp, 3)
    one, other = factorise(as_support).solve(loads), factorise(as_clamp).solve(loads)
    size = np.abs(one.displacements).max()
    assert_allclose(one.displacements, other.displacements, atol=1e-12 * size, rtol=0)
    size = np.abs(one.reactions).max()
    assert_allclose(one.support_reactions[:, 0], other.reactions[:, 1], atol=1e-11 * size, rtol=0)


def test_turning_the_whole_model_turns_the_answer_to_loads_and_motions():
    """Supports hold along global axes, so only those that hold all translations or all rotations can turn along."""
    turn = Rotation.from_rotvec([0.4, -1.1, 2.0])
    turned = space_frame(turn)
    frame = space_frame()
    frame = Frame(dict(frame.nodes), frame.members, frame.bodies, frame.clamps, turned.supports)
    loads, motions = random_case(frame, 3)

    def rotated(values: np.ndarray) -> np.ndarray:
        return turn.apply(values.reshape(-1, 3).copy()).reshape(values.shape)

    one, other = factorise(frame).solve(loads, motions), factorise(turned).solve(rotated(loads), rotated(motions))
    for name in ("displacements", "reactions", "support_reactions"):
        expected = rotated(getattr(one, name))
        assert_allclose(getattr(other, name), expected, atol=1e-11 * np.abs(expected).max(), rtol=0)
    assert_allclose(other.end_forces, one.end_forces, atol=1e-11 * np.abs(one.end_forces).max(), rtol=0)


def test_castiglianos_first_theorem_through_jax():
    """The gradient of the strain energy by a prescribed motion is the reaction of its support."""
    frame = space_frame()
    solver, (_, motions) = factorise(frame), random_case(frame, 2)

    def energy(motion):
        u = solver.displacements(jnp.zeros_like(motion), motion).ravel()
        return u @ solver.stiffness @ u / 2

    with jax.enable_x64(True):
        gradient = np.asarray(jax.jit(jax.vmap(jax.grad(energy)))(motions))
        moved = np.asarray(jax.jit(solver.displacements)(np.zeros((7, 6)), motions))
    solution = solver.solve(0 * motions, motions)
    assert_allclose(moved, solution.displacements, atol=1e-13 * np.abs(moved).max(), rtol=0)
    nodes = [frame.index(s.node) for s in frame.supports]
    size = np.abs(solution.support_reactions).max()
    assert_allclose(gradient[:, nodes], solution.support_reactions, atol=1e-10 * size, rtol=0)
    assert np.count_nonzero(np.delete(gradient, nodes, axis=1)) == 0


# ---- Stresses: Roark's Formulas, 7th ed., eq. 8.1-1, in both principal planes ----

FORCES = np.array([-200.0, 9.0, 9.0, 9.0, -3.0, 4.0])


def numbers(section: Section) -> Fibres:
    return Fibres(*(getattr(section, name) for name in Fibres._fields))


def test_stress_of_a_rectangle_is_that_of_its_corner():
    """6M/(b t²) of each plane adds, and |N|/(b t)."""
    b, t = 0.03, 0.02
    bending = 6 * 3.0 / (b * t**2) + 6 * 4.0 / (t * b**2)
    assert_allclose(bending_stress(np, FORCES, numbers(rectangle(b, t))), bending, rtol=1e-14)
    assert_allclose(normal_stress(np, FORCES, numbers(rectangle(b, t))), bending + 200 / (b * t), rtol=1e-14)


def test_stress_of_a_circle_is_that_of_the_resulting_moment():
    """32M/(π d³) with M = hypot(3, 4) = 5, and 4|N|/(π d²)."""
    d = 0.012
    bending = 32 * 5.0 / (math.pi * d**3)
    assert_allclose(bending_stress(np, FORCES, numbers(circle(d))), bending, rtol=1e-14)
    assert_allclose(normal_stress(np, FORCES, numbers(circle(d))), bending + 4 * 200 / (math.pi * d**2), rtol=1e-14)


def test_stress_of_unknown_fibres_is_unknown():
    unknown = Section(1e-4, 1e-9, 1e-9, 1e-9)
    assert math.isnan(bending_stress(np, FORCES, numbers(unknown)))
    frame = beam(clamps=["a"], section=unknown)
    stress = solve(frame, [Load("c", force=(0, 0, 1.0))]).stress()
    assert np.isnan(stress.bending).all()
    assert np.isnan(stress.place).all()


def test_stress_is_the_same_in_jax_over_any_batch_and_has_a_derivative_at_rest():
    sections = Fibres(*np.array([numbers(rectangle(0.03, 0.02)), numbers(circle(0.012))]).T[:, :, None])
    sections = sections._replace(is_round=sections.is_round.astype(bool))
    internal = np.random.default_rng(1).normal(size=(6, 5, 2, 3))
    with jax.enable_x64(True):
        traced = jax.jit(lambda x: normal_stress(jnp, x, sections))(internal)
        gradient = jax.grad(lambda x: bending_stress(jnp, x, numbers(rectangle(0.03, 0.02))))(jnp.zeros(6))
    assert_allclose(traced, normal_stress(np, internal, sections), rtol=1e-14)
    assert traced.shape == (5, 2, 3)
    assert np.isfinite(gradient).all()


def test_largest_stress_of_a_cantilever_is_at_its_clamp_whichever_way_the_member_runs():
    """σ = P L c/I at the root and P (L/2) c/I at the middle."""
    frame = beam(clamps=["c"])
    stress = solve(frame, [Load("a", force=(0, 0, 5.0))]).stress()
    assert_allclose(stress.bending[0], np.array([0.5, 1.0]) * 5.0 * L * 0.005 / SLENDER.second_moment_y, rtol=1e-11)
    assert_allclose(stress.place[0], [1.0, 1.0], atol=0)
    backwards = Frame(
        {"a": (0, 0, 0), "c": (L, 0, 0)}, [Member("ca", "c", "a", SLENDER, STEEL, up=(0, 0, 1))], clamps=["c"]
    )
    assert solve(backwards, [Load("a", force=(0, 0, 5.0))]).stress().place[0, 0] == 0.0

"""The Assur-group method as a whole: independent formulations, energy, balance, failures, refusals."""

import dataclasses
import math
import pickle

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import simpson
from scipy.optimize import root

from experiments.assur import (
    GROUND,
    DrivingLink,
    Dyad,
    Flexure,
    Leaf,
    Load,
    Mechanism,
    Settings,
    Triad,
    flexure_3rrr,
    flexure_four_bar,
    solve,
)
from experiments.assur.elastica import deflect, moments_along

LEAF = Leaf(width=0.005, thickness=0.0002, young=70e9)
POINTS = (0, 0), (0.005, 0.03), (0.055, 0.04), (0.06, 0)
LOADS = (Load("coupler", (0.4, -0.6), (0.03, 0.05)), Load("rocker", moment=0.002))


def four_bar(**changes) -> Mechanism:
    mechanism = flexure_four_bar(*POINTS, LEAF, 0.01)
    return Mechanism(tuple(dataclasses.replace(f, **changes) for f in mechanism.flexures), mechanism.modules)


def chain() -> Mechanism:
    """A four-bar, a dyad on its coupler and the ground, a driven link on that dyad, a triad on three links."""
    bars = four_bar()
    more = (
        Flexure("a", "coupler", "up", (0.03, 0.045), (0.03, 0.055), LEAF),
        Flexure("b", "up", "down", (0.04, 0.08), (0.05, 0.08), LEAF, joint="start"),
        Flexure("c", "down", GROUND, (0.1, 0.05), (0.1, 0.04), LEAF),
        Flexure("d", "up", "arm", (0.02, 0.09), (0.02, 0.1), LEAF, joint="start"),
        Flexure("e1", "arm", "leg1", (0.0, 0.12), (-0.01, 0.12), LEAF),
        Flexure("e2", "arm", "leg2", (0.03, 0.13), (0.03, 0.14), LEAF, joint="start"),
        Flexure("e3", GROUND, "leg3", (-0.1, 0.1), (-0.1, 0.11), LEAF),
        Flexure("f1", "leg1", "table", (-0.03, 0.13), (-0.03, 0.14), LEAF),
        Flexure("f2", "table", "leg2", (0.0, 0.16), (0.01, 0.16), LEAF),
        Flexure("f3", "leg3", "table", (-0.08, 0.16), (-0.07, 0.16), LEAF),
    )
    modules = (*bars.modules, Dyad("up", "down"), DrivingLink("arm"), Triad("table", ("leg1", "leg2", "leg3")))
    return Mechanism((*bars.flexures, *more), modules)


CHAIN_LOADS = (
    Load("table", (0.1, -0.2), (-0.03, 0.15), 0.001),
    Load("up", (0.0, 0.3), (0.03, 0.07)),
    Load("crank", (0.2, 0.1), (0.0, 0.02)),
)


# ---- Against a formulation of our own for this test: all unknowns at once, by shooting and a general solver ----


def four_bar_at_once(turn, loads, steps=40):
    """Poses, leaf forces and torque of :func:`four_bar`, in mm, N, N mm: 21 equations in 21 unknowns.

    Each leaf starts tangent to its first link under an unknown force and moment; integrated by RK4 it must end
    tangent to its second. Each link is in equilibrium.
    """
    flexures = four_bar().flexures
    stiffness = LEAF.bending_stiffness * 1e6
    start, end = (np.array([getattr(f, edge) for f in flexures]) * 1e3 for edge in ("start", "end"))
    along = np.arctan2(*(end - start).T[::-1])

    def carried(pose, point):
        c, s = np.cos(pose[2]), np.sin(pose[2])
        return pose[:2] + np.array([c * point[0] - s * point[1], s * point[0] + c * point[1]])

    def residual(unknown):
        crank, coupler, rocker = [*unknown[:2], turn], unknown[2:5], unknown[5:8]
        force, moment, torque = unknown[8:16].reshape(4, 2), unknown[16:20], unknown[20]
        poses = [np.zeros(3), np.array(crank), coupler, rocker, np.zeros(3)]
        first = np.array([carried(poses[k], start[k]) for k in range(4)])
        state = np.column_stack([first, along + [p[2] for p in poses[:4]]])

        def slope(state):
            # moment in the leaf at a point = root moment − (point − root) × force there, both on the leaf's root
            lever = state[:, :2] - first
            bend = moment - (lever[:, 0] * force[:, 1] - lever[:, 1] * force[:, 0])
            return np.column_stack([np.cos(state[:, 2]), np.sin(state[:, 2]), bend / stiffness])

        h = 10.0 / steps
        for _ in range(steps):
            k1 = slope(state)
            k2 = slope(state + h / 2 * k1)
            k3 = slope(state + h / 2 * k2)
            state = state + h / 6 * (k1 + 2 * k2 + 2 * k3 + slope(state + h * k3))
        wanted = [[*carried(poses[k + 1], end[k]), along[k] + poses[k + 1][2]] for k in range(4)]
        balance = np.zeros((5, 3))  # of the five bodies, moments about the origin
        for k in range(4):
            turning = first[k, 0] * force[k, 1] - first[k, 1] * force[k, 0]
            balance[k] += [*force[k], turning + moment[k]]
            balance[k + 1] -= [*force[k], turning + moment[k]]
        balance[1, 2] += torque
        for load in loads:
            body = ("ground", "crank", "coupler", "rocker").index(load.link)
            place, push = carried(poses[body], np.array(load.at) * 1e3), load.force
            balance[body] += [*push, place[0] * push[1] - place[1] * push[0] + load.moment * 1e3]
        return np.concatenate([(state - wanted).ravel(), balance[1:4].ravel()])

    found = root(residual, np.zeros(21), tol=1e-12)
    assert np.abs(found.fun).max() < 1e-9, found.message
    return found.x


@pytest.mark.parametrize("turn", [-0.2, 0.15, 0.3])
@pytest.mark.parametrize("loads", [(), LOADS])
def test_four_bar_against_all_equations_at_once(turn, loads):
    expected = four_bar_at_once(turn, loads)
    found = solve(four_bar(), [[turn]], loads)
    assert found.ok.all()
    assert_allclose(found.rotations[0, 2:4], expected[[4, 7]], atol=2e-8)
    assert_allclose(found.shifts[0, 1:].ravel() * 1e3, expected[[0, 1, 2, 3, 5, 6]], atol=2e-6)
    assert_allclose(found.torques[0] * 1e3, expected[20], atol=2e-6)
    assert_allclose(found.root_moments[0] * 1e3, expected[16:20], atol=2e-6)


# ---- Laws ----


def energy(solution: object) -> np.ndarray:
    """∫ M² / 2 E I over all leaves, J, from the leaves' own rotations and forces."""
    total = 0.0
    for k, flexure in enumerate(solution.mechanism.flexures):
        clamped, jointed = (solution.rotation(link) for link in flexure.links)
        edges = np.array(flexure.edges)
        along = complex(*(edges[1] - edges[0])) / flexure.length
        local = solution.forces[:, k] @ [1, 1j] * np.exp(-1j * clamped) / along
        length, bending = np.array(flexure.length), np.array(flexure.leaf.bending_stiffness)
        bent = deflect(jointed - clamped, local, length, bending)
        moments = moments_along(bent, local, length, bending)
        total = total + simpson(moments**2, dx=flexure.length / 32, axis=1) / (2 * bending)
    return total


def potential(mechanism, angles, loads):
    found = solve(mechanism, angles, loads)
    assert found.ok.all(), found.reasons
    work = sum(found.displacement(p.link, p.at) @ p.force + found.rotation(p.link) * p.moment for p in loads)
    return energy(found) - work


@pytest.mark.parametrize(
    ("mechanism", "angles", "loads"),
    [
        (four_bar(), [0.25], LOADS),
        (
            flexure_3rrr(),
            flexure_3rrr().rest + np.array([0.2, -0.1, 0.15]),
            (Load("platform", (-0.4, 0.0), (0.01, 0.006)),),
        ),
        (chain(), [0.15, 0.1], CHAIN_LOADS),
    ],
    ids=["four-bar", "3-RRR", "chain"],
)
def test_torques_are_the_gradient_of_the_potential(mechanism, angles, loads):
    """Castigliano: τ = ∂(elastic energy − work of dead loads) / ∂q. So τ holds the driving flexure's own moment."""
    h = 1e-3
    angles = np.array(angles)
    for k, torque in enumerate(solve(mechanism, [angles], loads).torques[0]):
        moved = angles + h * np.array([[2], [1], [-1], [-2]]) * np.eye(len(angles))[k]
        u = potential(mechanism, moved, loads)
        assert_allclose((-u[0] + 8 * u[1] - 8 * u[2] + u[3]) / (12 * h), torque, rtol=1e-6)


def test_ground_carries_loads_and_torques():
    mechanism = chain()
    found = solve(mechanism, [[0.15, 0.1], [-0.1, -0.2]], CHAIN_LOADS)
    push, spin = np.zeros((2, 2)), found.torque("crank").copy()  # the arm's drive reacts on its own parent
    for load in CHAIN_LOADS:
        push += load.force
        spin += np.linalg.det(np.stack([found.place(load.link, load.at), np.tile(load.force, (2, 1))], 1)) + load.moment
    for k, flexure in enumerate(mechanism.flexures):
        if GROUND in flexure.links:
            sign = -1 if flexure.links[0] == GROUND else 1  # what the ground does to the leaf
            joint = found.place(flexure.links[1], flexure.edges[1])
            push += sign * found.forces[:, k]
            spin += sign * (np.linalg.det(np.stack([joint, found.forces[:, k]], 1)) + found.moments[:, k])
    assert_allclose(push, 0, atol=1e-9)
    assert_allclose(spin, 0, atol=1e-10)


@pytest.mark.parametrize("angles", [[0.3], [-0.2]])
def test_the_edge_of_the_equivalent_joint_does_not_matter(angles):
    """The thesis leaves the edge free; the fixed point is the same."""
    ends, starts = solve(four_bar(), [angles], LOADS), solve(four_bar(joint="start"), [angles], LOADS)
    assert_allclose(starts.rotations, ends.rotations, atol=1e-8)
    assert_allclose(starts.torques, ends.torques, rtol=1e-7)
    assert_allclose(starts.moments, -ends.root_moments, atol=1e-10)
    assert_allclose(starts.stress, ends.stress, rtol=1e-6)


def test_leaves_fit_the_links_and_their_centrelines():
    mechanism = chain()
    found = solve(mechanism, [[0.15, 0.1]], CHAIN_LOADS)
    for flexure in mechanism.flexures:
        line = found.centreline(flexure.name)
        for link, edge, end in zip(flexure.links, flexure.edges, (0, -1), strict=True):
            assert_allclose(line[:, end], found.place(link, edge), atol=1e-10)


def test_plain_and_accelerated_iteration_agree():
    angles = [[0.3], [-0.3], [0.1]]
    plain = solve(four_bar(), angles, LOADS, Settings(memory=0, retries=()))
    relaxed = solve(four_bar(), angles, LOADS, Settings(memory=0, relaxation=0.6, retries=()))
    quick = solve(four_bar(), angles, LOADS)
    for other in (plain, relaxed):
        assert other.ok.all()
        assert_allclose(other.torques, quick.torques, atol=1e-8)
    assert quick.iterations.sum() < plain.iterations.sum() < relaxed.iterations.sum()


def test_extensible_leaves_give_way():
    """A rigid arm on one leaf, pulled along it: the leaf grows by F L / E A."""
    arm = Mechanism((Flexure("f", GROUND, "arm", (0, 0), (0.01, 0), LEAF),), (DrivingLink("arm"),))
    pull = [Load("arm", (5.0, 0.0), (0.05, 0.0))]
    stiff, soft = (solve(arm, [[0.0]], pull, Settings(extensible=e)).displacement("arm") for e in (False, True))
    assert_allclose(stiff, 0, atol=1e-15)
    assert_allclose(soft, [[5.0 * 0.01 / LEAF.axial_stiffness, 0]], rtol=1e-9, atol=1e-15)


def test_driven_arm_bends_its_leaf_to_an_arc():
    """Without load the leaf is a circular arc: τ = E I Θ / L and σ = E t Θ / 2 L."""
    arm = Mechanism((Flexure("f", GROUND, "arm", (0, 0), (0.01, 0), LEAF),), (DrivingLink("arm", rest=1.0),))
    found = solve(arm, [[1.4]])
    assert_allclose(found.torque("arm"), LEAF.bending_stiffness * 0.4 / 0.01, rtol=1e-12)
    assert_allclose(found.max_stress, 70e9 * 0.0002 * 0.4 / (2 * 0.01), rtol=1e-12)
    assert_allclose(found.place("arm", (0.01, 0)), [[0.01 * math.sin(0.4) / 0.4, 0.01 * (1 - math.cos(0.4)) / 0.4]])


def test_a_mirrored_mechanism_moves_mirrored():
    """Its dyad is in the other assembly mode."""
    flexures = [
        dataclasses.replace(f, start=(f.start[0], -f.start[1]), end=(f.end[0], -f.end[1])) for f in four_bar().flexures
    ]
    found = solve(four_bar(), [[0.3]])
    mirrored = solve(Mechanism(tuple(flexures), four_bar().modules), [[-0.3]])
    assert_allclose(mirrored.rotations, -found.rotations, rtol=1e-7, atol=1e-12)
    assert_allclose(mirrored.torques, -found.torques, rtol=1e-7)


def test_more_points_than_go_at_a_time():
    arm = Mechanism((Flexure("f", GROUND, "arm", (0, 0), (0.01, 0), LEAF),), (DrivingLink("arm"),))
    angles = np.linspace(-0.5, 0.5, 2100)[:, None]
    found = solve(arm, angles)
    assert_allclose(found.torques, LEAF.bending_stiffness * angles / 0.01, rtol=1e-10, atol=1e-15)
    assert len(found.reasons) == 2100


def test_loads_may_differ_from_point_to_point():
    forces, moments = np.array([[0.1, 0.0], [0.4, -0.6], [0.0, 0.3]]), [0.0, 0.002, -0.001]
    both = solve(four_bar(), [[0.1]] * 3, [Load("coupler", forces, (0.03, 0.05)), Load("rocker", moment=moments)])
    one = solve(four_bar(), [[0.1]], LOADS)
    assert_allclose(both.torques[1], one.torques[0], rtol=1e-9)
    assert len(set(both.torques.ravel().round(9))) == 3


# ---- Failures are told ----


def test_a_failed_point_is_told_and_spoils_no_other():
    mechanism = flexure_four_bar((0, 0), (0, 0.03), (0.05, 0.04), (0.09, 0), LEAF, 0.01)
    found = solve(mechanism, [[0.2], [2.5], [-0.2]])
    assert found.ok.tolist() == [True, False, True]
    assert found.reasons[0] == found.reasons[2] == ""
    assert "Dyad coupler, rocker cannot be assembled" in found.reasons[1]
    for values in (found.torques, found.rotations, found.shifts, found.forces, found.moments, found.stress, found.tips):
        assert np.isnan(values[1]).all()
        assert np.isfinite(values[[0, 2]]).all()
    alone = solve(mechanism, [[0.2]])
    assert_allclose(found.torques[0], alone.torques[0], rtol=1e-12)


@pytest.mark.parametrize(
    ("settings", "turn", "force", "reason"),
    [
        (Settings(max_iterations=2, retries=()), 0.3, 0.0, "not settled after 2 passes"),
        (Settings(nodes=3, retries=()), 0.3, 0.0, "raise nodes"),
        (Settings(retries=()), 0.1, 1e300, "left the finite numbers"),
    ],
)
def test_reasons(settings, turn, force, reason):
    found = solve(four_bar(), [[turn]], [Load("coupler", (force, 0.0))], settings)
    assert not found.ok.any()
    assert reason in found.reasons[0]


def test_a_triad_that_cannot_close_is_told():
    mechanism = flexure_3rrr()
    found = solve(mechanism, mechanism.rest + np.array([[2.0, -2.0, 2.0]]), settings=Settings(retries=()))
    assert not found.ok.any()
    assert "Triad platform" in found.reasons[0]


def test_a_settled_point_that_does_not_close_is_told():
    """However loose the tolerances, joints that stay apart are no answer."""
    mechanism, loose = flexure_3rrr(), Settings(tolerance=1e3, torque_tolerance=1e3, retries=())
    found = solve(mechanism, mechanism.rest + np.array([[0.6, -0.6, -1.5], [0.1, 0.1, 0.1]]), settings=loose)
    assert found.ok.tolist() == [False, True]
    assert "cannot be assembled there: its joints stay" in found.reasons[0]


def test_torques_and_geometry_must_both_settle():
    passes = [
        solve(four_bar(), [[0.3]], settings=Settings(tolerance=a, torque_tolerance=b)).iterations[0]
        for a, b in ((1e-3, 1e-3), (1e-3, 1e-10), (1e-10, 1e-3))
    ]
    assert passes[0] < min(passes[1:])


def test_smaller_steps_rescue_a_point_and_are_counted():
    mechanism = flexure_3rrr()
    turns = np.random.default_rng(1).uniform(-0.7, 0.7, (60, 3))
    once = solve(mechanism, mechanism.rest + turns, settings=Settings(retries=()))
    again = solve(mechanism, mechanism.rest + turns)
    assert not once.ok.all()
    assert again.ok.all()
    assert_allclose(again.torques[once.ok], once.torques[once.ok])
    assert (again.iterations > once.iterations).tolist() == (~once.ok).tolist()


def test_no_points_no_answer():
    found = solve(flexure_3rrr(), np.zeros((0, 3)))
    assert found.torques.shape == (0, 3)
    assert found.reasons == ()


# ---- Refusals ----


@pytest.mark.parametrize(
    ("make", "sentence"),
    [
        (lambda: Leaf(0.005, 0.0, 70e9), "thickness of a leaf must be positive and finite"),
        (lambda: Leaf(0.005, 0.0001, math.nan), "young of a leaf must be positive"),
        (lambda: Flexure("f", "a", "a", (0, 0), (1, 0), LEAF), "joins link 'a' to itself"),
        (lambda: Flexure("f", "a", "b", (1, 0), (1, 0), LEAF), "give it a length"),
        (lambda: Flexure("f", "a", "b", (0, 0), (1, math.inf), LEAF), "end of flexure 'f' must be finite"),
        (lambda: Flexure("f", "a", "b", (0, 0), (1, 0, 0), LEAF), "end of flexure 'f' must be two numbers"),
        (lambda: Flexure("f", "a", "b", (0, 0), (1, 0), LEAF, joint="middle"), "must be 'end' or 'start'"),
        (lambda: Load("a", force=(1, 2, 3)), r"force on link 'a' must have shape \(2,\) or \(n_points, 2\)"),
        (lambda: Load("a", moment="x"), "moment on link 'a' must be numbers"),
        (lambda: Load("a", force=(math.nan, 0)), "force on link 'a' must be finite"),
        (lambda: Triad("p", ("a", "b")), "legs of triad 'p' must be three link names"),
        (lambda: Mechanism((), ()), "needs at least one module"),
        (lambda: Mechanism((), (DrivingLink("a"),)), "must hang on the ground or an earlier link by one flexure"),
        (lambda: Mechanism((), (DrivingLink("a"), DrivingLink("a"))), "link 'a' belongs to two modules"),
        (lambda: Mechanism(four_bar().flexures, (DrivingLink("crank"), Dyad("cuopler", "rocker"))), "mean 'cuopler'"),
        (lambda: Mechanism(four_bar().flexures, four_bar().modules[::-1]), "order of the modules"),
        (lambda: Mechanism(four_bar().flexures * 2, four_bar().modules), "two flexures are called 'A'"),
        (lambda: with_flexure("crank", "rocker"), "link 'rocker' of the Dyad must hang"),
        (lambda: with_flexure("coupler", "rocker"), "needs one flexure from it to 'rocker'"),
        (lambda: with_table_on_ground(), "flexure 'X' between 'ground' and 'platform' is one too many"),
        (lambda: flexure_four_bar((0, 0), (0, 0.03), (0.03, 0.03), (0.06, 0.03), LEAF, 0.01), "coupler', 'rocker'"),
        (lambda: flexure_four_bar((0, 0), (0, 0.03), (0, 0.03), (0.06, 0.03), LEAF, 0.01), "further apart"),
        (lambda: flexure_3rrr(crank=0.2), "cannot span"),
        (lambda: flexure_3rrr(base=0.0), "base must be a positive length"),
        (lambda: Settings(nodes=1), "nodes must be a whole number of at least 2"),
        (lambda: Settings(memory=True), "memory must be a whole number"),
        (lambda: Settings(relaxation=0.0), "relaxation must lie above 0"),
        (lambda: Settings(tolerance=0.0), "tolerance must be positive"),
        (lambda: Settings(retries=(1,)), "retries must be whole numbers above 1"),
        (lambda: solve(four_bar(), [0.1]), r"one column each for crank, got shape \(1,\)"),
        (lambda: solve(four_bar(), [[0.1], [math.nan]]), "angles must be finite, row 1 is not"),
        (lambda: solve(four_bar(), "x"), "angles must be numbers"),
        (lambda: solve(four_bar(), [[0.1]], [Load("ground")]), "acts on 'ground', which is no moving link"),
        (lambda: solve(four_bar(), [[0.1]], [Load("crnk")]), "did you mean 'crank'"),
        (lambda: solve(four_bar(), [[0.1]], [Load("crank", np.zeros((2, 2)))]), "holds 2 points, the angles 1"),
        (lambda: solve(four_bar(), [[0.1]]).rotation("cuopler"), "did you mean 'coupler'"),
        (lambda: solve(four_bar(), [[0.1]]).torque("rocker"), "unknown driving link 'rocker'"),
    ],
)
def test_refusals(make, sentence):
    with pytest.raises(ValueError, match=sentence):
        make()


def with_flexure(first, second):
    return Mechanism((*four_bar().flexures, Flexure("X", first, second, (0, 0), (0, 1), LEAF)), four_bar().modules)


def with_table_on_ground():
    mechanism = flexure_3rrr()
    extra = Flexure("X", GROUND, "platform", (0, 0), (0, 0.01), LEAF)
    return Mechanism((*mechanism.flexures, extra), mechanism.modules)


def test_a_mechanism_survives_pickling():
    assert pickle.loads(pickle.dumps(flexure_3rrr())) == flexure_3rrr()

"""The nonlinear solver's contract: what it refuses, in which words, and how its answers are read."""

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from experiments.fea import (
    Frame,
    Load,
    Material,
    Member,
    Motion,
    RigidBody,
    Support,
    condense,
    load_array,
    motion_array,
    rectangle,
)

STEEL = Material(young=210e9, poisson=0.3)
LEAF = rectangle(width=0.0005, thickness=0.01)
NODES = {"root": (0, 0, 0), "tip": (0.1, 0, 0), "arm": (0.1, 0.02, 0)}


def leaf(supports=(), clamps=("root",), up=None, tip=(0.1, 0.0, 0.0)) -> Frame:
    """A leaf spring in the xy-plane with an arm on its tip."""
    members = [Member("leaf", "root", "tip", LEAF, STEEL, up)]
    return Frame({**NODES, "tip": tip}, members, [RigidBody("lever", "tip", ("arm",))], clamps, supports)


@pytest.fixture(scope="module")
def solver():
    return condense(leaf(), planar=True)


@pytest.fixture(scope="module")
def found(solver):
    """One case that bends by a radian, one that is pulled, and one without load."""
    cases = [[Load("tip", moment=(0, 0, 0.2))], [Load("arm", force=(5.0, 1.0, 0))], []]
    return solver.solve(load_array(solver.frame, cases))


# ---- What is compiled ----


def test_frames_that_are_joined_alike_share_their_programs(solver):
    """Whatever their sizes; not with other steps, in space, or held otherwise, which are other programs."""
    longer = condense(leaf(tip=(0.2, 0.0, 0.0)), planar=True)
    assert longer.kernel.topology is solver.kernel.topology
    pinned = leaf(clamps=(), supports=[Support("root", ("x", "y", "rz"))])
    guided = leaf(supports=[Support("tip", ("x", "rz"))])
    others = [condense(frame, planar=True) for frame in (pinned, guided, replace(guided, supports=()))]
    others += [condense(leaf(), planar=True, n_steps=10), condense(leaf())]
    same = [other.kernel.topology is solver.kernel.topology for other in others]
    assert same == [False, False, True, False, False]


# ---- Refusals when a frame is condensed ----


@pytest.mark.parametrize("n_steps", [0, 1, 2, 7, -4])
def test_steps_that_are_odd_or_too_few(n_steps):
    with pytest.raises(ValueError, match=f"n_steps must be an even number from 4 on, got {n_steps}"):
        condense(leaf(), n_steps=n_steps)


@pytest.mark.parametrize("planar", [True, False])
def test_a_mechanism(planar):
    with pytest.raises(ValueError, match="nothing is clamped"):
        condense(leaf(clamps=()), planar=planar)
    with pytest.raises(ValueError, match="free to rotate about z"):
        condense(leaf(clamps=(), supports=[Support("root", ("x", "y", "z", "rx", "ry"))]), planar=planar)


def test_what_holds_a_planar_frame_in_its_plane_need_not_be_named():
    pinned = leaf(clamps=(), supports=[Support("root", ("x", "y", "rz"))])
    assert condense(pinned, planar=True).frame is pinned
    with pytest.raises(ValueError, match="is free to"):
        condense(pinned)


def test_a_planar_frame_out_of_plane():
    with pytest.raises(ValueError, match=r"the same z for all nodes and arcs; node 'tip' has z = 0.001"):
        condense(leaf(tip=(0.1, 0.0, 0.001)), planar=True)
    with pytest.raises(ValueError, match=r"local z along global z; give member 'leaf' up = \(0, 0, 1\)"):
        condense(leaf(up=(0, 1, 0)), planar=True)


@pytest.mark.parametrize("held", [("rx",), ("ry", "rz")])
def test_one_or_two_rotations_held_in_space(held):
    with pytest.raises(ValueError, match="in space hold all three or none, or condense the frame as planar"):
        condense(leaf(supports=[Support("tip", ("x", *held))]))


# ---- Refusals when it is solved ----


@pytest.mark.parametrize("shape", [(3, 6), (2, 2, 6), (2, 3, 3), (18,)])
def test_arrays_of_another_shape(solver, shape):
    with pytest.raises(ValueError, match=r"loads must have shape \(n_cases, 3, 6\)"):
        solver.solve(np.zeros(shape))
    with pytest.raises(ValueError, match=r"motions must have shape \(n_cases, 3, 6\)"):
        solver.solve(motions=np.zeros(shape))
    with pytest.raises(ValueError, match=r"must have shape \(n_cases, 3, 6\)"):
        solver.solve(followers=np.zeros(shape))


def test_as_many_cases_of_each(solver):
    two, three = np.zeros((2, 3, 6)), np.zeros((3, 3, 6))
    with pytest.raises(ValueError, match="2 load cases and 3 motion cases"):
        solver.solve(two, three)
    with pytest.raises(ValueError, match="2 cases of loads and 3 of followers"):
        solver.solve(two, followers=three)


@pytest.mark.parametrize("bad", [math.nan, math.inf])
def test_numbers_that_are_not_finite(solver, bad):
    loads = np.zeros((2, 3, 6))
    loads[1, 1, 0] = bad
    with pytest.raises(ValueError, match="load case 1 on node 'tip' is not finite"):
        solver.solve(loads)
    with pytest.raises(ValueError, match="motion case 1 of node 'tip' is not finite"):
        solver.solve(motions=loads)


def test_motions_where_none_is_held(solver):
    with pytest.raises(ValueError, match="moves node 'tip' in 'y', which no support holds"):
        solver.solve(motions=motion_array(solver.frame, [[Motion("tip", translation=(0, 0.01, 0))]]))
    with pytest.raises(ValueError, match="moves node 'root' in 'x', which a clamp keeps at rest"):
        solver.solve(motions=motion_array(solver.frame, [[Motion("root", translation=(0.01, 0, 0))]]))


@pytest.mark.parametrize("load", [Load("tip", force=(0, 0, 1)), Load("arm", moment=(0, 1, 0))])
def test_loads_out_of_the_plane(solver, load):
    loads = load_array(solver.frame, [[], [load]])
    with pytest.raises(ValueError, match="load case 1 acts out of the plane at node"):
        solver.solve(loads)
    with pytest.raises(ValueError, match="follower case 1 acts out of the plane at node"):
        solver.solve(followers=loads)


def test_a_node_or_case_that_does_not_exist(found):
    with pytest.raises(ValueError, match="unknown node 'tipp'; did you mean 'tip'"):
        found.at("tipp")
    with pytest.raises(ValueError, match="case 3 does not exist: there are 3"):
        found.centrelines(3)


def test_nothing_to_solve(solver):
    with pytest.raises(ValueError, match="nothing to solve: give loads, motions or followers of at least one case"):
        solver.solve()
    with pytest.raises(ValueError, match="nothing to solve"):
        solver.solve(np.zeros((0, 3, 6)))


# ---- Reading the answers ----


def test_a_case_without_load_is_at_rest(found):
    assert found.ok.all()
    assert_array_equal(found.displacements[2], 0)
    assert_array_equal(found.energy[2], 0)


def test_a_body_carries_its_nodes(found):
    """u(arm) = u(tip) + (R − 1) d, and both turn alike."""
    angle = found.at("tip")[:, 5]
    d = 0.02 * np.column_stack([-np.sin(angle), np.cos(angle) - 1])
    assert_allclose(found.at("arm")[:, :2] - found.at("tip")[:, :2], d, atol=1e-15)
    assert_allclose(found.rotation("arm").as_rotvec(), found.rotation("tip").as_rotvec(), atol=1e-15)


def test_centrelines_meet_the_nodes_and_have_the_length_of_the_member(found):
    (line,) = found.centrelines(0)
    assert_allclose(line.points[[0, -1]], [NODES["root"], NODES["tip"]], atol=1e-15)
    assert_allclose(line.displacement[-1], found.at("tip")[0, :3], atol=1e-13)
    at = line.points + line.displacement
    curvature = found.at("tip")[0, 5] / 0.1
    chords = np.linalg.norm(np.diff(at, axis=0), axis=1)
    assert_allclose(chords, 2 / curvature * math.sin(curvature * 0.1 / len(chords) / 2), rtol=1e-9)


def test_largest_stress(found):
    """M c/I of a constant moment, and where a force bends most: at the root."""
    stress, member, _ = found.largest_stress()
    assert_allclose(stress[0], 0.2 * 0.00025 / LEAF.second_moment_z, rtol=1e-9)
    assert_array_equal(member, 0)
    moments = np.abs(found.end_forces[1, 0, :, 5])
    assert_allclose(stress[1], moments.max() * 0.00025 / LEAF.second_moment_z, rtol=1e-9)


def test_end_forces_are_what_the_clamp_exerts(found):
    """In the axes of the section at the clamp, which are the global ones."""
    assert_allclose(found.end_forces[:, 0, 0], found.reactions[:, 0], atol=1e-12)


def test_float64_outside_the_scope_is_not_touched(found):
    import jax.numpy as jnp

    assert found.motion.dtype == np.float64
    assert jnp.zeros(1).dtype == jnp.float32


def test_small_loads_in_the_plane_give_the_linear_answer(solver):
    """F L³/(3EI) + F L/(κGA) and F L²/(2EI): steps of constant force and linear moment are exact."""
    tip = solver.solve(load_array(solver.frame, [[Load("tip", force=(0, 1e-6, 0))]])).at("tip")[0]
    EI = STEEL.young * LEAF.second_moment_z
    assert_allclose(tip[1], 1e-6 * (1e-3 / (3 * EI) + 0.1 / (STEEL.shear * LEAF.shear_area_y)), rtol=1e-9)
    assert_allclose(tip[5], 1e-6 * 1e-2 / (2 * EI), rtol=1e-9)

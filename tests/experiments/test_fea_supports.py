"""Behaviour of supports, prescribed motions and arcs: refusals, mechanisms, tracing."""

import copy
import math
import pickle

import jax
import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from experiments.fea import Frame, Load, Material, Member, Motion, RigidBody, Support, factorise, load_array, rectangle
from experiments.fea.arrays import frame_arrays
from experiments.fea.loads import motion_array

STEEL = Material(210e9, 0.3)
LEAF = rectangle(0.01, 0.001)
NODES = {"a": (0, 0, 0), "b": (1, 0, 0), "c": (1, 1, 0)}
XYZ = ("x", "y", "z")
ALL = (*XYZ, "rx", "ry", "rz")


def member(name: str, start: str, end: str, **kwargs) -> Member:
    return Member(name, start, end, LEAF, STEEL, **kwargs)


MEMBERS = (member("ab", "a", "b"), member("bc", "b", "c"))


def frame(*supports: tuple[str, tuple[str, ...]], **changes) -> Frame:
    parts = {"nodes": NODES, "members": MEMBERS, "supports": [Support(*s) for s in supports]}
    return Frame(**(parts | changes))


# ---- Refusals of the description ----


def test_support_refuses_motions():
    with pytest.raises(ValueError, match="motions of the support at 'a' must be a sequence, got 'x'"):
        Support("a", "x")
    with pytest.raises(ValueError, match="support at node 'a' holds an unknown motion 'ux': name some of x, y, z, rx"):
        Support("a", ("x", "ux"))
    for motions in ((), ("x", "y", "x")):
        with pytest.raises(ValueError, match="support at node 'a' must name motions, each once"):
            Support("a", motions)


def test_motion_refuses_what_is_no_vector():
    with pytest.raises(ValueError, match="translation of 'a' must be three numbers"):
        Motion("a", translation=(1, 2))
    with pytest.raises(ValueError, match="rotation of 'a' must be finite"):
        Motion("a", rotation=(0, 0, math.nan))


def test_frame_refuses_supports_that_do_not_fit():
    with pytest.raises(ValueError, match="a support names an unknown node 'd'"):
        frame(("d", XYZ))
    with pytest.raises(ValueError, match="node 'a' is held twice: give it one clamp or support"):
        frame(("a", XYZ), ("a", ("rx",)))
    with pytest.raises(ValueError, match="node 'a' is held twice: give it one clamp or support"):
        frame(("a", XYZ), clamps=("a",))
    with pytest.raises(ValueError, match=r"rigid body 'r' is clamped at nodes 'a' and 'p': .* keep one"):
        frame(("a", XYZ), ("p", XYZ), nodes=NODES | {"p": (0, 1, 0)}, bodies=[RigidBody("r", "a", ("p",))])


@pytest.mark.parametrize("through", [(0.5, 0, 0), (3, 0, 0), (0, 0, 0), (0.5, 1e-9, 0)])
def test_member_refuses_an_arc_through_the_line_of_its_ends(through):
    with pytest.raises(
        ValueError, match=r"member 'ab': through = .* lies on the line of its ends; give a point off it"
    ):
        frame(members=(member("ab", "a", "b", through=through), MEMBERS[1]), clamps=("a",))


def test_member_refuses_through_that_is_no_vector():
    with pytest.raises(ValueError, match="through of member 'ab' must be three numbers"):
        member("ab", "a", "b", through=(0.5, 0.5))


def test_arc_refuses_up_along_its_start():
    """The quarter circle from a to b about (0.5, −0.5) starts along (1, 1)."""
    through = (0.5, math.sqrt(0.5) - 0.5, 0)
    with pytest.raises(ValueError, match=r"member 'ab': up = .* is parallel to the member or zero"):
        frame(members=(member("ab", "a", "b", through=through, up=(1, 1, 0)), MEMBERS[1]), clamps=("a",))


def test_supports_copy_and_pickle():
    f = frame(("a", ALL))
    for other in (copy.deepcopy(f), pickle.loads(pickle.dumps(f))):
        assert other.supports == f.supports == (Support("a", ALL),)


# ---- Refusals of motions ----


def test_motion_array_refuses():
    f = frame(("a", ALL))
    with pytest.raises(ValueError, match="unknown node 'd'"):
        motion_array(f, [[Motion("d")]])
    with pytest.raises(ValueError, match="motion case 1 moves node 'a' twice: give it one motion"):
        motion_array(f, [[], [Motion("a", (1, 0, 0)), Motion("b"), Motion("a", rotation=(0, 1, 0))]])
    motions = motion_array(f, [[], [Motion("a", (1, 2, 3), (4, 5, 6))]])
    assert motions.shape == (2, 3, 6)
    assert_allclose(motions[1, 0], [1, 2, 3, 4, 5, 6])
    assert np.count_nonzero(motions) == 6


def test_solve_refuses_motions_that_nothing_holds():
    f = frame(("a", ("x", "ry")), clamps=("c",))
    solver, loads = factorise(f), np.zeros((1, 3, 6))
    with pytest.raises(
        ValueError, match=r"motion case 0 moves node 'b' in 'z', which no support holds: support it that"
    ):
        solver.solve(loads, motion_array(f, [[Motion("b", (0, 0, 1e-3))]]))
    with pytest.raises(
        ValueError, match=r"moves node 'a' in 'rx', which no support holds: .* or leave this motion zero"
    ):
        solver.solve(loads, motion_array(f, [[Motion("a", (1e-3, 0, 0), (1e-3, 0, 0))]]))
    with pytest.raises(ValueError, match=r"moves node 'c' in 'x', which a clamp keeps at rest: make it a support that"):
        solver.solve(loads, motion_array(f, [[Motion("c", (1e-3, 0, 0))]]))


def test_solve_refuses_motions_of_another_shape():
    f = frame(("a", ALL))
    solver, loads = factorise(f), np.zeros((2, 3, 6))
    with pytest.raises(
        ValueError, match=r"motions must have shape \(n_cases, 3, 6\), three translations.*shape \(3, 6\)"
    ):
        solver.solve(loads, np.zeros((3, 6)))
    with pytest.raises(ValueError, match="there are 2 load cases and 1 motion cases: give as many of both"):
        solver.solve(loads, np.zeros((1, 3, 6)))
    with pytest.raises(ValueError, match="motion case 1 of node 'a' is not finite: give finite motions"):
        solver.solve(loads, motion_array(f, [[], [Motion("a")]]) + np.array([0, np.nan])[:, None, None])
    with jax.enable_x64(True), pytest.raises(ValueError, match=r"motions must have .*got shape \(2, 6\)"):
        solver.displacements(loads, np.zeros((2, 6)))


def test_displacements_broadcast_motions_over_loads_and_read_only_what_is_held():
    f = frame(("a", ("x", "ry", "rz")), clamps=("c",))
    solver = factorise(f)
    loads = np.random.default_rng(1).normal(size=(4, 3, 6))
    motion = motion_array(f, [[Motion("a", (1e-3, 0, 0), (0, 2e-3, 0))]])
    expected = solver.solve(loads, np.repeat(motion, 4, axis=0)).displacements
    with jax.enable_x64(True):
        moved = solver.displacements(loads, motion[0])
        stray = solver.displacements(loads, motion[0] + 5.0 * ~np.any(motion[0] != 0, axis=1)[:, None])
    assert_allclose(moved, expected, rtol=1e-12, atol=1e-18)
    assert_allclose(stray, moved, atol=0)


def test_no_case_gives_no_answer():
    f = frame(("a", XYZ), clamps=("c",))
    solution = factorise(f).solve(load_array(f, []), motion_array(f, []))
    assert solution.support_reactions.shape == (0, 1, 6)
    assert solution.reactions.shape == (0, 1, 6)
    assert solution.stress().bending.shape == (0, 2)


# ---- Mechanisms, and what is none ----


@pytest.mark.parametrize(
    ("supports", "node", "way"),
    [
        ([("a", XYZ)], "c", "rotate about x"),
        ([("a", XYZ), ("b", XYZ)], "c", "rotate about x"),
        ([("b", XYZ), ("c", XYZ)], "a", "rotate about y"),
        ([("a", XYZ), ("c", XYZ)], "b", r"rotate about \(0\.707, 0\.707, 0\)"),
        ([("a", ("x", "y", "rz")), ("b", ("x", "y"))], "a", "translate along z"),
        ([("a", ("rx", "ry", "rz")), ("b", ("z", "x"))], "a", "translate along y"),
        ([("a", ("y", "z")), ("b", ("y", "z")), ("c", ("z",))], "a", "translate along x"),
        ([("a", XYZ), ("b", ("x", "z")), ("c", ("z",))], "c", "rotate about z"),
    ],
)
@pytest.mark.parametrize("size", [1e-6, 1.0, 1e4])
def test_supports_that_leave_a_motion_are_refused(supports, node, way, size):
    nodes = {name: tuple(size * np.array(x)) for name, x in NODES.items()}
    with pytest.raises(ValueError, match=f"node '{node}' is free to {way}, because the supports of its part leave it"):
        factorise(frame(*supports, nodes=nodes))


def test_a_beam_that_only_spins_is_refused():
    f = Frame({"a": (0, 0, 0), "b": (2, 0, 0)}, [MEMBERS[0]], supports=[Support("a", XYZ), Support("b", ("y", "z"))])
    with pytest.raises(ValueError, match="node 'a' is free to rotate about x"):
        factorise(f)


@pytest.mark.parametrize("turn", [[0.0, 0.0, 0.0], [0.3, 0.4, 0.5]])
def test_pins_in_line_are_refused_in_any_orientation(turn):
    turn = Rotation.from_rotvec(turn)
    nodes = {name: tuple(turn.apply(x) + np.array([100, -50, 20])) for name, x in NODES.items()}
    with pytest.raises(ValueError, match="node 'c' is free to rotate about"):
        factorise(frame(("a", XYZ), ("b", XYZ), nodes=nodes))
    assert factorise(frame(("a", XYZ), ("b", XYZ), ("c", XYZ), nodes=nodes)).reciprocal_condition > 1e-6


@pytest.mark.parametrize("lever", 10.0 ** -np.arange(1, 11))
def test_a_shrinking_lever_is_answered_right_or_refused(lever):
    """Pins on a line but for b, off it by the lever: the moment F lever about the line gives b the force F."""
    f = frame(("a", XYZ), ("c", XYZ), ("b", ("y",)), nodes={"a": (0, 0, 0), "b": (1, 0, lever), "c": (2, 0, 0)})
    if lever < 5e-7:
        with pytest.raises(ValueError, match="is free to rotate about x"):
            factorise(f)
    else:
        solution = factorise(f).solve(load_array(f, [[Load("b", moment=(7.0 * lever, 0, 0))]]))
        assert_allclose(solution.support_reactions[0, 2, 1], 7.0, rtol=1e-3)


def test_each_part_is_asked_for_itself():
    nodes = NODES | {"d": (5, 0, 0), "e": (6, 0, 0)}
    members = (*MEMBERS, member("de", "d", "e"))
    with pytest.raises(ValueError, match=r"node 'd' is free to rotate about x, because the supports"):
        factorise(frame(("d", XYZ), nodes=nodes, members=members, clamps=("a",)))
    with pytest.raises(ValueError, match=r"node 'd' is free to translate and rotate, because no members join it"):
        factorise(frame(("a", ALL), nodes=nodes, members=members))
    solver = factorise(frame(("d", XYZ), ("e", ("y", "z", "rx")), nodes=nodes, members=members, clamps=("a",)))
    assert solver.kinematics.shape == (30, 30 - 6 - 3 - 3)


def test_a_rigid_body_carries_a_support_to_a_part():
    """The body of c and p is pinned at p, which with a and b makes three pins off a line."""
    nodes = NODES | {"p": (1, 2, 0)}
    f = frame(("a", XYZ), ("p", XYZ), ("b", ("z",)), nodes=nodes, bodies=[RigidBody("r", "c", ("p",))])
    solution = factorise(f).solve(load_array(f, [[Load("c", force=(1.0, 2.0, 3.0))]]))
    assert_allclose(solution.at("p")[0, :3], 0, atol=0)
    assert_allclose(solution.support_reactions[0, :, :3].sum(axis=0), [-1, -2, -3], rtol=1e-9)


# ---- The axes of arcs ----


@pytest.mark.parametrize("through", [(0.5, 0.2, 0), (0.5, -0.7, 0), (0.5, 0, 0.3)])
def test_local_z_of_an_arc_is_the_normal_of_its_plane_towards_z_y_or_x(through):
    a = frame_arrays(frame(members=(member("ab", "a", "b", through=through), MEMBERS[1]), clamps=("a",)))
    assert_allclose(a.axes[0, 2], [0, 0, 1] if through[2] == 0 else [0, 1, 0], atol=1e-14)
    assert a.is_curved.tolist() == [True, False]

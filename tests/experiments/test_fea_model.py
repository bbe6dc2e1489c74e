"""Behaviour of the beam FEA: refusals, float64, scale, tracing."""

import copy
import math
import pickle
import subprocess
import sys

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from numpy.testing import assert_allclose

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
from experiments.fea.assembly import assemble
from experiments.fea.elements import Properties
from experiments.fea.sections import rectangle_properties, rectangle_torsion_constant
from experiments.fea.shapes import shapes

STEEL = Material(210e9, 0.3)
LEAF = rectangle(0.01, 0.001)
NODES = {"root": (0, 0, 0), "knee": (0.1, 0, 0), "tip": (0.1, 0.05, 0)}


def member(name: str, start: str, end: str, **kwargs) -> Member:
    return Member(name, start, end, LEAF, STEEL, **kwargs)


MEMBERS = (member("arm", "root", "knee"), member("hand", "knee", "tip"))


def frame(**changes) -> Frame:
    return Frame(**({"nodes": NODES, "members": MEMBERS, "clamps": ("root",)} | changes))


# ---- Refusals: one sentence that names the culprit and says what to do ----


@pytest.mark.parametrize("young", [0.0, -1.0, math.nan, math.inf])
def test_material_refuses_young(young):
    with pytest.raises(ValueError, match="young must be a positive modulus"):
        Material(young, 0.3)


@pytest.mark.parametrize("poisson", [-1.0, 0.51, math.nan])
def test_material_refuses_poisson(poisson):
    with pytest.raises(ValueError, match=r"poisson must lie above -1 and at most at 0\.5"):
        Material(1.0, poisson)


def test_material_shear_modulus():
    assert Material(3.0, 0.5).shear == 1.0


@pytest.mark.parametrize("bad", [0.0, -1.0, math.nan, math.inf])
@pytest.mark.parametrize("name", ["area", "second_moment_y", "second_moment_z", "torsion_constant"])
def test_section_refuses(name, bad):
    with pytest.raises(ValueError, match=f"{name} of a section must be positive and finite"):
        Section(**({"area": 1, "second_moment_y": 1, "second_moment_z": 1, "torsion_constant": 1} | {name: bad}))


@pytest.mark.parametrize("bad", [0.0, math.nan])
@pytest.mark.parametrize("name", ["shear_area_y", "shear_area_z"])
def test_section_refuses_shear_area(name, bad):
    with pytest.raises(ValueError, match=f"{name} of a section must be positive"):
        Section(1, 1, 1, 1, **{name: bad})


def test_rectangle_and_circle_refuse():
    with pytest.raises(ValueError, match="width must be a positive length"):
        rectangle(-0.01, 0.001)
    with pytest.raises(ValueError, match="thickness must be a positive length"):
        rectangle(0.01, 0.0)
    with pytest.raises(ValueError, match="shear_coefficient must be positive"):
        rectangle(0.01, 0.001, shear_coefficient=0)
    with pytest.raises(ValueError, match="diameter must be a positive length"):
        circle(math.inf)
    with pytest.raises(ValueError, match="shear_coefficient must be positive"):
        circle(0.01, shear_coefficient=-1)


def test_member_refuses_one_node_twice():
    with pytest.raises(ValueError, match="member 'arm' starts and ends at node 'root'"):
        member("arm", "root", "root")


def test_member_refuses_zero_length():
    with pytest.raises(ValueError, match="member 'hand' has zero length: move node 'knee' or 'tip'"):
        frame(nodes=NODES | {"tip": NODES["knee"]})


@pytest.mark.parametrize("up", [(1, 0, 0), (-2, 0, 0), (0, 0, 0), (1, 1e-8, 0)])
def test_member_refuses_up_along_itself(up):
    with pytest.raises(ValueError, match=r"member 'arm': up = .* is parallel to the member or zero; give a vector"):
        frame(members=(member("arm", "root", "knee", up=up), MEMBERS[1]))


@pytest.mark.parametrize("up", [(1, 0), "z", (0, math.nan, 1)])
def test_member_refuses_up_that_is_no_vector(up):
    with pytest.raises(ValueError, match="up of member 'arm' must be"):
        member("arm", "root", "knee", up=up)


@pytest.mark.parametrize("coordinates", [(0, math.nan, 0), (math.inf, 0, 0)])
def test_node_refuses_coordinates_not_finite(coordinates):
    with pytest.raises(ValueError, match="coordinates of node 'tip' must be finite"):
        frame(nodes=NODES | {"tip": coordinates})


def test_node_refuses_two_coordinates():
    with pytest.raises(ValueError, match="coordinates of node 'tip' must be three numbers"):
        frame(nodes=NODES | {"tip": (0, 1)})


def test_node_refuses_to_be_connected_to_nothing():
    with pytest.raises(ValueError, match="node 'stray' is connected to nothing: join it"):
        frame(nodes=NODES | {"stray": (1, 1, 1)})


def test_unknown_nodes_are_refused_with_the_nearest_name():
    with pytest.raises(ValueError, match="member 'hand' names an unknown node 'tipp'; did you mean 'tip'"):
        frame(members=(MEMBERS[0], member("hand", "knee", "tipp")))
    with pytest.raises(ValueError, match="rigid body 'stage' names an unknown node 'kne'; did you mean 'knee'"):
        frame(bodies=[RigidBody("stage", "tip", ("kne",))])
    with pytest.raises(ValueError, match="a clamp names an unknown node 'roof'; did you mean 'root'"):
        frame(clamps=("roof",))
    with pytest.raises(ValueError, match="unknown node 'Tip'; did you mean 'tip'"):
        load_array(frame(), [[Load("Tip")]])
    with pytest.raises(ValueError, match="unknown node 'elbow'; known are root, knee, tip"):
        factorise(frame()).solve(np.zeros((1, 3, 6))).at("elbow")


def test_repeated_names_are_refused():
    with pytest.raises(ValueError, match="two members are called 'arm'"):
        frame(members=(MEMBERS[0], member("arm", "knee", "tip")))
    with pytest.raises(ValueError, match="node 'root' is clamped twice"):
        frame(clamps=("root", "root"))
    with pytest.raises(ValueError, match="two rigid bodies are called 'b': give each its own name"):
        frame(
            nodes=NODES | {"p": (0, 1, 0), "q": (1, 1, 0)},
            bodies=[RigidBody("b", "tip", ("p",)), RigidBody("b", "root", ("q",))],
        )


def test_empty_parts_are_refused():
    with pytest.raises(ValueError, match="a frame needs nodes and at least one member"):
        frame(members=())
    with pytest.raises(ValueError, match="member name '' must be a text"):
        frame(members=(MEMBERS[0], member("", "knee", "tip")))
    with pytest.raises(ValueError, match="clamps must be a sequence of node names, got 'root'"):
        frame(clamps="root")


def test_bodies_are_refused():
    with pytest.raises(ValueError, match="rigid body 'b' has only its reference"):
        RigidBody("b", "tip", ("tip",))
    with pytest.raises(ValueError, match="rigid body 'b' lists node 'p' twice"):
        RigidBody("b", "tip", ("p", "p"))
    with pytest.raises(ValueError, match="nodes of rigid body 'b' must be a sequence of names, got 'tip'"):
        RigidBody("b", "knee", "tip")
    nodes = NODES | {"p": (0, 1, 0)}
    with pytest.raises(ValueError, match="node 'p' is in two rigid bodies, 'a' and 'b': make them one"):
        frame(nodes=nodes, bodies=[RigidBody("a", "tip", ("p",)), RigidBody("b", "root", ("p",))])
    with pytest.raises(ValueError, match="member 'hand' joins two nodes of rigid body 'b' and cannot deform: remove"):
        frame(bodies=[RigidBody("b", "tip", ("knee",))])
    with pytest.raises(ValueError, match=r"rigid body 'b' is clamped at nodes 'root' and 'p': .* keep one"):
        frame(nodes=nodes, bodies=[RigidBody("b", "root", ("p",))], clamps=("root", "p"))


def test_loads_are_refused():
    with pytest.raises(ValueError, match="force on node 'tip' must be finite"):
        Load("tip", force=(math.nan, 0, 0))
    with pytest.raises(ValueError, match="moment on node 'tip' must be three numbers"):
        Load("tip", moment=(1, 0))
    solver = factorise(frame())
    with pytest.raises(ValueError, match=r"loads must have shape \(n_cases, 3, 6\).*got shape \(3, 6\)"):
        solver.solve(np.zeros((3, 6)))
    with jax.enable_x64(True), pytest.raises(ValueError, match=r"loads must have .*got shape \(2, 6\)"):
        solver.displacements(np.zeros((2, 6)))
    loads = np.zeros((2, 3, 6))
    loads[1, 2, 0] = np.inf
    with pytest.raises(ValueError, match="load case 1 on node 'tip' is not finite"):
        solver.solve(loads)


def test_centrelines_refuse():
    solution = factorise(frame()).solve(np.zeros((1, 3, 6)))
    with pytest.raises(ValueError, match="load case 1 does not exist: there are 1"):
        centrelines(solution, case=1)
    with pytest.raises(ValueError, match="n_points must be 2 or more"):
        centrelines(solution, n_points=1)


# ---- Mechanisms, and what is none ----


def test_nothing_clamped_is_refused():
    with pytest.raises(ValueError, match=r"nothing is clamped, so node 'root' .* clamp at least one node"):
        factorise(frame(clamps=()))


def test_loose_part_is_refused():
    loose = frame(
        nodes=NODES | {"far": (1, 1, 1), "farther": (2, 1, 1)},
        members=(*MEMBERS, member("m", "far", "farther")),
    )
    with pytest.raises(ValueError, match=r"node 'far' is free to translate and rotate.*clamp a node of its part"):
        factorise(loose)


def test_loose_rigid_body_is_refused():
    loose = frame(nodes=NODES | {"p": (1, 1, 1), "q": (2, 1, 1)}, bodies=[RigidBody("b", "p", ("q",))])
    with pytest.raises(ValueError, match="node 'p' is free to translate and rotate"):
        factorise(loose)


def test_a_rigid_body_joins_parts():
    joined = frame(
        nodes=NODES | {"far": (1, 1, 1), "farther": (2, 1, 1)},
        members=(*MEMBERS, member("m", "far", "farther")),
        bodies=[RigidBody("b", "tip", ("far",))],
    )
    assert factorise(joined).arrays.n_free == 3


def stepped(thickness: float, block: float) -> Frame:
    """A leaf of 50 mm and a block of 10 mm beyond it."""
    return Frame(
        {"a": (0, 0, 0), "b": (0.05, 0, 0), "c": (0.06, 0, 0)},
        [
            Member("leaf", "a", "b", rectangle(0.01, thickness), STEEL),
            Member("block", "b", "c", rectangle(0.01, block), STEEL),
        ],
        clamps=("a",),
    )


def test_slender_leaf_beside_a_stiff_block_is_no_mechanism():
    """L/t = 1000 beside 10 mm: a ratio 1e9 of bending stiffnesses costs nine of 16 digits, no more."""
    f = stepped(thickness=50e-6, block=0.01)
    tip = factorise(f).solve(load_array(f, [[Load("c", force=(0, 0, 1e-3))]])).at("c")[0, 2]
    length, reach = 0.05, 0.01
    leaf, block = (m.section for m in f.members)
    flexibility = (
        (length**3 / 3 + length**2 * reach + length * reach**2) / (STEEL.young * leaf.second_moment_y)
        + reach**3 / (3 * STEEL.young * block.second_moment_y)
        + length / (STEEL.shear * leaf.shear_area_z)
        + reach / (STEEL.shear * block.shear_area_z)
    )
    assert_allclose(tip, 1e-3 * flexibility, rtol=2e-6)


def test_stiffness_beyond_float64_is_refused_not_answered():
    with pytest.raises(ValueError, match=r"node 'c' is almost free to translate along z.*make the stiffest members"):
        factorise(stepped(thickness=1e-6, block=0.1))


def test_stiffness_out_of_range_is_refused():
    tiny = {"a": (0, 0, 0), "b": (1e-120, 0, 0)}
    with pytest.raises(ValueError, match="outside the range of float64: check the units"):
        factorise(Frame(tiny, [member("m", "a", "b")], clamps=("a",)))


@pytest.mark.parametrize("scale", [1e-6, 1e-3, 1.0, 1e3])
@pytest.mark.parametrize("young", [1e3, 210e9])
def test_answers_do_not_depend_on_the_scale(scale, young):
    """A leaf of L/t = 1000, micrometres to kilometres, jelly to steel: δ = P L³/3EI + P L/(G A_s)."""
    length, material = 1.0 * scale, Material(young, 0.3)
    section = rectangle(0.1 * scale, 0.001 * scale)
    f = Frame(
        {"a": (0, 0, 0), "b": (0.6 * length, 0, 0), "c": (length, 0, 0)},
        [Member("ab", "a", "b", section, material), Member("bc", "b", "c", section, material)],
        clamps=("a",),
    )
    tip = factorise(f).solve(load_array(f, [[Load("c", force=(0, 0, 1.0))]])).at("c")[0, 2]
    expected = length**3 / (3 * young * section.second_moment_y) + length / (material.shear * section.shear_area_z)
    assert_allclose(tip, expected, rtol=1e-10)


def test_everything_clamped_answers_zero_and_the_reactions_take_the_loads():
    f = frame(clamps=("root", "knee", "tip"))
    solution = factorise(f).solve(load_array(f, [[Load("knee", force=(1, 2, 3), moment=(4, 5, 6))]]))
    assert_allclose(solution.displacements, 0, atol=0)
    assert_allclose(solution.end_forces, 0, atol=0)
    assert_allclose(solution.reactions[0], [[0] * 6, [-1, -2, -3, -4, -5, -6], [0] * 6], atol=0)


def test_a_clamp_on_any_node_of_a_rigid_body_holds_it_and_takes_the_reaction_there():
    """A body of tip and pin, clamped at the pin, holds the tip: by statics the pin takes the whole load."""
    f = frame(nodes=NODES | {"pin": (0.2, 0, 0.3)}, bodies=[RigidBody("b", "root", ("pin",))], clamps=("pin",))
    force = np.array([1.0, -2.0, 3.0])
    solution = factorise(f).solve(load_array(f, [[Load("tip", force=tuple(force))]]))
    assert_allclose(solution.at("root"), 0, atol=0)
    assert_allclose(solution.at("pin"), 0, atol=0)
    lever = np.subtract(f.nodes["tip"], f.nodes["pin"])
    assert_allclose(solution.reactions[0, 0], -np.r_[force, np.cross(lever, force)], atol=1e-13)
    free_standing = factorise(frame()).solve(load_array(frame(), [[Load("tip", force=tuple(force))]]))
    assert_allclose(solution.at("tip"), free_standing.at("tip"), rtol=1e-12)


# ---- Loads, axes, copies ----


def test_no_load_case_gives_no_answer():
    solution = factorise(frame()).solve(load_array(frame(), []))
    assert solution.displacements.shape == (0, 3, 6)
    assert solution.reactions.shape == (0, 1, 6)
    assert solution.end_forces.shape == (0, 2, 2, 6)


def test_loads_on_one_node_add_up():
    loads = load_array(frame(), [[], [Load("tip", force=(1, 0, 0)), Load("tip", (0, 2, 0), (0, 0, 3))]])
    assert loads.shape == (2, 3, 6)
    assert_allclose(loads[1, 2], [1, 2, 0, 0, 0, 3])
    assert np.count_nonzero(loads) == 3


@pytest.mark.parametrize(
    ("end", "y", "z"),
    [
        ((1, 0, 0), (0, 1, 0), (0, 0, 1)),
        ((0, 0, 1), (1, 0, 0), (0, 1, 0)),
        ((0, 0, -1), (-1, 0, 0), (0, 1, 0)),
        ((math.sin(math.radians(0.9)), 0, math.cos(math.radians(0.9))), None, (0, 1, 0)),
        ((math.sin(math.radians(1.1)), 0, math.cos(math.radians(1.1))), (0, 1, 0), None),
    ],
)
def test_default_up_is_z_and_y_for_upright_members(end, y, z):
    f = Frame({"a": (0, 0, 0), "b": end}, [member("m", "a", "b")], clamps=("a",))
    axes = frame_arrays(f).axes[0]
    assert_allclose(axes[0], np.array(end), atol=1e-15)
    if y is not None:
        assert_allclose(axes[1], y, atol=1e-15)
    if z is not None:
        assert_allclose(axes[2], z, atol=1e-15)


def test_frames_copy_and_pickle_but_do_not_change():
    f = frame(bodies=[RigidBody("b", "tip", ("root",))], clamps=("root",))
    for other in (copy.deepcopy(f), pickle.loads(pickle.dumps(f))):
        assert dict(other.nodes) == dict(f.nodes)
        assert (other.members, other.bodies, other.clamps) == (f.members, f.bodies, f.clamps)
    with pytest.raises(TypeError):
        f.nodes["tip"] = (0, 0, 0)
    with pytest.raises(ValueError, match="read-only"):
        factorise(f).stiffness[0, 0] = 0


# ---- Float64 without surprise ----


@pytest.mark.parametrize("outer", [False, True])
def test_float64_whatever_the_scope_and_the_scope_is_left_as_it_was(outer):
    f = frame()
    loads = load_array(f, [[Load("tip", force=(0, 0, 1.0))]])
    with jax.enable_x64(outer):
        solver = factorise(f)
        solution = solver.solve(loads)
        lines = centrelines(solution)
        assert jax.config.jax_enable_x64 is outer
    for array in (solution.displacements, solution.reactions, solution.end_forces, lines[0].displacement):
        assert array.dtype == np.float64
    assert_allclose(solution.reactions[0, 0], [0, 0, -1, -0.05, 0.1, 0], atol=1e-12)


def test_importing_leaves_the_global_setting_alone():
    code = "import jax; before = jax.config.jax_enable_x64; import experiments.fea as f\n" + (
        "s = f.rectangle(0.01, 0.001); assert abs(s.area / 1e-5 - 1) < 1e-15\n"
        "assert not before and jax.config.jax_enable_x64 is before\n"
        "import jax.numpy as jnp; assert jnp.ones(1).dtype == jnp.float32"
    )
    subprocess.run([sys.executable, "-c", code], check=True, timeout=120)


def test_displacements_inside_an_outer_jit_vmap_and_grad():
    f = frame()
    solver = factorise(f)
    loads = np.random.default_rng(1).normal(size=(4, 3, 6))
    expected = solver.solve(loads).displacements

    def compliance(load):
        return 0.5 * jnp.sum(load * solver.displacements(load))

    with jax.enable_x64(True):
        batch = jax.jit(jax.vmap(solver.displacements))(loads)
        gradient = jax.jit(jax.vmap(jax.grad(compliance)))(loads)
    assert batch.dtype == jnp.float64
    assert_allclose(batch, expected, rtol=1e-10, atol=1e-18)
    # Castigliano: the gradient of the strain energy by the load is the displacement.
    assert_allclose(gradient, expected, atol=1e-12 * np.abs(expected).max(), rtol=0)


def test_displacements_in_float32_are_refused():
    solver = factorise(frame())
    with jax.enable_x64(False):
        for call in (solver.displacements, jax.jit(solver.displacements)):
            with pytest.raises(ValueError, match="displacements runs in float64 only: call it, or the outer jit"):
                call(np.zeros((3, 6)))


# ---- Differentiable in geometry, for the solvers to come ----


def test_stiffness_is_differentiable_in_coordinates_and_section():
    """d/dL and d/dt of the cantilever's δ = L³/(3EI), E I = E b t³/12: 3δ/L and −3δ/t."""
    a = frame_arrays(frame(nodes={"root": (0, 0, 0), "knee": (0.1, 0, 0)}, members=MEMBERS[:1]))

    def deflection(length, thickness):
        x = jnp.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]) * length
        section = rectangle_properties(0.01, thickness, jnp.inf)
        properties = Properties(*(jnp.asarray(v)[None] for v in (STEEL.young, STEEL.shear, *section)))
        rest = shapes(jnp, x[:1].T, x[1:].T, x.mean(axis=0)[:, None], a.up.T)
        stiffness = assemble(rest, a.ends, properties, 2)[0][6:, 6:]
        return jnp.linalg.solve(stiffness, jnp.eye(6)[2])[2]

    with jax.enable_x64(True):
        value, (by_length, by_thickness) = jax.jit(jax.value_and_grad(deflection, (0, 1)))(0.1, 0.001)
    delta = 0.1**3 / (3 * STEEL.young * LEAF.second_moment_y)
    assert_allclose([value, by_length, by_thickness], [delta, 3 * delta / 0.1, -3 * delta / 0.001], rtol=1e-10)


@pytest.mark.parametrize("sides", [(0.01, 0.01), (0.01, 0.002), (0.002, 0.01)])
def test_torsion_constant_is_differentiable_even_at_the_square(sides):
    """J is homogeneous of degree four: b ∂J/∂b + t ∂J/∂t = 4J; and symmetric at the square."""
    with jax.enable_x64(True):
        J, (by_width, by_thickness) = jax.value_and_grad(rectangle_torsion_constant, (0, 1))(
            *(jnp.asarray(side) for side in sides)
        )
    gradient = np.array([by_width, by_thickness])
    assert_allclose(gradient @ sides, 4 * float(J), rtol=1e-13)
    if sides[0] == sides[1]:
        assert_allclose(gradient[0], gradient[1], rtol=1e-13)

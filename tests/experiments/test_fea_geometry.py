"""Geometry as data: derivatives with respect to it."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from numpy.testing import assert_allclose

from experiments import oracles
from experiments.fea import (
    Frame,
    Load,
    Material,
    Member,
    Motion,
    RigidBody,
    Support,
    condense,
    geometry_rates,
    load_array,
    motion_array,
    rectangle,
)
from experiments.fea.arrays import frame_arrays
from experiments.fea.scaling import geometry

AT = {"length": 0.05, "rise": 0.01, "arm": 0.02, "thickness": 1e-3, "young": 70e9, "angle": 0.3}
CANTILEVER = (0.1, 0.01, 1e-3, 210e9)
"""Length, width, thickness and Young's modulus."""


def build(length, rise, arm, thickness, young, angle, cantilever=CANTILEVER):
    """A driven lever on an arc and a leaf, turned in its plane; every number moves nodes, sections or materials.

    Beside it, along x, a cantilever that does not shear: what is compiled serves both.
    """
    turn = np.array([[np.cos(angle), -np.sin(angle), 0.0], [np.sin(angle), np.cos(angle), 0.0], [0.0, 0.0, 1.0]])
    places = {
        "ground": (0.0, 0.0, 0.0),
        "tip": (length, rise, 0.0),
        "hand": (length + arm, 2 * arm, 0.0),
        "drive": (length + arm, rise - 0.04, 0.0),
    }
    nodes = {name: tuple((turn @ np.array(place)).tolist()) for name, place in places.items()}
    section, material = rectangle(0.01, thickness), Material(young, 0.33)
    members = [
        Member("arc", "ground", "tip", section, material, through=tuple(turn @ (length / 2, rise / 2 + 0.008, 0))),
        Member("leaf", "drive", "hand", section, material),
    ]
    bodies = [RigidBody("lever", "tip", ("hand",))]
    long, wide, thick, stiff = cantilever
    nodes |= {"root": (0.0, 0.1, 0.0), "end": (long, 0.1, 0.0)}
    slender = replace(rectangle(thick, wide), shear_area_y=np.inf, shear_area_z=np.inf)
    members.append(Member("cantilever", "root", "end", slender, Material(stiff, 0.3)))
    return Frame(nodes, members, bodies, ["ground", "root"], [Support("drive", ("x", "y", "rz"))])


def read(answer):
    """Pose of the lever, the moment at the roots of all members, and the deflection of the cantilever."""
    return jnp.concatenate([answer.motion[[0, 1, 5], 0], answer.internal[5, 0], answer.motion[1:2, 2]])


def values(frame):
    loads = load_array(frame, [[Load("hand", (2.0, -1.0, 0.0), (0.0, 0.0, 0.02))], [Load("tip", (-1.0, 3.0, 0.0))]])
    motions = motion_array(frame, [[Motion("drive", (1e-3, 5e-4, 0.0), (0.0, 0.0, 0.2))], []])
    return loads, motions


def for_both_cases(rates):
    """The rates for each of two cases, which is what is compiled."""
    return jax.tree.map(lambda part: np.repeat(part, 2, axis=-1), rates)


@pytest.fixture(scope="module")
def lever():
    """One solver for all tests and the rates of all its numbers, for each of two cases: one program, which takes
    seconds to compile. Rates that all cases share are in the test of the hexflex."""
    frame = build(*AT.values())
    rates = for_both_cases(geometry_rates(build, list(AT.values())))
    return condense(frame, planar=True, n_steps=4), rates


def differences(near, step):
    """Central difference of the fourth order, from the values at −2, −1, 1 and 2 steps."""
    return (near[0] - 8 * near[1] + 8 * near[2] - near[3]) / (12 * step)


class TestDerivatives:
    """Beside differences of solutions of the same compiled solver, handed other geometries."""

    def test_of_a_planar_mechanism(self, lever):
        solver, rates = lever
        given = values(solver.frame)
        found = solver.differentiate(read, *given, geometry_directions=rates)
        assert found.shape == (2, 7, len(AT))
        for j, (name, at) in enumerate(AT.items()):
            others = [build(**{**AT, name: at * (1 + 1e-3 * k)}) for k in (-2, -1, 1, 2)]
            near = [solver.read(read, *given, geometry(frame_arrays(other))).values for other in others]
            expected = differences(near, 1e-3 * at)
            assert_allclose(found[:, :, j], expected, rtol=0, atol=1e-7 * np.abs(expected).max(), err_msg=name)

    def test_of_the_hexflex_whose_loaded_nodes_move(self):
        names = ("length_1", "thickness", "bend_angle", "poisson", "load_radius")
        oracle = oracles.get("hexflex", kinematics="nonlinear", stress_limit=1e9)
        force = load_array(oracle.frame, [[Load("T1", (0.7, -0.3, 0.5)), Load("T2", (0.0, 0.0, -0.9))]])
        at = np.array([getattr(oracle, name) for name in names])
        # The oracle's own, so that the program of `read` is the one that other tests of it have compiled.
        solver, pose, with_peak = oracle._map.solver, oracle._map.read, oracle._map._read_with_peak

        def built(*at):
            return replace(oracle, **dict(zip(names, at, strict=True))).frame

        rates = geometry_rates(built, at.tolist())
        found = solver.differentiate(pose, force, geometry_directions=rates)
        for j, name in enumerate(names):
            step = 1e-3 * abs(at[j]) * np.eye(len(at))[j]
            others = [geometry(frame_arrays(built(*(at + k * step).tolist()))) for k in (-2, -1, 1, 2)]
            near = [solver.read(with_peak, force, None, other).values[:, :6] for other in others]
            expected = differences(near, step[j])
            assert_allclose(found[:, :, j], expected, rtol=0, atol=1e-6 * np.abs(expected).max(), err_msg=name)

    def test_verification_cube_law_of_a_cantilever(self, lever):
        """u = 4 P L³ / (E w t³): d ln u / d ln (L, w, t, E) = 3, −1, −3, −1 (Gere, Mechanics of Materials, app. G).

        In both cases, whose loads are opposite; the two directions that the program has beside these four are none.
        """
        solver, _ = lever
        length, width, thickness, young = CANTILEVER
        rates = geometry_rates(lambda *at: build(*AT.values(), at), list(CANTILEVER))
        rates = jax.tree.map(lambda part: np.concatenate([part, np.zeros_like(part[:2])]), rates)
        load = load_array(solver.frame, [[Load("end", (0.0, sign * 1e-6, 0.0))] for sign in (1, -1)])
        found = solver.differentiate(read, load, geometry_directions=for_both_cases(rates))[:, -1]
        deflection = 4e-6 * length**3 / (young * width * thickness**3)
        expected = deflection * np.array([3, -1, -3, -1]) / list(CANTILEVER)
        assert_allclose(found[:, :4], [expected, -expected], rtol=1e-9)
        assert (found[:, 4:] == 0).all()

    def test_several_kinds_at_once(self, lever):
        """A direction may change loads and geometry together: the derivatives add."""
        solver, rates = lever
        given = values(solver.frame)
        push = load_array(solver.frame, [[Load("hand", (1.0, 0.0, 0.0))]] * len(AT))
        found = [
            solver.differentiate(read, *given, load_directions=by * push, geometry_directions=rates) for by in (0, 1)
        ]
        alone = solver.differentiate(read, *given, load_directions=push)
        assert_allclose(found[1] - found[0], alone, rtol=1e-9, atol=1e-9 * np.abs(found[1]).max())

    def test_directions_may_differ_from_case_to_case(self, lever):
        solver, rates = lever
        given = values(solver.frame)
        once = solver.differentiate(read, *given, geometry_directions=rates)
        thrice = jax.tree.map(lambda part: part * np.array([1.0, 3.0]), rates)
        found = solver.differentiate(read, *given, geometry_directions=thrice)
        expected = once * np.array([1.0, 3.0])[:, None, None]
        assert_allclose(found, expected, rtol=1e-9, atol=1e-9 * np.abs(expected).max())


class TestErrors:
    def test_no_direction(self):
        frame = build(*AT.values())
        with pytest.raises(ValueError, match="there is no direction: give load_directions"):
            condense(frame, planar=True).differentiate(read, *values(frame))

    def test_not_as_many_of_each(self):
        frame = build(*AT.values())
        rates = geometry_rates(build, list(AT.values()))
        with pytest.raises(ValueError, match="2 directions of one kind and 6 of another"):
            condense(frame, planar=True).differentiate(
                read, *values(frame), load_directions=values(frame)[0], geometry_directions=rates
            )

    def test_directions_of_another_shape(self):
        frame = build(*AT.values())
        rates = geometry_rates(build, list(AT.values()))
        with pytest.raises(ValueError, match=r"geometry_directions must have the shapes of a geometry with the 6 dir"):
            condense(frame, planar=True).differentiate(
                read, *values(frame), geometry_directions=rates._replace(coordinates=np.ones((6, 2, 1)))
            )

    def test_a_step_must_be_positive(self):
        with pytest.raises(ValueError, match=r"a positive step for each of the 1 numbers, got \[0.0\]"):
            geometry_rates(lambda angle: build(**{**AT, "angle": angle}), [0.0])

    def test_what_joins_what_must_stay(self):
        def changing(length):
            return build(**{**AT, "length": length}) if length > 0.05 else build_other()

        def build_other():
            frame = build(*AT.values())
            return replace(frame, members=[replace(m, name=f"{m.name}!") for m in frame.members])

        with pytest.raises(ValueError, match="the numbers change what joins what"):
            geometry_rates(changing, [0.05])

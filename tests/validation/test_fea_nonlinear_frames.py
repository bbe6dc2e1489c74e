"""Verification of the nonlinear FEA on frames in space: laws that hold for any of them, and the linear limit.

One frame of several parts that do not touch: a space frame with a rigid body and an arc, an arc on a ball joint, and
the right-angle cantilever that OpenSees has solved too.
"""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from experiments.fea import Frame, Load, Material, Member, RigidBody, Section, Support, condense, factorise, load_array
from experiments.fea.equilibria import Equilibria
from experiments.fea.nonlinear import NonlinearSolver
from experiments.fea.scaling import geometry

Floats = NDArray[np.float64]

REFERENCE = Path(__file__).parents[1] / "reference"
CORNER = json.loads((REFERENCE / "opensees_cantilevers.json").read_text(encoding="utf-8"))["right_angle"]

YOUNG, POISSON = 1.0, -0.5  # so that the shear modulus is one too
STOCKY = Section(3e3, 0.7, 1.0, 0.8, 1e3, 1.2e3)
EI = CORNER["stiffness"]["bending_y"]
"""The right angle in units of order one: lengths in dm, forces in EI/dm²."""
TURN = Rotation.from_rotvec([0.4, -1.1, 2.0])


def gallery(turn: Rotation | None = None) -> Frame:
    """All parts; the whole turned about the origin if asked."""
    turn = turn or Rotation.identity()
    rng = np.random.default_rng(20240607)
    nodes = {f"n{i}": x for i, x in enumerate(rng.uniform(-1.0, 1.0, (6, 3)))}
    nodes["arm"] = nodes["n1"] + [0.3, 0.2, -0.4]
    ups = iter(rng.normal(size=(12, 3)))
    joined: list[tuple[str, str, Floats | None]] = [
        ("n0", "n1", None),
        ("n1", "n2", None),
        ("n2", "n3", nodes["n2"] * 0.4 + nodes["n3"] * 0.6 + [0.03, 0.1, -0.07]),
        ("n3", "n0", None),
        ("n2", "n4", None),
        ("arm", "n5", None),
    ]
    nodes |= {"base": np.array([-4.0, 0, 0]), "joint": np.array([-4.0, 1.0, 0.2])}
    nodes |= {"foot": np.array([-4.0, 1.3, 0.1])}
    joined.append(("base", "joint", np.array([-4.02, 0.5, 0.14])))
    k = {name: value / EI for name, value in CORNER["stiffness"].items()}
    angle = Section(k["axial"] * 0.01, k["bending_y"], k["bending_z"], k["torsion"])
    nodes |= {f"c{i}": np.array([0, 0, 5.0]) + x for i, x in enumerate(([0, 0, 0], [2.0, 0, 0], [2.0, 1.5, 0]))}

    material = Material(YOUNG, POISSON)

    def turned(x: Floats | None) -> tuple[float, float, float] | None:
        return None if x is None else tuple(turn.apply(x))

    members = [Member(a + b, a, b, STOCKY, material, turned(next(ups)), turned(x)) for a, b, x in joined]
    upright = turned(np.array([0, 0, 1.0]))
    members += [Member(a + b, a, b, angle, material, upright) for a, b in (("c0", "c1"), ("c1", "c2"))]
    return Frame(
        {name: turned(x) for name, x in nodes.items()},
        members,
        [RigidBody("body", "n1", ("arm",)), RigidBody("shoe", "joint", ("foot",))],
        clamps=("n0", "n5", "base", "c0"),
        supports=(Support("foot", ("x", "y", "z")),),
    )


@pytest.fixture(scope="module")
def solver() -> NonlinearSolver:
    return condense(gallery(), n_steps=16)


def actions(frame: Frame, n_cases: int, size: float = 1.0) -> tuple[Floats, Floats, Floats]:
    """Loads, motions and followers in every part: bends of some tenths of a radian."""
    rng = np.random.default_rng(5)
    loads, motions, followers = np.zeros((3, n_cases, len(frame.nodes), 6))
    for node in ("n1", "arm", "n2", "n3", "n4", "joint", "c1", "c2"):
        loads[:, frame.index(node)] = size * rng.normal(size=(n_cases, 6)) * [0.4, 0.4, 0.4, 0.1, 0.1, 0.1]
    for node in ("arm", "n4"):
        followers[:, frame.index(node)] = size * rng.normal(size=(n_cases, 6)) * [0.3, 0.3, 0.3, 0.1, 0.1, 0.1]
    motions[:, frame.index("foot"), :3] = size * rng.uniform(-0.01, 0.01, (n_cases, 3))
    return loads, motions, followers


@pytest.fixture(scope="module")
def eight(solver) -> Equilibria:
    return solver.solve(*actions(solver.frame, 8))


def test_every_case_of_the_gallery_is_found(eight):
    assert eight.ok.all(), eight.reasons
    assert np.abs(eight.displacements[..., 3:]).max() > 0.5


def test_turning_the_whole_model_turns_the_answer(solver, eight):
    """To 1e-10: every equation is in the axes of a body or a section."""
    loads, motions, followers = (TURN.apply(x.reshape(-1, 3)).reshape(x.shape) for x in actions(solver.frame, 8))
    frame = gallery(TURN)
    found = condense(frame, n_steps=16).solve(loads, motions, followers)
    expected = TURN.apply(eight.displacements.reshape(-1, 3).copy()).reshape(eight.displacements.shape)
    assert_allclose(found.displacements, expected, atol=1e-10)
    assert_allclose(found.internal, eight.internal, atol=1e-9 * np.abs(eight.internal).max())
    reactions = TURN.apply(eight.reactions.reshape(-1, 3).copy()).reshape(eight.reactions.shape)
    assert_allclose(found.reactions, reactions, atol=1e-9 * np.abs(reactions).max())
    assert_allclose(found.energy, eight.energy, rtol=1e-9)


def test_loads_followers_and_reactions_balance_in_the_deformed_place(solver, eight):
    """Followers turned by their nodes; forces, and moments about the origin; to the residual, 1e-8."""
    frame = solver.frame
    loads, _, followers = actions(frame, 8)
    moved = np.array(list(frame.nodes.values())) + eight.displacements[:, :, :3]
    total = loads.copy()
    for i, node in enumerate(frame.nodes):
        turn = eight.rotation(node)
        total[:, i] += np.hstack([turn.apply(followers[:, i, :3].copy()), turn.apply(followers[:, i, 3:].copy())])
    for i, clamp in enumerate(frame.clamps):
        total[:, frame.index(clamp)] += eight.reactions[:, i]
    for i, support in enumerate(frame.supports):
        total[:, frame.index(support.node)] += eight.support_reactions[:, i]
    moment = np.cross(moved, total[:, :, :3]) + total[:, :, 3:]
    assert np.abs(total[:, :, :3].sum(1)).max() < 1e-8 * np.abs(total[..., :3]).max()
    assert np.abs(moment.sum(1)).max() < 1e-8 * np.abs(moment).max()


def test_small_actions_give_the_linear_answer(solver):
    """Of 1e-7 the size: what is left of second order is 1e-7 of it. Straight members are exact then, arcs are not: the
    one on the ball joint leaves 4e-6 when it turns by 0.85 rad in 16 steps, and here, by 0.35, a fortieth of it."""
    loads, motions, followers = actions(solver.frame, 4, 1e-7)
    linear = factorise(solver.frame).solve(loads + followers, motions)
    found = solver.solve(loads, motions, followers)
    parts = (
        ["n1", "arm", "n2", "n3", "n4"],
        ["joint", "foot"],
        ["c1", "c2"],
    )
    for names in parts:
        rows = [solver.frame.index(name) for name in names]
        one, other = found.displacements[:, rows], linear.displacements[:, rows]
        assert_allclose(one, other, atol=1e-6 * np.abs(other).max())
    assert_allclose(found.reactions, linear.reactions, atol=1e-6 * np.abs(linear.reactions).max())
    held = linear.support_reactions
    assert_allclose(found.support_reactions, held, atol=1e-6 * np.abs(held).max())
    assert_allclose(found.end_forces, linear.end_forces, atol=1e-6 * np.abs(linear.end_forces).max())


def test_the_order_of_cases_and_the_path_to_them_do_not_matter(solver, eight):
    """The same actions last in another batch, after others that lead elsewhere; and through a batch of fractions."""
    loads, motions, followers = actions(solver.frame, 8)
    order = [5, 2, 7, 0, 1, 6, 4, 3]
    found = solver.solve(loads[order], motions[order], followers[order])
    np.testing.assert_array_equal(found.displacements, eight.displacements[order])
    np.testing.assert_array_equal(found.energy, eight.energy[order])
    t = np.linspace(0.2, 1.0, 5)[:, None, None]
    path = solver.solve(t * loads[3], t * motions[3], t * followers[3])
    np.testing.assert_array_equal(path.displacements[-1], eight.displacements[3])


# ---- The right angle: OpenSees, straight corotational elements extrapolated to zero size ----


def test_right_angle_against_opensees(solver):
    """Euler–Bernoulli, to the 1e-5 of the displacement that ``N_STEPS`` promises for half as many steps.

    With shear, OpenSees's force-based elements converge elsewhere where the section has two bending stiffnesses: by
    4e-7 m at the smallest load, 200 times the estimated error. The equations of the rod bear out the FEA:
    test_fea_nonlinear_cantilevers has sections of unequal bending and shear stiffnesses.
    """
    frame = solver.frame
    loads = load_array(frame, [[Load("c2", force=tuple(np.array(f) * 0.01 / EI))] for f in CORNER["loads"]])
    found = solver.solve(loads)
    tip = 0.1 * found.at("c2")[:, :3]
    expected, estimated = (np.array(CORNER["euler_bernoulli"][n]) for n in ("tip_displacement", "estimated_error"))
    error = np.linalg.norm(tip - expected, axis=1) - 3 * np.linalg.norm(estimated, axis=1)
    assert np.all(error < 1e-5 * np.linalg.norm(expected, axis=1))


def test_geometry_is_that_of_another_frame(solver):
    """Nodes, arms of rigid bodies and arcs moved by hundredths: as if the frame were built so."""
    frame = solver.frame
    shift = np.random.default_rng(8).normal(size=(len(frame.nodes), 3)) * 0.03
    nodes = {name: tuple(np.add(x, d)) for (name, x), d in zip(frame.nodes.items(), shift, strict=True)}
    through = np.random.default_rng(9).normal(size=(len(frame.members), 3)) * 0.02
    members = [
        m if m.through is None else replace(m, through=tuple(np.add(m.through, d)))
        for m, d in zip(frame.members, through, strict=True)
    ]
    other = Frame(nodes, members, frame.bodies, frame.clamps, frame.supports)
    built = condense(other, n_steps=16)
    acting = actions(frame, 2)
    expected, found = built.solve(*acting), solver.solve(*acting, geometry=geometry(built.arrays))
    assert_allclose(found.displacements, expected.displacements, atol=1e-9)
    assert_allclose(found.reactions, expected.reactions, atol=1e-8 * np.abs(expected.reactions).max())

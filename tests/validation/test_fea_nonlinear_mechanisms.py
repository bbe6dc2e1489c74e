"""Verification of the nonlinear FEA on whole mechanisms: OpenSees, and the laws that any elastic frame obeys.

What is exact in the equations and not in their integration must fall with the fourth power of the step: those laws are
asserted at 8 steps a member and at 16, with the ratio.
"""

import json
import math
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from numpy.typing import NDArray

from experiments.fea import Frame, Material, Member, RigidBody, Support, condense, rectangle
from experiments.fea.equilibria import Equilibria
from experiments.fea.nonlinear import NonlinearSolver
from experiments.fea.scaling import Geometry, geometry
from experiments.oracles import get

Floats = NDArray[np.float64]

REFERENCE = Path(__file__).parents[1] / "reference"
HEXFLEX = json.loads((REFERENCE / "opensees_hexflex.json").read_text(encoding="utf-8"))
FLEXURES = json.loads((REFERENCE / "opensees_flexure_3rrr.json").read_text(encoding="utf-8"))
BEAMS = json.loads((REFERENCE / "beams.json").read_text(encoding="utf-8"))["flexure_3rrr"]

STEPS = (8, 16)
FOURTH = (11.0, 25.0)
"""What an error of the fourth order is divided by at half the step: 2^3.5 to 2^4.6."""


# ---- The HexFlex: 30 load points ----


@pytest.fixture(scope="module")
def hexflex() -> dict[int, NonlinearSolver]:
    frame = get("hexflex").frame
    return {n: condense(frame, n_steps=n) for n in STEPS}


def tab_loads(frame: Frame, forces: Floats) -> Floats:
    """Forces T1D1, T1D2, … on the tabs: D1 in the plane at 0°, 60° and 120° from x, D2 along z."""
    loads = np.zeros((len(forces), len(frame.nodes), 6))
    for tab, angle in enumerate(np.deg2rad([0.0, 60.0, 120.0])):
        d1 = np.array([math.cos(angle), math.sin(angle), 0.0])
        loads[:, frame.index(f"T{tab + 1}"), :3] = forces[:, [2 * tab]] * d1 + forces[:, [2 * tab + 1]] * [0, 0, 1.0]
    return loads


def without_shear(solver: NonlinearSolver) -> Geometry:
    """The frame's own, but of Euler–Bernoulli beams."""
    own = geometry(solver.arrays)
    rigid = np.full_like(own.properties.area, np.inf)
    return own._replace(properties=own.properties._replace(shear_area_y=rigid, shear_area_z=rigid))


@pytest.fixture(scope="module")
def thirty(hexflex) -> dict[int, Equilibria]:
    return {n: s.solve(tab_loads(s.frame, np.array(HEXFLEX["forces"]))) for n, s in hexflex.items()}


def pose(found: Equilibria, node: str = "centroid") -> Floats:
    """Translation and intrinsic XYZ Euler angles."""
    return np.hstack([found.at(node)[:, :3], found.rotation(node).as_euler("XYZ")])


def test_hexflex_against_opensees(thirty):
    """In units of the spread of each response, 8 steps are to be good for 3e-4 and 16 for 3e-5. The limit of OpenSees's
    elements with shear is another rod, by 3e-5 at 2 N: see the right angle in test_fea_nonlinear_frames."""
    reference = np.array(HEXFLEX["timoshenko"]["pose"])
    errors = {n: (np.abs(pose(found) - reference) / reference.std(axis=0)).max() for n, found in thirty.items()}
    assert all(found.ok.all() for found in thirty.values())
    assert errors[8] < 3e-4
    assert errors[16] < 3e-5


def test_hexflex_of_euler_bernoulli_beams_against_opensees(hexflex):
    """Straight corotational elements, extrapolated to zero size, with estimated errors of 3e-7 of the spread: beside
    three of those, 16 steps leave a 16th of what 8 leave."""
    reference, estimated = (np.array(HEXFLEX["euler_bernoulli"][name]) for name in ("pose", "estimated_error"))
    loads = tab_loads(hexflex[8].frame, np.array(HEXFLEX["forces"]))
    found = [solver.solve(loads, geometry=without_shear(solver)) for solver in hexflex.values()]
    coarse, fine = ((np.abs(pose(one) - reference) / reference.std(axis=0)).max(0) for one in found)
    assert np.all(coarse < 3e-4)
    assert np.all(fine < coarse / FOURTH[0] + 3 * (estimated / reference.std(axis=0)).max(0))


def test_loads_and_reactions_balance_in_the_deformed_place(thirty):
    """Forces, and moments about the origin of forces where their points have moved; to the residual, 1e-8."""
    found = thirty[8]
    frame = found.frame
    loads = tab_loads(frame, np.array(HEXFLEX["forces"]))
    moved = np.array(list(frame.nodes.values())) + found.displacements[:, :, :3]
    clamps = np.array([frame.nodes[name] for name in frame.clamps])
    force = loads[:, :, :3].sum(1) + found.reactions[:, :, :3].sum(1)
    moment = np.cross(moved, loads[:, :, :3]).sum(1)
    moment += (np.cross(clamps, found.reactions[:, :, :3]) + found.reactions[:, :, 3:]).sum(1)
    assert np.abs(force).max() < 1e-8 * np.abs(found.reactions[..., :3]).max()
    assert np.abs(moment).max() < 1e-8 * np.abs(found.reactions[..., 3:]).max()


def test_the_internal_wrench_along_a_member_is_that_of_statics(thirty):
    """The force is the same all along and the moment falls by r' × n: at the far end both are what the clamp exerts,
    to the error of the integration, which the second number of steps shows to be of fourth order."""
    left = []
    for found in thirty.values():
        end = [i for i, m in enumerate(found.frame.members) if m.end in found.frame.clamps]
        order = [found.frame.clamps.index(found.frame.members[i].end) for i in end]
        size = [np.linalg.norm(part, axis=2) for part in np.split(found.end_forces[:, end, 1], 2, axis=2)]
        clamp = [np.linalg.norm(part, axis=2) for part in np.split(found.reactions[:, order], 2, axis=2)]
        left.append(max(np.abs(a - b).max() / b.max() for a, b in zip(size, clamp, strict=True)))
    assert FOURTH[0] < left[0] / left[1] < FOURTH[1]


def test_compliance_at_a_loaded_equilibrium_is_reciprocal(hexflex):
    """Maxwell's theorem for the tangent of dead forces, by central differences of h and h/2, extrapolated.

    The equations have a potential; their integration breaks it by its error, of fourth order.
    """
    points = [("T1", 0), ("T1", 2), ("T2", 1), ("T3", 2), ("T1 right bend", 0), ("T2 left bend", 2)]
    base, left = 0.7 * np.array(HEXFLEX["forces"])[:1], []
    for solver in hexflex.values():
        frame = solver.frame
        places = [(frame.index(node), axis) for node, axis in points]
        cases = [(column, sign * h) for h in (0.02, 0.01) for sign in (1, -1) for column in places]
        loads = np.repeat(tab_loads(frame, base), len(cases), axis=0)
        for row, (column, change) in zip(loads, cases, strict=True):
            row[column] += change
        found = solver.solve(loads)
        assert found.ok.all()
        u = np.stack([found.displacements[:, node, axis] for node, axis in places], axis=1).reshape(2, 2, 6, 6)
        coarse, fine = (u[0, 0] - u[0, 1]) / 0.04, (u[1, 0] - u[1, 1]) / 0.02
        compliance = (4 * fine - coarse) / 3
        left.append(np.abs(compliance - compliance.T).max() / np.abs(compliance).max())
    assert left[0] < 1e-4
    assert FOURTH[0] < left[0] / left[1] < FOURTH[1]


def test_work_of_the_loads_is_the_strain_energy(hexflex):
    """∫ F·du along the path t F is F·u(1) − ∫ F·u(t) dt, by 12 Gauss points."""
    t, weights = np.polynomial.legendre.leggauss(12)
    t, weights = (t + 1) / 2, weights / 2
    left = []
    for solver in hexflex.values():
        full = tab_loads(solver.frame, np.array(HEXFLEX["forces"])[20:21])
        found = solver.solve(np.concatenate([full, t[:, None, None] * full]))
        assert found.ok.all()
        along = np.einsum("nd,cnd->c", full[0, :, :3], found.displacements[:, :, :3])
        work = along[0] - weights @ along[1:]
        left.append(abs(work / found.energy[0] - 1))
    assert left[0] < 1e-4
    assert FOURTH[0] < left[0] / left[1] < FOURTH[1]


# ---- The planar 3-RRR mechanism ----


def flexure_frame(force_point: Floats) -> Frame:
    """From the words of ``beams.json``; SI. `force_point` is where the force acts on the platform at rest."""
    section, material = rectangle(width=0.0001, thickness=0.005, shear_coefficient=math.inf), Material(70e9, 0.3)
    nodes, members, bodies, clamps, supports = {"centre": (0, 0, 0), "force": (*force_point, 0)}, [], [], [], []
    for leg, turn in enumerate(np.deg2rad([0, 120, 240])):
        ground, corner = (side / math.sqrt(3) * np.exp(1j * math.radians(-150)) for side in (0.1, 0.04))
        crank = np.exp(-0.599365j)
        elbow = ground + 0.04 * crank
        coupler = (corner - elbow) / abs(corner - elbow)
        assert abs(corner - elbow) == pytest.approx(0.04, abs=1e-7)
        places = [ground, ground + 0.01 * crank, ground + 0.03 * crank, elbow, elbow + 0.03 * coupler, corner]
        names = [f"{part}{leg}" for part in "GEFHIK"]
        nodes |= {
            n: ((z * np.exp(1j * turn)).real, (z * np.exp(1j * turn)).imag, 0)
            for n, z in zip(names, places, strict=True)
        }
        for start, end in list(pairwise(names))[::2]:
            members.append(Member(start + end, start, end, section, material))
        bodies += [RigidBody(f"crank{leg}", names[1], (names[2],)), RigidBody(f"coupler{leg}", names[3], (names[4],))]
        clamps.append(names[0])
        supports.append(Support(names[1], ("rz",)))
    bodies.append(RigidBody("platform", "centre", ("force", "K0", "K1", "K2")))
    return Frame(nodes, members, bodies, clamps, supports)


@pytest.fixture(scope="module")
def flexures() -> dict[int, NonlinearSolver]:
    return {
        n: condense(flexure_frame(np.array(FLEXURES["exact_case"]["force_point"])), planar=True, n_steps=n)
        for n in STEPS
    }


def answers(solver: NonlinearSolver, points: Floats, node: str) -> tuple[Floats, Equilibria]:
    """x, y, ψ, three torques, the largest bending stress; the force acts on `node`."""
    frame = solver.frame
    loads, motions = np.zeros((2, len(points), len(frame.nodes), 6))
    for leg in range(3):
        motions[:, frame.index(f"E{leg}"), 5] = points[:, leg]
    loads[:, frame.index(node), :2] = points[:, 3:5]
    loads[:, frame.index("centre"), 5] = points[:, 5]
    found = solver.solve(loads, motions)
    torques = found.support_reactions[:, :, 5]
    return np.column_stack([found.at("centre")[:, [0, 1, 5]], torques, found.largest_stress()[0]]), found


@pytest.mark.parametrize(("name", "node"), [("exact_case", "force"), ("random", "centre")])
def test_flexure_3rrr_against_opensees(flexures, name, node):
    """Straight corotational elements extrapolated to zero size, with their estimated errors. The stress is that of
    the ends of steps, among which are the ends of flexures, where it is largest."""
    reference = FLEXURES[name]
    points, expected, estimated = (np.array(reference[part]) for part in ("points", "values", "estimated_error"))
    coarse, fine = (answers(solver, points, node)[0] for solver in flexures.values())
    size = np.abs(expected).max(0)
    assert np.abs((coarse - expected) / size).max() < 1e-4
    assert np.all(np.abs(fine - expected) < np.abs(coarse - expected) / FOURTH[0] + 3 * estimated)


def test_flexure_3rrr_against_the_exact_elastica(flexures):
    """Elastica on each flexure, solved by shooting, printed in mm, N mm and rad."""
    printed = BEAMS["exact_elastica (ours; OpenSees corotational, 10 elements a flexure, agrees)"]
    row = answers(flexures[16], np.array(FLEXURES["exact_case"]["points"]), "force")[0][0]
    assert_allclose(row[:2] * 1e3, printed["r_o_mm"], atol=0.6e-4)
    assert_allclose(row[2], printed["psi_rad"], atol=0.6e-5)
    assert_allclose(row[3:6] * 1e3, printed["tau_Nmm"], atol=0.6e-3)


def test_work_of_the_drives_is_the_strain_energy(flexures):
    """Σ ∫ τ dθ along the path t θ, by 12 Gauss points."""
    t, weights = np.polynomial.legendre.leggauss(12)
    t, weights = (t + 1) / 2, weights / 2
    full = np.array([*np.array(FLEXURES["exact_case"]["points"])[0, :3], 0, 0, 0])
    left = []
    for solver in flexures.values():
        values, found = answers(solver, np.concatenate([full[None], t[:, None] * full]), "centre")
        work = weights @ (values[1:, 3:6] @ full[:3])
        left.append(abs(work / found.energy[0] - 1))
    assert left[0] < 1e-4
    assert FOURTH[0] < left[0] / left[1] < FOURTH[1]


def test_the_answer_does_not_depend_on_the_path(flexures):
    """Cases that stop half way, or go through others, are other cases of a batch: alone, first or last, the same."""
    points = np.array(FLEXURES["random"]["points"])
    together, _ = answers(flexures[8], points, "centre")
    backwards, _ = answers(flexures[8], points[::-1], "centre")
    alone, _ = answers(flexures[8], points[7:8], "centre")
    np.testing.assert_array_equal(backwards[::-1], together)
    np.testing.assert_array_equal(alone[0], together[7])

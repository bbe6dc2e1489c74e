"""Verification of what the nonlinear FEA says of stability: classical critical loads, and mechanisms that snap.

One planar frame of several parts: a case loads one of them and leaves the others at rest.
"""

import json
import math
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from numpy.typing import NDArray
from scipy.special import ellipe, ellipk

from experiments.fea import Frame, Load, Material, Member, Section, Support, condense, load_array
from experiments.fea.equilibria import Equilibria
from experiments.fea.nonlinear import NonlinearSolver

Floats = NDArray[np.float64]

TOGGLE = json.loads((Path(__file__).parents[1] / "reference" / "opensees_frames.json").read_text(encoding="utf-8"))[
    "williams_toggle"
]
SPAN, RISE, EA, EI = 12.943, 0.386, 1.885e6, 9.27e3  # in, lb: as the file says

COLUMNS = {"free": math.pi**2 / 4, "guided": 4 * math.pi**2, "pinned": math.pi**2}
"""Critical loads over EI/L²: Timoshenko and Gere, Theory of Elastic Stability, 2nd ed. (1961), §2.1 and 2.2."""

COLUMN_NAMES = [(name, pieces) for name in COLUMNS for pieces in (1, 2)]


def stability_frame() -> Frame:
    """Columns of length and EI one, in one piece and in two, and Williams's toggle with a half span of one."""
    nodes, members, clamps, supports = {}, [], [], []
    column = Section(1e8, 1.0, 1.0, 1.0)
    for x, (name, pieces) in enumerate(COLUMN_NAMES):
        at = [f"{name}{pieces}.{i}" for i in range(pieces + 1)]
        nodes |= {node: (3.0 * x, i / pieces, 0.0) for i, node in enumerate(at)}
        for i in range(pieces):
            members.append(Member(at[i], at[i], at[i + 1], column, Material(1.0, 0.0), (0, 0, 1)))
        if name == "pinned":
            supports += [Support(at[0], ("x", "y")), Support(at[-1], ("x",))]
        else:
            clamps.append(at[0])
        if name == "guided":
            supports.append(Support(at[-1], ("x", "rz")))
    nodes |= {"left": (-4, 0, 0), "apex": (-3, RISE / SPAN, 0), "right": (-2, 0, 0)}
    leaf = Section(EA * SPAN**2 / EI, 1.0, 1.0, 1.0)
    members += [Member(end, end, "apex", leaf, Material(1.0, 0.0), (0, 0, 1)) for end in ("left", "right")]
    return Frame(nodes, members, (), [*clamps, "left", "right"], supports)


@pytest.fixture(scope="module")
def solver() -> NonlinearSolver:
    return condense(stability_frame(), planar=True, n_steps=16)


def top(name: str, pieces: int) -> str:
    return f"{name}{pieces}.{pieces}"


SHARES = (0.5, 0.99, 1.01, 1.5)


@pytest.fixture(scope="module")
def pressed(solver) -> tuple[Equilibria, Equilibria]:
    """Each column under SHARES of its critical load, all in one solve: stable equilibria, and any."""
    cases = [
        [Load(top(name, pieces), force=(0, -f * COLUMNS[name], 0))] for name, pieces in COLUMN_NAMES for f in SHARES
    ]
    loads = load_array(solver.frame, cases)
    return solver.solve(loads), solver.solve(loads, only_stable=False)


@pytest.mark.parametrize(("name", "pieces"), COLUMN_NAMES)
def test_timoshenko_and_gere_critical_loads(pressed, name, pieces):
    """A straight column is stable at 1 % less and not at 1 % more.

    In one piece the guided column has no free motion but its shortening: that it buckles between its ends is seen
    along the member alone. There its flexibility is integrated over kh = 2π/8 at a time, which puts the load where
    it changes sign to (kh)⁴/60 = 0.6 %.
    """
    first = COLUMN_NAMES.index((name, pieces)) * len(SHARES)
    rows = slice(first, first + len(SHARES))
    found, anyway = pressed
    assert found.ok[rows].tolist() == [True, True, False, False]
    assert all("unstable in one mode" in reason for reason in found.reasons[rows][2:])
    assert anyway.ok[rows].all()
    assert anyway.unstable[rows].tolist() == [0, 0, 1, 1]
    assert_allclose(anyway.at(top(name, pieces))[rows, 0], 0, atol=1e-12)


def test_timoshenko_and_gere_beam_column(solver):
    """§1.11: a lateral load Q at the free end of a column under P bends it by Q (tan u − u)/(P k), u = kL = √(P L²/EI);
    Q so small that the rotation squared is below the tolerance."""
    shares, Q = np.array([0.1, 0.5, 0.9, 0.99]), 1e-6
    p = shares * COLUMNS["free"]
    found = solver.solve(load_array(solver.frame, [[Load("free1.1", force=(Q, -x, 0))] for x in p]))
    u = np.sqrt(p)
    assert_allclose(found.at("free1.1")[:, 0], Q * (np.tan(u) - u) / (p * u), rtol=1e-4)


ANGLES = (20, 60, 100, 140)


def post_critical(degrees: float) -> list[float]:
    """P/P_cr, x/L and y/L where the tip has turned by so much."""
    k = math.sin(math.radians(degrees) / 2)
    K, E = ellipk(k * k), ellipe(k * k)
    return [(2 * K / math.pi) ** 2, 2 * E / K - 1, 2 * k / K]


@pytest.fixture(scope="module")
def buckled(solver) -> Equilibria:
    loads = [(1e-4, -post_critical(degrees)[0] * COLUMNS["free"], 0) for degrees in ANGLES]
    return solver.solve(load_array(solver.frame, [[Load("free2.2", force=force)] for force in loads]))


@pytest.mark.parametrize("degrees", ANGLES)
def test_timoshenko_and_gere_beyond_the_critical_load(buckled, degrees):
    """§2.7: P/P_cr = (2K/π)² with k = sin α/2, x/L = 2E/K − 1, y/L = 2k/K. A lateral load of 1e-4 chooses the side
    and moves the tip by not more than itself times the compliance, which is 1/(P/P_cr − 1) at most."""
    exact, i = post_critical(degrees), ANGLES.index(degrees)
    assert buckled.ok[i], buckled.reasons[i]
    tip = buckled.at("free2.2")[i]
    atol = 1e-4 / (exact[0] - 1) + 2e-4
    assert_allclose([1 + tip[1], tip[0], -tip[5]], [exact[1], exact[2], math.radians(degrees)], atol=atol)


def test_williams_toggle_up_to_its_limit_against_opensees(solver):
    """The path nearly to the limit load, where the apex yields more and more; beyond, a case has no answer, and says
    so. Near the limit the legs are as long as kL = π, and 16 steps leave (kh)⁴/10 of a displacement."""
    curve, limit = np.array(TOGGLE["curve"]["values"]), TOGGLE["limit_points"]["values"][0]
    rising = curve[(curve[:, 2] > limit[2]) & (curve[:, 0] > 0)]
    unit, n = EI / SPAN**2, len(rising)
    beyond = [limit[0] * f for f in (0.995, 1.005, 1.5)]
    cases = [[Load("apex", force=(0, -f / unit, 0))] for f in (*rising[:, 0], *beyond)]
    failed = solver.solve(load_array(solver.frame, cases))
    assert n >= 3
    assert_allclose(failed.at("apex")[:n, 1] * SPAN, rising[:, 2], rtol=(math.pi / 16) ** 4 / 10 * 1.1)
    assert failed.ok.tolist() == [True] * (n + 1) + [False, False]
    assert np.isnan(failed.at("apex")[n + 1 :]).all()
    assert np.isnan(failed.energy[n + 1 :]).all()
    assert np.isnan(failed.reactions[n + 1 :]).all()
    assert np.isnan(failed.bending_stress[n + 1 :]).all()
    assert all("no equilibrium was found beyond" in r or "unstable" in r for r in failed.reasons[n + 1 :])


def test_a_case_that_fails_leaves_the_others_as_they_are(solver):
    cases = [[Load("apex", force=(0, -f, 0))] for f in (0.1, 1.0, 0.2, 2.0, 0.3)]
    loads = load_array(solver.frame, cases)
    found = solver.solve(loads)
    assert found.ok.tolist() == [True, False, True, False, True]
    good = solver.solve(loads[found.ok])
    np.testing.assert_array_equal(found.displacements[found.ok], good.displacements)
    np.testing.assert_array_equal(found.iterations[found.ok], good.iterations)
    for i in range(len(cases)):
        np.testing.assert_array_equal(solver.solve(loads[i : i + 1]).displacements[0], found.displacements[i])


def test_more_cases_than_a_chunk(solver):
    """300 cases, of which every fifth snaps, are the same as those of the chunks."""
    sizes = np.where(np.arange(300) % 5, 0.2, 1.5) * np.linspace(0.5, 1.0, 300)
    found = solver.solve(load_array(solver.frame, [[Load("apex", force=(0, -f, 0))] for f in sizes]))
    assert len(found) == len(found.reasons) == 300
    again = solver.solve(load_array(solver.frame, [[Load("apex", force=(0, -f, 0))] for f in sizes[250:262]]))
    np.testing.assert_array_equal(found.displacements[250:262], again.displacements)

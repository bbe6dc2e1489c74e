"""The planar 3-RRR flexure mechanism, against two independent solvers, the thesis and itself.

The elastica, OpenSeesPy's beams and the thesis's method know no shear, and neither do the default parameters. What
shear does is seen by itself.
"""

import json
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

from experiments import Status, oracles
from experiments.designs import Random
from tests.contracts.oracle_contract import default

REFERENCE = Path(__file__).parents[1] / "reference"
PEER = json.loads((REFERENCE / "opensees_flexure_3rrr.json").read_text(encoding="utf-8"))
THESIS = json.loads((REFERENCE / "assur_3rrr.json").read_text(encoding="utf-8"))
UNITS = np.array([1e3, 1e3, 1.0, 1e3, 1e3, 1e3, 1e-6])
"""mm, mm, rad, three N mm, MPa."""
LIMIT = 200e6
CASE = PEER["exact_case"]
"""The thesis's: cranks turned, a force at the middle of LM."""
TOO_FAR, FINE = [-0.195, -0.195, -0.195, 0.0, 0.0, 0.0], [0.05, 0.0, 0.02, 0.0, 0.0, 0.0]


@pytest.fixture(scope="module")
def oracle():
    """With default parameters, and shared with the contract tests: compiling takes seconds."""
    return default("flexure_3rrr")


@pytest.fixture(scope="module")
def fine():
    return oracles.get("flexure_3rrr", n_steps=8, stress_limit=LIMIT)


@pytest.fixture(scope="module")
def assur():
    return oracles.get("flexure_3rrr", method="assur", stress_limit=LIMIT)


@pytest.fixture(scope="module")
def grid():
    """Six levels of each crank over the workspace, no load, (216, 6)."""
    turns = np.array(list(product(np.linspace(-0.195, 0.245, 6), repeat=3)))
    return np.hstack([turns, np.zeros_like(turns)])


@pytest.fixture(scope="module")
def span(oracle):
    """How far each response ranges over the factors."""
    return np.ptp(oracle.evaluate(Random(300).generate(oracle.factors, rng=3).physical).values, axis=0)


def with_force_at(oracle, point, force_point):
    """Responses where the force acts at a point of the platform: its moment follows the platform's turn."""
    psi, values = 0.0, np.zeros(7)
    arm = complex(*force_point)
    for _ in range(30):
        turned = arm * np.exp(1j * psi)
        point = np.array([*point[:5], turned.real * point[4] - turned.imag * point[3]])
        values = oracle.evaluate(point[None]).values[0]
        if abs(values[2] - psi) < 1e-12:
            return values
        psi = values[2]
    raise AssertionError("the platform's turn does not settle")


class TestVerification:
    """Against what we did not write."""

    def test_exact_elastica(self, oracle):
        """Elliptic integrals, to 1e-4 and half of the last digit printed."""
        found = with_force_at(oracle, CASE["points"][0], CASE["force_point"]) * UNITS
        exact = THESIS["exact"]
        assert_allclose(found[2], exact["psi"], rtol=1e-4)
        assert_allclose(found[:2], exact["r_o"], rtol=1e-4, atol=5e-5)
        assert_allclose(found[3:6], exact["tau"], rtol=1e-4, atol=5e-4)

    def test_published(self, fine):
        """Loosely, within what the thesis itself gives as its error of the pose, 0.026 mm and 6.1 mrad."""
        found = with_force_at(fine, CASE["points"][0], CASE["force_point"]) * UNITS
        published = THESIS["published"]
        assert_allclose(found[2], published["psi"], atol=6.1e-3)
        assert np.hypot(*(found[:2] - published["r_o"])) < 0.026
        assert_allclose(found[3:6], published["tau"], atol=0.6)

    def test_opensees_at_the_published_case(self, fine):
        found = with_force_at(fine, CASE["points"][0], CASE["force_point"])
        assert_allclose(found, CASE["values"][0], rtol=2e-6, atol=2e-8)

    def test_opensees_at_random_points(self, fine, span):
        """Pose, torques and stress; in parts of their ranges."""
        found = fine.evaluate(np.array(PEER["random"]["points"])).values
        assert (np.abs(found - PEER["random"]["values"]) / span).max() < 2e-6

    def test_shear_is_seen(self, span):
        """1 part in 20 000 of the range."""
        shearing = oracles.get("flexure_3rrr", shear=True)
        away = np.abs(shearing.evaluate(np.array(PEER["random"]["points"])).values - PEER["random"]["values"]) / span
        assert 1e-5 < away.max() < 6e-5


class TestMethods:
    """The thesis's Assur-group method against beams, over the unloaded workspace."""

    def test_agree(self, oracle, assur, grid):
        """Within the extension of the flexures, which the thesis neglects, and much closer than it found its method
        to its own finite elements: 0.026 mm and 6.1 mrad."""
        beams, groups = oracle.evaluate(grid), assur.evaluate(grid)
        assert set(beams.status) == {Status.OK}
        away = np.abs(beams.values - groups.values).max(axis=0)
        assert (away[:2] < 2e-7).all()
        assert away[2] < 6e-6
        assert (away[3:6] < 2e-6).all()
        assert away[6] < 5e4

    def test_largest_stress_is_at_the_corner(self, oracle, grid):
        """Section 1.1.5.4 places the range of the cranks so that 250 MPa are just reached."""
        stress = oracle.evaluate(grid).values[:, 6]
        worst = int(stress.argmax())
        assert_allclose(stress[worst], 250e6, rtol=0.004)
        assert_allclose(grid[worst, :3], -0.195)


@pytest.mark.parametrize("name", ["oracle", "assur"])
class TestSymmetry:
    def test_cranks_in_turn_turn_the_pose(self, name, request):
        """What one leg does, with the force turned, the next does turned by 120°."""
        oracle = request.getfixturevalue(name)
        points = Random(20).generate(oracle.factors, rng=4).physical
        third = np.exp(2j * np.pi / 3)
        force = points[:, 3:5] @ [1, 1j] * third
        turned = np.column_stack([np.roll(points[:, :3], 1, axis=1), force.real, force.imag, points[:, 5]])
        before, after = oracle.evaluate(points).values, oracle.evaluate(turned).values
        assert_allclose(after[:, :2] @ [1, 1j], before[:, :2] @ [1, 1j] * third, atol=1e-9)
        assert_allclose(after[:, 2], before[:, 2], atol=1e-7)
        assert_allclose(after[:, 3:6], np.roll(before[:, 3:6], 1, axis=1), atol=1e-8)
        assert_allclose(after[:, 6], before[:, 6], rtol=1e-6)

    def test_rest_stays_at_rest(self, name, request):
        answers = request.getfixturevalue(name).evaluate(np.zeros((1, 6)))
        assert answers.status == [Status.OK]
        assert_allclose(answers.values * UNITS, 0.0, atol=1e-9)


class TestJacobian:
    def test_against_central_differences(self, oracle):
        points = oracle.factors.decode(np.random.default_rng(1).uniform(-0.9, 0.9, (4, 6)))
        half = oracle.factors.half_range
        h = 1e-2
        steps = h * np.vstack([np.eye(6), -np.eye(6), 2 * np.eye(6), -2 * np.eye(6)]) * half
        values = oracle.evaluate((points[:, None] + steps).reshape(-1, 6)).values.reshape(4, 4, 6, 7)
        near, back, far, far_back = np.moveaxis(values, 1, 0)
        differences = ((8 * (near - back) - (far - far_back)) / (12 * h)).transpose(0, 2, 1)
        away = np.abs(oracle.jacobian(points) * half - differences).max(2) / np.abs(differences).max(2)
        assert away.max() < 1e-6

    def test_reciprocity(self, oracle):
        """Angles, loads, pose and torques come from one energy; four steps along a flexure keep that to 1e-6.

        Torques by cranks and pose by loads are symmetric, torques by loads and pose by cranks opposite.
        """
        slope = oracle.jacobian(np.array([[0.1, -0.05, 0.2, 0.03, -0.02, 0.0004]]))[0]
        units = np.array([1e-2, 1e-2, 1.0])  # metres weigh as much as radians
        stiffness, compliance = slope[3:6, :3], slope[:3, 3:] / np.outer(units, units)
        for matrix in (stiffness, compliance):
            assert_allclose(matrix, matrix.T, rtol=0, atol=3e-6 * np.abs(matrix).max())
        by_cranks, by_loads = slope[:3, :3] / units[:, None], slope[3:6, 3:] / units
        assert_allclose(by_loads.T, -by_cranks, rtol=0, atol=3e-6 * np.abs(by_cranks).max())


class TestStatus:
    @pytest.mark.parametrize("size", [1e-2, 1e-4, 1e-6, 1e-8])
    def test_nothing_is_too_small_to_be_answered(self, oracle, size):
        points = size * Random(20).generate(oracle.factors, rng=1).physical
        assert set(oracle.evaluate(points).status) == {Status.OK}

    def test_stress_limit_names_member_and_place(self, fine):
        answers = fine.evaluate(np.array([TOO_FAR, FINE]))
        assert answers.status == [Status.REJECTED, Status.OK]
        assert answers.reasons[1] == ""
        stress = answers.values[0, 6] / 1e6
        words = answers.reasons[0].split()
        assert answers.reasons[0].startswith(f"bending stress of {stress:.4g} MPa in flexure ")
        assert answers.reasons[0].endswith("of its length, more than stress_limit = 200 MPa")
        assert words[words.index("flexure") + 1] in set("EFGHIJKLM")

    def test_stress_limit_of_the_assur_method(self, assur):
        answers = assur.evaluate(np.array([TOO_FAR, FINE]))
        assert answers.status == [Status.REJECTED, Status.OK]
        assert answers.reasons[0] == "bending stress of 250.7 MPa, more than stress_limit = 200 MPa"
        assert answers.reasons[1] == ""

    def test_out_of_reach_is_a_status(self, oracle):
        """Cranks turned against each other by twelve radians; its neighbour in the batch does not suffer."""
        far = np.array([[6.0, -6.0, 6.0, 0.0, 0.0, 0.0], [0.1, 0.1, 0.1, 0.0, 0.0, 0.0]])
        answers = oracle.evaluate(far)
        assert answers.status == [Status.NOT_CONVERGED, Status.OK]
        assert "of the load" in answers.reasons[0]
        assert np.isnan(answers.values[0]).all()
        assert_allclose(answers.values[1], oracle.evaluate(far[1:]).values[0], rtol=0, atol=0)


class TestParameters:
    @pytest.mark.parametrize(
        ("given", "message"),
        [
            ({"method": "fea"}, "method must be one of beams, assur, got 'fea'"),
            ({"thickness": 0.0}, "thickness must be positive, got 0.0"),
            ({"young": -7e10}, "young must be positive, got -70000000000.0"),
            ({"base": 1.0}, "a leg cannot span from base to platform"),
            ({"stress_limit": 0.0}, "stress_limit must be positive, got 0.0"),
        ],
    )
    def test_refused(self, given, message):
        with pytest.raises(ValueError, match=message):
            oracles.get("flexure_3rrr", **given)

    @pytest.mark.parametrize(
        ("given", "message"),
        [({"n_steps": 3}, "n_steps must be an even number from 4 on, got 3"), ({"poisson": 0.6}, "poisson must lie")],
    )
    def test_refused_before_the_first_run(self, given, message):
        with pytest.raises(ValueError, match=message):
            oracles.get("flexure_3rrr", **given).prepare()

    def test_frame_has_the_joints_of_the_thesis(self, oracle):
        """Section 1.1.5.2, printed to 0.01 mm: the distal ends of the flexures at the base."""
        printed = {1: (-41.74, -34.51), 2: (50.76, -18.90), 3: (-9.01, 53.40)}
        for leg, place in printed.items():
            assert_allclose(1e3 * np.array(oracle.frame.nodes[f"crank in{leg}"][:2]), place, atol=0.0051)
        assert_allclose(oracle.rest_angles, [-0.599365, 1.495030, 3.589425], atol=1e-6)

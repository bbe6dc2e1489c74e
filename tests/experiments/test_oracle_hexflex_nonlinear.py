"""The HexFlex with large displacements, against an independent solver, the linear oracle and itself.

One instance answers for the whole module, since compiling it takes ten seconds. Its stress limit is so low
that it rejects all but rest: a rejected point keeps its values, and says where its largest stress is.
"""

import json
import re
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from experiments import Status, Terms, model_matrix, oracles
from experiments.designs import Design, Random
from experiments.fea import factorise

REFERENCE = Path(__file__).parents[1] / "reference"
PEER = json.loads((REFERENCE / "opensees_hexflex.json").read_text(encoding="utf-8"))
SECOND_ORDER = json.loads((REFERENCE / "hexflex" / "second_order.json").read_text(encoding="utf-8"))
LIMIT = 1e4
RESPONSES = ("x", "y", "z", "theta_x", "theta_y", "theta_z")
REST = np.zeros((1, 6))


@pytest.fixture(scope="module")
def oracle():
    return oracles.get("hexflex", kinematics="nonlinear", stress_limit=LIMIT)


@pytest.fixture(scope="module")
def slope():
    """The linear oracle's map, (6, 6)."""
    return oracles.get("hexflex").jacobian(REST)[0]


@pytest.fixture(scope="module")
def runs(oracle):
    """600 random runs within ±1 N: forces and poses."""
    forces = Random(600).generate(oracle.factors, rng=2012).physical
    return forces, oracle.evaluate(forces).values


@pytest.fixture(scope="module")
def second(oracle):
    """Second derivatives at rest, (response, factor, factor), by differences of the Jacobian that cancel to h⁴."""
    h = 1e-2
    steps = h * np.vstack([np.eye(6), -np.eye(6), 2 * np.eye(6), -2 * np.eye(6)])
    near, back, far, far_back = oracle.jacobian(steps).reshape(4, 6, 6, 6)
    return ((8 * (near - back) - (far - far_back)) / (12 * h)).transpose(1, 2, 0)


def fitted(runs, degree):
    """Coefficients of a polynomial by least squares, and the share of each standard deviation that it leaves."""
    forces, poses = runs
    terms = Terms.polynomial(tuple(oracles.get("hexflex").factors.names), degree)
    matrix = model_matrix(terms, forces)
    coefficients = np.linalg.lstsq(matrix, poses, rcond=None)[0]
    return dict(zip(terms.labels, coefficients, strict=True)), (poses - matrix @ coefficients).std(0) / poses.std(0)


class TestSmallLoads:
    def test_jacobian_at_rest_is_the_linear_map(self, oracle, slope):
        away = np.abs(oracle.jacobian(REST)[0] - slope).max(1)
        assert (away < 1e-11 * np.abs(slope).max(1)).all()

    def test_odd_part_of_small_answers_is_the_linear_map(self, oracle, slope):
        """At 1 mN what is of second order is 1e-4 of the answer; it cancels between a load and its opposite."""
        h = 1e-3
        values = oracle.evaluate(h * np.vstack([np.eye(6), -np.eye(6)])).values.reshape(2, 6, 6)
        odd = (values[0] - values[1]).T / (2 * h)
        assert (np.abs(odd - slope).max(1) < 1e-6 * np.abs(slope).max(1)).all()

    @pytest.mark.parametrize("force", [1e-2, 1e-4, 1e-5, 1e-6, 1e-8])
    def test_smaller_and_smaller(self, oracle, slope, force):
        """Second order falls with the force, rounding grows against it, and none is too small to be answered."""
        points = force * Random(20).generate(oracle.factors, rng=1).coded
        expected = points @ slope.T
        away = np.abs(oracle.evaluate(points).values - expected).max(0) / np.abs(expected).max(0)
        assert (away < 0.4 * force + 1e-13 / force).all()

    def test_rest_stays_at_rest(self, oracle):
        assert_allclose(oracle.evaluate(REST).values, 0.0, atol=1e-15)


class TestVerification:
    """Against OpenSeesPy, corotational beams extrapolated in mesh size and platform stiffness."""

    def test_poses(self, oracle, runs):
        """In standard deviations within ±1 N; what is left is the error of eight steps along each leg, of fourth order,
        and of the peer's own elements: 7e-6 at 1 N and 3e-5 at 2 N, see the README beside its numbers.
        """
        std = runs[1].std(0)
        found = oracle.evaluate(np.array(PEER["forces"])).values
        away = np.abs(found - PEER["timoshenko"]["pose"]) / std
        assert away[:20].max() < 4e-5
        assert away[20:].max() < 2e-4  # ±2 N
        assert (np.array(PEER["timoshenko"]["estimated_error"]) / std).max() < 1e-6

    @pytest.mark.parametrize("response", SECOND_ORDER["coefficients"])
    def test_second_order(self, runs, response):
        """Coefficients of a quadratic fitted over ±1 N, which is how they were found; asked for 5 %, kept to 2 %."""
        row = RESPONSES.index(response)
        found, _ = fitted(runs, 2)
        for product, theirs in SECOND_ORDER["coefficients"][response].items():
            assert_allclose(1e6 * found[product][row], theirs, rtol=0.02, err_msg=product)

    def test_second_order_at_rest(self, runs, second):
        """Taylor's coefficients are the same to 3 %: the products are physics, not the fit."""
        found, _ = fitted(runs, 2)
        names = oracles.get("hexflex").factors.names
        for response, products in SECOND_ORDER["coefficients"].items():
            row = RESPONSES.index(response)
            for product in products:
                i, j = (names.index(n) for n in product.replace("^2", ":" + product[:4]).split(":"))
                taylor = second[row, i, j] * (0.5 if i == j else 1.0)
                assert_allclose(taylor, found[product][row], rtol=0.035, err_msg=product)

    def test_second_derivatives_commute(self, second):
        size = np.abs(second).max((1, 2), keepdims=True)
        assert_allclose(second / size, second.transpose(0, 2, 1) / size, atol=1e-8)

    def test_what_the_best_linear_map_leaves(self, runs):
        """Loosely: 19 % of x and y, 12 % of θz, 1.1 to 1.4 % of the others, each within a tenth."""
        _, left = fitted(runs, 1)
        for share, (response, published) in zip(
            left[[0, 1, 5, 2, 3, 4]], SECOND_ORDER["left_by_the_best_linear_map"].items(), strict=True
        ):
            low, high = np.broadcast_to(published, 2)
            assert 0.9 * low < share < 1.1 * high, response

    def test_what_a_quadratic_leaves(self, runs):
        _, left = fitted(runs, 2)
        low, high = SECOND_ORDER["left_by_the_full_quadratic"]
        assert 0.9 * low < left.min()
        assert left.max() < 1.1 * high


class TestSymmetry:
    def test_a_third_of_a_turn(self, oracle, runs):
        """The mechanism looks the same turned by 120°: T1 comes to lie on T3, T3 on T2 and T2 on T1."""
        forces, poses = runs[0][:20], runs[1][:20]
        # T1D1 comes to lie on T3D1, but T3D1 and T2D1 on the opposites of T2D1 and T1D1.
        turned = oracle.evaluate(forces[:, [2, 3, 4, 5, 0, 1]] * [-1, 1, -1, 1, 1, 1]).values
        third = Rotation.from_rotvec([0.0, 0.0, 2 * np.pi / 3])
        assert_allclose(turned[:, :3], third.apply(poses[:, :3]), atol=1e-11)
        before, after = (Rotation.from_euler("XYZ", p[:, 3:]) for p in (poses, turned))
        assert_allclose(after.as_matrix(), (third * before * third.inv()).as_matrix(), atol=1e-9)


class TestJacobian:
    def test_against_central_differences(self, oracle):
        points = np.random.default_rng(1).uniform(-0.9, 0.9, (4, 6))
        h = 1e-2
        steps = h * np.vstack([np.eye(6), -np.eye(6), 2 * np.eye(6), -2 * np.eye(6)])
        values = oracle.evaluate((points[:, None] + steps).reshape(-1, 6)).values.reshape(4, 4, 6, 6)
        near, back, far, far_back = np.moveaxis(values, 1, 0)
        differences = ((8 * (near - back) - (far - far_back)) / (12 * h)).transpose(0, 2, 1)
        away = np.abs(oracle.jacobian(points) - differences).max(2) / np.abs(differences).max(2)
        assert away.max() < 1e-6


class TestStress:
    """Of a rest that is never rejected, and of 1 mN, where the linear solver knows the stresses."""

    def test_no_load_no_stress(self, oracle):
        answers = oracle.evaluate(REST)
        assert answers.status == [Status.OK]
        assert answers.reasons == [""]

    def test_rejects_and_names_member_and_place(self, oracle):
        point = 1e-3 * np.array([[0.3, -0.2, 0.1, 0.5, -0.4, 0.25]])
        answers = oracle.evaluate(point)
        assert answers.status == [Status.REJECTED]
        linear = oracles.get("hexflex")
        stress = factorise(linear.frame).solve(np.tensordot(point, linear._unit_loads, 1)).stress()
        member = int(stress.bending[0].argmax())
        name, place = linear.frame.members[member].name, stress.place[0, member]
        said = answers.reasons[0]
        assert re.fullmatch(
            rf"bending stress of [\d.]+ MPa in {name} at {place:.0%} of its length, more than stress_limit = 0.01 MPa",
            said,
        )
        assert_allclose(float(said.split()[3]) * 1e6, stress.bending[0, member], rtol=2e-3)

    def test_of_a_whole_design(self, oracle):
        design = Design(oracle.factors, np.vstack([REST, np.ones((1, 6))]), "two")
        runs = oracle(design)
        assert runs.status == (Status.OK, Status.REJECTED)
        assert "1 of 2 runs failed: run 2: rejected (bending stress of" in runs.failures()


class TestParameters:
    @pytest.mark.parametrize(
        ("given", "message"),
        [
            ({"kinematics": "quadratic"}, "kinematics must be one of linear, nonlinear, got 'quadratic'"),
            ({"stress_limit": 1e8}, "stress_limit needs kinematics = 'nonlinear'"),
            ({"stress_limit": 0.0, "kinematics": "nonlinear"}, "stress_limit must be positive, got 0.0"),
            ({"thickness": 0.0}, "thickness must be positive, got 0.0"),
            ({"young": -1.0}, "young must be positive, got -1.0"),
        ],
    )
    def test_refused(self, given, message):
        with pytest.raises(ValueError, match=message):
            oracles.get("hexflex", **given)

    @pytest.mark.parametrize("n_steps", [0, 3, -2])
    def test_number_of_steps_is_refused_before_the_first_run(self, n_steps):
        with pytest.raises(ValueError, match=f"n_steps must be an even number from 4 on, got {n_steps}"):
            oracles.get("hexflex", kinematics="nonlinear", n_steps=n_steps).prepare()

    def test_published_is_for_the_thesis_model_only(self):
        assert oracles.get("hexflex").published is not None
        for other in ({"kinematics": "nonlinear"}, {"width": 0.002}, {"load_radius": 0.02}):
            assert oracles.get("hexflex", **other).published is None

    def test_says_what_it_leaves_out(self):
        assert "Linear finite elements" in oracles.get("hexflex").limits
        assert "inear finite elements" not in oracles.get("hexflex", kinematics="nonlinear").limits

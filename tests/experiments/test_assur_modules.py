"""Steps 1 and 2 of the Assur-group method, module by module, against closed forms."""

import cmath
import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from experiments.assur import Dyad, Flexure, Leaf, Load, Mechanism, Settings, flexure_3rrr, flexure_four_bar
from experiments.assur.acceleration import Anderson
from experiments.assur.batch import solve_each
from experiments.assur.iteration import iterate, one_pass, sound
from experiments.assur.kinematics import flexure_rotations, modular_kinematics, rest_poses
from experiments.assur.layout import layout, wrenches
from experiments.assur.statics import modular_statics

LEAF = Leaf(width=0.005, thickness=0.0001, young=70e9)
SHORT = 1e-6  # m; so short a flexure is a pin
TURNS = np.linspace(-0.5, 0.6, 7)


def rigid(mechanism, turns):
    """Step 1 with straight flexures."""
    lay = layout(mechanism)
    turns = np.atleast_2d(turns)
    tips = np.tile(lay.length + 0j, (len(turns), 1))
    return lay, modular_kinematics(lay, tips, turns, rest_poses(lay, len(turns)))


# ---- Step 1 ----


def test_driving_link_turns_about_its_joint():
    mechanism = flexure_four_bar((0, 0), (0, 0.03), (0.05, 0.04), (0.06, 0), LEAF, SHORT)
    _, poses = rigid(mechanism, TURNS[:, None])
    assert_allclose(poses.joints[:, 0], SHORT / 2 * 1j, atol=1e-15)
    assert_allclose(poses.turn[:, 1], TURNS)
    assert_allclose(poses.joints[:, 1], 0.03j * np.exp(1j * TURNS), atol=2 * SHORT)


def test_parallelogram_keeps_its_coupler_level():
    """Away from rest too, the dyad stays in its mode: the crossed one would turn the coupler."""
    mechanism = flexure_four_bar((0, 0), (0, 0.03), (0.05, 0.03), (0.05, 0), LEAF, SHORT)
    _, poses = rigid(mechanism, TURNS[:, None])
    assert_allclose(poses.turn[:, 2], 0, atol=2e-4)
    assert_allclose(poses.turn[:, 3], TURNS, atol=2e-4)


def test_four_bar_angle_by_freudenstein():
    """K1 cos φ − K2 cos θ + K3 = cos(θ − φ). Source: Freudenstein, Trans. ASME 77 (1955) 853–861."""
    ground, crank, coupler, rocker = 0.06, 0.02, 0.05, 0.04
    rest = math.radians(60)
    tip = cmath.rect(crank, rest)
    span = abs(tip - ground)
    foot = (span**2 + rocker**2 - coupler**2) / (2 * span)
    toward = (tip - ground) / span
    top = ground + toward * (foot - 1j * math.sqrt(rocker**2 - foot**2))
    mechanism = flexure_four_bar((0, 0), (tip.real, tip.imag), (top.real, top.imag), (ground, 0), LEAF, SHORT)
    _, poses = rigid(mechanism, TURNS[:, None])
    theta, phi = rest + TURNS, cmath.phase(top - ground) + poses.turn[:, 3]
    k3 = (crank**2 - coupler**2 + rocker**2 + ground**2) / (2 * crank * rocker)
    assert_allclose(ground / crank * np.cos(phi) - ground / rocker * np.cos(theta) + k3, np.cos(theta - phi), atol=1e-3)
    assert np.ptp(phi) > 0.3


@pytest.mark.parametrize("turn", [-0.2, 0.1, 0.25])
def test_triad_with_equal_cranks_turns_on_the_spot(turn):
    """By symmetry the platform stays centred; its angle follows from the triangle O H K."""
    lay, poses = rigid(flexure_3rrr(), [turn] * 3)
    assert_allclose(poses.shift[:, 4], 0, atol=1e-15)
    knee, radius, reach = abs(poses.joints[0, 1]), 0.04 / math.sqrt(3), 0.04
    opening = math.acos((knee**2 + radius**2 - reach**2) / (2 * knee * radius))
    before = cmath.phase(lay.joint[2] / lay.joint[1])
    corner = cmath.phase(poses.joints[0, 1]) + math.copysign(opening, before)
    assert_allclose(poses.turn[0, 4], corner - cmath.phase(lay.joint[2]), rtol=1e-12)
    assert poses.kept.all()


def test_triad_closes_at_unequal_cranks():
    turns = np.random.default_rng(0).uniform(-0.3, 0.3, (50, 3))
    lay, poses = rigid(flexure_3rrr(), turns)
    assert poses.gap.max() < 1e-15
    for first, second in ((1, 2), (4, 5), (7, 8)):
        rest = abs(lay.joint[first] - lay.joint[second])
        assert_allclose(np.abs(poses.joints[:, first] - poses.joints[:, second]), rest, rtol=1e-12)


def test_flexure_rotation_is_that_of_its_joint_against_its_clamp():
    """Eq. 1.3, and Θ sums up to the platform's turn along each leg."""
    lay, poses = rigid(flexure_3rrr(), [0.2, -0.1, 0.05])
    theta = flexure_rotations(lay, poses)[0]
    assert_allclose(theta[[0, 3, 6]], [0.2, -0.1, 0.05])
    assert_allclose(theta.reshape(3, 3).sum(axis=1), poses.turn[0, 4], rtol=1e-12)


def test_a_dyad_out_of_reach_leaves_a_gap():
    mechanism = flexure_four_bar((0, 0), (0, 0.03), (0.05, 0.04), (0.09, 0), LEAF, SHORT)
    _, poses = rigid(mechanism, [[0.0], [1.5]])
    assert poses.gap[0].max() < 1e-15
    assert poses.gap[1].max() > 1e-3


def test_a_triad_started_in_its_other_mode_is_told():
    """At rest the platform can also stand mirrored at the lines from its centre to the knees."""
    mechanism = flexure_3rrr()
    lay = layout(mechanism)
    before = iterate(lay, np.zeros((1, 3)), (), Settings())
    assert before.converged.all()
    before.last.poses.turn[:, 4] = other = 2 * cmath.phase(lay.joint[1] / lay.joint[2])
    straight = lay.length[None] + 0j
    same, mirrored = (
        one_pass(lay, straight, np.zeros((1, 9)), np.zeros((1, 3)), (), Settings(), start)
        for start in (None, before.last)
    )
    assert_allclose(mirrored.poses.turn[0, 4], other, rtol=1e-9)
    assert mirrored.poses.gap.max() < 1e-12
    assert mirrored.poses.kept.tolist() == [[True, True, True, False]]
    assert sound(lay, same).tolist() == [True]
    assert sound(lay, mirrored).tolist() == [False]


# ---- Step 2 ----


def arch() -> Mechanism:
    """A three-hinged arch, span 0.2 m, rise 0.05 m."""
    flexures = (
        Flexure("left", "ground", "a", (-0.1 - SHORT, 0), (-0.1, 0), LEAF),
        Flexure("top", "a", "b", (-SHORT, 0.05), (0, 0.05), LEAF),
        Flexure("right", "ground", "b", (0.1 + SHORT, 0), (0.1, 0), LEAF),
    )
    return Mechanism(flexures, (Dyad("a", "b"),))


def statics(mechanism, loads, moments=None):
    lay = layout(mechanism)
    poses = rest_poses(lay, 1)
    moments = np.zeros((1, len(lay.length))) if moments is None else np.array([moments], float)
    return lay, poses, *modular_statics(lay, poses, moments, wrenches(mechanism, loads, 1))


def test_thrust_of_a_three_hinged_arch():
    """A load P on the top: P/2 upward and P span / 4 rise inward at each foot."""
    _, _, forces, torques = statics(arch(), [Load("a", (0, -8.0), (0, 0.05))])
    on_arch = -forces[0]  # tip forces act on the flexure; the feet push the arch
    assert_allclose(on_arch[0], 8.0 + 4.0j, rtol=1e-12)
    assert_allclose(on_arch[2], -8.0 + 4.0j, rtol=1e-12)
    assert torques.shape == (1, 0)


def test_flexure_moments_enter_the_balance():
    """Equal and opposite moments of the feet on the arch's halves change the thrust by M / rise."""
    _, _, forces, _ = statics(arch(), [], [0.1, 0.0, -0.1])
    assert_allclose(np.abs(forces[0]), 0.1 / 0.05, rtol=1e-12)
    assert_allclose(forces[0].imag, 0, atol=1e-12)


def test_crank_torque_balances_a_couple():
    """A couple on the coupler of a parallelogram is carried by the ground joints, not by the drive."""
    mechanism = flexure_four_bar((0, 0), (0, 0.03), (0.05, 0.03), (0.05, 0), LEAF, SHORT)
    _, _, _, torque = statics(mechanism, [Load("coupler", moment=1.0)])
    assert_allclose(torque, 0, atol=2e-4)
    _, _, _, torque = statics(mechanism, [Load("coupler", force=(2.0, 0.0), at=(0.02, 0.03))])
    assert_allclose(torque, 2.0 * 0.03, rtol=1e-4)


def test_triad_forces_hold_every_link():
    loads = [Load("platform", (-0.4, 0.1), (0.01, 0.0)), Load("coupler2", (0.2, 0.3), (0.03, -0.04), 0.01)]
    moments = np.linspace(-1e-3, 2e-3, 9)
    lay, poses, forces, torques = statics(flexure_3rrr(), loads, moments)
    push, spin = np.zeros(8, complex), np.zeros(8)
    for load in loads:
        link = flexure_3rrr().links.index(load.link)
        push[link] += complex(*load.force)
        spin[link] += np.cross([*load.at, 0], [*load.force, 0])[2] + load.moment
    for k in range(9):
        about = (poses.joints[0, k].conj() * forces[0, k]).imag
        for link, sign in ((lay.clamped[k], 1), (lay.jointed[k], -1)):
            push[link] += sign * forces[0, k]
            spin[link] += sign * (about + moments[k])
    spin[1:4] += torques[0]
    assert_allclose(push[1:], 0, atol=1e-14)
    assert_allclose(spin[1:], 0, atol=1e-15)


# ---- Helpers ----


def test_a_singular_system_spoils_no_other():
    matrices = np.array([np.eye(2), np.zeros((2, 2)), 2 * np.eye(2)])
    found = solve_each(matrices, np.ones((3, 2)))
    assert_allclose(found[[0, 2]], [[1, 1], [0.5, 0.5]])
    assert np.isnan(found[1]).all()


def test_anderson_finds_the_fixed_point_of_a_linear_map():
    """With a memory as long as the state it ends like a Krylov method; the plain iteration is far away."""
    rng = np.random.default_rng(0)
    maps, shift = rng.normal(size=(4, 3, 3)) / 3, rng.normal(size=(4, 3))
    exact = np.linalg.solve(np.eye(3) - maps, shift[..., None])[..., 0]

    def error(memory):
        x, anderson = np.zeros((4, 3)), Anderson(memory, 1.0)
        for _ in range(5):
            x = anderson.next(x, (maps @ x[..., None])[..., 0] + shift - x)
        return np.abs(x - exact).max()

    assert error(3) < 1e-5
    assert error(0) > 1e-3

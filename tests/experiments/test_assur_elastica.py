"""Step 3 of the Assur-group method: the boundary value problem of a leaf, against the elastica."""

import json
import math
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

from experiments.assur import deflect
from experiments.assur.elastica import gauss, integrals_to, moments_along

REFERENCE = json.loads((Path(__file__).parents[1] / "reference" / "assur_elastica.json").read_text(encoding="utf-8"))
CASES = sorted(REFERENCE["values"].items(), key=lambda item: float(item[0]))


def leaf(rotation, force, **kwargs):
    """A leaf of unit length and stiffness."""
    return deflect(np.atleast_1d(rotation), np.atleast_1d(force).astype(complex), 1.0, 1.0, **kwargs)


@pytest.mark.parametrize(("alpha", "exact"), CASES)
def test_cantilever_under_a_transverse_load(alpha, exact):
    """Given the exact tip rotation, the tip moment of a cantilever vanishes. Elliptic integrals; Mattiasson 1981."""
    found = leaf(exact["exact_theta"], 1j * float(alpha))
    assert found.solved.all()
    assert_allclose(found.moment, 0, atol=1e-11)
    assert_allclose(found.tip, 1 - exact["exact_u_L"] + 1j * exact["exact_w_L"], atol=1e-11)
    assert_allclose(found.root_moment, float(alpha) * (1 - exact["exact_u_L"]), rtol=1e-11)


@pytest.mark.parametrize("turn", [0.0, -0.4, 1.5, math.pi])
def test_end_moment_bends_a_circular_arc(turn):
    found = leaf(turn, 0.0)
    assert_allclose([found.moment, found.root_moment], turn, atol=1e-13)
    assert_allclose(found.tip, (np.exp(1j * turn) - 1) / (1j * turn) if turn else 1.0, atol=1e-13)


def test_small_deflections_are_those_of_the_linear_cantilever():
    """Clamped tip pushed sideways: M = −F/2 L, v = F L³ / 12 E I."""
    found = leaf(0.0, 1e-4j)
    assert_allclose(found.moment, -0.5e-4, rtol=1e-8)
    assert_allclose(found.tip.imag, 1e-4 / 12, rtol=1e-8)


@pytest.mark.parametrize("force", [0.8 + 0.3j, -2.0 + 1.0j, 5j])
def test_tip_moment_balances_the_clamp(force):
    """Equilibrium of the leaf as a whole: M_root = M + u Fy − v Fx, eq. 1.5 at s = 0."""
    found = leaf(0.5, force)
    assert_allclose(found.root_moment, found.moment + (found.tip.conj() * force).imag, rtol=1e-12)


def test_error_falls_spectrally():
    exact = leaf(0.7, 3 - 4j, nodes=30)
    errors = [abs(leaf(0.7, 3 - 4j, nodes=p).tip - exact.tip)[0] for p in (3, 5, 7, 9)]
    assert all(after < before / 50 for before, after in pairwise(errors)), errors


def test_tail_warns_of_too_few_nodes():
    rough, fine = leaf(0.5, 100j, nodes=6), leaf(0.5, 100j, nodes=24)
    assert rough.tail > 1e-2
    assert fine.tail < 1e-5
    assert abs(rough.tip - fine.tip) > 1e-5


def test_axial_stretch_is_that_of_a_bar():
    found = leaf(0.0, 2.0, axial=1e3)
    assert_allclose(found.tip, 1 + 2e-3, rtol=1e-12)
    assert_allclose(leaf(0.0, 2.0).tip, 1.0, rtol=1e-14)


@pytest.mark.parametrize("axial", [30.0, 1e4])
def test_stretched_leaf_is_in_equilibrium(axial):
    """Moments of the whole leaf about its clamp, eq. 1.5 at s = 0, with tip places on the stretched line."""
    found = leaf(0.5, -2.0 + 3.0j, axial=axial, nodes=16)
    assert_allclose(found.root_moment, found.moment + (found.tip.conj() * (-2.0 + 3.0j)).imag, rtol=1e-10)


def test_moments_along_run_from_clamp_to_tip():
    """At each station they are M + Fy (u − x) − Fx (v − y), eq. 1.5."""
    force = np.array([1.0 - 3.0j])
    found = leaf(0.6, force)
    along = moments_along(found, force, np.array([1.0]), np.array([1.0]))[0]
    place = integrals_to(np.linspace(-1, 1, 33), 12) @ np.exp(1j * found.angles[0])
    assert_allclose(along, found.moment + (np.conj(found.tip - place) * force).imag, atol=1e-9)
    assert_allclose(along[[0, -1]], [found.root_moment[0], found.moment[0]], rtol=1e-12)


def test_leaves_are_independent_and_scale():
    """Doubled length, tripled stiffness, many at once: the same shape under the same dimensionless load."""
    turns, forces = np.array([[0.2, -0.3], [0.5, 0.0]]), np.array([[1.0, 1j], [0.5 - 1j, 2j]])
    many = deflect(turns, forces * 3 / 4, np.array(2.0), np.array(3.0))
    for index in np.ndindex(2, 2):
        one = leaf(turns[index], forces[index])
        assert_allclose(many.tip[index], 2 * one.tip[0], rtol=1e-13)
        assert_allclose(many.moment[index], 1.5 * one.moment[0], rtol=1e-12, atol=1e-14)


def test_a_leaf_that_fails_spoils_no_other():
    found = deflect(np.array([0.3, np.nan, 0.3]), np.array([1j, 1j, -1e9 + 1j]), 1.0, 1.0)
    assert (found.solved & (found.tail < 1e-3)).tolist() == [True, False, False]
    assert_allclose(found.tip[0], leaf(0.3, 1j).tip[0], rtol=1e-14)


def test_rule_integrates_polynomials():
    rule = gauss(5)
    assert_allclose(rule.integrals @ rule.nodes**4, rule.nodes**5 / 5, atol=1e-16)
    assert_allclose(rule.weights @ rule.nodes**9, 0.1, rtol=1e-13)

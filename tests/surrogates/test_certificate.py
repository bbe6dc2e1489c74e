"""The certificate claims only what is proven, and a refutation shows its witness."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from surrogates import Verdict, certify
from tests.surrogates.cases import NONLINEAR, block_map, constant, hexflex_like, overdetermined, surrogate, unit_box


@pytest.mark.parametrize("build", [hexflex_like, block_map, overdetermined])
def test_affine_of_full_column_rank_is_certified(build):
    model = build()
    certificate = certify(model)
    scaled = model.jacobian_coded(np.zeros((1, len(model.factors))))[0] / model.scale[:, None]
    assert certificate.verdict is Verdict.CERTIFIED
    assert certificate.condition == pytest.approx(np.linalg.cond(scaled), rel=1e-12)
    assert certificate.witness == ()
    assert f"{certificate.condition:.3g}" in certificate.reason


@pytest.mark.parametrize("seed", range(20))
def test_random_square_maps_are_certified_with_numpy_s_condition(seed):
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 7))
    names = [f"f{i}" for i in range(n)]
    model = surrogate(unit_box(n), names, rng.normal(size=(n, n)) * 10.0 ** rng.uniform(-9, 3, (n, 1)))
    certificate = certify(model)
    assert certificate.verdict is Verdict.CERTIFIED
    assert certificate.condition == pytest.approx(np.linalg.cond(model.coefficients.T / model.scale[:, None]), rel=1e-9)


def lost_rank(seed):
    """A map of random shape whose rank is below its number of factors."""
    rng = np.random.default_rng(seed)
    n, m = int(rng.integers(2, 7)), int(rng.integers(1, 7))
    rank = int(rng.integers(1, min(n - 1, m) + 1))
    slope = rng.normal(size=(m, rank)) @ rng.normal(size=(rank, n))
    rows = np.column_stack([rng.normal(size=m), slope]) * 10.0 ** rng.uniform(-9, 3, (m, 1))
    return surrogate(unit_box(n), ["1", *(f"f{i}" for i in range(n))], rows)


@pytest.mark.parametrize("seed", range(20))
def test_lost_rank_is_refuted_with_a_direction_that_changes_nothing(seed):
    model = lost_rank(seed)
    certificate = certify(model)
    assert certificate.verdict is Verdict.REFUTED
    assert certificate.condition is None
    witness = np.array(certificate.witness)
    assert witness.shape == (len(model.factors),)
    assert np.linalg.norm(witness) == pytest.approx(1.0)
    along = np.linspace(-1.0, 1.0, 11)[:, None] / np.abs(witness).max() * witness  # from face to face of the box
    change = (model.predict_coded(along) - model.predict_coded(0.0 * along)) / model.scale
    assert_allclose(change, 0.0, atol=1e-13)


def test_a_wide_map_of_full_row_rank_is_refuted():
    model = surrogate(unit_box(3), ["f0", "f1", "f2"], [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    certificate = certify(model)
    assert certificate.verdict is Verdict.REFUTED
    assert_allclose(np.abs(certificate.witness), [0.0, 0.0, 1.0], atol=1e-12)


def test_a_constant_model_is_refuted():
    assert certify(constant()).verdict is Verdict.REFUTED


@pytest.mark.parametrize(("gap", "verdict"), [(1e-6, Verdict.CERTIFIED), (1e-13, Verdict.REFUTED)])
def test_rank_is_judged_with_a_margin_above_rounding(gap, verdict):
    model = surrogate(unit_box(2), ["f0", "f1"], [[1.0, 1.0], [1.0, 1.0 + gap]])
    assert certify(model).verdict is verdict


VERDICTS = {
    "square_quadratic": Verdict.CERTIFIED,
    "cantilever_like": Verdict.REFUTED,  # two responses of four factors
    "quintic": Verdict.CERTIFIED,
    "dead_parts": Verdict.REFUTED,  # a response that does not move
    "many": Verdict.REFUTED,  # three responses of five factors
    "more_responses": Verdict.CERTIFIED,
    "folded": Verdict.REFUTED,
    "dependent": Verdict.UNDECIDED,  # of rank two but for rounding in its coefficients
}


@pytest.mark.parametrize("name", NONLINEAR)
def test_verdicts_of_nonlinear_models(name):
    assert certify(NONLINEAR[name]()).verdict is VERDICTS[name]


def test_claim_names_the_domain():
    assert "in the domain" in certify(hexflex_like()).claim

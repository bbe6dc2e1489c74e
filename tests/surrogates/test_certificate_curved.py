"""Certificates of curved maps: maps on both sides of the line, and what a certificate promises, tried out."""

from fractions import Fraction
from functools import lru_cache
from itertools import pairwise

import numpy as np
import pytest
from numpy.testing import assert_allclose

from experiments import Terms
from surrogates import Verdict, certify
from surrogates.derivatives import jacobian_tensor
from surrogates.enclosures import Ball, control, product, to_bernstein
from surrogates.injectivity import contraction_rate, is_definite
from tests.surrogates.cases import NONLINEAR, box, surrogate, unit_box


def one(*terms_and_coefficients):
    terms, coefficients = zip(*terms_and_coefficients, strict=True)
    return surrogate(unit_box(1), terms, [coefficients])


def plane(terms, *rows):
    return surrogate(unit_box(2), terms, rows)


def cube(epsilon: float):
    """x³ + εx: injective for every ε ≥ 0, with a singular point at ε = 0, folded below."""
    return one(("f0", epsilon), ("f0^3", 1.0))


def edge(slope: float):
    """x + slope·x²/2: the derivative 1 + slope·x is zero on the face of the box where slope = ±1."""
    return one(("f0", 1.0), ("f0^2", slope / 2.0))


def squared(centre: float, reach: float):
    """z² on the square of half side `reach` about (centre, 0), in coded units: folded if it meets its mirror."""
    u, v = ("f0", "f1")
    return plane(
        ["1", u, v, f"{u}^2", f"{v}^2", f"{u}:{v}"],
        [centre**2, 2 * centre * reach, 0.0, reach**2, -(reach**2), 0.0],
        [0.0, 0.0, 2 * centre * reach, 0.0, 0.0, 2 * reach**2],
    )


def spiral(height: float, degree: int = 5):
    """exp(z) to the 5th order on |x| ≤ 0.1, |y| ≤ height: regular everywhere; beyond height = π it would wind."""
    from math import factorial

    names = Terms.polynomial(("f0", "f1"), degree)
    rows = np.zeros((2, len(names)))
    for k, (i, j) in enumerate(names.exponents):
        value = (0.1**i) * (1j * height) ** j / (factorial(i) * factorial(j))
        rows[:, k] = value.real, value.imag
    return plane(names.labels, *rows)


@pytest.mark.parametrize(
    ("model", "verdict"),
    [
        (cube(1e-3), Verdict.CERTIFIED),
        (cube(0.0), Verdict.REFUTED),
        (cube(-1e-9), Verdict.REFUTED),
        (cube(-1e-3), Verdict.REFUTED),
        (edge(0.999), Verdict.CERTIFIED),
        (edge(-0.999), Verdict.CERTIFIED),
        (edge(1.0), Verdict.REFUTED),
        (edge(1.001), Verdict.REFUTED),
        (squared(1.5, 1.0), Verdict.CERTIFIED),
        (squared(1.01, 1.0), Verdict.CERTIFIED),
        (squared(1.0, 1.0), Verdict.REFUTED),
        (squared(0.5, 1.0), Verdict.REFUTED),
        (spiral(1.0), Verdict.CERTIFIED),
    ],
)
def test_both_sides_of_the_line(model, verdict):
    assert certify(model).verdict is verdict


@pytest.mark.parametrize("exponent", [3, 6, 9, 12, 15])
def test_a_derivative_that_dips_below_zero_by_little_is_never_certified(exponent):
    """The derivative is (x − c)² ± 10^-exponent: above zero it must not be refuted, below not certified."""
    dip = 10.0**-exponent
    c = 0.3
    for sign, wrong in ((1.0, Verdict.REFUTED), (-1.0, Verdict.CERTIFIED)):
        model = one(("f0", c * c + sign * dip), ("f0^2", -c), ("f0^3", 1.0 / 3.0))
        lowest = Fraction(model.coefficients[0, 0]) - Fraction(model.coefficients[1, 0]) ** 2 / (
            3 * Fraction(model.coefficients[2, 0])
        )
        assert (lowest > 0) == (sign > 0)  # of the coefficients as they are in floats
        assert certify(model).verdict is not wrong


def random_map(seed: int):
    """A square map of random size and degree whose curvature straddles what can be certified."""
    rng = np.random.default_rng(seed)
    n, degree = int(rng.integers(1, 5)), int(rng.integers(2, 4))
    terms = Terms.polynomial([f"f{i}" for i in range(n)], degree)
    curved = np.array(terms.degrees) > 1
    rows = rng.normal(size=(n, len(terms))) * np.where(curved, 10.0 ** rng.uniform(-2.0, 0.3), 1.0)
    return surrogate(unit_box(n), terms.labels, rows * 10.0 ** rng.uniform(-6, 3, (n, 1)))


@lru_cache
def certificate_of(seed: int):
    return certify(random_map(seed))


@pytest.mark.parametrize("seed", range(30))
def test_what_is_certified_has_no_counterexample_and_keeps_its_promises(seed):
    """4000 points: no change of the determinant's sign, no two near images, and the promised steps suffice."""
    model = random_map(seed)
    certificate = certificate_of(seed)
    rng = np.random.default_rng(seed)
    points = rng.uniform(-1.0, 1.0, (4000, len(model.factors)))
    signs = np.sign(np.linalg.det(model.jacobian_coded(points) / model.scale[:, None]))
    if certificate.verdict is not Verdict.CERTIFIED:
        assert certificate.verdict is Verdict.REFUTED or (signs == signs[0]).all()
        return
    assert (signs == signs[0]).all()
    if certificate.contraction is None:
        return
    slope = model.jacobian_coded(np.zeros((1, len(model.factors))))[0] / model.scale[:, None]
    for steps, newton in ((certificate.chord_iterations, False), (certificate.newton_iterations, True)):
        found = np.zeros_like(points[:200])
        for _ in range(steps or 0):
            miss = (model.predict_coded(found) - model.predict_coded(points[:200])) / model.scale
            at = (
                model.jacobian_coded(found) / model.scale[:, None]
                if newton
                else np.broadcast_to(slope, (200, *slope.shape))
            )
            found = np.clip(found - np.linalg.solve(at, miss[..., None])[..., 0], -1.0, 1.0)
        if steps:
            assert_allclose(found, points[:200], rtol=0.0, atol=3e-9)
    conditions = np.linalg.cond(model.jacobian_coded(points[:500]) / model.scale[:, None], p=np.inf)
    assert conditions.max() <= certificate.condition


def test_all_verdicts_occur_among_the_random_maps():
    assert {certificate_of(seed).verdict for seed in range(12)} >= {Verdict.CERTIFIED, Verdict.REFUTED}


def test_the_witnesses_of_a_sign_change_have_determinants_of_opposite_signs():
    model = plane(["f0", "f1", "f0^2", "f0:f1"], [1.0, 0.2, 1.0, 0.0], [0.1, 1.0, 0.0, 0.3])
    first, second = np.reshape(certify(model).witness, (2, 2))
    signs = np.linalg.det(model.jacobian_coded(np.array([first, second])))
    assert signs[0] * signs[1] < 0.0


def test_the_sub_box_is_certified_and_a_larger_one_is_not_claimed():
    """x + x² on [−1, 1] folds at −1/2: half of the ranges is the most, and nearly that is proven."""
    certificate = certify(edge(2.0))
    assert certificate.verdict is Verdict.REFUTED
    assert 0.45 <= certificate.sub_box <= 0.5


@pytest.mark.parametrize("name", [n for n in NONLINEAR if n not in ("cantilever_like", "many")])
def test_the_tensor_is_the_jacobian(name):
    """Evaluated at random points, against the model's own Jacobian."""
    model = NONLINEAR[name]()
    n = len(model.factors)
    left = np.random.default_rng(0).normal(size=(n, len(model.responses))) / model.scale
    tensor = jacobian_tensor(model, left)
    for point in np.random.default_rng(1).uniform(-1.0, 1.0, (20, n)):
        value = tensor.mid
        for x in point:
            value = np.tensordot(value, x ** np.arange(value.shape[2]), axes=(2, 0))
        assert_allclose(value, left @ model.jacobian_coded(point[None])[0], rtol=1e-12, atol=1e-12)


def test_control_points_enclose_the_polynomial_and_shrink_with_the_box():
    """(x − 1/3)² on parts of [−1, 1]: exact values lie inside, and the excess falls by the square of the width."""
    power = Ball(np.array([1.0 / 9.0, -2.0 / 3.0, 1.0]), np.full(3, 1e-16))
    excess = []
    for width in (1.0, 0.5, 0.25, 0.125):
        low, high = np.array([-0.5]), np.array([-0.5 + width])
        found = control(power, low, high)
        values = (np.linspace(low, high, 101) - 1.0 / 3.0) ** 2
        assert (found.mid - found.rad).min() <= values.min()
        assert (found.mid + found.rad).max() >= values.max()
        excess.append(values.min() - found.mid.min())
    rates = [a / b for a, b in pairwise(excess) if b > 1e-12]
    assert all(rate > 3.9 for rate in rates)


def test_bernstein_matrices_are_those_of_the_textbook():
    """Farouki and Rajan (1987): 1, t, t² on [0, 1] have the coefficients (1, 1, 1), (0, ½, 1), (0, 0, 1)."""
    assert_allclose(to_bernstein(2, 0.0, 1.0), [[1, 0, 0], [1, 0.5, 0], [1, 1, 1]], rtol=0.0, atol=0.0)


@pytest.mark.parametrize("seed", range(10))
def test_products_of_balls_contain_the_exact_product(seed):
    rng = np.random.default_rng(seed)
    left, mid = rng.normal(size=(4, 6)) * 10.0 ** rng.integers(-8, 8, (4, 6)), rng.normal(size=(6, 3))
    found = product(left, Ball(mid, np.zeros_like(mid)))
    for i in range(4):
        for j in range(3):
            exact = sum(Fraction(float(left[i, k])) * Fraction(float(mid[k, j])) for k in range(6))
            assert abs(exact - Fraction(float(found.mid[i, j]))) <= Fraction(float(found.rad[i, j]))


def sharp(matrix: np.ndarray) -> Ball:
    return Ball(matrix[:, :, None], np.zeros((*matrix.shape, 1)))


@pytest.mark.parametrize(
    ("matrix", "definite"),
    [
        (np.array([[1.0, 5.0], [-5.0, 1.0]]), True),
        (np.array([[1.0, 2.0], [0.0, 1.0]]), False),  # the symmetric part is singular
        (np.array([[1.0, 1.999], [0.0, 1.0]]), True),
        (np.array([[-1.0, 0.0], [0.0, 1.0]]), False),
        (np.array([[np.nan, 0.0], [0.0, 1.0]]), False),
    ],
)
def test_definite_symmetric_parts(matrix, definite):
    assert is_definite(sharp(matrix)) is definite


def test_a_radius_can_spoil_definiteness_and_a_contraction():
    wide = Ball(np.eye(2)[:, :, None], np.full((2, 2, 1), 0.6))
    assert not is_definite(wide)
    assert contraction_rate(wide, np.ones(2)) > 1.0
    assert contraction_rate(sharp(np.eye(2)), np.ones(2)) < 1e-8


def test_ranges_and_scales_do_not_matter():
    """The same coded polynomials in other units: same verdict, same rate."""
    other = surrogate(
        box(("a", 1e-9, 2e-9), ("b", -1e6, 1e6)), ["a", "b", "a^2", "a:b"], [[1e-9, 0, 2e-10, 0], [0, 3e8, 0, 5e7]]
    )
    same = surrogate(unit_box(2), ["f0", "f1", "f0^2", "f0:f1"], [[1, 0, 0.2, 0], [0, 3, 0, 0.5]])
    assert certify(other).contraction == pytest.approx(certify(same).contraction, rel=1e-9)


def test_a_map_too_large_to_try_is_undecided():
    n = 14
    names = [f"f{i}" for i in range(n)]
    terms = [*names, *(f"{name}^2" for name in names)]
    model = surrogate(unit_box(n), terms, np.hstack([np.eye(n), 0.01 * np.eye(n)]))
    certificate = certify(model)
    assert certificate.verdict is Verdict.UNDECIDED
    assert "too many factors" in certificate.reason

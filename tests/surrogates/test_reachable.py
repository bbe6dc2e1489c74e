"""Boxes of responses that may be commanded: known answers, exact checks of every claim, and little is given away.

All is verification: against closed forms, rational arithmetic, a dual bound, or the inverse itself.
"""

import json
from dataclasses import replace
from fractions import Fraction
from functools import lru_cache
from itertools import product

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from experiments import Terms
from surrogates import Verdict, certify, dumps, loads
from surrogates.enclosures import Ball
from surrogates.faces import lowest_affine, lowest_on_face
from surrogates.inscribed import largest_box
from surrogates.reachable import Polytope, _inside, _regular, response_box
from tests.surrogates.cases import (
    block_map,
    constant,
    dead_parts,
    dependent,
    hexflex_like,
    more_responses,
    overdetermined,
    quintic,
    square_quadratic,
    surrogate,
    underdetermined,
    unit_box,
)
from tests.surrogates.test_certificate_curved import cube, edge, random_map, spiral, squared

SEEDS = range(30)
FEW = range(7)
"""Of these the certificate is asked for, which takes longer."""


def affine(slope, offset=None):
    slope = np.asarray(slope, dtype=float)
    n = len(slope)
    offset = np.zeros(n) if offset is None else offset
    return surrogate(unit_box(n), ["1", *(f"f{i}" for i in range(n))], np.column_stack([offset, slope]))


def random_affine(seed):
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 6))
    slope = rng.normal(size=(n, n)) + np.eye(n)
    scale = 10.0 ** rng.uniform(-9, 3, (n, 1))
    return affine(slope * scale, rng.normal(size=n) * scale[:, 0])


def corners(box):
    return np.array(list(product(*box)))


def targets(box, n=2000, seed=0):
    low, high = np.array(box).T
    return np.vstack([corners(box), np.random.default_rng(seed).uniform(low, high, (n, len(box)))])


def restricted(model, reach):
    """The same map on the centred box of that fraction of the ranges, in its own coded units."""
    centre, half = model.factors.centre, reach * model.factors.half_range
    ends = {n: (c - h, c + h) for n, c, h in zip(model.factors.names, centre, half, strict=True)}
    powers = reach ** np.array(model.terms.degrees, dtype=float)
    return replace(model, factors=model.factors.with_ranges(ends), coefficients=model.coefficients * powers[:, None])


def exact_settings(model, target):
    """Coded settings of an affine model at a target, in rationals."""
    n = len(target)
    rows = {tuple(e): Fraction(0) for e in np.eye(n, dtype=int).tolist()}
    table = [[Fraction(float(model.coefficients[model.terms.exponents.index(e), j])) for e in rows] for j in range(n)]
    zero = model.terms.exponents.index((0,) * n)
    table = [
        [*row, Fraction(float(y)) - Fraction(float(model.coefficients[zero, j]))]
        for j, (row, y) in enumerate(zip(table, target, strict=True))
    ]
    for k in range(n):
        pivot = next(i for i in range(k, n) if table[i][k])
        table[k], table[pivot] = table[pivot], table[k]
        table[k] = [v / table[k][k] for v in table[k]]
        for i in range(n):
            if i != k:
                table[i] = [a - table[i][k] * b for a, b in zip(table[i], table[k], strict=True)]
    return [row[-1] for row in table]


def value(model, x):
    """Exact response of a model of one factor at a coded setting."""
    return sum(
        (
            Fraction(float(c)) * Fraction(x) ** e
            for (e,), (c,) in zip(model.terms.exponents, model.coefficients, strict=True)
        ),
        Fraction(0),
    )


# --- affine maps: closed forms -----------------------------------------------------------------------------------


def test_of_a_diagonal_map_the_box_is_its_range():
    slope, offset = np.array([2e-9, -3.0, 5e4]), np.array([1e-9, 0.0, -7e4])
    box, reason = response_box(affine(np.diag(slope), offset))
    expected = np.column_stack([offset - np.abs(slope), offset + np.abs(slope)])
    assert_allclose(box / np.abs(slope)[:, None], expected / np.abs(slope)[:, None], rtol=0.0, atol=1e-7)
    assert "Poincaré and Miranda" in reason


def test_of_a_turned_square_the_box_is_the_one_inscribed_in_the_diamond():
    """y = (a + b, a − b)/√2 reaches |y₁| + |y₂| ≤ √2: sides from −1/√2 to 1/√2."""
    box, _ = response_box(affine(np.array([[1.0, 1.0], [1.0, -1.0]]) / np.sqrt(2.0)))
    assert_allclose(box, np.sqrt(0.5) * np.array([[-1.0, 1.0]] * 2), rtol=1e-7)


def test_a_smaller_reach_scales_the_box_of_an_affine_map():
    model = hexflex_like()
    offset = model.predict_coded(np.zeros((1, 6)))[0][:, None]
    whole, half = ((np.array(response_box(model, r)[0]) - offset) / model.scale[:, None] for r in (1.0, 0.5))
    assert_allclose(half, 0.5 * whole, rtol=0.0, atol=1e-7)


def largest_volume(inverse):
    """Upper bound on Σ log h with |A| h ≤ 1, by duality: Σλ − n − Σ log(|A|ᵀλ) for any λ ≥ 0, here nearly the best."""
    table, n = np.abs(inverse), len(inverse)
    weights = np.ones(n)
    for _ in range(20_000):  # multiplicative updates: the bound falls, the weights keep the sum n
        weights = weights * (table @ (1.0 / (table.T @ weights)))
    return weights.sum() - n - np.log(table.T @ weights).sum()


@pytest.mark.parametrize("seed", SEEDS)
def test_affine_boxes_are_inside_in_exact_arithmetic_and_no_box_is_larger(seed):
    """Corners are solved in rationals, without any tolerance; no box beats the bound of the dual problem."""
    model = random_affine(seed)
    box, _ = response_box(model)
    for corner in corners(box):
        assert all(abs(x) <= 1 for x in exact_settings(model, corner))
    slope = model.jacobian_coded(np.zeros((1, len(box))))[0] / model.scale[:, None]
    ours = np.log(0.5 * np.ptp(np.array(box), axis=1) / model.scale).sum()
    assert ours == pytest.approx(largest_volume(np.linalg.inv(slope)), abs=1e-5)


@pytest.mark.parametrize("seed", SEEDS)
def test_affine_boxes_cannot_grow_without_losing_a_corner(seed):
    model = random_affine(seed)
    low, high = np.array(response_box(model)[0]).T
    middle, half = 0.5 * (low + high), 0.5 * (high - low)
    grown = corners(np.column_stack([middle - 1.001 * half, middle + 1.001 * half]))
    assert not model.invert(grown).ok.all()


@pytest.mark.parametrize("build", [hexflex_like, block_map])
def test_targets_in_the_boxes_of_affine_models_are_all_inverted(build):
    model = build()
    certificate = certify(model)
    assert certificate.factor_box == tuple((f.low, f.high) for f in model.factors)
    assert model.invert(targets(certificate.response_box)).ok.all()


# --- the inscribed box, alone -------------------------------------------------------------------------------------


def test_the_largest_box_in_a_triangle_has_half_its_sides():
    middle, half = largest_box(np.array([[-1.0, 0.0], [0.0, -1.0], [1.0, 1.0]]), np.array([0.0, 0.0, 1.0]))
    assert_allclose(middle, [0.25, 0.25], atol=1e-6)
    assert_allclose(half, [0.25, 0.25], atol=1e-6)


@pytest.mark.parametrize("room", [[-1.0, -1.0, 1.0], [0.0, 0.0, 0.0]])
def test_an_empty_polytope_and_a_point_hold_no_box(room):
    assert largest_box(np.array([[-1.0, 0.0], [0.0, -1.0], [1.0, 1.0]]), np.array(room)) is None


def test_a_box_that_sticks_out_by_one_float_is_not_inside():
    """The exact check alone: sides and ends whose sums round to the room in floats."""
    polytope = Polytope(np.array([[1.0, 2.0**-60], [-1.0, 0.0]]), np.array([1.0, 1.0]))
    low, high = np.array([-1.0, -1.0]), np.array([1.0, 1.0])
    assert not _inside(polytope, np.zeros(2), low, high)  # 1 + 2⁻⁶⁰ is 1 in floats
    assert _inside(polytope, np.zeros(2), low, np.array([1.0, 0.0]))
    assert not _inside(polytope, np.zeros(2), np.array([np.nextafter(-1.0, -2.0), -1.0]), np.array([1.0, 0.0]))


# --- bounds on faces ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("sign", [-1.0, 1.0])
@pytest.mark.parametrize("reach", [1.0, 0.3])
def test_linear_forms_are_bounded_by_their_corners(sign, reach):
    row = np.array([0.25, 1.0, -0.5, 0.125])
    corner = min(row @ c for c in product(*[(-reach, reach)] * 4) if c[1] == sign * reach)
    bound = lowest_affine(Ball(row, np.zeros(4)), 1, sign, reach)
    assert corner - 1e-12 <= bound < corner
    assert lowest_affine(Ball(row, np.full(4, 0.1)), 1, sign, reach) <= corner - 0.4 * reach


def test_a_lowest_value_inside_a_face_is_found_to_the_gap():
    """x + (y − 1/3)² + (z + 1/5)² on the face x = 1: lowest 1, where no control point of the whole face is near."""
    row = np.zeros((3, 3, 3))
    row[1, 0, 0], row[0, 0, 0] = 1.0, 1.0 / 9.0 + 0.04
    row[0, 1, 0], row[0, 2, 0], row[0, 0, 1], row[0, 0, 2] = -2.0 / 3.0, 1.0, 0.4, 1.0
    bound = lowest_on_face(Ball(row, np.zeros_like(row)), 0, 1.0, 1.0)
    assert 0.998 <= bound <= 1.0 + 1e-15
    assert lowest_on_face(Ball(row, np.full(row.shape, 0.01)), 0, 1.0, 1.0) < 1.0 - 0.01


@pytest.mark.parametrize("seed", range(10))
def test_no_value_on_a_face_is_below_its_bound(seed):
    rng = np.random.default_rng(seed)
    row = rng.normal(size=(4, 3, 2))
    points = rng.uniform(-0.7, 0.7, (5000, 3))
    points[:, 2] = 0.7
    points[:64] = np.sign(points[:64]) * 0.7
    values = np.polynomial.polynomial.polyval3d(*points.T, row)
    bound = lowest_on_face(Ball(row, np.zeros_like(row)), 2, 1.0, 0.7)
    assert values.min() - 0.05 <= bound <= values.min() + 1e-12


# --- curved maps --------------------------------------------------------------------------------------------------


NAMED = {
    "square_quadratic": square_quadratic,
    "quintic": quintic,
    "cube": lambda: cube(1e-3),
    "steep at one end": lambda: edge(0.999),
    "squared": lambda: squared(1.5, 1.0),
    "squared, near its mirror": lambda: squared(1.01, 1.0),
    "a sector of a ring": lambda: spiral(1.0),
    **{f"random {seed}": lambda seed=seed: random_map(seed) for seed in FEW},
}


@lru_cache
def named(name):
    model = NAMED[name]()
    return model, certify(model)


@pytest.mark.parametrize("name", NAMED)
def test_every_target_in_the_box_is_reached_within_the_factors_box(name):
    """2000 random ones and all corners; on a sub-box the same map with that sub-box as its domain is asked."""
    model, certificate = named(name)
    if certificate.response_box is None:
        assert certificate.factor_box is None
        return
    here = restricted(model, certificate.sub_box or 1.0)
    low, high = np.array(certificate.factor_box).T
    answer = here.invert(targets(certificate.response_box))
    assert answer.ok.all()
    slack = 2e-9 * (high - low)
    assert ((answer.settings >= low - slack) & (answer.settings <= high + slack)).all()


def test_all_of_these_random_maps_have_a_box():
    assert all(named(f"random {seed}")[1].response_box is not None for seed in FEW)


@pytest.mark.parametrize("seed", SEEDS)
def test_what_is_claimed_of_any_map_has_a_setting_even_where_it_folds(seed):
    """Existence does not rest on injectivity: faces of the whole domain, whatever the verdict."""
    model = random_map(seed)
    box, _ = response_box(model)
    if box is not None:
        assert model.invert(targets(box, n=200)).ok.all()


def test_some_of_these_maps_fold_and_have_a_box():
    folded = [seed for seed in FEW if named(f"random {seed}")[1].verdict is Verdict.REFUTED]
    assert any(response_box(random_map(seed))[0] for seed in folded)


@pytest.mark.parametrize("name", ["square_quadratic", "squared", *(f"random {seed}" for seed in FEW)])
def test_boxes_of_certified_curved_maps_grown_by_half_hold_unreachable_targets(name):
    model, certificate = named(name)
    if certificate.verdict is not Verdict.CERTIFIED:
        return
    low, high = np.array(certificate.response_box).T
    middle, half = 0.5 * (low + high), 0.75 * (high - low)
    assert not model.invert(corners(np.column_stack([middle - half, middle + half]))).ok.all()


@pytest.mark.parametrize("build", [quintic, lambda: cube(1e-3), lambda: edge(0.999), lambda: edge(-0.999)])
def test_in_one_dimension_the_box_is_the_image_to_the_gap_of_the_bounds_and_never_more(build):
    model = build()
    low, high = certify(model).response_box[0]
    ends = sorted(value(model, x) for x in (-1, 1))
    assert ends[0] <= Fraction(low)
    assert Fraction(high) <= ends[1]
    assert high - low >= 0.998 * float(ends[1] - ends[0])


@pytest.mark.parametrize("curvature", [1.001, 2.0, 5.0, -3.0])
def test_of_a_fold_only_the_part_before_it_is_claimed(curvature):
    model = edge(curvature)
    certificate = certify(model)
    reach = certificate.sub_box
    ((low, high),) = certificate.response_box
    assert certificate.factor_box == ((-reach, reach),)
    assert value(model, -reach) <= Fraction(low) < Fraction(high) <= value(model, reach)
    assert high - low >= 0.99 * float(value(model, reach) - value(model, -reach))


def test_units_and_offsets_do_not_matter():
    """Responses in other units and shifted, to 1e-9 and back: the same box in their units."""
    model = square_quadratic()
    factor, shift = np.array([1e-9, 1e6, 1.0]), np.array([0.0, 3e4, -2.0])
    table = model.coefficients * factor
    table[model.terms.degrees == 0] += shift
    box, _ = response_box(model)
    other, _ = response_box(replace(model, coefficients=table))
    assert_allclose((np.array(other) - shift[:, None]) / factor[:, None], box, rtol=1e-5)


# --- where floats are at their end --------------------------------------------------------------------------------


@pytest.mark.parametrize("gap", [1e-2, 1e-6, 1e-9])
def test_near_singular_maps_claim_nothing_false(gap):
    model = affine([[1.0, 1.0], [1.0, 1.0 + gap]])
    box, _ = response_box(model)
    for corner in corners(box) if box else ():
        assert all(abs(x) <= 1 for x in exact_settings(model, corner))


def test_a_near_singular_map_has_a_box_all_the_same():
    assert response_box(affine([[1.0, 1.0], [1.0, 1.0 + 1e-6]]))[0] is not None


@pytest.mark.parametrize(("constant_part", "there"), [(1e3, True), (1e9, False)])
def test_movement_that_a_constant_nearly_swallows(constant_part, there):
    """1e-9 about a constant: of 1e3 with some 9e3 floats in between, of 1e9 with none."""
    model = affine([[1e-9]], [constant_part])
    box, _ = response_box(model)
    assert (box is not None) == there
    for corner in corners(box) if box else ():
        assert all(abs(x) <= 1 for x in exact_settings(model, corner))


@pytest.mark.parametrize("size", [1e-300, 1e-160, 1e160, 1e300])
def test_sizes_at_the_ends_of_the_floats_claim_nothing_false(size):
    with np.errstate(all="ignore"):
        box, reason = response_box(affine(np.array([[2.0, 1.0], [0.5, -1.0]]) * size))
    assert reason
    for corner in corners(box) if box else ():
        assert all(abs(x) <= 1 for x in exact_settings(affine(np.array([[2.0, 1.0], [0.5, -1.0]]) * size), corner))


@pytest.mark.parametrize(
    ("second", "regular"),
    [
        (np.eye(2), True),
        (np.array([[1.0, 0.9], [0.0, 1.0]]), True),
        (-np.eye(2), False),  # a matrix between the two is zero
        (np.diag([1.0, -0.5]), False),
        (np.array([[0.0, 1.0], [1.0, 0.0]]), False),  # rows (½, ½) and (½, ½) lie between
        (np.full((2, 2), np.nan), False),
    ],
)
def test_rows_between_which_a_matrix_is_singular_are_refused(second, regular):
    assert _regular(np.stack([np.eye(2), second])) is regular


# --- no box, and why ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("build", "reason"),
    [
        (overdetermined, "3 responses follow from 2 factors: they cannot be chosen independently"),
        (more_responses, "3 responses follow from 2 factors: they cannot be chosen independently"),
        (underdetermined, "the claim is proven on no box of factors"),
        (constant, "the claim is proven on no box of factors"),
        (dead_parts, "the claim is proven on no box of factors"),
        (dependent, "the claim is proven on no box of factors"),
    ],
)
def test_certificates_say_why_there_is_no_box(build, reason):
    certificate = certify(build())
    assert certificate.response_box is None
    assert reason in certificate.box_reason
    assert (certificate.factor_box is not None) == (certificate.verdict is Verdict.CERTIFIED)


def test_the_search_alone_says_why_it_finds_none():
    assert "4 factors give 2 responses" in response_box(underdetermined())[1]
    assert "r1 does not move" in response_box(dead_parts())[1]
    assert "leave room for no box" in response_box(affine([[1.0, 1.0], [1.0, 1.0]]))[1]


# --- in model.json ------------------------------------------------------------------------------------------------


def certified(build):
    model = build()
    return replace(model, certificate=certify(model))


@pytest.mark.parametrize("build", [hexflex_like, square_quadratic, lambda: edge(2.0), more_responses, dead_parts])
def test_boxes_survive_model_json(build):
    model = certified(build)
    assert loads(dumps(model)).certificate == model.certificate


def test_models_written_before_there_were_boxes_still_load():
    document = json.loads(dumps(certified(square_quadratic)))
    for name in ("factor_box", "response_box", "box_reason"):
        del document["certificate"][name]
    del document["digest"]
    old = loads(json.dumps(document)).certificate
    assert (old.factor_box, old.response_box, old.box_reason) == (None, None, "")
    assert old.verdict is Verdict.CERTIFIED


@pytest.mark.parametrize(
    ("name", "given", "complaint"),
    [
        ("response_box", [[0.0, 1.0]], "one each for r0, r1, r2"),
        ("factor_box", [[0.0, 1.0]] * 4, "one each for a, b, c"),
        ("response_box", [[0.0, 1.0], [1.0, 0.0], [0.0, 1.0]], "finite pairs low < high"),
        ("response_box", [[0.0, 1.0], [0.0, 1e999], [0.0, 1.0]], "finite pairs low < high"),
        ("response_box", [[0.0, 1.0], [0.0], [0.0, 1.0]], "must be a list of pairs"),
        ("response_box", 3.0, "must be a list of pairs"),
        ("factor_box", [[0.0, "1"]] * 3, "factor_box must be numbers"),
    ],
)
def test_bad_boxes_are_refused(name, given, complaint):
    document = json.loads(dumps(certified(square_quadratic)))
    document["certificate"][name] = given
    text = json.dumps(document).replace("Infinity", "1e999")
    with pytest.raises(ValueError, match=complaint):
        loads(text)


def test_the_same_model_gets_the_same_box():
    assert_array_equal(response_box(square_quadratic())[0], response_box(square_quadratic())[0])


def test_the_scale_of_a_certificate_s_box_is_that_of_the_terms():
    """Two factors out of three move nothing but the product term: the box shrinks with it, not to nothing."""
    terms = Terms.parse(["f0", "f1", "f0:f1"], ("f0", "f1"))
    rows = [[1.0, 0.0, 0.3], [0.0, 1.0, -0.3]]
    model = surrogate(unit_box(2), terms.labels, rows)
    box = np.array(response_box(model)[0])
    assert model.invert(corners(box)).ok.all()
    assert np.ptp(box, axis=1).min() > 1.0

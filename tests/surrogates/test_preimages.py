"""All settings that give one target: maps whose preimages are known, and nothing called complete that is not."""

from dataclasses import replace
from itertools import product
from math import comb

import numpy as np
import pytest
from numpy.testing import assert_allclose

from experiments import Terms
from surrogates import Surrogate, Verdict, certify
from surrogates.multistart import distinct, newton
from surrogates.preimages import preimages
from surrogates.roots import REACH, find_roots
from tests.surrogates.cases import (
    ALL,
    box,
    constant,
    dead_parts,
    dependent,
    folded,
    hexflex_like,
    more_responses,
    overdetermined,
    points,
    quintic,
    square_quadratic,
    surrogate,
    underdetermined,
    unit_box,
)


def one(*coefficients: float) -> Surrogate:
    """One factor on [−1, 1], one response, coefficients from the constant up."""
    return surrogate(unit_box(1), Terms.polynomial(("f0",), len(coefficients) - 1).labels, [coefficients])


def complex_power(power: int, reach: float = 1.0, centre: complex = 0.0, scales=(1.0, 1.0)) -> Surrogate:
    """z ↦ zᵖ as a map of the plane, z = centre + reach (f0 + i f1)."""
    terms = Terms.polynomial(("f0", "f1"), power)
    rows = np.zeros((2, len(terms)))
    for column, (a, b) in enumerate(terms.exponents):
        value = comb(power, a + b) * comb(a + b, a) * centre ** (power - a - b) * reach ** (a + b) * 1j**b
        rows[:, column] = value.real, value.imag
    return surrogate(unit_box(2), terms.labels, rows * np.array(scales)[:, None])


def folds_in(n: int) -> Surrogate:
    """n responses, each the square of a factor with a slight slope: 2ⁿ preimages about the middle."""
    rows = np.hstack([0.1 * np.eye(n), np.eye(n)])
    mixing = np.eye(n) + 0.3 * np.ones((n, n))  # every response follows from every factor
    return surrogate(unit_box(n), [*(f"f{i}" for i in range(n)), *(f"f{i}^2" for i in range(n))], mixing @ rows)


def random_map(seed: int, n: int, degree: int, size: float) -> tuple[Surrogate, np.ndarray]:
    rng = np.random.default_rng([seed, n, degree])
    terms = Terms.polynomial(unit_box(n).names, degree)
    rows = rng.normal(size=(n, len(terms))) * np.where(terms.degrees <= 1, 1.0, size)
    model = surrogate(unit_box(n), terms.labels, rows)
    return model, model.predict(rng.uniform(-1.0, 1.0, (1, n)))[0]


def by_brute_force(model: Surrogate, target: np.ndarray, per_factor: int) -> np.ndarray:
    """Distinct ends of Newton's method from every point of a grid that lie well inside the box."""
    grid = np.array(list(product(np.linspace(-1.0, 1.0, per_factor), repeat=len(model.factors))))
    ends = newton(model, np.tile(target, (len(grid), 1)), grid)
    ends = ends[np.isfinite(ends).all(axis=1)]
    miss = np.abs(model.predict(ends) - target).max(axis=1)
    return distinct(ends[(np.abs(ends) < 1.0 - 1e-6).all(axis=1) & (miss < 1e-12 * model.scale.max())])


def same_settings(found: np.ndarray, expected: np.ndarray, within: float = 1e-9) -> bool:
    """Whether each of one list is near exactly one of the other."""
    if found.shape != expected.shape:
        return False
    near = np.abs(found[:, None] - expected[None]).max(axis=2) <= within
    return bool((near.sum(axis=0) == 1).all() and (near.sum(axis=1) == 1).all())


# --- verification: preimages known in closed form ---------------------------------------------------------------------


def test_a_fold_has_two_settings_and_both_are_found():
    model = folded()
    for target in (0.0, 0.005, 0.009, -0.3):
        found = model.preimages([target])
        roots = np.roots([-0.1, -0.6, -1.0, 0.2, -target])
        inside = np.sort(roots[(np.abs(roots.imag) < 1e-12) & (np.abs(roots.real) <= 1.0)].real)
        assert found.complete
        assert_allclose(np.sort(model.factors.code(found.settings)[:, 0]), inside, atol=1e-9)
        assert len(found) == 2
        assert found.reason.startswith("exactly 2 settings of the domain, proven on ")


@pytest.mark.parametrize("seed", range(40))
def test_polynomials_of_degree_five_have_the_real_roots_that_numpy_finds(seed):
    coefficients = np.random.default_rng(seed).uniform(-1.0, 1.0, 6)
    coefficients[0] *= 0.2  # so that roots in [−1, 1] are common
    roots = np.roots(coefficients[::-1])
    inside = np.sort(roots[(np.abs(roots.imag) < 1e-9) & (np.abs(roots.real) < 1.0)].real)
    found = one(*coefficients).preimages([0.0])
    assert found.complete
    assert_allclose(np.sort(found.settings[:, 0]), inside, atol=1e-9)


def test_the_polynomials_tried_have_from_none_to_three_roots():
    constants = [np.random.default_rng(seed).uniform(-1.0, 1.0, 6) for seed in range(40)]
    counts = {len(one(*(c * [0.2, 1, 1, 1, 1, 1])).preimages([0.0])) for c in constants}
    assert {0, 1, 2, 3} <= counts


@pytest.mark.parametrize("power", [2, 3, 4, 5])
@pytest.mark.parametrize("scales", [(1.0, 1.0), (1e-9, 1e6)])
def test_a_power_of_z_has_as_many_roots_as_its_degree(power, scales):
    model = complex_power(power, scales=scales)
    for target in (0.3 + 0.2j, 0.5, -0.1j, 1e-3 - 1e-3j):
        angles = (np.angle(target) + 2.0 * np.pi * np.arange(power)) / power
        roots = abs(target) ** (1.0 / power) * np.column_stack([np.cos(angles), np.sin(angles)])
        found = model.preimages([target.real * scales[0], target.imag * scales[1]])
        assert found.complete
        assert same_settings(found.settings, roots)


def test_of_roots_outside_the_box_none_is_counted():
    model = complex_power(2, reach=0.5, centre=0.4)  # Re z from −0.1 to 0.9
    assert len(model.preimages([0.0025, 0.0])) == 2  # z = ±0.05
    both = model.preimages([0.25, 0.0])  # z = ±0.5
    assert both.complete
    assert_allclose(both.settings, [[0.2, 0.0]], atol=1e-9)
    none = model.preimages([4.0, 0.0])
    assert none.complete
    assert none.settings.shape == (0, 2)
    assert none.reason.startswith("no setting of the domain, proven on ")


@pytest.mark.parametrize(("n", "count"), [(1, 2), (2, 4), (3, 8), (4, 16), (5, 32)])
def test_folds_in_every_factor_multiply(n, count):
    model = folds_in(n)
    squares = np.linspace(0.2, 0.6, n)  # x² + 0.1 x of each factor
    roots = np.array(list(product(*(np.roots([1.0, 0.1, -s]) for s in squares))))
    found = model.preimages((np.eye(n) + 0.3 * np.ones((n, n))) @ squares)
    assert len(found) == count
    assert found.complete
    assert same_settings(found.settings, roots)


@pytest.mark.parametrize("root", [0.0, 1.0, -1.0, 0.5, 0.25, REACH / 2.0, REACH / 1024.0])
def test_settings_on_the_border_of_parts_are_counted_once(root):
    """The search halves the box about 0, then at ±REACH/2 and so on."""
    model = one(-root * (-root - 1.0 / 3.0), -root - (root + 1.0 / 3.0), 1.0)  # (x − root)(x − root − 1/3)
    found = model.preimages([0.0])
    inside = [r for r in (root, root + 1.0 / 3.0) if r <= 1.0]
    assert found.complete
    assert_allclose(np.sort(found.settings[:, 0]), inside, atol=1e-9)


def test_corners_and_faces_of_the_box_are_in_it():
    model = complex_power(2)
    for z in (1.0 + 1.0j, -1.0 + 1.0j, 1.0, 1j, 1.0 + 0.5j):
        found = model.preimages([(z * z).real, (z * z).imag])
        assert found.complete
        assert same_settings(found.settings, np.array([[z.real, z.imag], [-z.real, -z.imag]]))
        assert model.contains(found.settings).all()


@pytest.mark.parametrize(("beyond", "count"), [(1e-10, 1), (1.5e-9, 0), (1e-8, 0), (1e-6, 0)])
@pytest.mark.parametrize("cubic", [0.0, -0.05])  # without it the bounds are exact at the ends
def test_the_domain_ends_where_inversion_ends_it(beyond, count, cubic):
    model = one(0.0, 2.0, 0.25, cubic)
    target = np.polyval([cubic, 0.25, 2.0, 0.0], 1.0 + beyond)
    assert model.invert([[target]]).ok[0] == bool(count)
    found = model.preimages([target])
    assert found.complete
    assert len(found) == count
    assert found.settings.max(initial=0.0) <= 1.0


def test_settings_are_in_the_factors_units():
    model = surrogate(box(("a", 10.0, 30.0), ("b", -2e-3, 0.0)), ["a", "a^2", "b"], [[0.0, 1.0, 0.0], [0.1, 0.0, 2.0]])
    found = model.preimages([0.25, 1.0])
    assert found.complete
    assert same_settings(found.settings, np.array([[25.0, -1e-3 + 1e-3 * 0.475], [15.0, -1e-3 + 1e-3 * 0.525]]), 1e-8)


def test_the_nearest_to_the_centre_comes_first():
    found = one(-0.2 * 0.7, 0.5, 1.0).preimages([0.0])  # (x − 0.2)(x + 0.7)
    assert_allclose(found.settings[:, 0], [0.2, -0.7], atol=1e-12)


# --- verification: nothing is called complete that is not -------------------------------------------------------------


@pytest.mark.parametrize(
    ("n", "degree", "size", "per_factor", "maps"),
    [(1, 5, 1.0, 200, 20), (2, 2, 1.0, 15, 15), (2, 3, 1.0, 20, 15), (2, 5, 1.0, 20, 8), (3, 2, 1.0, 8, 10)],
)
def test_brute_force_finds_none_that_a_complete_list_lacks(n, degree, size, per_factor, maps):
    complete = several = 0
    for seed in range(maps):
        model, target = random_map(seed, n, degree, size)
        found = model.preimages(target)
        assert (np.abs(model.predict(found.settings) - target) <= 1e-9 * model.scale).all()
        complete += found.complete
        several += len(found) > 1
        brute = by_brute_force(model, target, per_factor)
        lacking = [row for row in brute if np.abs(found.settings - row).max(axis=1, initial=0.0).min() > 1e-8]
        assert not (found.complete and lacking)
        assert len(found) >= 1  # the target is the response of a setting
    assert complete >= 0.9 * maps  # random targets are not at folds
    assert several >= 2


@pytest.mark.parametrize("exponent", range(1, 17))
def test_near_a_fold_a_complete_list_has_two_or_none(exponent):
    """x² = ±δ: two roots 2√δ apart, or none; below the smallest part, 2⁻²⁰ or about √1e-12, nothing is decided."""
    delta = 10.0**-exponent
    two, none = (one(0.0, 0.0, 1.0).preimages([d]) for d in (delta, -delta))
    assert two.complete == (exponent <= 12)
    if two.complete:
        assert_allclose(np.sort(two.settings[:, 0]), [-np.sqrt(delta), np.sqrt(delta)], atol=1e-9)
    else:
        assert len(two)
        assert "there may be others" in two.reason
    # Within 1e-9 of the scale, zero counts as an answer; it is no exact one, and the list does not say so.
    assert none.complete == (exponent < 9)
    assert len(none) == (exponent >= 9)


def test_a_fold_gives_the_answer_and_does_not_call_it_the_only_one():
    for model, target in (
        (one(0.0, 0.0, 1.0), [0.0]),
        (one(0.1, 0.0, 0.0, 1.0), [0.1]),  # x³ has one root, and a singular one
        (complex_power(2), [0.0, 0.0]),
        (complex_power(3, centre=0.3 + 0.1j), [0.0, 0.0]),
    ):
        found = model.preimages(target)
        assert len(found) == 1
        assert not found.complete
        assert not found.continuum
        assert_allclose(model.predict(found.settings)[0], target, atol=1e-9)


@pytest.mark.parametrize("apart", [1e-2, 1e-3, 1e-4])
def test_settings_that_are_close_are_told_apart(apart):
    found = one(0.3 * (0.3 + apart), -0.6 - apart, 1.0).preimages([0.0])
    assert found.complete
    assert_allclose(np.sort(found.settings[:, 0]), [0.3, 0.3 + apart], atol=1e-9)


def test_a_search_that_ends_early_says_so_and_gives_what_starts_find():
    model = complex_power(3)
    found = model.preimages([0.3, 0.2], most=5)
    assert not found.complete
    assert len(found) == 3
    assert found.reason.startswith("the search ended after 5 parts of the box with ")
    assert found.reason.endswith("; there may be others")


@pytest.mark.parametrize("most", [1, 2, 7, 20, 50, 100, 200])
def test_however_early_it_ends_a_complete_list_is_complete(most):
    roots = find_roots(folds_in(3), (np.eye(3) + 0.3) @ np.array([0.2, 0.4, 0.6]), most)
    assert roots.parts <= most
    assert len(roots.coded) <= 8
    assert roots.complete <= (len(roots.coded) == 8)


@pytest.mark.parametrize("build", [square_quadratic, more_responses])
def test_a_certificate_that_no_longer_fits_the_factors_is_not_believed(build):
    model = build()
    certified = replace(model, certificate=certify(model))
    assert certified.certificate is not None
    assert certified.certificate.verdict is Verdict.CERTIFIED
    unit = model.factors.factors[0].unit
    wider = certified.embed(box(("z", 0.0, 1.0), *((f.name, f.low, f.high) for f in model.factors), unit=unit))
    answer = wider.invert(wider.predict(points(wider, 20)))
    assert answer.ok.all()
    assert not answer.complete.any()
    assert answer.continuum.all()
    found = wider.preimages(wider.predict(points(wider, 1))[0])
    assert (found.complete, found.continuum) == (False, True)


@pytest.mark.parametrize("seed", range(6))
def test_where_a_model_is_certified_the_search_finds_one(seed):
    terms = Terms.polynomial(("f0", "f1"), 3)
    rows = np.random.default_rng(seed).normal(size=(2, len(terms))) * 0.05
    model = surrogate(unit_box(2), terms.labels, rows + np.eye(2, len(terms), 1))
    assert certify(model).verdict is Verdict.CERTIFIED
    for target in model.predict(points(model, 10, seed)):
        roots = find_roots(model, target, 2000)
        assert roots.complete
        assert len(roots.coded) == 1


# --- other shapes -----------------------------------------------------------------------------------------------------


def one_idle():
    """Two responses along a curve in one factor; the other factor does not act."""
    return surrogate(unit_box(2), ["f0", "f0^2"], [[1.0, 0.2], [0.3, 1.0]])


@pytest.mark.parametrize("build", [underdetermined, dead_parts, dependent, constant, one_idle])
def test_more_factors_than_responses_give_a_continuum(build):
    model = build()
    found = model.preimages(model.predict(points(model, 1, reach=0.5))[0])
    assert (found.complete, found.continuum) == (False, True)
    assert len(found) == 1
    assert "the settings form a continuum, of which one is given" in found.reason


def test_a_corner_of_an_underdetermined_map_is_not_called_a_continuum():
    model = surrogate(unit_box(2), ["f0", "f1"], [[3.0, 1.0]])
    edge = model.preimages([3.5])  # the answer lies on f0 = 1, others inside
    assert_allclose(edge.settings, [[1.0, 0.5]], atol=1e-9)
    assert edge.continuum
    found = model.preimages([4.0])
    assert_allclose(found.settings, [[1.0, 1.0]], atol=1e-9)
    assert (found.complete, found.continuum) == (False, False)


def test_affine_models_of_full_rank_have_one_setting_or_none():
    model = hexflex_like()
    inside, outside = model.predict(points(model, 1))[0], model.predict(points(model, 1, reach=30.0))[0]
    assert [len(model.preimages(t)) for t in (inside, outside)] == [1, 0]
    assert all(model.preimages(t).complete for t in (inside, outside))
    tall = overdetermined()
    target = tall.predict(points(tall, 1))[0]
    assert [(len(f), f.complete) for f in (tall.preimages(target), tall.preimages(target * [1, 1, 2]))] == [
        (1, True),
        (0, True),
    ]
    assert "affine and of full rank" in tall.preimages(target).reason


def test_more_responses_than_factors_are_not_searched_with_proof():
    model = more_responses()
    setting = points(model, 1)
    found = model.preimages(model.predict(setting)[0])
    assert_allclose(found.settings, setting, atol=1e-9)
    assert not found.complete
    assert "there are more responses than factors" in found.reason
    none = model.preimages(model.predict(setting)[0] + [0.0, 0.0, 0.1])
    assert (len(none), none.complete) == (0, False)
    assert none.reason.startswith("none was found from several starts")


def test_of_a_certified_model_one_is_proven_when_the_search_ends_early():
    model = square_quadratic()
    target = model.predict(points(model, 1))[0]
    early = replace(model, certificate=certify(model)).preimages(target, most=1)
    assert early.complete
    assert len(early) == 1
    assert "certified" in early.reason or "proven on 1 part of the box" in early.reason


def test_large_models_are_not_searched_with_proof():
    model = surrogate(unit_box(8), [f"f{i}^9" for i in range(8)] + [f"f{i}" for i in range(8)], np.eye(8, 16) + 0.1)
    wide = replace(model, terms=Terms(model.terms.names, tuple(tuple(9 for _ in range(8)) if i == 0 else e
                   for i, e in enumerate(model.terms.exponents))))  # fmt: skip
    found = wide.preimages(wide.predict(points(wide, 1))[0])
    assert not found.complete
    assert "the model has too many terms" in found.reason


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("name", ["square_quadratic", "quintic", "folded"])
def test_a_target_at_the_end_of_float64_has_none_by_proof(name):
    model = ALL[name]()
    found = model.preimages(np.full(len(model.responses), 1e308))
    assert (len(found), found.complete) == (0, True)


# --- misuse -----------------------------------------------------------------------------------------------------------


def test_bad_arguments_are_errors():
    model = quintic()
    with pytest.raises(ValueError, match=r"target must have shape \(1,\), the responses wanted at once; got \(1, 1\)"):
        preimages(model, [[1.0]])
    with pytest.raises(ValueError, match=r"targets must have shape \(n, 1\)"):
        preimages(model, [1.0, 2.0])
    with pytest.raises(ValueError, match="targets must be finite"):
        preimages(model, [np.nan])
    with pytest.raises(ValueError, match="most must be at least 1 part of the box, got 0"):
        preimages(model, [1.0], most=0)

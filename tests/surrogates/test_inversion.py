"""Inversion: reached targets are met, refused ones come with the nearest point of the box."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.optimize import minimize

from surrogates import InversionStatus, affine_inverse, certify, obstacle
from tests.surrogates.cases import (
    AFFINE,
    ALL,
    NONLINEAR,
    block_map,
    box,
    cantilever_like,
    constant,
    dead_parts,
    dependent,
    folded,
    hexflex_like,
    more_responses,
    overdetermined,
    points,
    square_quadratic,
    surrogate,
    underdetermined,
    unit_box,
)

# On a model that folds back the search is local: it may miss settings that exist, so no promise is tested there.
SEARCHED = sorted(set(ALL) - {"folded"})
INJECTIVE = {"hexflex_like", "block_map", "overdetermined", "square_quadratic", "quintic", "more_responses"}


def distance_at(model, coded, target):
    return np.linalg.norm((model.predict_coded(np.atleast_2d(coded)) - target) / model.scale, axis=1)


def nearest_by_minimize(model, target, starts=4):
    """Smallest distance in the box that an independent optimiser finds, from several starts."""
    rng = np.random.default_rng(0)
    n = len(model.factors)

    def square(coded):
        miss = (model.predict_coded(coded[None])[0] - target) / model.scale
        return miss @ miss, 2.0 * miss @ (model.jacobian_coded(coded[None])[0] / model.scale[:, None])

    found = [
        minimize(square, start, jac=True, bounds=[(-1.0, 1.0)] * n, options={"ftol": 1e-16, "gtol": 1e-12}).fun
        for start in (np.zeros(n), *rng.uniform(-1.0, 1.0, (starts, n)))
    ]
    return np.sqrt(max(min(found), 0.0))


# --- targets that can be reached --------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", SEARCHED)
def test_every_target_that_the_model_gives_inside_the_box_is_reached(name):
    model = ALL[name]()
    targets = model.predict(points(model, 400, seed=5))
    answer = model.invert(targets)
    refused = np.flatnonzero(~answer.ok)
    assert not refused.size, f"{refused.size} of 400 refused; largest distance {answer.distance[refused].max():.2g}"
    assert model.contains(answer.settings).all()
    assert np.abs((model.predict(answer.settings) - targets) / model.scale).max() <= 1e-9
    assert_array_equal(answer.settings, answer.nearest_settings)


@pytest.mark.parametrize("name", sorted(INJECTIVE))
def test_round_trip_gives_the_settings_back(name):
    model = ALL[name]()
    settings = points(model, 300, seed=6)
    found = model.invert(model.predict(settings)).settings
    assert_allclose((found - settings) / model.factors.half_range, 0.0, atol=1e-11)


@pytest.mark.parametrize("name", sorted(INJECTIVE))
def test_corners_of_the_box_are_reached_without_leaving_it(name):
    model = ALL[name]()
    n = len(model.factors)
    corners = np.array(np.meshgrid(*[[-1.0, 1.0]] * n)).reshape(n, -1).T
    answer = model.invert(model.predict_coded(corners))
    assert answer.ok.all()
    assert (np.abs(model.factors.code(answer.settings)) <= 1.0 + 1e-15).all()
    assert_allclose(model.factors.code(answer.settings), corners, atol=1e-9)


def test_an_underdetermined_answer_is_of_least_coded_norm():
    model = underdetermined()
    targets = model.predict(points(model, 50, seed=7, reach=0.4))
    coded = model.factors.code(model.invert(targets).settings)
    slope = model.jacobian_coded(np.zeros((1, 4)))[0]
    _, _, rows = np.linalg.svd(slope)
    assert_allclose(coded @ rows[2:].T, 0.0, atol=1e-13)  # nothing along the null space
    assert_allclose(model.predict_coded(coded), targets, rtol=0.0, atol=1e-12)


def test_a_target_is_reached_where_the_least_norm_solution_leaves_the_box():
    # 3x + y = 3.5: the least-norm solution is (1.05, 0.35), outside; (1, 0.5) is inside.
    model = surrogate(unit_box(2), ["f0", "f1"], [[3.0, 1.0]])
    answer = model.invert([[3.5]])
    assert answer.ok.all()
    assert model.contains(answer.settings).all()
    assert answer.settings[0] @ [3.0, 1.0] == pytest.approx(3.5, abs=1e-9)


def test_the_same_when_the_model_is_not_affine():
    model = cantilever_like()
    coded = points(surrogate(unit_box(4), ["1"], [[1.0]]), 300, seed=8)
    edge = np.sign(coded) * np.abs(coded) ** 0.2  # crowded towards the faces
    targets = model.predict_coded(edge)
    answer = model.invert(targets)
    refused = np.flatnonzero(~answer.ok)
    assert not refused.size, f"{refused.size} of 300 refused; largest distance {answer.distance[refused].max():.2g}"


def test_an_overdetermined_target_on_the_surface_is_reached_and_one_beside_it_is_not():
    model = overdetermined()
    target = model.predict(points(model, 1, seed=9))
    assert model.invert(target).ok.all()
    slope = model.jacobian_coded(np.zeros((1, 2)))[0] / model.scale[:, None]
    normal = np.linalg.svd(slope.T)[2][-1]
    answer = model.invert(target + 0.01 * normal * model.scale)
    assert answer.status == (InversionStatus.OUTSIDE,)
    assert answer.distance[0] == pytest.approx(0.01, rel=1e-9)
    assert_allclose(answer.nearest / model.scale, target / model.scale, atol=1e-12)


def test_a_constant_model_reaches_only_its_constant():
    answer = constant().invert([[3.0, 0.0], [3.0, 0.1]])
    assert answer.status == (InversionStatus.OK, InversionStatus.OUTSIDE)
    assert_array_equal(answer.settings[0], [0.0, 0.0])
    assert answer.distance[1] == pytest.approx(0.1)


# --- targets that cannot ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", [n for n in SEARCHED if n != "constant"])
def test_a_refused_target_comes_with_the_nearest_point_of_the_box(name):
    model = ALL[name]()
    centre = model.predict(model.factors.centre[None])[0]
    directions = np.random.default_rng(10).normal(size=(15, len(model.responses)))
    targets = centre + 2.5 * model.scale * directions / np.linalg.norm(directions, axis=1, keepdims=True)
    answer = model.invert(targets)
    assert set(answer.status) == {InversionStatus.OUTSIDE}
    assert np.isnan(answer.settings).all()
    assert model.contains(answer.nearest_settings).all()
    assert_allclose(answer.nearest, model.predict(answer.nearest_settings), rtol=1e-13, atol=1e-13 * model.scale.max())
    for target, distance, settings in zip(targets, answer.distance, answer.nearest_settings, strict=True):
        assert distance == pytest.approx(
            distance_at(model, model.factors.code(settings[None])[0], target)[0], rel=1e-12
        )
        assert distance <= nearest_by_minimize(model, target) * (1.0 + 1e-9)


def test_the_nearest_point_is_measured_in_scaled_responses():
    # Diagonal map: each response saturates on its own, whatever the units of the other.
    model = surrogate(unit_box(2), ["f0", "f1"], [[1e-6, 0.0], [0.0, 1e2]])
    answer = model.invert([[2e-6, 50.0]])
    assert_allclose(answer.nearest_settings, [[1.0, 0.5]], atol=1e-9)
    assert answer.distance[0] == pytest.approx(1.0)


def test_answers_do_not_depend_on_the_batch():
    for build in (hexflex_like, square_quadratic, underdetermined):
        model = build()
        targets = model.predict(np.vstack([points(model, 4, seed=11, reach=0.9), points(model, 3, seed=12, reach=3.0)]))
        together = model.invert(targets)
        alone = [model.invert(t[None]) for t in targets]
        assert together.status == tuple(a.status[0] for a in alone)
        assert {InversionStatus.OK, InversionStatus.OUTSIDE} == set(together.status)
        assert_allclose([a.distance[0] for a in alone], together.distance, rtol=1e-9, atol=1e-11)
        found = np.vstack([a.settings for a in alone])
        assert_array_equal(np.isnan(found).any(axis=1), ~together.ok)
        assert_allclose(((found - together.settings) / model.factors.half_range)[together.ok], 0.0, atol=1e-11)


def test_no_targets_give_no_answers():
    for build in (hexflex_like, square_quadratic):
        model = build()
        answer = model.invert(np.empty((0, len(model.responses))))
        assert answer.settings.shape == (0, len(model.factors))
        assert answer.status == ()


def test_an_inversion_converts_to_its_settings():
    model = hexflex_like()
    answer = model.invert(model.predict(points(model, 3)))
    assert_array_equal(np.asarray(answer), answer.settings)
    assert_array_equal(answer.ok, [True] * 3)


# --- how many settings ------------------------------------------------------------------------------------------------


def complex_square():
    """z², on a box that holds both roots of every number of modulus below one."""
    return surrogate(unit_box(2), ["f0^2", "f1^2", "f0:f1"], [[1.0, -1.0, 0.0], [0.0, 0.0, 2.0]])


def test_several_settings_are_counted_and_one_is_given():
    answer = folded().invert([[0.005], [0.02], [-0.3]])
    assert answer.status == ("ok", "outside", "ok")
    assert_array_equal(answer.count, [2, 0, 2])
    assert not answer.complete.any()
    assert not answer.unique.any()
    model = complex_square()
    answer = model.invert(model.predict(points(model, 200, reach=0.9)))
    assert answer.ok.all()
    assert_array_equal(answer.count, 2)
    assert not answer.complete.any()


def test_a_double_root_is_counted_once():
    model = complex_square()
    assert_array_equal(model.invert([[0.0, 0.0]]).count, [1])
    fold = surrogate(unit_box(1), ["f0^2", "f0"], [[1.0, 0.4]])  # lowest at −0.2
    assert_array_equal(fold.invert([[-0.04], [-0.0399]]).count, [1, 2])
    triple = surrogate(unit_box(1), ["f0^3"], [[1.0]])
    assert_array_equal(triple.invert([[0.0]]).count, [1])


def test_of_a_certified_model_there_is_one():
    model = square_quadratic()
    targets = np.vstack([model.predict(points(model, 50)), model.predict(points(model, 5, reach=9.0))])
    before, after = (m.invert(targets) for m in (model, replace(model, certificate=certify(model))))
    assert_array_equal(after.unique, after.ok)
    assert_array_equal(after.count, after.ok.astype(int))
    assert not before.complete.any()
    assert_array_equal(before.count, after.count)
    assert_array_equal(before.settings, after.settings)


@pytest.mark.parametrize("name", AFFINE)
def test_an_affine_model_is_decided_by_its_rank(name):
    model = AFFINE[name]()
    answer = model.invert(np.vstack([model.predict(points(model, 5, reach=0.5)), np.full(len(model.responses), 1e9)]))
    full = name not in ("constant", "underdetermined")
    assert_array_equal(answer.count, [1] * 5 + [0])
    assert_array_equal(answer.complete, [full] * 6)
    assert_array_equal(answer.continuum, [not full] * 5 + [False])


def one_idle():
    """Two responses along a curve in one factor; the other factor acts on neither."""
    return surrogate(unit_box(2), ["f0", "f0^2"], [[1.0, 0.2], [0.3, 1.0]])


@pytest.mark.parametrize("build", [dead_parts, dependent, underdetermined, cantilever_like, one_idle])
def test_more_factors_than_independent_responses_give_a_continuum(build):
    model = build()
    answer = model.invert(model.predict(points(model, 20, reach=0.3)))
    assert answer.ok.all()
    assert answer.continuum.all()
    assert_array_equal(answer.count, 1)
    assert not answer.complete.any()


def test_a_factor_that_was_added_makes_a_certified_model_ambiguous():
    model = square_quadratic()
    wider = replace(model, certificate=certify(model)).embed(
        box(("z", 0.0, 1.0), *((f.name, f.low, f.high) for f in model.factors), unit="N")
    )
    answer = wider.invert(wider.predict(points(wider, 5)))
    assert answer.ok.all()
    assert answer.continuum.all()
    assert not answer.unique.any()


@pytest.mark.parametrize("seed", range(8))
def test_no_more_settings_are_counted_than_there_are(seed):
    rng = np.random.default_rng(seed)
    terms = ["1", "f0", "f1", "f0^2", "f0:f1", "f1^2", "f0^3", "f1^3"]
    model = surrogate(unit_box(2), terms, rng.normal(size=(2, 8)))
    targets = model.predict(points(model, 10, seed))
    answer, listed = model.invert(targets), [model.preimages(t) for t in targets]
    assert answer.ok.all()
    assert all(one.complete for one in listed)
    assert (answer.count <= [len(one) for one in listed]).all()
    assert answer.count.max() > 1
    for setting, one in zip(answer.settings, listed, strict=True):
        assert np.abs(one.settings - setting).max(axis=1).min() < 1e-7


# --- the closed form --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", sorted(set(AFFINE) - {"constant", "underdetermined"}))
def test_affine_inverse_is_a_left_inverse(name):
    model = AFFINE[name]()
    inverse = affine_inverse(model)
    settings = points(model, 30)
    found = model.predict(settings) @ inverse.gain.T + inverse.offset
    assert_allclose((found - settings) / model.factors.half_range, 0.0, atol=1e-12)


def test_affine_inverse_condition_is_of_coded_factors_and_scaled_responses():
    model = hexflex_like()
    scaled = model.coefficients[1:].T / model.scale[:, None]
    assert affine_inverse(model).condition == pytest.approx(np.linalg.cond(scaled), rel=1e-12)
    assert affine_inverse(block_map()).condition < 10.0
    assert affine_inverse(constant()).condition == np.inf
    lost = surrogate(unit_box(2), ["f0", "f1"], [[1.0, 2.0], [2.0, 4.0]])
    assert affine_inverse(lost).condition == np.inf


@pytest.mark.parametrize("name", NONLINEAR)
def test_a_nonlinear_model_has_no_closed_form(name):
    with pytest.raises(ValueError, match="only an affine model has a closed-form inverse"):
        affine_inverse(NONLINEAR[name]())


# --- what stands in the way of an inverse -----------------------------------------------------------------------------


@pytest.mark.parametrize("name", ALL)
def test_only_a_curved_model_of_more_responses_than_factors_has_an_obstacle(name):
    against = obstacle(ALL[name]())
    assert bool(against) == (name == "more_responses")
    assert against in (
        "",
        "3 responses follow from 2 factors, so that they cannot be chosen independently of each other",
    )


@pytest.mark.parametrize(
    ("terms", "rows", "counts"),
    [
        (["f0", "f0^2"], [[1, 1], [2, 0]], "2 responses follow from 1 factor"),  # f1 and f2 do not act
        (["1", "f0", "f0^2"], [[1, 1, 1], [2, 0, 0], [3, 0, 0]], ""),  # two responses do not move
        (["f0", "f1", "f0:f1"], [[1, 0, 0], [0, 1, 0]], ""),  # no response uses the curved term: yet it is no obstacle
        (["f0", "f1", "f0:f1"], [[1, 0, 0], [0, 1, 0], [0, 0, 1]], "3 responses follow from 2 factors"),
    ],
)
def test_an_obstacle_counts_what_moves_and_what_acts(terms, rows, counts):
    against = obstacle(surrogate(unit_box(3), terms, np.array(rows, dtype=float)))
    assert against.startswith(counts)
    assert bool(against) == bool(counts)


# --- misuse -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("build", [hexflex_like, square_quadratic])
def test_targets_that_are_not_finite_are_an_error(build, bad):
    model = build()
    targets = model.predict(points(model, 3))
    targets[1, 0] = bad
    with pytest.raises(ValueError, match="targets must be finite"):
        model.invert(targets)


@pytest.mark.parametrize("targets", [[1.0, 2.0, 3.0], [[1.0, 2.0]], [[[1.0, 2.0, 3.0]]], 5.0])
def test_targets_of_the_wrong_shape_are_an_error(targets):
    with pytest.raises(ValueError, match=r"targets must have shape \(n, 3\), one column per response \(r0, r1, r2\)"):
        more_responses().invert(targets)


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("name", ["hexflex_like", "square_quadratic"])
def test_a_target_at_the_end_of_float64_is_refused_quietly(name):
    model = ALL[name]()
    answer = model.invert(np.full((1, len(model.responses)), 1e308))
    assert answer.status == (InversionStatus.OUTSIDE,)
    assert np.isfinite(answer.nearest).all()
    assert model.contains(answer.nearest_settings).all()

"""Definitive screening designs: orthogonality to second order, sizes, fake factors."""

from itertools import combinations

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from experiments import Factor, FactorSpace
from experiments.designs import DefinitiveScreening
from experiments.screening.contrasts import contrast_columns
from experiments.terms import Terms, model_matrix


def space(k: int) -> FactorSpace:
    return FactorSpace(tuple(Factor(f"f{i}", "1", 0, 1) for i in range(k)))


@pytest.mark.parametrize(
    ("k", "n_runs"),
    [
        (1, 9),
        (4, 9),
        (5, 13),
        (6, 13),
        (7, 17),
        (8, 17),
        (9, 21),
        (10, 21),
        (12, 25),
        (16, 33),
        (21, 49),
        (30, 61),
        (33, 77),
    ],
)
def test_default_size(k, n_runs):
    """2m + 1 for even m (Xiao, Lin and Bai 2012); no order 22 or 34 exists, and 36 is not built."""
    assert len(DefinitiveScreening().generate(space(k))) == n_runs


@pytest.mark.parametrize("k", [4, 6, 7, 10, 12, 14, 16])
def test_main_effects_are_clear_of_the_second_order(k):
    """Jones and Nachtsheim (2011), properties 2 to 4."""
    design = DefinitiveScreening().generate(space(k))
    columns = np.hstack([design.coded, design.dummies])
    m = columns.shape[1]
    assert_array_equal(columns.T @ columns, (2 * m - 2) * np.eye(m))
    second = [columns[:, i] * columns[:, j] for i in range(m) for j in range(i + 1)]
    assert_array_equal(columns.T @ np.column_stack([np.ones(len(columns)), *second]), np.zeros((m, 1 + len(second))))


@pytest.mark.parametrize("k", [4, 6, 8, 10, 18, 26])
def test_correlation_of_squares(k):
    """Jones and Nachtsheim (2011): 1/3 − 1/(m − 1)."""
    coded = DefinitiveScreening().generate(space(k)).coded
    found = np.corrcoef((coded**2).T)[np.triu_indices(k, 1)]
    assert_allclose(found, 1.0 / 3.0 - 1.0 / (k - 1.0), atol=1e-12)


@pytest.mark.parametrize("k", [4, 6, 10])
def test_runs_come_in_mirrored_pairs_with_one_factor_at_the_centre(k):
    coded = DefinitiveScreening().generate(space(k)).coded
    assert_array_equal(coded[0:-1:2], -coded[1:-1:2])
    assert_array_equal((coded[:-1] == 0.0).sum(axis=1), np.ones(2 * k))
    assert_array_equal((coded[:-1] == 0.0).sum(axis=0), np.full(k, 2))
    assert_array_equal(coded[-1], np.zeros(k))


def test_all_squares_are_estimable_and_any_three_factors_give_a_full_quadratic():
    """Jones and Nachtsheim (2011), properties 5 and 6, for six factors."""
    names, coded = tuple("ABCDEF"), DefinitiveScreening().generate(space(6)).coded
    squares = Terms.polynomial(names, 2, interactions=False)
    assert np.linalg.matrix_rank(model_matrix(squares, coded)) == 13
    for chosen in combinations(range(6), 3):
        full = Terms.polynomial([names[i] for i in chosen], 2)
        assert np.linalg.matrix_rank(model_matrix(full, coded[:, chosen])) == 10


@pytest.mark.parametrize(
    ("k", "fake", "n_runs", "dummies"), [(6, 2, 17, 2), (5, 0, 13, 1), (20, 1, 49, 4), (6, 0, 13, 0)]
)
def test_fake_factors_are_dummies(k, fake, n_runs, dummies):
    design = DefinitiveScreening(fake_factors=fake).generate(space(k))
    assert (len(design), design.dummies.shape[1]) == (n_runs, dummies)
    assert np.array_equal(np.unique(design.dummies), [-1, 0, 1] if dummies else [])


def test_fake_factors_measure_noise_free_of_any_quadratic():
    """Jones and Nachtsheim (2017), section 3: fake columns are orthogonal to every first- and second-order effect."""
    design = DefinitiveScreening(fake_factors=2).generate(space(6))
    full = Terms.polynomial(design.space.names, 2)
    response = model_matrix(full, design.coded) @ np.random.default_rng(0).normal(size=len(full))
    assert_allclose(design.dummies.T @ response, np.zeros(2), atol=1e-12)
    assert np.abs(design.coded.T @ response).min() > 0.1


def test_extra_centre_runs():
    plain, more = (DefinitiveScreening(13, extra_centre=e).generate(space(5)) for e in (0, 2))
    assert len(more) == 15
    assert_array_equal(more.coded[:13], plain.coded)
    assert_array_equal(more.coded[12:], np.zeros((3, 5)))
    assert_array_equal(more.dummies[12:], np.zeros((3, 1)))


def test_is_no_two_level_design():
    with pytest.raises(ValueError, match="two-level"):
        contrast_columns(DefinitiveScreening().generate(space(6)))


@pytest.mark.parametrize(
    ("settings", "k", "message"),
    [
        ({"n_runs": 13}, 7, "13 runs has 6 columns, too few for 7 factors and 0 fake ones; use n_runs = 17"),
        ({"n_runs": 13, "fake_factors": 2}, 5, "too few for 5 factors and 2 fake ones; use n_runs = 17"),
        ({"fake_factors": 200}, 1, "no definitive screening design for 201 factors, fake ones counted: at most 200"),
    ],
)
def test_refuses_too_many_factors(settings, k, message):
    with pytest.raises(ValueError, match=message):
        DefinitiveScreening(**settings).generate(space(k))


@pytest.mark.parametrize(
    ("n_runs", "near"), [(10, "9, 13, 17"), (45, "37, 41, 49"), (73, "65, 77, 81"), (999, "389, 397, 401")]
)
def test_refuses_sizes_without_a_conference_matrix(n_runs, near):
    with pytest.raises(ValueError, match=f"no definitive screening design with {n_runs} runs .*nearest sizes: {near}"):
        DefinitiveScreening(n_runs)

"""The algebra of terms and their model matrices."""

from math import comb

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from experiments import Terms, model_matrix
from experiments.terms import model_matrix_gradient

NAMES = ("A", "B", "C")
POINTS = np.random.default_rng(0).uniform(-1.0, 1.0, (7, 3))
A, B, C = POINTS.T


@pytest.mark.parametrize("degree", [0, 1, 2, 3, 4])
@pytest.mark.parametrize("k", [1, 2, 3, 6])
def test_number_of_terms_is_binomial(k, degree):
    terms = Terms.polynomial([f"f{i}" for i in range(k)], degree)
    assert len(terms) == comb(k + degree, degree)
    assert terms.degrees.max() == degree
    assert (np.diff(terms.degrees) >= 0).all()


@pytest.mark.parametrize("degree", [0, 1, 3])
@pytest.mark.parametrize("k", [1, 4])
def test_number_of_pure_powers(k, degree):
    terms = Terms.polynomial([f"f{i}" for i in range(k)], degree, interactions=False)
    assert len(terms) == 1 + k * degree
    assert all(sum(e > 0 for e in row) <= 1 for row in terms.exponents)


def test_quadratic_in_two_factors_reads_as_in_the_books():
    assert Terms.polynomial("AB", 2).labels == ("1", "A", "B", "A^2", "A:B", "B^2")
    assert Terms.polynomial("AB", 2, interactions=False).labels == ("1", "A", "B", "A^2", "B^2")


def test_labels_parse_back():
    terms = Terms.polynomial(("force", "b2", "C"), 3)
    assert Terms.parse(terms.labels, terms.names) == terms


@pytest.mark.parametrize(
    ("label", "exponents"),
    [
        ("1", (0, 0, 0)),
        ("B", (0, 1, 0)),
        ("C:A", (1, 0, 1)),
        ("A^2:B", (2, 1, 0)),
        ("A:A", (2, 0, 0)),
        ("A^1", (1, 0, 0)),
        (" A : B^3 ", (1, 3, 0)),
    ],
)
def test_parse(label, exponents):
    assert Terms.parse([label], NAMES).exponents == (exponents,)


@pytest.mark.parametrize(
    ("label", "message"),
    [
        ("D", "term 'D' names an unknown factor 'D'; known are A, B, C"),
        ("", "term '' names an unknown factor ''"),
        ("A:", "unknown factor ''"),
        ("A::B", "unknown factor ''"),
        ("A*B", "unknown factor 'A\\*B'"),
        ("1:A", "unknown factor '1'"),
        ("a", "unknown factor 'a'"),
        ("A^0", "the power '0' must be a positive whole number"),
        ("A^-1", "the power '-1' must be a positive whole number"),
        ("A^1.5", "the power '1.5' must be a positive whole number"),
        ("A^", "the power '' must be a positive whole number"),
        ("A^²", "the power '²' must be a positive whole number"),
        ("A^2^3", "the power '2\\^3' must be a positive whole number"),
    ],
)
def test_parse_refuses(label, message):
    with pytest.raises(ValueError, match=message):
        Terms.parse(["1", label], NAMES)


def test_parse_suggests_the_nearest():
    with pytest.raises(ValueError, match="did you mean 'force'"):
        Terms.parse(["forse:C"], ("force", "C"))


@pytest.mark.parametrize(
    ("exponents", "message"),
    [
        (((1, 0),), "each term needs 3 exponents"),
        (((1, 0, -1),), "exponents must not be negative"),
        (((1, 0, 0), (0, 0, 0), (1, 0, 0)), "a term appears twice"),
    ],
)
def test_terms_refuse(exponents, message):
    with pytest.raises(ValueError, match=message):
        Terms(NAMES, exponents)


def test_the_same_term_in_two_spellings_appears_twice():
    with pytest.raises(ValueError, match="a term appears twice"):
        Terms.parse(["A:B", "B:A"], NAMES)


def test_a_negative_degree_is_refused():
    with pytest.raises(ValueError, match="degree must be 0 or more, got -1"):
        Terms.polynomial(NAMES, -1)


def test_degrees_and_select():
    terms = Terms.parse(["1", "A^2:B", "C", "A:B"], NAMES)
    assert_array_equal(terms.degrees, [0, 3, 1, 2])
    assert terms.select([3, 0]).labels == ("A:B", "1")
    assert terms.select(np.array([2])).exponents == ((0, 0, 1),)


def test_model_matrix_is_the_formula():
    terms = Terms.parse(["1", "A", "B:C", "A^2", "A^2:B", "C^3", "A:B:C"], NAMES)
    expected = np.column_stack([np.ones(7), A, B * C, A**2, A**2 * B, C**3, A * B * C])
    assert_allclose(model_matrix(terms, POINTS), expected, rtol=1e-14)


def test_model_matrix_of_terms_in_another_order():
    terms = Terms.polynomial(NAMES, 3)
    order = np.random.default_rng(1).permutation(len(terms))
    assert_array_equal(model_matrix(terms.select(order), POINTS), model_matrix(terms, POINTS)[:, order])


def test_gradient_is_the_formula():
    terms = Terms.parse(["1", "B", "A^2:B", "C^3"], NAMES)
    zero, one = np.zeros(7), np.ones(7)
    by_a = np.column_stack([zero, zero, 2 * A * B, zero])
    by_b = np.column_stack([zero, one, A**2, zero])
    by_c = np.column_stack([zero, zero, zero, 3 * C**2])
    assert_allclose(model_matrix_gradient(terms, POINTS), np.stack([by_a, by_b, by_c], axis=2), rtol=1e-14)


def test_gradient_is_that_of_central_differences():
    terms = Terms.polynomial(NAMES, 4)
    gradient, step = model_matrix_gradient(terms, POINTS), 1e-5
    for j, unit in enumerate(np.eye(3)):
        ahead, behind = (model_matrix(terms, POINTS + s * step * unit) for s in (1, -1))
        assert_allclose(gradient[:, :, j], (ahead - behind) / (2 * step), rtol=0.0, atol=1e-9)


def test_gradient_at_the_centre_is_exact():
    gradient = model_matrix_gradient(Terms.polynomial(NAMES, 2), np.zeros((1, 3)))
    assert_array_equal(gradient[0, 1:4], np.eye(3))
    assert_array_equal(gradient[0, 4:], np.zeros((6, 3)))


@pytest.mark.parametrize("function", [model_matrix, model_matrix_gradient])
@pytest.mark.parametrize("coded", [np.zeros(3), np.zeros((2, 2))], ids=["flat", "narrow"])
def test_refuses_settings_of_another_shape(function, coded):
    with pytest.raises(ValueError, match=r"coded settings must have shape \(n_runs, 3\)"):
        function(Terms.polynomial(NAMES, 1), coded)


def test_no_runs_give_an_empty_matrix():
    terms = Terms.polynomial(NAMES, 2)
    assert model_matrix(terms, np.empty((0, 3))).shape == (0, 10)
    assert model_matrix_gradient(terms, np.empty((0, 3))).shape == (0, 10, 3)

"""Bases: orthonormal where they should be, with the right slopes, and the same polynomial in monomials."""

import numpy as np
import pytest
from numpy.polynomial import chebyshev, legendre
from numpy.testing import assert_allclose

from experiments import Terms, model_matrix
from experiments.terms import model_matrix_gradient
from surrogates.basis import BASES, as_monomials, basis_gradient, basis_matrix, check_basis

TERMS = Terms.polynomial(("a", "b", "c"), 5)
POINTS = np.random.default_rng(0).uniform(-1.0, 1.0, (40, 3))


def test_legendre_terms_are_orthonormal_over_the_box():
    """By Gauss–Legendre quadrature, exact to degree 11 in each factor."""
    nodes, weights = legendre.leggauss(6)
    grid = np.stack(np.meshgrid(nodes, nodes, nodes, indexing="ij"), axis=-1).reshape(-1, 3)
    weight = np.einsum("i,j,k->ijk", weights, weights, weights).ravel() / 8.0
    matrix = basis_matrix("legendre", TERMS, grid)
    assert_allclose(matrix.T @ (matrix * weight[:, None]), np.eye(len(TERMS)), atol=1e-12)


@pytest.mark.parametrize(
    ("basis", "evaluate", "size"),
    [("legendre", legendre.legval, lambda d: np.sqrt(2 * d + 1)), ("chebyshev", chebyshev.chebval, lambda d: 1.0)],
)
def test_one_factor_agrees_with_numpy(basis, evaluate, size):
    terms = Terms.polynomial(("a",), 9)
    x = np.linspace(-1.0, 1.0, 21)
    expected = np.column_stack([evaluate(x, np.eye(d + 1)[d]) * size(d) for d in range(10)])
    assert_allclose(basis_matrix(basis, terms, x[:, None]), expected, atol=1e-12)


def test_monomials_are_the_model_matrix():
    assert_allclose(basis_matrix("monomial", TERMS, POINTS), model_matrix(TERMS, POINTS), rtol=1e-14)
    assert_allclose(basis_gradient("monomial", TERMS, POINTS), model_matrix_gradient(TERMS, POINTS), rtol=1e-13)


@pytest.mark.parametrize("basis", BASES)
def test_written_in_monomials_it_is_the_same_polynomial(basis):
    rng = np.random.default_rng(1)
    columns = np.sort(rng.choice(len(TERMS), 20, replace=False))
    coefficients = rng.normal(size=20)
    monomials, change = as_monomials(basis, TERMS, columns)
    there = basis_matrix(basis, TERMS, POINTS)[:, columns] @ coefficients
    assert_allclose(model_matrix(monomials, POINTS) @ (change @ coefficients), there, atol=1e-12)
    slopes = np.einsum("npk,p->nk", basis_gradient(basis, TERMS, POINTS)[:, columns], coefficients)
    own = np.einsum("npk,p->nk", model_matrix_gradient(monomials, POINTS), change @ coefficients)
    assert_allclose(own, slopes, atol=1e-11)


def test_no_column_is_no_monomial():
    monomials, change = as_monomials("legendre", TERMS, [])
    assert len(monomials) == 0
    assert change.shape == (0, 0)


def test_an_unknown_basis_is_refused():
    with pytest.raises(ValueError, match="basis must be one of monomial, legendre, chebyshev, got 'fourier'"):
        check_basis("fourier")


def test_settings_of_the_wrong_width_are_refused():
    with pytest.raises(ValueError, match=r"shape \(n_runs, 3\); got \(4, 2\)"):
        basis_matrix("legendre", TERMS, np.zeros((4, 2)))

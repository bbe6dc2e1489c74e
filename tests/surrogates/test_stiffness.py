"""Stiffness of a square map, held at the other responses."""

import numpy as np
from numpy.testing import assert_allclose

from surrogates.stiffness import held_stiffness


def test_of_two_coupled_springs():
    """Nodes in a row on springs k and 2k: the flexibility is [[1, 1], [1, 3/2]]/k, and its inverse has 3k and 2k."""
    k = 50.0
    found = held_stiffness(np.array([[1.0, 1.0], [1.0, 1.5]]) / k, np.ones(2))
    assert found is not None
    assert_allclose(found, [3 * k, 2 * k], rtol=1e-14)


def test_none_without_an_inverse_whatever_the_units():
    assert held_stiffness(np.ones((1, 2)), np.ones(2)) is None
    assert held_stiffness(np.array([[1e-9, 2e-9], [1e3, 2e3]]), np.array([1.0, 1e-6])) is None
    assert held_stiffness(np.array([[1e-9, 0.0], [0.0, 1e3]]), np.array([1e6, 1e-6])) is not None

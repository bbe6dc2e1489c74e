"""Small dense blocks, many at once: the batch lies in the last axes.

A vector has shape (n, ...), a matrix (n, n, ...). Products are written out as sums over the short
axis, so that XLA runs one vectorised loop over the batch instead of one small product after another.
"""

import jax.numpy as jnp
import numpy as np
from jax import Array


def multiply(first: Array, second: Array) -> Array:
    """Matrix times matrix, (n, k, ...) and (k, m, ...) to (n, m, ...)."""
    total = first[:, 0, None] * second[None, 0]
    for k in range(1, first.shape[1]):
        total = total + first[:, k, None] * second[None, k]
    return total


def apply(matrix: Array, vector: Array) -> Array:
    """Matrix times vector, (n, k, ...) and (k, ...) to (n, ...)."""
    return multiply(matrix, vector[:, None])[:, 0]


def transpose(matrix: Array) -> Array:
    """Of every block."""
    return jnp.swapaxes(matrix, 0, 1)


def inverse(matrix: Array) -> tuple[Array, Array]:
    """Inverse and pivots of every block, (n, n, ...) and (n, ...), by Gauss–Jordan without exchange of rows.

    Of a symmetric block as many pivots are negative as eigenvalues (Sylvester's law of inertia).
    Without exchanges a leading minor that vanishes spoils the inverse: the caller iterates, and
    judges by residuals.
    """
    size, tail = matrix.shape[0], (1,) * (matrix.ndim - 2)
    pivots = []
    for p in range(size):
        here = np.arange(size) == p
        row_mask, column_mask = here.reshape(size, 1, *tail), here.reshape(1, size, *tail)
        pivot = matrix[p, p]
        row, column = matrix[p] / pivot, matrix[:, p]
        row = jnp.where(here.reshape(size, *tail), 1 / pivot, row)
        rest = jnp.where(column_mask, 0.0, matrix) - column[:, None] * row[None]
        matrix = jnp.where(row_mask, row[None], rest)
        pivots.append(pivot)
    return matrix, jnp.stack(pivots)


def cross(first: Array, second: Array) -> Array:
    """Vector product, (3, ...)."""
    a, b, c = first
    x, y, z = second
    return jnp.stack([b * z - c * y, c * x - a * z, a * y - b * x])


def skew(vector: Array) -> Array:
    """The matrix of ``vector × ·``, (3, 3, ...)."""
    x, y, z = vector
    o = jnp.zeros_like(x)
    return jnp.stack([jnp.stack([o, -z, y]), jnp.stack([z, o, -x]), jnp.stack([-y, x, o])])


def four(upper_left: Array, upper_right: Array, lower_left: Array, lower_right: Array) -> Array:
    """One matrix of four, (n + m, n + m, ...)."""
    upper = jnp.concatenate([upper_left, upper_right], axis=1)
    return jnp.concatenate([upper, jnp.concatenate([lower_left, lower_right], axis=1)], axis=0)

"""The straight two-node Timoshenko beam in space.

Pure functions of one member, to be mapped over members with ``jax.vmap``; differentiable in
coordinates and properties. The stiffness is exact for loads at the ends.

Source: Przemieniecki, Theory of Matrix Structural Analysis (1968), §5.6.
"""

from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jax import Array

# The four unknowns of each bending plane among the twelve of a member, and the sign of its slopes:
# in the xy-plane θz = dv/dx, in the xz-plane θy = −dw/dx.
XY, XZ = (1, 5, 7, 11), (2, 4, 8, 10)
XZ_SIGNS = np.array([1.0, -1.0, 1.0, -1.0])


class Properties(NamedTuple):
    """Material and section of a member as numbers, or of all members as arrays of shape (n_members,); SI."""

    young: Array
    shear: Array
    area: Array
    second_moment_y: Array
    second_moment_z: Array
    torsion_constant: Array
    shear_area_y: Array
    shear_area_z: Array


def local_axes(start: Array, end: Array, up: Array) -> Array:
    """Rotation from global to local axes, shape (3, 3): its rows are the local x, y, z."""
    x = end - start
    x = x / jnp.linalg.norm(x)
    z = up - x * (up @ x)
    z = z / jnp.linalg.norm(z)
    return jnp.stack([x, jnp.cross(z, x), z])


def rotation(start: Array, end: Array, up: Array) -> Array:
    """Rotation of a member's twelve unknowns from global to local axes, shape (12, 12)."""
    return jnp.kron(jnp.eye(4), local_axes(start, end, up))


def shear_parameters(length: Array, p: Properties) -> tuple[Array, Array]:
    """Φ_y = 12 E I_z / (G A_sy L²) and Φ_z = 12 E I_y / (G A_sz L²); zero for an infinite shear area."""
    phi_y = 12 * p.young * p.second_moment_z * _inverse(p.shear_area_y) / (p.shear * length**2)
    phi_z = 12 * p.young * p.second_moment_y * _inverse(p.shear_area_z) / (p.shear * length**2)
    return phi_y, phi_z


def local_stiffness(length: Array, p: Properties) -> Array:
    """Stiffness in local axes, shape (12, 12); unknowns (u, v, w, θx, θy, θz) at start, then at end."""
    phi_y, phi_z = shear_parameters(length, p)
    rod = jnp.array([[1.0, -1.0], [-1.0, 1.0]])
    xy = _bending(length, p.young * p.second_moment_z, phi_y)
    xz = _bending(length, p.young * p.second_moment_y, phi_z) * np.outer(XZ_SIGNS, XZ_SIGNS)
    k = jnp.zeros((12, 12))
    k = k.at[np.ix_((0, 6), (0, 6))].set(p.young * p.area / length * rod)
    k = k.at[np.ix_((3, 9), (3, 9))].set(p.shear * p.torsion_constant / length * rod)
    return k.at[np.ix_(XY, XY)].set(xy).at[np.ix_(XZ, XZ)].set(xz)


def member_stiffness(start: Array, end: Array, up: Array, p: Properties) -> Array:
    """Stiffness in global axes, shape (12, 12), from the end points (3,), `up` (3,) and properties."""
    turn = rotation(start, end, up)
    return turn.T @ local_stiffness(jnp.linalg.norm(end - start), p) @ turn


def end_forces(start: Array, end: Array, up: Array, p: Properties, displacements: Array) -> Array:
    """Forces that the nodes exert on the member, in local axes, N and N m.

    Parameters
    ----------
    start, end, up : Array, shape (3,)
    p : Properties
    displacements : Array, shape (..., 12)
        Motions of both ends in global axes, m and rad.

    Returns
    -------
    Array, shape (..., 12)
    """
    k = local_stiffness(jnp.linalg.norm(end - start), p)
    return displacements @ rotation(start, end, up).T @ k


def _bending(length: Array, bending_stiffness: Array, phi: Array) -> Array:
    """Stiffness of one bending plane for (v₁, slope₁, v₂, slope₂), shape (4, 4)."""
    a, b, c = 6 * length, (4 + phi) * length**2, (2 - phi) * length**2
    k = jnp.array([[12, a, -12, a], [a, b, -a, c], [-12, -a, 12, -a], [a, c, -a, b]])
    return bending_stiffness / (length**3 * (1 + phi)) * k


def _inverse(shear_area: Array) -> Array:
    """1/A, zero where A is infinite; both branches are finite, so that derivatives are too."""
    finite = jnp.isfinite(shear_area)
    return jnp.where(finite, 1 / jnp.where(finite, shear_area, 1.0), 0.0)

"""The two-node Timoshenko beam in space, straight or a circular arc.

Pure functions of one member, to be mapped over members with ``jax.vmap``; differentiable in its shape
and properties. The stiffness is exact for loads at the ends: in closed form for a straight member, by
the complementary energy of the loaded end for an arc.

Source: Przemieniecki, Theory of Matrix Structural Analysis (1968), §5.6 (straight), ch. 7 (flexibility).
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.scipy.linalg import block_diag

from .blocks import skew
from .shapes import Shapes

# The four unknowns of each bending plane among the twelve of a member, and the sign of its slopes:
# in the xy-plane θz = dv/dx, in the xz-plane θy = −dw/dx.
XY, XZ = (1, 5, 7, 11), (2, 4, 8, 10)
XZ_SIGNS = np.array([1.0, -1.0, 1.0, -1.0])

# The integrand has frequencies of up to four times the bend: 24 points give float64 to a full turn.
GAUSS_POINTS, GAUSS_WEIGHTS = np.polynomial.legendre.leggauss(24)


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


def along(shape: Shapes, s: Array | float) -> tuple[Array, Array]:
    """The section at the fraction `s` of a member's length, in the axes of its start.

    Returns
    -------
    place : Array, shape (3,)
        From the start, m.
    turn : Array, shape (3, 3)
        From its own axes to those of the start.
    """
    spin = skew(shape.bend) * s
    sine, versine = _sine_and_versine((shape.bend @ shape.bend) * s**2)
    turn = jnp.eye(3) + sine * spin + versine * spin @ spin
    return shape.length * s * (sine * jnp.eye(3)[0] + versine * spin[:, 0]), turn


def rotation(shape: Shapes) -> Array:
    """Rotation of a member's twelve unknowns from global to its local axes at each end, shape (12, 12)."""
    start, end = shape.axes, along(shape, 1.0)[1].T @ shape.axes
    return block_diag(start, start, end, end)


def shear_parameters(length: Array, p: Properties) -> tuple[Array, Array]:
    """Φ_y = 12 E I_z / (G A_sy L²) and Φ_z = 12 E I_y / (G A_sz L²); zero for an infinite shear area."""
    phi_y = 12 * p.young * p.second_moment_z * inverse_area(p.shear_area_y) / (p.shear * length**2)
    phi_z = 12 * p.young * p.second_moment_y * inverse_area(p.shear_area_z) / (p.shear * length**2)
    return phi_y, phi_z


def straight_stiffness(length: Array, p: Properties) -> Array:
    """Stiffness in local axes, shape (12, 12); unknowns (u, v, w, θx, θy, θz) at start, then at end."""
    phi_y, phi_z = shear_parameters(length, p)
    rod = jnp.array([[1.0, -1.0], [-1.0, 1.0]])
    xy = _bending(length, p.young * p.second_moment_z, phi_y)
    xz = _bending(length, p.young * p.second_moment_y, phi_z) * np.outer(XZ_SIGNS, XZ_SIGNS)
    k = jnp.zeros((12, 12))
    k = k.at[np.ix_((0, 6), (0, 6))].set(p.young * p.area / length * rod)
    k = k.at[np.ix_((3, 9), (3, 9))].set(p.shear * p.torsion_constant / length * rod)
    return k.at[np.ix_(XY, XY)].set(xy).at[np.ix_(XZ, XZ)].set(xz)


def flexibility(shape: Shapes, p: Properties, s: Array | float = 1.0) -> Array:
    """Motion of the section at `s`, the start held, per wrench upon it; in the axes of the start, (6, 6).

    The wrench w gives the section at t ≤ s the internal forces B w in its own axes, and the
    complementary energy ½ ∫ wᵀ Bᵀ C B w dx, with C the compliance of the section.
    """
    loaded = along(shape, s)[0]
    compliance = jnp.stack(
        [
            1 / (p.young * p.area),
            inverse_area(p.shear_area_y) / p.shear,
            inverse_area(p.shear_area_z) / p.shear,
            1 / (p.shear * p.torsion_constant),
            1 / (p.young * p.second_moment_y),
            1 / (p.young * p.second_moment_z),
        ]
    )

    def per_length(t: Array) -> Array:
        place, turn = along(shape, t)
        internal = jnp.block([[turn.T, jnp.zeros((3, 3))], [turn.T @ skew(loaded - place), turn.T]])
        return (internal.T * compliance) @ internal

    at_points = jax.vmap(per_length)(jnp.asarray(s * (1 + GAUSS_POINTS) / 2))
    return shape.length * s / 2 * jnp.tensordot(GAUSS_WEIGHTS, at_points, axes=1)


def arc_stiffness(shape: Shapes, p: Properties) -> Array:
    """Stiffness of an arc, H F⁻¹ Hᵀ, in the local axes at each end, shape (12, 12).

    Hᵀ gives the motion of the end beside that of the start as a rigid body, in the axes of the start.
    """
    f = flexibility(shape, p)
    scale = 1 / jnp.sqrt(jnp.diag(f))
    inverse = scale[:, None] * jnp.linalg.inv(scale[:, None] * f * scale) * scale
    place, turn = along(shape, 1.0)
    unit, none = jnp.eye(3), jnp.zeros((3, 3))
    deformation = jnp.block([[-unit, skew(place), turn, none], [none, -unit, none, turn]])
    return deformation.T @ (inverse + inverse.T) @ deformation / 2


def local_stiffness(shape: Shapes, p: Properties) -> Array:
    """Stiffness in the local axes at each end, shape (12, 12)."""
    return jnp.where(jnp.any(shape.bend != 0), arc_stiffness(shape, p), straight_stiffness(shape.length, p))


def member_stiffness(shape: Shapes, p: Properties) -> tuple[Array, Array]:
    """Stiffness in global axes, and end forces in local axes per motion in global axes; (12, 12) each."""
    turn = rotation(shape)
    recovery = local_stiffness(shape, p) @ turn
    return turn.T @ recovery, recovery


def _bending(length: Array, bending_stiffness: Array, phi: Array) -> Array:
    """Stiffness of one bending plane for (v₁, slope₁, v₂, slope₂), shape (4, 4)."""
    a, b, c = 6 * length, (4 + phi) * length**2, (2 - phi) * length**2
    k = jnp.array([[12, a, -12, a], [a, b, -a, c], [-12, -a, 12, -a], [a, c, -a, b]])
    return bending_stiffness / (length**3 * (1 + phi)) * k


def inverse_area(shear_area: Array) -> Array:
    """1/A, zero where A is infinite; both branches are finite, so that derivatives are too."""
    finite = jnp.isfinite(shear_area)
    return jnp.where(finite, 1 / jnp.where(finite, shear_area, 1.0), 0.0)


def _sine_and_versine(square: Array) -> tuple[Array, Array]:
    """sin x / x and (1 − cos x) / x² of x²; differentiable at zero, where three terms give float64."""

    def sine(square: Array) -> Array:
        small = square < 1e-4
        x = jnp.sqrt(jnp.where(small, 1.0, square))
        return jnp.where(small, 1 - square / 6 * (1 - square / 20), jnp.sin(x) / x)

    return sine(square), sine(square / 4) ** 2 / 2

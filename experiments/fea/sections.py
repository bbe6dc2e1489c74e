"""Cross-sections: what a beam needs to know of its shape.

Local y and z are the principal axes through the centroid; ``second_moment_y`` = ∫ z² dA resists
bending about y, that is, deflection along z.
"""

import math
from dataclasses import dataclass, fields

import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.typing import ArrayLike

from .precision import in_float64

ZETA_5 = 1.0369277551433699  # Riemann's ζ(5)


@dataclass(frozen=True)
class Section:
    """A cross-section.

    Parameters
    ----------
    area : float
        m².
    second_moment_y, second_moment_z : float
        ∫ z² dA and ∫ y² dA, m⁴.
    torsion_constant : float
        J in torque = G J × twist per length, m⁴.
    shear_area_y, shear_area_z : float
        Area × shear coefficient for shear along y and z, m²; ``math.inf`` gives the Euler–Bernoulli beam.
    extreme_y, extreme_z : float
        From the centroid to the outermost fibres along y and z, m; NaN where unknown, and then the stress is.
    is_round : bool
        Bending stresses about y and z add as vectors, as on a circle, not as on the corner of a rectangle.

    Raises
    ------
    ValueError
        If a property is not positive, or one other than a shear area is not finite.
    """

    area: float
    second_moment_y: float
    second_moment_z: float
    torsion_constant: float
    shear_area_y: float = math.inf
    shear_area_z: float = math.inf
    extreme_y: float = math.nan
    extreme_z: float = math.nan
    is_round: bool = False

    def __post_init__(self) -> None:
        for field in fields(self)[:-1]:
            value = getattr(self, field.name)
            if field.name.startswith("extreme") and math.isnan(value):
                continue
            if not value > 0 or (math.isinf(value) and not field.name.startswith("shear")):
                raise ValueError(f"{field.name} of a section must be positive and finite, got {value}")


@in_float64
def rectangle(width: float, thickness: float, shear_coefficient: float = 5 / 6) -> Section:
    """The solid rectangle, `width` along local y and `thickness` along local z.

    Parameters
    ----------
    width, thickness : float
        m.
    shear_coefficient : float
        Shear area over area; 5/6 from the strain energy of a parabolic shear stress, ``math.inf`` for the
        Euler–Bernoulli beam.

    Returns
    -------
    Section

    Raises
    ------
    ValueError
        If a size or the coefficient is not positive.
    """
    _check_positive("width", width)
    _check_positive("thickness", thickness)
    if not shear_coefficient > 0:
        raise ValueError(f"shear_coefficient must be positive, got {shear_coefficient}")
    numbers = map(float, rectangle_properties(width, thickness, shear_coefficient))
    return Section(*numbers, extreme_y=width / 2, extreme_z=thickness / 2)


def circle(diameter: float, shear_coefficient: float = 9 / 10) -> Section:
    """The solid circle.

    Parameters
    ----------
    diameter : float
        m.
    shear_coefficient : float
        Shear area over area; 9/10 from the strain energy of a parabolic shear stress, ``math.inf`` for
        the Euler–Bernoulli beam.

    Raises
    ------
    ValueError
        If the diameter or the coefficient is not positive.
    """
    _check_positive("diameter", diameter)
    if not shear_coefficient > 0:
        raise ValueError(f"shear_coefficient must be positive, got {shear_coefficient}")
    area, second_moment = math.pi * diameter**2 / 4, math.pi * diameter**4 / 64
    shear_area = shear_coefficient * area
    radius = diameter / 2
    return Section(
        area, second_moment, second_moment, 2 * second_moment, shear_area, shear_area, radius, radius, is_round=True
    )


def rectangle_properties(
    width: ArrayLike, thickness: ArrayLike, shear_coefficient: ArrayLike = 5 / 6
) -> tuple[Array, ...]:
    """The six numbers of a rectangular :class:`Section`, in its order; differentiable in all arguments."""
    width, thickness = jnp.asarray(width, float), jnp.asarray(thickness, float)
    area = width * thickness
    bernoulli = jnp.isinf(shear_coefficient)  # ∞ × area would have no derivative
    shear_area = jnp.where(bernoulli, jnp.inf, jnp.where(bernoulli, 1.0, shear_coefficient) * area)
    return (
        area,
        area * thickness**2 / 12,
        area * width**2 / 12,
        rectangle_torsion_constant(width, thickness),
        shear_area,
        shear_area,
    )


def rectangle_torsion_constant(width: Array, thickness: Array) -> Array:
    """Saint-Venant's torsion constant of the solid rectangle, m⁴.

    J = k₁ a³ b with a the shorter and b the longer side, and
    k₁ = (1/3) (1 − (192/π⁵) (a/b) Σ tanh(nπb/2a) / n⁵) over odd n.

    Since 1 − tanh x = 2/(e²ˣ + 1) and Σ 1/n⁵ = (31/32) ζ(5) over odd n, seven terms give float64.

    Source: Timoshenko & Goodier, Theory of Elasticity, 3rd ed., §109.
    """
    shorter, longer = jnp.minimum(width, thickness), jnp.maximum(width, thickness)
    odd = np.arange(1, 15, 2)
    decay = jnp.exp(-np.pi * odd * (longer / shorter))
    total = 31 / 32 * ZETA_5 - jnp.sum(2 * decay / (1 + decay) / odd**5)
    k1 = (1 - 192 / np.pi**5 * (shorter / longer) * total) / 3
    return k1 * shorter**3 * longer


def _check_positive(name: str, value: float) -> None:
    if not (math.isfinite(value) and value > 0):
        raise ValueError(f"{name} must be a positive length in m, got {value}")

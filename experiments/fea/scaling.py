"""From a frame in SI units to the arrays of a condensed problem, of order one; pure functions of its geometry.

Written with ``jax.numpy`` so that coordinates and sections can be traced and batched: the last axis of
every array is n_points or 1.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from numpy.typing import NDArray

from .arrays import FrameArrays
from .condensed import Space
from .elements import Properties, along, inverse_area
from .planar import Planar
from .rods import Rods
from .shapes import Shapes, shapes
from .spatial import conjugate, product, quaternion, quaternion_of, rotated


class Units(NamedTuple):
    """What one means: a length in m and a force in N; moments in their product."""

    length: float
    force: float


class Geometry(NamedTuple):
    """What may differ from point to point.

    Parameters
    ----------
    coordinates : Array, shape (3, n_nodes, ...)
        m.
    through : Array, shape (3, n_members, ...)
        A point of each member between its ends, m; of a straight one the middle of the chord.
    up : Array, shape (3, n_members, ...)
        Direction whose part normal to the member is local z.
    properties : Properties
        Of shape (n_members, ...), SI.
    """

    coordinates: Array | NDArray[np.float64]
    through: Array | NDArray[np.float64]
    up: Array | NDArray[np.float64]
    properties: Properties


def geometry(arrays: FrameArrays) -> Geometry:
    """Of the frame as it is."""
    return Geometry(
        arrays.coordinates.T[:, :, None],
        arrays.through.T[:, :, None],
        arrays.up.T[:, :, None],
        Properties(*(p[:, None] for p in arrays.properties)),
    )


def units(arrays: FrameArrays) -> Units:
    """The mean length of the members, and the bending stiffness that is in the middle of all."""
    p = arrays.properties
    bending = np.median(np.asarray(p.young) * np.minimum(p.second_moment_y, p.second_moment_z))
    length = float(arrays.lengths.mean())
    return Units(length, float(bending) / length**2)


def condensed(
    arrays: FrameArrays, space: Space, unit: Units, n_steps: int, geometry: Geometry
) -> tuple[Rods, Array, Array]:
    """The members, the poses of blocks (P, n_blocks, …) and the centres of sections (3, n_steps + 1, n_members, …)."""
    masters = arrays.master[[np.flatnonzero(arrays.block == b)[0] for b in range(arrays.n_blocks)]]
    place = jnp.asarray(geometry.coordinates)[:, masters] / unit.length
    unturned = space.unturned.reshape(-1, 1, 1) + 0 * place[:1]
    shape = member_shapes(arrays, geometry)
    at = jnp.linspace(0.0, 1.0, n_steps + 1)

    def places(shape: Shapes) -> Array:
        return jax.vmap(lambda s: along(shape, s)[0])(at).T

    local = jax.vmap(jax.vmap(places, -1, -1), -1, -1)(shape)
    start = geometry.coordinates[:, None, arrays.ends[:, 0]]
    centre = (start + (local[:, None] * shape.axes[:, :, None]).sum(0)) / unit.length
    rest = jnp.concatenate([place[: space.n_translations], unturned])
    return rods(arrays, space, unit, geometry, shape), rest, centre


def member_shapes(arrays: FrameArrays, geometry: Geometry) -> Shapes:
    """The shapes of the members in a geometry."""
    x, a, b = geometry.coordinates, arrays.ends[:, 0], arrays.ends[:, 1]
    through = jnp.where(arrays.is_curved[:, None], geometry.through, (x[:, a] + x[:, b]) / 2)
    return shapes(jnp, x[:, a], x[:, b], through, geometry.up)


def rods(arrays: FrameArrays, space: Space, unit: Units, geometry: Geometry, shape: Shapes) -> Rods:
    """The members of a frame."""
    x, a, b = jnp.asarray(geometry.coordinates), arrays.ends[:, 0], arrays.ends[:, 1]
    offsets = [(x[:, n] - x[:, arrays.master[n]]) / unit.length for n in (a, b)]
    length = shape.length / unit.length
    p, f = geometry.properties, unit.force
    shear = [inverse_area(p.shear_area_y) / p.shear, inverse_area(p.shear_area_z) / p.shear]
    bending = f * unit.length**2
    ones = jnp.ones_like(length)
    if isinstance(space, Planar):
        return _planar(
            shape,
            offsets,
            length,
            [f / (p.young * p.area), f * shear[0], bending / (p.young * p.second_moment_z)],
            ones,
        )
    give = [
        f / (p.young * p.area),
        f * shear[0],
        f * shear[1],
        bending / (p.shear * p.torsion_constant),
        bending / (p.young * p.second_moment_y),
        bending / (p.young * p.second_moment_z),
    ]
    start = quaternion_of(jnp.swapaxes(shape.axes, 0, 1))
    back = conjugate(tuple(product(tuple(start), tuple(quaternion(shape.bend)))))
    end = [*rotated(back, tuple(-offsets[1])), *back]
    strain = jnp.stack([ones, 0 * ones, 0 * ones, *(shape.bend / length)])
    return Rods(_stacked([*(offsets[0]), *start], ones), _stacked(end, ones), length, _stacked(give, ones), strain)


def _planar(shape, offsets: list[Array], length: Array, give: list[Array], ones: Array) -> Rods:
    tangent, bend = shape.axes[0], (shape.axes * shape.bend[:, None]).sum(0)[2]
    angle = jnp.arctan2(tangent[1], tangent[0])
    c, s = jnp.cos(angle + bend), jnp.sin(angle + bend)
    dx, dy, _ = -offsets[1]
    end = [c * dx + s * dy, c * dy - s * dx, -(angle + bend)]
    strain = jnp.stack([ones, 0 * ones, bend / length])
    return Rods(
        _stacked([offsets[0][0], offsets[0][1], angle, jnp.cos(angle), jnp.sin(angle)], ones),
        _stacked(end, ones),
        length,
        _stacked(give, ones),
        strain,
    )


def _stacked(parts: list[Array], ones: Array) -> Array:
    return jnp.stack([part * ones for part in parts])

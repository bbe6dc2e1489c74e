"""Directions in which loads, prescribed motions and geometry change, from SI units to those of a problem."""

from functools import lru_cache
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray

from . import scaling
from .arrays import FrameArrays
from .blockloads import dead_loads, prescribed
from .condensed import Topology
from .scaling import Geometry, Units
from .sensitivity import Directions

Floats = NDArray[np.float64]


class Toward(NamedTuple):
    """m directions, SI units.

    Parameters
    ----------
    loads, motions : ndarray, shape (m, n_nodes, 6)
    geometry : Geometry, optional
        m first.
    """

    loads: Floats
    motions: Floats
    geometry: Geometry | None


def directions(
    arrays: FrameArrays, topology: Topology, unit: Units, toward: Toward, geometry: Geometry, loads: Floats
) -> Directions:
    """Of the problem of a chunk of cases, whose `loads` have the shape (n_cases, n_nodes, 6)."""
    space, place = topology.space, np.asarray(geometry.coordinates)

    def dead(coordinates: Floats, loads: Floats) -> Floats:
        n_cases = max(coordinates.shape[-1], len(loads))
        return dead_loads(arrays, space, unit, coordinates, np.broadcast_to(loads, (n_cases, *loads.shape[1:])))

    pulled = jnp.asarray(np.stack([dead(place, one[None]) for one in toward.loads]))
    motion = jnp.moveaxis(jnp.asarray(prescribed(arrays, space, unit, toward.motions)), -1, 0)[..., None]
    still = jnp.zeros((len(pulled), space.size, arrays.n_blocks, 1))
    if toward.geometry is None:
        return Directions(pulled, still, motion)
    change = jax.tree.map(lambda g, d: spread(d, g, len(pulled)), geometry, toward.geometry)
    geometry = jax.tree.map(lambda g, d: np.broadcast_to(g, d.shape[1:]), geometry, change)
    rods, rest = _rates(arrays, topology, unit)(geometry, change)
    # Loads depend on the places of their nodes linearly, by their arms.
    moved = np.stack([dead(np.asarray(one), loads) - dead(0 * place, loads) for one in change.coordinates])
    return Directions(pulled + moved, still, motion, rods, rest)


def spread(change: Any, of: Any, m: int) -> Floats:
    """`change`, of shape (m, …) or (1,), repeated to the shape (m, *of.shape), or that with all points.

    ``ValueError`` if it does not fit.
    """
    points = max(np.shape(of)[-1], np.shape(change)[-1] if np.ndim(change) > 1 else 1)
    shape = (m, *np.shape(of)[:-1], points)
    try:
        return np.broadcast_to(np.asarray(change, dtype=np.float64), shape)
    except ValueError:
        raise ValueError(
            f"geometry_directions must have the shapes of a geometry with the {m} directions as first axis; "
            f"got {np.shape(change)} where {shape} is wanted"
        ) from None


@lru_cache(maxsize=32)
def _rates(arrays: FrameArrays, topology: Topology, unit: Units) -> Any:
    """Change of the members and of the poses at rest per unit of each change of the geometry."""

    def condensed(geometry: Geometry) -> Any:
        return scaling.condensed(arrays, topology.space, unit, topology.n_steps, geometry)[:2]

    def along(geometry: Geometry, change: Geometry) -> Any:
        return jax.vmap(lambda one: jax.jvp(condensed, (geometry,), (one,))[1])(change)

    return jax.jit(along)

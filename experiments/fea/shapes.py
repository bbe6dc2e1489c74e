"""The shape of members at rest: length, local axes, bend. Straight members and circular arcs alike.

Written once for NumPy and for JAX, whichever module is handed in, so that a frame is described by the
numbers that a traced geometry gives.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike


class Shapes(NamedTuple):
    """Members at rest; vectors come first, the batch axes after them.

    Parameters
    ----------
    length : array, shape (...)
        Along the member, m.
    axes : array, shape (3, 3, ...)
        Local x, y and z at the start, as rows.
    bend : array, shape (3, ...)
        Rotation vector of the section from start to end, in local axes; zero for straight members.
    """

    length: Any
    axes: Any
    bend: Any


def shapes(xp: Any, start: Any, end: Any, through: Any, up: Any) -> Shapes:
    """Shapes of members from points and directions of shape (3, ...), m.

    The tangent of an arc and its chord enclose half the angle of the arc, and the chord is seen from
    any point of the arc under π minus that half (Euclid III.32). `through` on the chord, for instance
    in its middle, makes the member straight.

    Parameters
    ----------
    xp : module
        ``numpy`` or ``jax.numpy``.
    start, end, through, up : array, shape (3, ...)
        `up` need not be normal to the member.
    """
    chord = end - start
    along = _size(xp, chord)
    seen = _cross(xp, through - start, end - through)
    size2 = (seen * seen).sum(0)
    straight = size2 <= 1e-24 * along**4
    size = xp.sqrt(xp.where(straight, 1.0, size2))
    half = xp.where(straight, 0.0, xp.arctan2(size, ((through - start) * (end - through)).sum(0)))
    normal = xp.where(straight, 0.0, 1.0) * seen / size
    x = chord / along
    tangent = xp.cos(half) * x - xp.sin(half) * _cross(xp, normal, x)
    length = along * xp.where(straight, 1.0, half / xp.where(straight, 1.0, xp.sin(half)))
    z = up - tangent * (up * tangent).sum(0)
    z = z / _size(xp, z)
    axes = xp.stack([tangent, _cross(xp, z, tangent), z])
    return Shapes(length, axes, 2 * half * (axes * normal[None]).sum(1))


def arc_normal(start: ArrayLike, through: ArrayLike, end: ArrayLike) -> Any:
    """Normal of the plane of three points (3,), not normalised; small beside the chord squared if they are in line."""
    start, through, end = (np.asarray(point, dtype=np.float64) for point in (start, through, end))
    return np.cross(through - start, end - through)


def _size(xp: Any, vector: Any) -> Any:
    return xp.sqrt((vector * vector).sum(0))


def _cross(xp: Any, first: Any, second: Any) -> Any:
    a, b, c = first
    x, y, z = second
    return xp.stack([b * z - c * y, c * x - a * z, a * y - b * x])

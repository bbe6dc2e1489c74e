"""The stiffness of the bodies of a frame from the shapes of its members, for many geometries: points come last.

That of straight members is the closed form of :func:`.elements.straight_stiffness` written as outer
products of the local axes: no matrix of twelve rows is turned, and every operation runs along the points.

Source: Przemieniecki, Theory of Matrix Structural Analysis (1968), §5.6.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from numpy.typing import NDArray

from .arrays import FrameArrays
from .blocks import cross, four, multiply, skew, transpose
from .elements import member_stiffness, shear_parameters
from .elimination import Plan, Sum
from .scaling import Geometry
from .scaling import member_shapes as shapes_of

Blocks = tuple[Array, Array, Array, Array]
"""Force per translation and per rotation, moment per translation and per rotation; (3, 3, n_members, n_points) each."""


class Joined(NamedTuple):
    """Which blocks of which members count, since no body that stays put needs a stiffness.

    Parameters
    ----------
    members : tuple of ndarray of int
        For (start, start), (start, end), (end, start) and (end, end).
    entries : Sum
        Entries of a plan from these, one after the other.
    """

    members: tuple[NDArray[np.int64], ...]
    entries: Sum


def joined(arrays: FrameArrays, plan: Plan) -> Joined:
    """What the bodies of `arrays` that may move take from the members."""
    place = {pair: i for i, pair in enumerate(plan.entries)}
    ends = arrays.block[arrays.ends].tolist()
    members: list[list[int]] = []
    entries: list[list[int]] = [[] for _ in place]
    count = 0
    for first, second in ((0, 0), (0, 1), (1, 0), (1, 1)):
        members.append([m for m, pair in enumerate(ends) if (pair[first], pair[second]) in place])
        for m in members[-1]:
            entries[place[ends[m][first], ends[m][second]]].append(count)
            count += 1
    return Joined(tuple(np.array(some, dtype=np.int64) for some in members), Sum.of(entries))


def stiffness(arrays: FrameArrays, which: Joined, geometry: Geometry) -> Array:
    """Entries of the stiffness of the bodies about their origins, in global axes, (6, 6, n_entries, n_points), SI."""
    x, nodes = jnp.asarray(geometry.coordinates), arrays.ends.T
    near, between, far = (_general if arrays.is_curved.any() else _straight)(arrays, geometry)

    def arms(side: int, members: NDArray[np.int64]) -> Array | None:
        node = nodes[side][members]
        master = arrays.master[node]
        return None if (master == node).all() else skew(x[:, node] - x[:, master])

    def carried(blocks: Blocks, first: int, second: int) -> Array:
        members = which.members[2 * first + second]
        force, right, left, turn = (part[:, :, members] for part in blocks)
        arm, other = arms(first, members), arms(second, members)
        if other is not None:
            right, turn = right - multiply(force, other), turn - multiply(left, other)
        if arm is not None:
            left, turn = left + multiply(arm, force), turn + multiply(arm, right)
        return four(force, right, left, turn)

    across = carried(between, 0, 1)
    return which.entries(jnp.concatenate([carried(near, 0, 0), across, transpose(across), carried(far, 1, 1)], axis=2))


def _straight(arrays: FrameArrays, geometry: Geometry) -> tuple[Blocks, Blocks, Blocks]:
    """Straight members about their ends: (start, start), (start, end), (end, end)."""
    x, p = jnp.asarray(geometry.coordinates), geometry.properties
    chord = x[:, arrays.ends[:, 1]] - x[:, arrays.ends[:, 0]]
    length2 = (chord * chord).sum(0)
    length = jnp.sqrt(length2)
    along, up = chord / length, jnp.asarray(geometry.up)
    z = up - along * (up * along).sum(0)
    z = z / jnp.sqrt((z * z).sum(0))
    y = cross(z, along)

    phi_y, phi_z = shear_parameters(length, p)
    bend_y = p.young * p.second_moment_z / (length2 * length * (1 + phi_y))
    bend_z = p.young * p.second_moment_y / (length2 * length * (1 + phi_z))
    twist = p.shear * p.torsion_constant / length
    xx, yy, zz, yz = (first[:, None] * second[None] for first, second in ((along, along), (y, y), (z, z), (y, z)))
    force = p.young * p.area / length * xx + 12 * bend_y * yy + 12 * bend_z * zz
    couple = 6 * length * (bend_y * yz - bend_z * transpose(yz))
    back, about_z, about_y = transpose(couple), length2 * bend_y, length2 * bend_z
    same = twist * xx + (4 + phi_y) * about_z * zz + (4 + phi_z) * about_y * yy
    other = -twist * xx + (2 - phi_y) * about_z * zz + (2 - phi_z) * about_y * yy
    return (force, couple, back, same), (-force, couple, -back, other), (force, -couple, -back, same)


def _general(arrays: FrameArrays, geometry: Geometry) -> tuple[Blocks, Blocks, Blocks]:
    """The same of members that may be arcs."""
    shape = shapes_of(arrays, geometry)
    each = jax.vmap(jax.vmap(lambda shape, p: member_stiffness(shape, p)[0], -1, -1), -1, -1)
    whole = each(shape, jax.tree.map(lambda part: part + 0 * shape.length, geometry.properties))

    def blocks(row: int, column: int) -> Blocks:
        rows, columns = ((6 * k, 6 * k + 3) for k in (row, column))
        first, second, third, fourth = (whole[r : r + 3, c : c + 3] for r in rows for c in columns)
        return first, second, third, fourth

    return blocks(0, 0), blocks(0, 1), blocks(1, 1)

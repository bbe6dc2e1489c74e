"""Motions in space: a pose is (x, y, z, w, i, j, k) with a unit quaternion, a motion a translation and a spin.

The batch lies in the last axes of every array. Rotations are never added: a spin, in global axes,
multiplies the quaternion, so that large rotations have no order in which they were made.
"""

from dataclasses import dataclass
from typing import ClassVar

import jax.numpy as jnp
import numpy as np
from jax import Array

from .blocks import apply, four, multiply, skew
from .rods import Along, Components, Rods, along, even_series, integrate


@dataclass(frozen=True)  # any two are equal
class Spatial:
    """Space as the nonlinear solver sees it; :class:`.planar.Planar` has the same methods."""

    size: ClassVar[int] = 6
    block: ClassVar[int] = 16
    """Points that are worked on together: few enough for the cache, enough to fill the vector unit."""
    n_pose: ClassVar[int] = 7
    n_translations: ClassVar[int] = 3
    n_dead: ClassVar[int] = 15
    unturned: ClassVar = np.array([1.0, 0.0, 0.0, 0.0])
    motions: ClassVar[tuple[int, ...]] = (0, 1, 2, 3, 4, 5)
    """Which of the six motions of a node these are."""

    # --- along a member -------------------------------------------------------------------------

    def rates(self, internal: Components, strain: Components) -> Components:
        """N' = N × κ and M' = M × κ + N × γ."""
        n, m, g, k = internal[:3], internal[3:], strain[:3], strain[3:]
        return (*_cross(n, k), *(a + b for a, b in zip(_cross(m, k), _cross(n, g), strict=True)))

    def bracket(self, first: Components, second: Components) -> Components:
        """Commutator of two strains."""
        v, p, w, q = first[:3], first[3:], second[:3], second[3:]
        return (*(a - b for a, b in zip(_cross(p, w), _cross(q, v), strict=True)), *_cross(p, q))

    def screwed(self, pose: Components, screw: Components) -> Components:
        """The pose after a screw in its own axes."""
        place, quaternion, ahead, turn = pose[:3], pose[3:], screw[:3], screw[3:]
        square = turn[0] * turn[0] + turn[1] * turn[1] + turn[2] * turn[2]
        cosine, sine = even_series(square / 4, 0), even_series(square / 4, 1)
        once = _cross(turn, ahead)
        twice = _cross(turn, once)
        first, second = even_series(square, 2) / 2, even_series(square, 3) / 6
        chord = tuple(a + first * b + second * c for a, b, c in zip(ahead, once, twice, strict=True))
        step = rotated(quaternion, chord)
        turned = product(quaternion, (cosine, *(sine * t / 2 for t in turn)))
        return (*(a + b for a, b in zip(place, step, strict=True)), *turned)

    def carried(self, wrench: Components, twist: Components) -> Components:
        """Change of a wrench on a body that moves by a twist."""
        n, m, v, turn = wrench[:3], wrench[3:], twist[:3], twist[3:]
        return (*_cross(n, turn), *(a + b for a, b in zip(_cross(m, turn), _cross(n, v), strict=True)))

    def yielding(self, pose: Components, compliance: Components, wrench: Components) -> Components:
        """Twist per length about the origin under a wrench about the origin, of a section at `pose`."""
        place, turn = pose[:3], _rows(pose[3:])
        force, moment = wrench[:3], wrench[3:]
        moment = tuple(a - b for a, b in zip(moment, _cross(place, force), strict=True))
        columns = tuple(zip(*turn, strict=True))
        strain = tuple(c * x for c, x in zip(compliance[:3], _product(columns, force), strict=True))
        bend = tuple(c * x for c, x in zip(compliance[3:], _product(columns, moment), strict=True))
        spin = _product(turn, bend)
        return (*(a + b for a, b in zip(_product(turn, strain), _cross(place, spin), strict=True)), *spin)

    def law(self, wrench: Array, rods: Rods, n_steps: int) -> tuple[Array, Array, Along]:
        """Where members put their ends under the wrench (6, ...) about the origin of the start body, in its axes.

        Returns
        -------
        law : Array, shape (P, ...)
            Pose of the end body.
        twist : Array, shape (6, 6, ...)
            Of it about the origin of the start, per change of the wrench.
        along : Along
        """
        pose = tuple(part + jnp.zeros_like(wrench[0]) for part in rods.start)
        back, force, moment = conjugate(pose[3:]), tuple(wrench[:3]), tuple(wrench[3:])
        moment = tuple(a - b for a, b in zip(moment, _cross(pose[:3], force), strict=True))
        start = ((*rotated(back, force), *rotated(back, moment)), pose)
        reached, met = integrate(self, tuple(wrench), *start, rods, n_steps)
        place, quaternion = reached.pose[:3], reached.pose[3:]
        place = tuple(a + b for a, b in zip(place, rotated(quaternion, tuple(rods.end[:3])), strict=True))
        law = jnp.stack([*place, *product(quaternion, tuple(rods.end[3:]))])
        return law, jnp.stack(reached.twist), along(start, met)

    # --- poses ----------------------------------------------------------------------------------

    def spin(self, pose: Array, change: Array) -> Array:
        """Motion, translation and spin, that belongs to a `change` of the numbers of a pose."""
        twice = product(tuple(change[3:]), conjugate(tuple(pose[3:])))
        return jnp.stack([*change[:3], *(2 * part for part in twice[1:])])

    def turn(self, pose: Array) -> Array:
        """Matrix that takes motions and wrenches from the axes of a body to the global ones, (6, 6, ...)."""
        matrix = rotation_matrix(pose[3:])
        return four(matrix, jnp.zeros_like(matrix), jnp.zeros_like(matrix), matrix)

    def gap(self, start: Array, end: Array, law: Array) -> Array:
        """Motion, in the axes of the start, from where a member's law puts its end body to where that is."""
        back = conjugate(tuple(start[3:]))
        place = jnp.stack(rotated(back, tuple(end[:3] - start[:3]))) - law[:3]
        turned = product(back, tuple(end[3:]))
        return jnp.concatenate([place, rotation_vector(jnp.stack(product(turned, conjugate(tuple(law[3:])))))])

    def moved(self, pose: Array, motion: Array) -> Array:
        """The pose after a motion in global axes."""
        turned = product(tuple(quaternion(motion[3:])), tuple(pose[3:]))
        size = jnp.sqrt(sum(part * part for part in turned))
        return jnp.stack([*(pose[:3] + motion[:3]), *(part / size for part in turned)])

    def towards(self, goal: Array, pose: Array) -> Array:
        """Motion in global axes from `pose` to `goal`, by the shorter turn."""
        turned = product(tuple(goal[3:]), conjugate(tuple(pose[3:])))
        return jnp.concatenate([goal[:3] - pose[:3], rotation_vector(jnp.stack(turned))])

    # --- matrices of a member, in global axes -----------------------------------------------------

    def shift(self, start: Array, end: Array) -> Array:
        """Motion of the point at `end` when the start moves, (6, 6, ...)."""
        unit, arm = _unit(start[0] + end[0]), skew(end[:3] - start[:3])
        return four(unit, -arm, jnp.zeros_like(unit), unit)

    def swing(self, wrench: Array) -> Array:
        """Minus the change of a wrench per rotation of the body that carries it, (6, 6, ...)."""
        force, moment = skew(wrench[:3]), skew(wrench[3:])
        return four(jnp.zeros_like(force), force, jnp.zeros_like(force), moment)

    def lever(self, wrench: Array) -> Array:
        """Moment n × δx of the force n when its point moves, as a matrix on motions, (6, 6, ...)."""
        force = skew(wrench[:3])
        none = jnp.zeros_like(force)
        return four(none, none, force, none)

    # --- loads ----------------------------------------------------------------------------------

    def dead(self, pose: Array, load: Array) -> tuple[Array, Array]:
        """Wrench about a body's origin of loads of constant direction, and minus its tangent.

        `load` is a force, a moment and the nine numbers Σ dᵢ fⱼ, with d from the origin to the loaded
        point at rest.
        """
        none = jnp.zeros_like(pose[0] + load[0])
        turn = rotation_matrix(pose[3:])
        first = load[6:].reshape(3, 3, *load.shape[1:])
        moved = multiply(turn, first + none)  # Σ (R d)ᵢ fⱼ
        moment = [moved[1, 2] - moved[2, 1], moved[2, 0] - moved[0, 2], moved[0, 1] - moved[1, 0]]
        trace = moved[0, 0] + moved[1, 1] + moved[2, 2]
        stiffness = _unit(none) * trace - moved
        zero = jnp.zeros_like(stiffness)
        wrench = jnp.concatenate([load[:3] + none, load[3:6] + jnp.stack(moment)])
        return wrench, four(zero, zero, zero, stiffness)

    def follower(self, pose: Array, load: Array) -> tuple[Array, Array]:
        """Wrench (6, ...) of loads that turn with the body, and minus its tangent."""
        wrench = apply(self.turn(pose), load)
        return wrench, self.swing(wrench)


def rotation_matrix(q: Array) -> Array:
    """Of a unit quaternion, (4, ...) to (3, 3, ...)."""
    return jnp.stack([jnp.stack(row) for row in _rows(tuple(q))])


def _rows(q: Components) -> tuple[Components, Components, Components]:
    """Rows of the rotation matrix of a unit quaternion."""
    w, x, y, z = q
    return (
        (1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
        (2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
        (2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
    )


def _product(matrix: tuple[Components, ...], vector: Components) -> Components:
    """Matrix, as rows, times vector."""
    return tuple(a * vector[0] + b * vector[1] + c * vector[2] for a, b, c in matrix)


def quaternion(vector: Array) -> Array:
    """Unit quaternion of a rotation vector, (3, ...) to (4, ...); differentiable at zero."""
    square = jnp.sum(vector * vector, axis=0)
    small = square < 1e-8
    angle = jnp.sqrt(jnp.where(small, 1.0, square))
    sine = jnp.where(small, 0.5 - square / 48, jnp.sin(angle / 2) / angle)
    cosine = jnp.where(small, 1 - square / 8, jnp.cos(angle / 2))
    return jnp.concatenate([cosine[None], sine * vector])


def rotation_vector(q: Array) -> Array:
    """Rotation vector, at most π long, of a unit quaternion, (4, ...) to (3, ...); differentiable at zero."""
    q = q * jnp.where(q[0] < 0, -1.0, 1.0)
    square = jnp.sum(q[1:] * q[1:], axis=0)
    small = square < 1e-8
    sine = jnp.sqrt(jnp.where(small, 1.0, square))
    factor = jnp.where(small, 2 / q[0] * (1 - square / (3 * q[0] * q[0])), 2 * jnp.arctan2(sine, q[0]) / sine)
    return factor * q[1:]


def quaternion_of(matrix: Array) -> Array:
    """Unit quaternion of rotation matrices, (3, 3, ...) to (4, ...); differentiable at any rotation.

    Source: Shepperd, J. Guidance and Control 1 (1978), 223–224.
    """
    m = matrix
    xx, yy, zz, one = m[0, 0], m[1, 1], m[2, 2], 1.0
    across = (m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1])
    yz, zx, xy = m[2, 1] + m[1, 2], m[0, 2] + m[2, 0], m[1, 0] + m[0, 1]
    table = [
        (one + xx + yy + zz, *across),
        (across[0], one + xx - yy - zz, xy, zx),
        (across[1], xy, one - xx + yy - zz, yz),
        (across[2], zx, yz, one - xx - yy + zz),
    ]
    rows = jnp.stack([jnp.stack(row) for row in table])  # each is 4 q_k q
    row, size = rows[0], table[0][0]
    for k in (1, 2, 3):
        larger = table[k][k] > size
        row, size = jnp.where(larger, rows[k], row), jnp.where(larger, table[k][k], size)
    return row / jnp.sqrt((row * row).sum(0))


def _unit(like: Array) -> Array:
    one, zero = jnp.ones_like(like), jnp.zeros_like(like)
    return jnp.stack([jnp.stack([one if i == j else zero for j in range(3)]) for i in range(3)])


def _cross(first: Components, second: Components) -> Components:
    a, b, c = first
    x, y, z = second
    return b * z - c * y, c * x - a * z, a * y - b * x


def product(first: Components, second: Components) -> Components:
    """Hamilton's product of two quaternions."""
    a, b, c, d = first
    w, x, y, z = second
    return (
        a * w - b * x - c * y - d * z,
        a * x + b * w + c * z - d * y,
        a * y - b * z + c * w + d * x,
        a * z + b * y - c * x + d * w,
    )


def conjugate(q: Components) -> Components:
    """Of a quaternion: the inverse, for a unit one."""
    return q[0], -q[1], -q[2], -q[3]


def rotated(q: Components, vector: Components) -> Components:
    """q v q⁻¹ for a unit quaternion."""
    once = tuple(2 * part for part in _cross(q[1:], vector))
    twice = _cross(q[1:], once)
    return tuple(v + q[0] * a + b for v, a, b in zip(vector, once, twice, strict=True))

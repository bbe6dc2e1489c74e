"""Motions in the xy-plane: a pose is (x, y, θ, cos θ, sin θ), a motion (δx, δy, δθ), a wrench (Fx, Fy, Mz).

The batch lies in the last axes of every array.
"""

from dataclasses import dataclass
from typing import ClassVar

import jax.numpy as jnp
import numpy as np
from jax import Array

from .blocks import apply
from .rods import Along, Components, Rods, along, even_series, integrate


@dataclass(frozen=True)  # any two are equal
class Planar:
    """The plane as the nonlinear solver sees it; :class:`.spatial.Spatial` has the same methods."""

    size: ClassVar[int] = 3
    block: ClassVar[int] = 64
    """Points that are worked on together: few enough for the cache, enough to fill the vector unit."""
    n_pose: ClassVar[int] = 5
    n_translations: ClassVar[int] = 2
    n_dead: ClassVar[int] = 5
    unturned: ClassVar = np.array([0.0, 1.0, 0.0])
    motions: ClassVar[tuple[int, ...]] = (0, 1, 5)
    """Which of the six motions of a node these are."""

    # --- along a member -------------------------------------------------------------------------

    def rates(self, internal: Components, strain: Components) -> Components:
        """N' = N × κ and M' = N × γ."""
        n1, n2, _ = internal
        g1, g2, k = strain
        return n2 * k, -n1 * k, n1 * g2 - n2 * g1

    def bracket(self, first: Components, second: Components) -> Components:
        """Commutator of two strains."""
        a1, a2, k = first
        b1, b2, m = second
        return m * a2 - k * b2, k * b1 - m * a1, jnp.zeros_like(k)

    def screwed(self, pose: Components, screw: Components) -> Components:
        """The pose after a screw in its own axes."""
        x, y, angle, c, s = pose
        u, v, turn = screw
        square = turn * turn
        sine, versine = even_series(square, 1), even_series(square, 2) * turn / 2
        ahead, aside = sine * u - versine * v, versine * u + sine * v
        c_turn, s_turn = 1 - versine * turn, sine * turn
        return (
            x + c * ahead - s * aside,
            y + s * ahead + c * aside,
            angle + turn,
            c * c_turn - s * s_turn,
            s * c_turn + c * s_turn,
        )

    def carried(self, wrench: Components, twist: Components) -> Components:
        """Change of a wrench on a body that moves by a twist."""
        fx, fy, _ = wrench
        vx, vy, turn = twist
        return fy * turn, -fx * turn, fx * vy - fy * vx

    def yielding(self, pose: Components, compliance: Components, wrench: Components) -> Components:
        """Twist per length about the origin under a wrench about the origin, of a section at `pose`."""
        x, y, _, c, s = pose
        fx, fy, m = wrench
        axial, shear, bending = compliance
        along, aside = axial * (c * fx + s * fy), shear * (c * fy - s * fx)
        turn = bending * (m - x * fy + y * fx)
        return c * along - s * aside + y * turn, s * along + c * aside - x * turn, turn

    def law(self, wrench: Array, rods: Rods, n_steps: int) -> tuple[Array, Array, Along]:
        """Where members put their ends under the wrench (3, ...) about the origin of the start body, in its axes.

        Returns
        -------
        law : Array, shape (P, ...)
            Pose of the end body.
        twist : Array, shape (3, 3, ...)
            Of it about the origin of the start, per change of the wrench.
        along : Along
        """
        fx, fy, m = wrench
        x, y, angle, c, s = (part + jnp.zeros_like(fx) for part in rods.start)
        internal = (c * fx + s * fy, c * fy - s * fx, m - x * fy + y * fx)
        start = (internal, (x, y, angle, c, s))
        reached, met = integrate(self, tuple(wrench), *start, rods, n_steps)
        x, y, angle, c, s = reached.pose
        dx, dy, turn = rods.end
        law = jnp.stack([x + c * dx - s * dy, y + s * dx + c * dy, angle + turn])
        return law, jnp.stack(reached.twist), along(start, met)

    # --- poses ----------------------------------------------------------------------------------

    def spin(self, pose: Array, change: Array) -> Array:
        """Motion that belongs to a `change` of the numbers of a pose."""
        return change[:3]

    def turn(self, pose: Array) -> Array:
        """Matrix that takes motions and wrenches from the axes of a body to the global ones, (3, 3, ...)."""
        c, s = pose[3:]
        o, e = jnp.zeros_like(c), jnp.ones_like(c)
        return jnp.stack([jnp.stack([c, -s, o]), jnp.stack([s, c, o]), jnp.stack([o, o, e])])

    def gap(self, start: Array, end: Array, law: Array) -> Array:
        """Motion, in the axes of the start, from where a member's law puts its end body to where that is."""
        c, s = start[3:]
        dx, dy = end[0] - start[0], end[1] - start[1]
        return jnp.stack([c * dx + s * dy - law[0], c * dy - s * dx - law[1], end[2] - start[2] - law[2]])

    def moved(self, pose: Array, motion: Array) -> Array:
        """The pose after a motion in global axes."""
        x, y, angle = pose[:3] + motion
        return jnp.stack([x, y, angle, jnp.cos(angle), jnp.sin(angle)])

    def towards(self, goal: Array, pose: Array) -> Array:
        """Motion in global axes from `pose` to `goal`."""
        return (goal - pose)[:3]

    # --- matrices of a member, in global axes -----------------------------------------------------

    def shift(self, start: Array, end: Array) -> Array:
        """Motion of the point at `end` when the start moves, (3, 3, ...)."""
        x, y = end[:2] - start[:2]
        o, e = jnp.zeros_like(x), jnp.ones_like(x)
        return jnp.stack([jnp.stack([e, o, -y]), jnp.stack([o, e, x]), jnp.stack([o, o, e])])

    def swing(self, wrench: Array) -> Array:
        """Minus the change of a wrench per rotation of the body that carries it, (3, 3, ...)."""
        fx, fy, _ = wrench
        o = jnp.zeros_like(fx)
        return jnp.stack([jnp.stack([o, o, fy]), jnp.stack([o, o, -fx]), jnp.stack([o, o, o])])

    def lever(self, wrench: Array) -> Array:
        """Moment n × δx of the force n when its point moves, as a matrix on motions, (3, 3, ...)."""
        fx, fy, _ = wrench
        o = jnp.zeros_like(fx)
        return jnp.stack([jnp.stack([o, o, o]), jnp.stack([o, o, o]), jnp.stack([-fy, fx, o])])

    # --- loads ----------------------------------------------------------------------------------

    def dead(self, pose: Array, load: Array) -> tuple[Array, Array]:
        """Wrench about a body's origin of loads of constant direction, and minus its tangent.

        `load` is (Fx, Fy, Mz, Σ d × f, Σ d · f), with d from the origin to the loaded point at rest.
        """
        fx, fy, m, crossed, dotted = load
        c, s = pose[3:]
        o = jnp.zeros_like(c + m)
        stiffness = s * crossed + c * dotted
        rows = [jnp.stack([o, o, o]), jnp.stack([o, o, o]), jnp.stack([o, o, stiffness + o])]
        return jnp.stack([fx + o, fy + o, m + c * crossed - s * dotted]), jnp.stack(rows)

    def follower(self, pose: Array, load: Array) -> tuple[Array, Array]:
        """Wrench (3, ...) of loads that turn with the body, and minus its tangent."""
        wrench = apply(self.turn(pose), load)
        return wrench, self.swing(wrench)

"""What is read off a converged state, and what it is worth: how exact, how stable, and whether the path leads there.

Stability by Wittrick and Williams: at an equilibrium as many modes are unstable as the stiffness of the
bodies has negative eigenvalues, plus as many as the members would have with both ends held. The
latter are the conjugate points along a member, where the determinant of its flexibility changes sign.

Source: Wittrick and Williams, Q. J. Mech. Appl. Math. 24 (1971), 263–284.
"""

from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jax import Array

from .blocks import inverse, multiply
from .condensed import Problem, State, Topology
from .newton import Evaluated, largest
from .rods import Along


class Conclusion(NamedTuple):
    """Of each point, in units of order one; D motions, d coordinates.

    Parameters
    ----------
    motion : Array, shape (D, n_blocks, n_points)
        From rest: translation and rotation vector.
    direction : Array, shape (D, n_blocks, n_points)
        Motion per fraction of the load.
    force : Array, shape (D, n_blocks, n_points)
        What members and loads exert on each block.
    internal : Array, shape (D, n_steps + 1, n_members, n_points)
        Along the members, in section axes.
    centre : Array, shape (d, n_steps + 1, n_members, n_points)
        Where the centres of the sections are.
    energy : Array, shape (n_points,)
    residual : Array, shape (n_points,)
        Largest gap, or force over the largest in a member, that is left.
    unstable : Array of int, shape (n_points,)
        Number of unstable modes.
    astray : Array, shape (n_points,)
        How far the state is from where the directions at rest and here lead (the trapezoidal rule),
        relative to how far it is from rest: near zero on a smooth path.
    """

    motion: Array
    direction: Array
    force: Array
    internal: Array
    centre: Array
    energy: Array
    residual: Array
    unstable: Array
    astray: Array


def conclude(topology: Topology, problem: Problem, state: State, outset: Array, last: Evaluated) -> Conclusion:
    """Conclude on states from what was found at them; `outset` is the motion per fraction of the load at rest."""
    space = topology.space
    motion = space.towards(state.pose, problem.rest + jnp.zeros_like(state.pose))
    return Conclusion(
        motion,
        last.direction,
        last.left.force,
        last.met.internal,
        _centres(topology, state, last.met),
        _energy(topology, problem, last.met.internal),
        last.undone,
        last.negative + _conjugate_points(last.met.twist),
        largest(motion - (outset + last.direction) / 2) / jnp.maximum(largest(motion), 1e-12),
    )


def _conjugate_points(twist: Array) -> Array:
    """Unstable modes of the members with both ends held, all together, (n_points,)."""
    _, pivots = inverse(twist)
    odd = jnp.sum(pivots < 0, axis=0) % 2
    before = jnp.concatenate([jnp.zeros_like(odd[:1]), odd[:-1]])
    return jnp.sum(odd != before, axis=(0, 1))


def _centres(topology: Topology, state: State, met: Along) -> Array:
    space, d = topology.space, topology.space.n_translations
    start = state.pose[:, topology.start]
    return start[:d, None] + multiply(space.turn(start)[:d, :d, None], met.pose[:d, None])[:, 0]


def _energy(topology: Topology, problem: Problem, internal: Array) -> Array:
    """½ ∫ C N² along all members, by Simpson's rule on the ends of the steps."""
    n = topology.n_steps
    weight = np.full(n + 1, 2.0)
    weight[1::2], weight[[0, -1]] = 4.0, 1.0
    density = (problem.rods.compliance[:, None] * internal**2).sum(0) / 2
    along = (density * (weight / (3 * n))[:, None, None]).sum(0)
    return (along * problem.rods.length).sum(0)

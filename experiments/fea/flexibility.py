"""The flexibility of members by differentiation of their law as it is integrated.

That which :func:`.rods.integrate` gives along with the law costs a third of this and belongs to the
same rod, but differs from the derivative of the law by the error of the steps: enough to keep
Newton's method from contracting where steps are coarse and loads large.
"""

import jax
import jax.numpy as jnp
from jax import Array

from .blocks import multiply
from .condensed import Topology
from .rods import Rods


def exact(topology: Topology, rods: Rods, wrench: Array) -> tuple[Array, Array]:
    """Where the members put their ends, (P, n_members, …), and their flexibility about the starts, (D, D, …)."""
    space = topology.space

    def law(wrench: Array) -> Array:
        return space.law(wrench, rods, topology.n_steps)[0]

    def column(direction: Array) -> tuple[Array, Array]:
        return jax.jvp(law, (wrench,), (jnp.broadcast_to(direction.reshape(-1, 1, 1), wrench.shape),))

    pose, change = jax.vmap(column, out_axes=(None, 1))(jnp.eye(space.size))
    own = jax.vmap(space.spin, in_axes=(None, 1), out_axes=1)(pose, change)
    return pose, multiply(space.shift(pose, jnp.zeros_like(pose)), own)

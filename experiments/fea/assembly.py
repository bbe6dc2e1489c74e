"""The stiffness of a frame and the kinematics of its rigid bodies.

Pure functions of shapes, coordinates and properties, differentiable in all; topology comes as whole
numbers. The shapes are those of :class:`.arrays.FrameArrays` and :class:`.shapes.Shapes`.
"""

import jax
import jax.numpy as jnp
from jax import Array

from .arrays import FrameArrays
from .elements import Properties, member_stiffness
from .shapes import Shapes


def member_shapes(arrays: FrameArrays) -> Shapes:
    """The members at rest, as the functions here and in :mod:`.elements` take them."""
    return Shapes(arrays.lengths, arrays.axes.transpose(1, 2, 0), arrays.bends.T)


def assemble(shapes: Shapes, ends: Array, properties: Properties, n_nodes: int) -> tuple[Array, Array]:
    """The stiffness, without clamps, supports or rigid bodies, and what recovers the end forces.

    Returns
    -------
    stiffness : Array, shape (6 n_nodes, 6 n_nodes)
    recovery : Array, shape (n_members, 12, 12)
        Forces on both ends in local axes per motion of the ends in global axes.
    """
    members, recovery = jax.vmap(member_stiffness, in_axes=(-1, 0))(shapes, properties)
    unknowns = _unknowns(ends).reshape(-1, 12)
    empty = jnp.zeros((6 * n_nodes, 6 * n_nodes))
    return empty.at[unknowns[:, :, None], unknowns[:, None, :]].add(members), recovery


def transformation(coordinates: Array, master: Array, block: Array, n_blocks: int) -> Array:
    """T in u = T q, from the motions of the blocks to those of all nodes, shape (6 n_nodes, 6 n_blocks).

    A node at r from its block's master moves by u = u_master + θ × r, θ = θ_master.
    """
    n_nodes = len(coordinates)
    x, y, z = (coordinates - coordinates[master]).T
    zero = jnp.zeros(n_nodes)
    cross = jnp.stack([zero, z, -y, -z, zero, x, y, -x, zero], axis=1).reshape(n_nodes, 3, 3)
    motion = jnp.tile(jnp.eye(6), (n_nodes, 1, 1)).at[:, :3, 3:].set(cross)
    rows, columns = _unknowns(jnp.arange(n_nodes)), _unknowns(block)
    empty = jnp.zeros((6 * n_nodes, 6 * n_blocks))
    return empty.at[rows[:, :, None], columns[:, None, :]].set(motion)


def reduce(stiffness: Array, kinematics: Array) -> Array:
    """Stiffness of the unknowns, Tᵀ K T; exact, since rigid bodies are kinematics and not stiff members."""
    return kinematics.T @ stiffness @ kinematics


def member_end_forces(recovery: Array, ends: Array, displacements: Array) -> Array:
    """Forces that the nodes exert on both ends of each member, in its local axes there.

    From `displacements` in global axes, shape (n_cases, n_nodes, 6), to (n_cases, n_members, 2, 6).
    """
    moved = displacements[:, ends].reshape(len(displacements), len(ends), 12)
    return jnp.einsum("mij,cmj->cmi", recovery, moved).reshape(len(displacements), len(ends), 2, 6)


def _unknowns(nodes: Array) -> Array:
    """Positions of the six unknowns of each node: shape (...,) to (..., 6)."""
    return 6 * jnp.asarray(nodes)[..., None] + jnp.arange(6)

"""The stiffness of a frame and the kinematics of its rigid bodies.

Pure functions of coordinates and properties, differentiable in both; topology comes as whole numbers.
The shapes are those of :class:`.arrays.FrameArrays`.
"""

import jax
import jax.numpy as jnp
from jax import Array

from .elements import Properties, end_forces, member_stiffness


def assemble(coordinates: Array, ends: Array, up: Array, properties: Properties) -> Array:
    """Stiffness of all nodes, without clamps or rigid bodies, shape (6 n_nodes, 6 n_nodes)."""
    start, end = coordinates[ends[:, 0]], coordinates[ends[:, 1]]
    members = jax.vmap(member_stiffness)(start, end, up, properties)
    unknowns = _unknowns(ends).reshape(-1, 12)
    size = 6 * len(coordinates)
    return jnp.zeros((size, size)).at[unknowns[:, :, None], unknowns[:, None, :]].add(members)


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
    """Stiffness of the blocks, Tᵀ K T; exact, since rigid bodies are kinematics and not stiff members."""
    return kinematics.T @ stiffness @ kinematics


def member_end_forces(
    coordinates: Array, ends: Array, up: Array, properties: Properties, displacements: Array
) -> Array:
    """Forces on both ends of each member in local axes, shape (n_cases, n_members, 2, 6).

    `displacements` has shape (n_cases, n_nodes, 6), in global axes.
    """
    start, end = coordinates[ends[:, 0]], coordinates[ends[:, 1]]
    n_cases = len(displacements)
    moved = displacements[:, ends].reshape(n_cases, len(ends), 12)
    forces = jax.vmap(end_forces, in_axes=(0, 0, 0, 0, 1), out_axes=1)(start, end, up, properties, moved)
    return forces.reshape(n_cases, len(ends), 2, 6)


def _unknowns(nodes: Array) -> Array:
    """Positions of the six unknowns of each node: shape (...,) to (..., 6)."""
    return 6 * jnp.asarray(nodes)[..., None] + jnp.arange(6)

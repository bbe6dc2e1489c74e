"""Small displacements: factorise a frame once, solve many load cases."""

from collections.abc import Iterable
from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.scipy.linalg import cho_solve
from jax.typing import ArrayLike
from numpy.typing import NDArray
from scipy.linalg import get_lapack_funcs

from . import assembly
from .arrays import FrameArrays, frame_arrays
from .mechanisms import check_finite, check_held, check_resolved
from .model import Frame, Load
from .precision import check_float64_scope, in_float64


@dataclass(frozen=True, eq=False)
class Solution:
    """Answers to a batch of load cases, in SI units and radians.

    Parameters
    ----------
    frame : Frame
    loads : ndarray, shape (n_cases, n_nodes, 6)
        What was applied: forces N, moments N m.
    displacements : ndarray, shape (n_cases, n_nodes, 6)
        (ux, uy, uz, θx, θy, θz) of each node in global axes.
    reactions : ndarray, shape (n_cases, n_clamps, 6)
        What each clamp exerts on the frame, at the clamped node, in the order of ``frame.clamps``.
    end_forces : ndarray, shape (n_cases, n_members, 2, 6)
        What the nodes exert on the start and the end of each member, in its local axes.
    """

    frame: Frame
    loads: NDArray[np.float64]
    displacements: NDArray[np.float64]
    reactions: NDArray[np.float64]
    end_forces: NDArray[np.float64]

    def at(self, node: str) -> NDArray[np.float64]:
        """Displacements of one node in all cases, shape (n_cases, 6); ``ValueError`` if it is unknown."""
        return self.displacements[:, self.frame.index(node)]


@dataclass(frozen=True, eq=False)
class LinearSolver:
    """A factorised frame; made by :func:`factorise`.

    With q the motions of the free blocks, u = T q, D K_r D = L Lᵀ and K_r = Tᵀ K T.

    Parameters
    ----------
    frame : Frame
    arrays : FrameArrays
    stiffness : ndarray, shape (6 n_nodes, 6 n_nodes)
        K, without clamps or rigid bodies.
    kinematics : ndarray, shape (6 n_nodes, 6 n_blocks)
        T for all blocks, the free ones first.
    scale : ndarray, shape (6 n_free,)
        D, which gives D K_r D a unit diagonal.
    factor : ndarray, shape (6 n_free, 6 n_free)
        L, lower triangular.
    reciprocal_condition : float
        Of D K_r D; about −log₁₀(2e-16 / it) digits of an answer are right, or more.
    """

    frame: Frame
    arrays: FrameArrays
    stiffness: NDArray[np.float64]
    kinematics: NDArray[np.float64]
    scale: NDArray[np.float64]
    factor: NDArray[np.float64]
    reciprocal_condition: float

    @in_float64
    def solve(self, loads: ArrayLike) -> Solution:
        """Displacements, reactions and end forces under `loads`, shape (n_cases, n_nodes, 6).

        Raises
        ------
        ValueError
            If the loads have another shape or are not finite.
        """
        loads = _checked_loads(self.frame, loads)
        a = self.arrays
        u = _displacements(self.kinematics, self.scale, self.factor, loads)
        reactions = _reactions(self.stiffness, self.kinematics[:, 6 * a.n_free :], loads, u)
        forces = _end_forces(a.coordinates, a.ends, a.up, a.properties, u)
        return Solution(self.frame, loads, np.asarray(u), np.asarray(reactions), np.asarray(forces))

    def displacements(self, loads: ArrayLike) -> Array:
        """Displacements under `loads`, shape (..., n_nodes, 6) to the same, by JAX alone.

        For use inside an outer ``jit``, ``vmap`` or ``grad``, called in ``with jax.enable_x64(True):``.
        The values of the loads are not looked at, so one that is not finite gives NaN.

        Raises
        ------
        ValueError
            If it is called outside that scope, or the loads have another shape.
        """
        check_float64_scope()
        if jnp.shape(loads)[-2:] != (len(self.frame.nodes), 6):
            raise ValueError(_shape_sentence(self.frame, jnp.shape(loads)))
        return _displacements(self.kinematics, self.scale, self.factor, jnp.asarray(loads, jnp.float64))


@in_float64
def factorise(frame: Frame) -> LinearSolver:
    """Assemble `frame`, tie its rigid bodies, hold its clamps, and factorise what is left.

    Raises
    ------
    ValueError
        If a part of the frame is free to move, or its stiffness is too uneven for float64.
    """
    a = frame_arrays(frame)
    check_held(frame, a)
    stiffness = _frozen(_assemble(a.coordinates, a.ends, a.up, a.properties))
    kinematics = _frozen(_transformation(a.coordinates, a.master, a.block, a.n_blocks))
    free = kinematics[:, : 6 * a.n_free]
    reduced = np.asarray(_reduce(stiffness, free))
    check_finite(reduced)
    scale = 1 / np.sqrt(np.diag(reduced))
    scaled = scale[:, None] * reduced * scale
    factor, condition = _cholesky(scaled)
    check_resolved(frame, condition, scaled, scale, free)
    return LinearSolver(frame, a, stiffness, kinematics, _frozen(scale), _frozen(factor), condition)


def load_array(frame: Frame, cases: Iterable[Iterable[Load]]) -> NDArray[np.float64]:
    """Load cases as an array, shape (n_cases, n_nodes, 6), N and N m; loads on the same node add up.

    Raises
    ------
    ValueError
        If a load names an unknown node.
    """
    cases = [tuple(case) for case in cases]
    loads = np.zeros((len(cases), len(frame.nodes), 6))
    for row, case in zip(loads, cases, strict=True):
        for load in case:
            row[frame.index(load.node)] += (*load.force, *load.moment)
    return loads


dpotrf, dpocon = get_lapack_funcs(("potrf", "pocon"), dtype=np.float64)

_assemble = jax.jit(assembly.assemble)
_transformation = jax.jit(assembly.transformation, static_argnums=3)
_reduce = jax.jit(assembly.reduce)
_end_forces = jax.jit(assembly.member_end_forces)


@jax.jit
def _displacements(kinematics: Array, scale: Array, factor: Array, loads: Array) -> Array:
    free = kinematics[:, : len(scale)]
    on_blocks = loads.reshape(-1, len(free)) @ free
    q = cho_solve((factor, True), (on_blocks * scale).T).T * scale
    return (q @ free.T).reshape(loads.shape)


@jax.jit
def _reactions(stiffness: Array, clamped: Array, loads: Array, displacements: Array) -> Array:
    """What the clamps must add for equilibrium, Tᵀ (K u − f), shape (n_cases, n_clamps, 6)."""
    missing = displacements.reshape(-1, len(stiffness)) @ stiffness - loads.reshape(-1, len(stiffness))
    return (missing @ clamped).reshape(len(loads), clamped.shape[1] // 6, 6)


def _cholesky(scaled: NDArray[np.float64]) -> tuple[NDArray[np.float64], float]:
    """Lower Cholesky factor, and LAPACK's estimate of the reciprocal condition, 0 where it breaks down."""
    if not scaled.size:
        return scaled, 1.0
    factor, broke_down = dpotrf(scaled, lower=1, clean=1)
    if broke_down:
        return factor, 0.0
    return factor, float(dpocon(factor, np.abs(scaled).sum(axis=0).max(), uplo="L")[0])


def _checked_loads(frame: Frame, loads: ArrayLike) -> NDArray[np.float64]:
    loads = np.array(loads, dtype=np.float64)
    if loads.ndim != 3 or loads.shape[1:] != (len(frame.nodes), 6):
        raise ValueError(_shape_sentence(frame, loads.shape))
    bad = np.argwhere(~np.isfinite(loads))
    if bad.size:
        case, node, _ = bad[0]
        raise ValueError(f"load case {case} on node {frame.node_names[node]!r} is not finite: give finite loads")
    return loads


def _shape_sentence(frame: Frame, shape: tuple[int, ...]) -> str:
    return (
        f"loads must have shape (n_cases, {len(frame.nodes)}, 6), three forces and three moments a node; "
        f"got shape {shape}"
    )


def _frozen(array: ArrayLike) -> NDArray[np.float64]:
    """`array` as NumPy float64 that nobody can write to."""
    frozen = np.array(array)
    frozen.setflags(write=False)
    return frozen

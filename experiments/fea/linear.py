"""Small displacements: factorise a frame once, solve many load cases."""

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
from .loads import checked, checked_motions, shape_sentence
from .mechanisms import check_finite, check_held, check_resolved
from .model import Frame
from .precision import check_float64_scope, in_float64
from .stress import PeakStress, peak_stress


@dataclass(frozen=True, eq=False)
class Solution:
    """Answers to a batch of load cases, in SI units and radians.

    Parameters
    ----------
    frame : Frame
    loads : ndarray, shape (n_cases, n_nodes, 6)
        What was applied: forces N, moments N m.
    motions : ndarray, shape (n_cases, n_nodes, 6)
        What was prescribed: translations m, rotations rad.
    displacements : ndarray, shape (n_cases, n_nodes, 6)
        (ux, uy, uz, θx, θy, θz) of each node in global axes.
    reactions : ndarray, shape (n_cases, n_clamps, 6)
        What each clamp exerts on the frame, at the clamped node, in the order of ``frame.clamps``.
    support_reactions : ndarray, shape (n_cases, n_supports, 6)
        The same of ``frame.supports``; zero in the motions that a support leaves free.
    end_forces : ndarray, shape (n_cases, n_members, 2, 6)
        What the nodes exert on the start and the end of each member, in its local axes there; those of
        an arc turn with it.
    """

    frame: Frame
    loads: NDArray[np.float64]
    motions: NDArray[np.float64]
    displacements: NDArray[np.float64]
    reactions: NDArray[np.float64]
    support_reactions: NDArray[np.float64]
    end_forces: NDArray[np.float64]

    def at(self, node: str) -> NDArray[np.float64]:
        """Displacements of one node in all cases, shape (n_cases, 6); ``ValueError`` if it is unknown."""
        return self.displacements[:, self.frame.index(node)]

    def stress(self) -> PeakStress:
        """Largest bending stress of each member in each case, and where along the member it is."""
        return peak_stress(self.frame.members, frame_arrays(self.frame), self.end_forces)


@dataclass(frozen=True, eq=False)
class LinearSolver:
    """A factorised frame; made by :func:`factorise`.

    With q the free motions of the blocks and p the prescribed ones, u = T q + H p, and
    Tᵀ K T q = Tᵀ (f − K H p), D Tᵀ K T D = L Lᵀ.

    Parameters
    ----------
    frame : Frame
    arrays : FrameArrays
    stiffness : ndarray, shape (6 n_nodes, 6 n_nodes)
        K, without clamps, supports or rigid bodies.
    recovery : ndarray, shape (n_members, 12, 12)
        From the motions of a member's ends in global axes to its end forces in local axes.
    kinematics : ndarray, shape (6 n_nodes, n_unknowns)
        T, of the motions of blocks that nothing holds.
    holding : ndarray, shape (6 n_nodes, 6 (n_supports + n_clamps))
        H, of the motions of supports and then of clamps; zero for those that a support leaves free.
    scale : ndarray, shape (n_unknowns,)
        D, which gives D Tᵀ K T D a unit diagonal.
    factor : ndarray, shape (n_unknowns, n_unknowns)
        L, lower triangular.
    reciprocal_condition : float
        Of D Tᵀ K T D; about −log₁₀(2e-16 / it) digits of an answer are right, or more.
    """

    frame: Frame
    arrays: FrameArrays
    stiffness: NDArray[np.float64]
    recovery: NDArray[np.float64]
    kinematics: NDArray[np.float64]
    holding: NDArray[np.float64]
    scale: NDArray[np.float64]
    factor: NDArray[np.float64]
    reciprocal_condition: float

    @in_float64
    def solve(self, loads: ArrayLike, motions: ArrayLike | None = None) -> Solution:
        """Displacements, reactions and end forces under loads and prescribed motions.

        Parameters
        ----------
        loads : array_like, shape (n_cases, n_nodes, 6)
        motions : array_like, shape (n_cases, n_nodes, 6), optional
            Not zero only where a support holds its node; taken as small, rotations too.

        Raises
        ------
        ValueError
            If an array has another shape or is not finite, or a motion is prescribed that no support holds.
        """
        frame = self.frame
        loads = checked("loads", frame, loads)
        moved = None if motions is None else checked_motions(frame, motions, len(loads))
        u = self._moved(loads, moved)
        reactions = np.asarray(_reactions(self.stiffness, self.holding, loads, u))
        forces = _end_forces(self.recovery, self.arrays.ends, u)
        n = len(frame.supports)
        return Solution(
            frame,
            loads,
            np.zeros_like(loads) if moved is None else moved,
            np.asarray(u),
            reactions[:, n:],
            reactions[:, :n],
            np.asarray(forces),
        )

    def displacements(self, loads: ArrayLike, motions: ArrayLike | None = None) -> Array:
        """Displacements under `loads` and `motions`, shape (..., n_nodes, 6) to the same, by JAX alone.

        For use inside an outer ``jit``, ``vmap`` or ``grad``, called in ``with jax.enable_x64(True):``.
        The values are not looked at: one that is not finite gives NaN, and of the motions only those
        that supports hold are read.

        Raises
        ------
        ValueError
            If it is called outside that scope, or the arrays have another shape.
        """
        check_float64_scope()
        given = [jnp.asarray(x, jnp.float64) for x in (loads, motions) if x is not None]
        for what, x in zip(("loads", "motions"), given, strict=False):
            if x.shape[-2:] != (len(self.frame.nodes), 6):
                raise ValueError(shape_sentence(what, self.frame, x.shape))
        return self._moved(*jnp.broadcast_arrays(*given))

    def _moved(self, loads: Array | NDArray[np.float64], motions: Array | NDArray[np.float64] | None = None) -> Array:
        nodes = [self.frame.index(s.node) for s in self.frame.supports]
        driven = None if motions is None or not nodes else motions[..., nodes, :]
        return _displacements(self.stiffness, self.kinematics, self.holding, self.scale, self.factor, loads, driven)


@in_float64
def factorise(frame: Frame) -> LinearSolver:
    """Assemble `frame`, tie its rigid bodies, hold its clamps and supports, and factorise what is left.

    Raises
    ------
    ValueError
        If a part of the frame is free to move, or its stiffness is too uneven for float64.
    """
    a = frame_arrays(frame)
    check_held(frame, a)
    assembled = _assemble(assembly.member_shapes(a), a.ends, a.properties, len(frame.nodes))
    stiffness, recovery = map(_frozen, assembled)
    of_blocks = np.asarray(_transformation(a.coordinates, a.master, a.block, a.n_blocks))
    kinematics = _frozen(of_blocks[:, ~a.held.ravel()])
    blocks = a.block[[frame.index(n) for n in (*(s.node for s in frame.supports), *frame.clamps)]]
    holding = of_blocks.reshape(-1, a.n_blocks, 6)[:, blocks] * a.held[blocks]
    reduced = np.asarray(_reduce(stiffness, kinematics))
    check_finite(reduced)
    scale = 1 / np.sqrt(np.diag(reduced))
    scaled = scale[:, None] * reduced * scale
    factor, condition = _cholesky(scaled)
    check_resolved(frame, condition, scaled, scale, kinematics)
    holding = _frozen(holding.reshape(len(stiffness), -1))
    return LinearSolver(frame, a, stiffness, recovery, kinematics, holding, _frozen(scale), _frozen(factor), condition)


dpotrf, dpocon = get_lapack_funcs(("potrf", "pocon"), dtype=np.float64)

_assemble = jax.jit(assembly.assemble, static_argnums=3)
_transformation = jax.jit(assembly.transformation, static_argnums=3)
_reduce = jax.jit(assembly.reduce)
_end_forces = jax.jit(assembly.member_end_forces)


@jax.jit
def _displacements(
    stiffness: Array, kinematics: Array, holding: Array, scale: Array, factor: Array, loads: Array, driven: Array | None
) -> Array:
    """u = T q + H p; `driven` is p, shape (..., n_supports, 6), None for zero."""
    forces, at_supports = loads.reshape(-1, len(stiffness)), 0.0
    if driven is not None:
        p = driven.reshape(-1, 6 * driven.shape[-2])
        at_supports = p @ holding[:, : p.shape[1]].T
        forces = forces - at_supports @ stiffness
    q = cho_solve((factor, True), (forces @ kinematics * scale).T).T * scale
    return (q @ kinematics.T + at_supports).reshape(loads.shape)


@jax.jit
def _reactions(stiffness: Array, holding: Array, loads: Array, displacements: Array) -> Array:
    """What holds the frame must add for equilibrium, Hᵀ (K u − f), shape (n_cases, n_supports + n_clamps, 6)."""
    missing = displacements.reshape(-1, len(stiffness)) @ stiffness - loads.reshape(-1, len(stiffness))
    return (missing @ holding).reshape(len(loads), holding.shape[1] // 6, 6)


def _cholesky(scaled: NDArray[np.float64]) -> tuple[NDArray[np.float64], float]:
    """Lower Cholesky factor, and LAPACK's estimate of the reciprocal condition, 0 where it breaks down."""
    if not scaled.size:
        return scaled, 1.0
    factor, broke_down = dpotrf(scaled, lower=1, clean=1)
    if broke_down:
        return factor, 0.0
    return factor, float(dpocon(factor, np.abs(scaled).sum(axis=0).max(), uplo="L")[0])


def _frozen(array: ArrayLike) -> NDArray[np.float64]:
    """`array` as NumPy float64 that nobody can write to."""
    frozen = np.array(array)
    frozen.setflags(write=False)
    return frozen

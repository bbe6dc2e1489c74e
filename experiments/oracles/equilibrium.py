"""Oracles whose answer is an equilibrium: loads and prescribed motions that grow with the factors, and what is read."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from numpy.typing import ArrayLike, NDArray

from ..fea import Equilibria, NonlinearSolver
from ..fea.nonlinear import CHUNK
from ..fea.sensitivity import Answer, Read
from ..fea.spatial import quaternion, rotation_matrix
from ..runs import Status
from .base import Answers

BATCH = 1024
"""Points that are answered together: several chunks of the solver, so that all cores have work."""


@dataclass(frozen=True, eq=False)
class EquilibriumMap:
    """From factors to what is read off the equilibrium of a frame.

    Parameters
    ----------
    solver : NonlinearSolver
    load_directions, motion_directions : ndarray, shape (n_factors, n_nodes, 6)
        Loads and prescribed motions per unit of each factor.
    read : callable
        From the answers of the solver to the responses; see :data:`experiments.fea.sensitivity.Read`.
    n_responses : int
        How many it gives.
    stress_limit : float, optional
        Largest bending stress, Pa, beyond which a point is rejected.
    """

    solver: NonlinearSolver
    load_directions: NDArray[np.float64]
    motion_directions: NDArray[np.float64]
    read: Read
    n_responses: int
    stress_limit: float | None = None

    def equilibria(self, points: ArrayLike) -> Equilibria:
        """Equilibria at points, shape (n, n_factors)."""
        return self.solver.solve(*self._inputs(points))

    def evaluate(self, points: ArrayLike) -> Answers:
        """Responses, a status and a reason for each point, shape (n, n_factors)."""
        values, status, reasons = [np.empty((0, self.n_responses))], list[Status](), list[str]()
        for part in self.solver.stream(*self._inputs(points)):
            with jax.enable_x64(True):
                answer = Answer(part.motion, part.force, part.internal)
                values.append(np.asarray(self._compiled_read(_filled(answer)))[:, : len(part)].T)
            for ok, reason, rejection in zip(part.ok, part.reasons, self._rejections(part), strict=True):
                status.append(Status.NOT_CONVERGED if not ok else Status.REJECTED if rejection else Status.OK)
                reasons.append(reason or rejection)
        return Answers(np.concatenate(values), status, reasons)

    def jacobian(self, points: ArrayLike) -> NDArray[np.float64]:
        """d response / d factor, shape (n, n_responses, n_factors), SI; NaN where there is no equilibrium."""
        loads, motions = self._inputs(points)
        return self.solver.differentiate(
            self.read,
            loads,
            motions,
            load_directions=self.load_directions,
            motion_directions=self.motion_directions,
        )

    def _inputs(self, points: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        points = np.asarray(points, dtype=np.float64)
        loads = np.tensordot(points, self.load_directions, 1)
        return loads, np.tensordot(points, self.motion_directions, 1)

    def _rejections(self, found: Equilibria) -> list[str]:
        if self.stress_limit is None:
            return [""] * len(found)
        stress, member, place = found.largest_stress()
        return [
            f"bending stress of {s / 1e6:.4g} MPa in {found.frame.members[m].name} at {p:.0%} of its length, more than "
            f"stress_limit = {self.stress_limit / 1e6:g} MPa"
            if s > self.stress_limit
            else ""
            for s, m, p in zip(stress, member, place, strict=True)
        ]

    @cached_property
    def _compiled_read(self) -> Any:
        return jax.jit(self.read)


def intrinsic_xyz(rotation_vector: Array) -> Array:
    """Intrinsic XYZ Euler angles of rotation vectors, (3, n) to (3, n), rad; R = Rx Ry Rz, |θy| < π/2."""
    r = rotation_matrix(quaternion(rotation_vector))
    return jnp.stack([jnp.arctan2(-r[1, 2], r[2, 2]), jnp.arcsin(r[0, 2]), jnp.arctan2(-r[0, 1], r[0, 0])])


def _filled(answer: Answer) -> Answer:
    """To one size of chunk, so that reading is compiled once."""
    n = answer.motion.shape[-1]
    rows = np.minimum(np.arange(CHUNK), n - 1)
    return Answer(*(part[..., rows] for part in answer))

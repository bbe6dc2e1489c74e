"""Oracles whose answer is an equilibrium: loads and prescribed motions that grow with the factors, and what is read."""

from dataclasses import dataclass
from functools import cached_property

import jax.numpy as jnp
import numpy as np
from jax import Array
from numpy.typing import ArrayLike, NDArray

from ..fea import Equilibria, NonlinearSolver
from ..fea.sensitivity import Answer, Read
from ..fea.spatial import quaternion, rotation_matrix
from ..fea.stress import bending_stress, fibres
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
        if not np.size(points):
            return Answers(np.empty((0, self.n_responses)), [], [])
        found = self.solver.read(self._read_with_peak, *self._inputs(points))
        values, peaks = found.values[:, : self.n_responses], found.values[:, self.n_responses :]
        status = [Status.OK if ok else Status.NOT_CONVERGED for ok in found.ok]
        reasons = list(found.reasons)
        for i in np.flatnonzero(found.ok & (peaks[:, 0] > self.stress_limit)) if self.stress_limit else ():
            status[i], reasons[i] = Status.REJECTED, self._rejection(*peaks[i])
        return Answers(values, status, reasons)

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

    def _rejection(self, stress: float, member: float, place: float) -> str:
        name = self.solver.frame.members[int(member)].name
        return (
            f"bending stress of {stress / 1e6:.4g} MPa in {name} at {place:.0%} of its length, more than "
            f"stress_limit = {(self.stress_limit or np.inf) / 1e6:g} MPa"
        )

    @cached_property
    def _read_with_peak(self) -> Read:
        """The responses and, where there is a limit, the largest stress, its member and its place."""
        if self.stress_limit is None:
            return self.read
        sections = fibres(self.solver.frame.members)

        def read(answer: Answer) -> Array:
            stress = bending_stress(jnp, answer.internal, sections)
            n_sections, n_members, n_points = stress.shape
            flat = stress.reshape(-1, n_points)
            peak = flat.argmax(axis=0)
            where = jnp.stack([peak % n_members, peak // n_members / (n_sections - 1)])
            return jnp.concatenate([self.read(answer), flat.max(axis=0)[None], where])

        return read


def check_limit(oracle: str, stress_limit: float | None) -> None:
    """Raise ``ValueError`` if there is a stress limit that is not positive."""
    if stress_limit is not None and not stress_limit > 0.0:
        raise ValueError(f"oracle {oracle!r}: stress_limit must be positive, got {stress_limit}")


def intrinsic_xyz(rotation_vector: Array) -> Array:
    """Intrinsic XYZ Euler angles of rotation vectors, (3, n) to (3, n), rad; R = Rx Ry Rz, |θy| < π/2."""
    r = rotation_matrix(quaternion(rotation_vector))
    return jnp.stack([jnp.arctan2(-r[1, 2], r[2, 2]), jnp.arcsin(r[0, 2]), jnp.arctan2(-r[0, 1], r[0, 0])])

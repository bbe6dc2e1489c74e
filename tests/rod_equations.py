"""Equations of a geometrically exact rod, integrated by SciPy: an independent peer of the nonlinear FEA.

The unknowns are the place r, the directors (columns of R, the tangent first) and the moment m in global axes; the
force n is constant. With the strains in the directors γ = e₁ + C Rᵀn and κ = κ₀ + C Rᵀm,
r' = R γ, R' = R [κ]×, m' = −r' × n: Antman, Nonlinear Problems of Elasticity, 2nd ed. (2005), ch. 8.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.integrate import solve_ivp
from scipy.optimize import root
from scipy.spatial.transform import Rotation

Floats = NDArray[np.float64]

TOLERANCE = 1e-11
"""Relative and absolute tolerance of the integration."""


@dataclass(frozen=True)
class Rod:
    """Place and directors (columns) at the start; length; compliance (6,), curvature at rest (3,) in the directors."""

    place: Floats
    turn: Floats
    length: float
    compliance: Floats
    curvature: Floats

    def end(self, force: ArrayLike, moment: ArrayLike) -> tuple[Floats, Floats, Floats]:
        """Place, directors and moment of the last section under the internal force and moment of the first."""
        n = np.asarray(force, dtype=np.float64)

        def slope(_: float, y: Floats) -> Floats:
            turn, m = y[3:12].reshape(3, 3), y[12:]
            tangent = turn @ ([1.0, 0.0, 0.0] + self.compliance[:3] * (n @ turn))
            x, y, z = self.curvature + self.compliance[3:] * (m @ turn)
            spin = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
            a, b, c = tangent
            lost = [c * n[1] - b * n[2], a * n[2] - c * n[0], b * n[0] - a * n[1]]
            return np.concatenate([tangent, (turn @ spin).ravel(), lost])

        start = np.concatenate([self.place, self.turn.ravel(), np.asarray(moment, dtype=np.float64)])
        end = solve_ivp(slope, (0.0, self.length), start, "DOP853", rtol=TOLERANCE, atol=TOLERANCE).y[:, -1]
        return end[:3], end[3:12].reshape(3, 3), end[12:]

    def shoot(self, conditions: Callable[..., Floats], guess: ArrayLike) -> tuple[Floats, Floats, Floats]:
        """Wrench of the first section at which `conditions` (of place, turn, force and moment at the end) are zero.

        With it, place and directors of the end. The guess chooses the branch, never the numbers.
        """

        def left(wrench: Floats) -> Floats:
            place, turn, moment = self.end(wrench[:3], wrench[3:])
            return conditions(place, turn, wrench[:3], moment)

        found = root(left, np.asarray(guess, dtype=np.float64), tol=1e-12)
        size = 1 + np.abs(found.x).max()
        assert np.abs(found.fun).max() < 1e-8 * size, found.message
        place, turn, _ = self.end(found.x[:3], found.x[3:])
        return found.x, place, turn


def loaded_end(rest: Floats, dead: ArrayLike, follower: ArrayLike, arm: ArrayLike) -> Callable[..., Floats]:
    """Conditions at an end with a dead and a follower wrench, both (6,); the dead force acts at `arm` from it.

    `rest` are the directors of the end at rest; follower and arm are given in global axes at rest.
    """
    dead, follower = np.asarray(dead, dtype=np.float64), np.asarray(follower, dtype=np.float64)

    def conditions(place: Floats, turn: Floats, force: Floats, moment: Floats) -> Floats:
        turned = turn @ rest.T
        f, m = turned @ follower[:3], turned @ follower[3:]
        lever = np.cross(turned @ np.asarray(arm), dead[:3])
        return np.concatenate([force - dead[:3] - f, moment - dead[3:] - m - lever])

    return conditions


def driven_end(rest: Floats, place: ArrayLike, rotation: ArrayLike) -> Callable[..., Floats]:
    """Conditions at an end that is put at `place` and turned by a rotation vector; `rest` as in :func:`loaded_end`."""
    goal, turned = np.asarray(place, dtype=np.float64), Rotation.from_rotvec(rotation).as_matrix() @ rest

    def conditions(place: Floats, turn: Floats, force: Floats, moment: Floats) -> Floats:
        return np.concatenate([place - goal, Rotation.from_matrix(turn @ turned.T).as_rotvec()])

    return conditions

"""What a solved mechanism tells: torques, motions, forces, stresses, and which points failed."""

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np

from ..naming import suggestion
from .elastica import integrals_to
from .groups import Mechanism


@dataclass(frozen=True, eq=False)
class Solution:
    """Equilibria, one for each point; a point that failed holds NaN.

    Links are ordered as ``mechanism.links``, flexures as ``mechanism.flexures``, drivers as
    ``mechanism.drivers``.

    Parameters
    ----------
    mechanism : Mechanism
    angles : numpy.ndarray, shape (n_points, n_drivers)
        Prescribed orientations, rad.
    ok : numpy.ndarray of bool, shape (n_points,)
        Whether the point converged.
    reasons : tuple of str
        Why it did not; empty where it did.
    iterations : numpy.ndarray of int, shape (n_points,)
        Passes through steps 1–3, those of all attempts.
    residual : numpy.ndarray, shape (n_points,)
        Largest change in the last pass of a tip over its flexure's length or of M L / E I.
    torque_change : numpy.ndarray, shape (n_points,)
        Largest change of a torque in the last pass, N m.
    torques : numpy.ndarray, shape (n_points, n_drivers)
        On the driving links, anticlockwise, N m.
    shifts : numpy.ndarray, shape (n_points, n_links, 2)
        Where the link carries the point that is at the origin at rest, m.
    rotations : numpy.ndarray, shape (n_points, n_links)
        Of the links from rest, rad.
    forces : numpy.ndarray, shape (n_points, n_flexures, 2)
        On the edge of the equivalent joint, exerted on the flexure by that link, global axes, N.
    moments, root_moments : numpy.ndarray, shape (n_points, n_flexures)
        Bending moment at the edge of the equivalent joint and at the other, N m.
    tips : numpy.ndarray, shape (n_points, n_flexures, 2)
        u, v of eq. 1.9 in the flexure's axes, m.
    stress : numpy.ndarray, shape (n_points, n_flexures)
        Largest bending stress |M| t / 2 I over 33 stations of the flexure, its edges included, Pa.
    leaf_angles : numpy.ndarray, shape (n_points, n_flexures, n_nodes)
        θ at the Gauss nodes, from the clamped edge, rad.
    """

    mechanism: Mechanism
    angles: np.ndarray
    ok: np.ndarray
    reasons: tuple[str, ...]
    iterations: np.ndarray
    residual: np.ndarray
    torque_change: np.ndarray
    torques: np.ndarray
    shifts: np.ndarray
    rotations: np.ndarray
    forces: np.ndarray
    moments: np.ndarray
    root_moments: np.ndarray
    tips: np.ndarray
    stress: np.ndarray
    leaf_angles: np.ndarray

    @property
    def max_stress(self) -> np.ndarray:
        """Largest bending stress of the mechanism, shape (n_points,), Pa."""
        return self.stress.max(axis=1)

    def rotation(self, link: str) -> np.ndarray:
        """Rotation of `link` from rest, shape (n_points,), rad."""
        return self.rotations[:, _index("link", link, self.mechanism.links)]

    def torque(self, driver: str) -> np.ndarray:
        """Torque on the driving link `driver`, shape (n_points,), N m."""
        return self.torques[:, _index("driving link", driver, self.mechanism.drivers)]

    def place(self, link: str, at: Sequence[float]) -> np.ndarray:
        """Where `link` carries the point that is `at` at rest, shape (n_points, 2), m."""
        k, (x, y) = _index("link", link, self.mechanism.links), at
        c, s = np.cos(self.rotations[:, k]), np.sin(self.rotations[:, k])
        return self.shifts[:, k] + np.stack([c * x - s * y, s * x + c * y], axis=1)

    def displacement(self, link: str, at: Sequence[float] = (0.0, 0.0)) -> np.ndarray:
        """How far the point of `link` that is `at` at rest moves, shape (n_points, 2), m."""
        return self.place(link, at) - np.asarray(at, float)

    def centreline(self, flexure: str, stations: int = 21) -> np.ndarray:
        """The bent flexure from its clamped edge to its joint's, shape (n_points, stations, 2), m.

        The stretch of an extensible leaf is left out.
        """
        k = _index("flexure", flexure, [f.name for f in self.mechanism.flexures])
        leaf = self.mechanism.flexures[k]
        clamp, joint = (complex(*edge) for edge in leaf.edges)
        angles = self.leaf_angles[:, k]
        bent = np.exp(1j * angles) @ integrals_to(np.linspace(-1, 1, stations), angles.shape[1]).T
        link = self.mechanism.links.index(leaf.links[0])
        turn, (x, y) = np.exp(1j * self.rotations[:, link])[:, None], self.shifts[:, link].T
        line = (x + 1j * y)[:, None] + turn * (clamp + (joint - clamp) * bent)
        return np.stack([line.real, line.imag], axis=-1)


def joined(parts: Sequence[Solution]) -> Solution:
    """Solutions of one mechanism after one another."""
    values = {f.name: [getattr(part, f.name) for part in parts] for f in fields(Solution)}
    joined = {name: np.concatenate(v) for name, v in values.items() if isinstance(v[0], np.ndarray)}
    reasons = tuple(reason for part in parts for reason in part.reasons)
    return Solution(mechanism=parts[0].mechanism, reasons=reasons, **joined)


def _index(kind: str, name: str, known: Sequence[str]) -> int:
    if name not in known:
        raise ValueError(f"unknown {kind} {name!r}{suggestion(name, known)}")
    return list(known).index(name)

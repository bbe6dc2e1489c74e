"""The plant: nonlinear finite elements of the HexFlex, at rest in every sample, and what the controller is not told."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from experiments.oracles.base import Answers
from experiments.runs import Status

STIFFER = 1.02
LOAD, LOADED = 0.01, "T1D2"
"""Newton, and the force that it adds to: out of plane on the first tab."""


class Mechanism(Protocol):
    """What the plant needs of an oracle."""

    def evaluate(self, points: NDArray[np.float64]) -> Answers:
        """Poses at forces, shape (n, 6)."""
        ...


@dataclass(frozen=True, eq=False)
class Disturbance:
    """How the plant differs from what the model was fitted to.

    Parameters
    ----------
    name : str
    stiffness : float
        Young's modulus over the nominal one. Elastic beams of one Poisson's ratio see only force over modulus,
        at any displacement, so that this divides the forces; no second mechanism need be built.
    load : ndarray, shape (6,)
        Forces [N] that act beside those commanded ...
    begins : float
        ... from this share of the trajectory on.
    """

    name: str
    stiffness: float
    load: NDArray[np.float64]
    begins: float = 0.0

    def forces(self, commanded: NDArray[np.float64], share: ArrayLike) -> NDArray[np.float64]:
        """What the nominal mechanism must see, shape (n, 6), N; `share` (n,) is how much of the trajectory is done."""
        acting = (np.asarray(share) >= self.begins)[:, None]
        return (commanded + np.where(acting, self.load, 0.0)) / self.stiffness


def disturbances(factors: tuple[str, ...]) -> tuple[Disturbance, ...]:
    """None; 2 % stiffer; 10 mN on one tab after three eighths of the trajectory. `factors` names the forces."""
    none = np.zeros(len(factors))
    load = np.where(np.array(factors) == LOADED, LOAD, 0.0)
    return (
        Disturbance("as modelled", 1.0, none),
        Disturbance("2 % stiffer", STIFFER, none),
        Disturbance("10 mN on a tab", 1.0, load, 3.0 / 8.0),
    )


@dataclass(frozen=True, eq=False)
class Plant:
    """Quasi-static: the pose at a sample is the equilibrium under the forces of that sample, and of nothing before.

    Parameters
    ----------
    mechanism : Mechanism
        The oracle; poses in SI.
    """

    mechanism: Mechanism

    def poses(self, forces: NDArray[np.float64]) -> NDArray[np.float64]:
        """Poses under forces, both shape (n, 6), SI.

        Raises
        ------
        RuntimeError
            If a point has no equilibrium, or is rejected: a plant that gives no pose cannot be tracked.
        """
        answers = self.mechanism.evaluate(forces)
        for status, reason, force in zip(answers.status, answers.reasons, forces, strict=True):
            if status is not Status.OK:
                told = ", ".join(f"{f:.4g}" for f in force)
                raise RuntimeError(f"the plant has no pose under the forces ({told}) N: {reason}; use a smaller reach")
        return np.asarray(answers.values)

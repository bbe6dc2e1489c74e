"""From wanted poses to forces: feed-forward alone, or with an integral loop about a noisy sensor."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .plant import Disturbance, Plant
from .trajectories import Trajectory

GAIN = 0.3
"""Share of the measured error that each sample takes off the next command."""

NOISE = np.array([5e-9] * 3 + [1e-7] * 3)
"""Standard deviation of the sensor in one sample: 5 nm and 0.1 µrad, white."""

Told = Callable[[int, int], None]
"""Samples done and samples in all."""


class Inverse(Protocol):
    """Forces for poses, and whether there are any."""

    def __call__(self, poses: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
        """Forces (n, 6) [N] for poses (n, 6) [m, rad], and which of them are good (n,)."""
        ...


@dataclass(frozen=True, eq=False)
class Controller:
    """A named inverse, with the integral loop about it or without.

    Parameters
    ----------
    name : str
    inverse : Inverse
    gain : float
        Of the integral loop; 0 is feed-forward alone.

    Raises
    ------
    ValueError
        If the gain is not in [0, 2): about a good inverse the error is multiplied by 1 - gain in each sample.
    """

    name: str
    inverse: Inverse
    gain: float = 0.0

    def __post_init__(self) -> None:
        if not 0.0 <= self.gain < 2.0:
            raise ValueError(
                f"the gain of an integral loop about an inverse is at least 0 and below 2, where it would grow; "
                f"got {self.gain}"
            )


@dataclass(frozen=True, eq=False)
class Lane:
    """One run of one controller: what is to be tracked, on which plant, with which sensor noise.

    Parameters
    ----------
    trajectory : Trajectory
    disturbance : Disturbance
    controller : Controller
    seed : int or None
        Of the sensor's noise; None where nothing is measured.
    """

    trajectory: Trajectory
    disturbance: Disturbance
    controller: Controller
    seed: int | None = None


@dataclass(frozen=True, eq=False)
class Tracked:
    """What came of a lane.

    Parameters
    ----------
    lane : Lane
    poses : ndarray, shape (n, 6)
        True poses of the plant, SI; what the sensor says is not kept.
    forces : ndarray, shape (n, 6)
        Commanded, N.
    refused : int
        Samples whose command the inverse refused.
    """

    lane: Lane
    poses: NDArray[np.float64]
    forces: NDArray[np.float64]
    refused: int


def feed_forward(plant: Plant, lane: Lane) -> Tracked:
    """All samples of a lane at once: nothing is measured.

    Raises
    ------
    RuntimeError
        If the inverse refuses a pose, or the plant has none under the forces.
    """
    wanted = lane.trajectory.poses
    forces, ok = lane.controller.inverse(wanted)
    if not ok.all():
        raise RuntimeError(
            f"{lane.controller.name} refused {int((~ok).sum())} of {len(ok)} poses of the {lane.trajectory.name}: they "
            "lie outside what the model can give; use a smaller reach"
        )
    n = len(wanted)
    poses = plant.poses(lane.disturbance.forces(forces, np.arange(n) / n))
    return Tracked(lane, poses, forces, 0)


def integral_loops(plant: Plant, lanes: Sequence[Lane], told: Told = lambda done, total: None) -> list[Tracked]:
    """Run many lanes of equal length side by side, sample by sample.

    In sample k the pose commanded is ``wanted[k] + shift``, and what was measured then changes the shift for
    sample k + 1 by ``gain * (wanted[k] - measured)``. A command that the inverse refuses leaves the last forces
    on (none at the start) and the shift as it is, so that it does not wind up.

    The plant answers all lanes in one call per sample: the finite elements take as long for one point as for
    some two hundred.

    Raises
    ------
    ValueError
        If there are no lanes, or they differ in length.
    RuntimeError
        If the plant has no pose under the forces.
    """
    lengths = {len(lane.trajectory) for lane in lanes}
    if len(lengths) != 1:
        raise ValueError(f"lanes side by side must have the same number of samples; got {sorted(lengths) or 'none'}")
    n = lengths.pop()
    wanted = np.stack([lane.trajectory.poses for lane in lanes])
    noise = np.stack([_noise(lane, n) for lane in lanes])
    gain = np.array([lane.controller.gain for lane in lanes])[:, None]
    shift, forces = np.zeros((len(lanes), 6)), np.zeros((len(lanes), 6))
    poses, commanded = np.empty_like(wanted), np.empty_like(wanted)
    refused = np.zeros(len(lanes), dtype=int)
    for k in range(n):
        found, ok = _inverted(lanes, wanted[:, k] + shift)
        forces = np.where(ok[:, None], found, forces)
        acting = [lane.disturbance.forces(row[None], [k / n])[0] for lane, row in zip(lanes, forces, strict=True)]
        poses[:, k], commanded[:, k] = plant.poses(np.array(acting)), forces
        measured = poses[:, k] + noise[:, k]
        shift += np.where(ok[:, None], gain * (wanted[:, k] - measured), 0.0)
        refused += ~ok
        told(k + 1, n)
    return [Tracked(*row) for row in zip(lanes, poses, commanded, refused.tolist(), strict=True)]


def _noise(lane: Lane, n: int) -> NDArray[np.float64]:
    """What the sensor adds, shape (n, 6)."""
    if lane.seed is None:
        return np.zeros((n, 6))
    return NOISE * np.random.default_rng(lane.seed).normal(size=(n, 6))


def _inverted(lanes: Sequence[Lane], wanted: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Forces (n_lanes, 6) and which are good (n_lanes,), each lane by its own inverse, one call per inverse."""
    forces, ok = np.empty_like(wanted), np.empty(len(lanes), dtype=bool)
    inverses = {id(lane.controller.inverse): lane.controller.inverse for lane in lanes}
    for key, inverse in inverses.items():
        rows = np.array([id(lane.controller.inverse) == key for lane in lanes])
        forces[rows], ok[rows] = inverse(wanted[rows])
    return forces, ok

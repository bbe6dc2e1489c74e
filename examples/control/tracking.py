"""Tracking errors: the plant's true pose less the pose that was wanted."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .controllers import Tracked


@dataclass(frozen=True, eq=False)
class Errors:
    """Errors of one controller on one trajectory and plant, over all samples and all seeds of the sensor.

    Parameters
    ----------
    trajectory, disturbance, controller : str
        Names.
    rms, largest : ndarray, shape (6,)
        Of each coordinate, m and rad.
    position_rms, position_largest : float
        Of the distance in space, m.
    rotation_rms, rotation_largest : float
        Of the root of the sum of the three Euler angles' squared errors, rad.
    refused : int
        Samples refused by the inverse.
    runs : int
        Seeds.
    """

    trajectory: str
    disturbance: str
    controller: str
    rms: NDArray[np.float64]
    largest: NDArray[np.float64]
    position_rms: float
    position_largest: float
    rotation_rms: float
    rotation_largest: float
    refused: int
    runs: int

    @property
    def four(self) -> NDArray[np.float64]:
        """RMS and largest of position, RMS and largest of rotation, SI."""
        return np.array([self.position_rms, self.position_largest, self.rotation_rms, self.rotation_largest])


def deviation(tracked: Tracked) -> NDArray[np.float64]:
    """True pose less wanted pose, shape (n, 6), SI."""
    return tracked.poses - tracked.lane.trajectory.poses


def errors(runs: Sequence[Tracked]) -> Errors:
    """Errors over runs that differ in the sensor's seed alone."""
    lane = runs[0].lane
    apart = np.concatenate([deviation(run) for run in runs])
    position, rotation = np.linalg.norm(apart[:, :3], axis=1), np.linalg.norm(apart[:, 3:], axis=1)
    return Errors(
        lane.trajectory.name,
        lane.disturbance.name,
        lane.controller.name,
        np.sqrt((apart**2).mean(axis=0)),
        np.abs(apart).max(axis=0),
        float(np.sqrt((position**2).mean())),
        float(position.max()),
        float(np.sqrt((rotation**2).mean())),
        float(rotation.max()),
        sum(run.refused for run in runs),
        len(runs),
    )


def grouped(runs: Sequence[Tracked]) -> list[list[Tracked]]:
    """Runs by trajectory, plant and controller, in the order in which these first appear."""
    groups: dict[tuple[str, str, str], list[Tracked]] = {}
    for run in runs:
        lane = run.lane
        groups.setdefault((lane.trajectory.name, lane.disturbance.name, lane.controller.name), []).append(run)
    return list(groups.values())


def smallest_ratio(linear: Errors, ours: Errors) -> float:
    """How many times smaller our errors are, in the coordinate and measure (RMS or largest) where it is least."""
    return float(min((linear.rms / ours.rms).min(), (linear.largest / ours.largest).min()))

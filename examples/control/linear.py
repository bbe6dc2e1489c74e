"""Linear inverses to compare with, from the thesis's to the best that any affine map can do on the same poses."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from experiments import oracles
from experiments.oracles.hexflex import HexFlex

from .controllers import Inverse
from .plant import Plant
from .trajectories import REACH, placed

N_FITTED = 500
"""Poses that the best affine inverse is fitted to: its 42 numbers are known far better than its errors need."""


@dataclass(frozen=True, eq=False)
class Linear:
    """``forces = gain @ pose + offset``.

    Parameters
    ----------
    gain : ndarray, shape (6, 6)
        N/m and N/rad.
    offset : ndarray, shape (6,)
        N.
    """

    gain: NDArray[np.float64]
    offset: NDArray[np.float64]

    def __call__(self, poses: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
        """Forces for poses, shape (n, 6); a linear map refuses nothing."""
        poses = np.asarray(poses, dtype=np.float64)
        return poses @ self.gain.T + self.offset, np.ones(len(poses), dtype=bool)


def thesis() -> Linear:
    """Inverse of Eq. 2.6 as printed: rounded to 0.1, and a misprint in row θy.

    Durango et al., chapter 2 of Durango's thesis; its finite elements were linear shells, and the plant's dimensions
    were identified from this very matrix.
    """
    published = oracles.get("hexflex").published
    if published is None:
        raise RuntimeError("the oracle 'hexflex' has no published map at its default parameters; it should")
    return Linear(np.asarray(np.linalg.inv(published.values), dtype=np.float64), np.zeros(len(published.values)))


def at_rest(mechanism: HexFlex) -> Linear:
    """Inverse of the plant's Jacobian at zero load: what linear finite elements without any error would give.

    Taken from the linear kinematics of the same frame, whose map is that Jacobian to rounding.
    """
    small = replace(mechanism, kinematics="linear", stress_limit=None)
    jacobian = small.jacobian(np.zeros((1, len(mechanism.factors))))[0]
    return Linear(np.linalg.inv(jacobian), np.zeros(len(jacobian)))


def best_affine(plant: Plant, inverse: Inverse, box: ArrayLike, rng: np.random.Generator) -> Linear:
    """The affine inverse of least squares over the part of the box that the trajectories use.

    It has seen the nonlinear plant exactly where it will be used, at more points than any of the models was
    fitted to: no affine inverse can be much better there.

    Parameters
    ----------
    plant : Plant
    inverse : Inverse
        Finds forces that bring the plant near random poses of the box; the fit is to where the plant then is.
    box : array_like, shape (6, 2)
        Certified poses, SI.
    rng : numpy.random.Generator
    """
    wanted = placed(rng.uniform(-1.0, 1.0, (N_FITTED, 6)), box, REACH)
    forces, ok = inverse(wanted)
    forces = forces[ok]
    poses = plant.poses(forces)
    middle, half = poses.mean(axis=0), np.ptp(poses, axis=0) / 2.0
    matrix = np.column_stack([np.ones(len(poses)), (poses - middle) / half])
    solution = np.linalg.lstsq(matrix, forces, rcond=None)[0]
    gain = solution[1:].T / half
    return Linear(gain, solution[0] - gain @ middle)

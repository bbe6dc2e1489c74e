"""Wanted poses, sample by sample: a circle, a raster, a train of steps, in all six coordinates at once."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from experiments import Factor, FactorSpace
from experiments.designs import PlackettBurman

REACH = 0.8
"""Of the box's half-width in each coordinate, to both sides of its middle."""

LINES = 12
"""Scan lines of the raster, and levels of the step train."""

MULTIPLE = 2 * LINES


@dataclass(frozen=True, eq=False)
class Trajectory:
    """A named sequence of poses.

    Parameters
    ----------
    name : str
    poses : ndarray, shape (n, 6)
        x, y, z [m], θx, θy, θz [rad] wanted at each sample.
    """

    name: str
    poses: NDArray[np.float64]

    def __len__(self) -> int:
        return len(self.poses)


def circle(n: int) -> NDArray[np.float64]:
    """x and y go round once, the rest at two and three times the speed; shape (n, 6), in [-1, 1]."""
    turn = 2.0 * np.pi * np.arange(n) / n
    return np.column_stack(
        [np.cos(turn), np.sin(turn), np.sin(2 * turn), np.cos(3 * turn), np.sin(3 * turn), np.cos(2 * turn)]
    )


def raster(n: int) -> NDArray[np.float64]:
    """Lines along x, to and fro, from y = -1 to 1, while the rest changes slowly; shape (n, 6), in [-1, 1]."""
    each = n // LINES
    line, along = np.divmod(np.arange(n), each)
    fast = -1.0 + 2.0 * along / (each - 1)
    x = np.where(line % 2 == 0, fast, -fast)
    y = -1.0 + 2.0 * line / (LINES - 1)
    turn = 2.0 * np.pi * np.arange(n) / n
    return np.column_stack([x, y, np.cos(turn), np.sin(turn), np.sin(2 * turn), np.cos(2 * turn)])


def step_train(n: int) -> NDArray[np.float64]:
    """Twelve corners, each held for n/12 samples, every coordinate as often low as high; shape (n, 6), -1 or 1.

    The corners are the runs of a Plackett-Burman design, so that no two coordinates step together throughout.
    """
    space = FactorSpace(tuple(Factor(f"q{i}", "1", -1.0, 1.0) for i in range(6)))
    return np.repeat(PlackettBurman(n_runs=LINES).generate(space).coded, n // LINES, axis=0)


SHAPES: dict[str, Callable[[int], NDArray[np.float64]]] = {
    "circle": circle,
    "raster": raster,
    "step train": step_train,
}


def placed(shape: ArrayLike, box: ArrayLike, reach: float = REACH) -> NDArray[np.float64]:
    """A shape in [-1, 1] brought into a box: ±1 becomes `reach` of the half-width about the middle.

    Parameters
    ----------
    shape : array_like, shape (n, 6)
    box : array_like, shape (6, 2)
        Low and high of each coordinate, SI.
    reach : float
        Above 0, up to 1.

    Raises
    ------
    ValueError
        If `reach` is not in (0, 1].
    """
    if not 0.0 < reach <= 1.0:
        raise ValueError(f"reach is a share of the certified box, above 0 and up to 1; got {reach}")
    low, high = np.asarray(box, dtype=np.float64).T
    return 0.5 * (low + high) + reach * 0.5 * (high - low) * np.asarray(shape, dtype=np.float64)


def trajectories(box: ArrayLike, n: int, reach: float = REACH) -> tuple[Trajectory, ...]:
    """All shapes with `n` samples each, in a box of poses, shape (6, 2).

    Raises
    ------
    ValueError
        If `n` is not a positive multiple of 24, or `reach` is not allowed.
    """
    if n < MULTIPLE or n % MULTIPLE:
        raise ValueError(
            f"a trajectory has {LINES} lines or levels of an even number of samples: give a multiple of {MULTIPLE}, "
            f"at least {MULTIPLE}; got {n}"
        )
    return tuple(Trajectory(name, placed(shape(n), box, reach)) for name, shape in SHAPES.items())

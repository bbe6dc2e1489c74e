"""Every controller on every trajectory and plant, and the time that the exported inverse takes."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path

import numpy as np

from experiments.oracles.hexflex import HexFlex
from surrogates import Surrogate

from .compiled import Timing, compiled
from .controllers import GAIN, Controller, Lane, Told, Tracked, feed_forward, integral_loops
from .linear import at_rest, best_affine, thesis
from .loading import certified_box
from .plant import Disturbance, Plant, disturbances
from .tracking import Errors, errors, grouped, smallest_ratio
from .trajectories import REACH, Trajectory, trajectories

THESIS, AT_REST, AFFINE, OURS = "linear, Eq. 2.6", "linear, at rest", "affine, fitted", "certified"
LINEAR = (THESIS, AT_REST, AFFINE)
LOOP = " + loop"
SEED = 2012


@dataclass(frozen=True)
class Size:
    """How much is run.

    Parameters
    ----------
    samples : int
        Of each trajectory.
    seeds : int
        Of the sensor's noise.
    repeats : int
        Timed calls of each pose.
    """

    samples: int
    seeds: int
    repeats: int


FULL, SMALL = Size(480, 10, 200), Size(48, 2, 5)


@dataclass(frozen=True, eq=False)
class Campaign:
    """All that was run.

    Parameters
    ----------
    model : Surrogate
    tracked : tuple of Tracked
    errors : tuple of Errors
        One per trajectory, plant and controller.
    timing : Timing
    """

    model: Surrogate
    tracked: tuple[Tracked, ...]
    errors: tuple[Errors, ...]
    timing: Timing

    def of(self, trajectory: str, disturbance: str, controller: str) -> Errors:
        """The errors of one controller on one trajectory and plant."""
        wanted = (trajectory, disturbance, controller)
        return next(e for e in self.errors if (e.trajectory, e.disturbance, e.controller) == wanted)

    def ratio(self, linear: str) -> float:
        """Errors of a linear inverse over ours, feed-forward on the plant as modelled: the least of all coordinates,
        trajectories, RMS and largest errors."""
        names = list(dict.fromkeys(e.trajectory for e in self.errors))
        plant = self.errors[0].disturbance
        return min(smallest_ratio(self.of(name, plant, linear), self.of(name, plant, OURS)) for name in names)


def track(
    model: Surrogate, mechanism: HexFlex, folder: Path, size: Size = FULL, told: Told = lambda done, total: None
) -> Campaign:
    """Compile the model's export in `folder`, and run everything.

    Parameters
    ----------
    model : Surrogate
    mechanism : HexFlex
        The plant, as :func:`.plant_of` gives it for a model that it accepts.
    folder : Path
        For the generated code and the library.
    size : Size
    told : callable
        Hears how many samples of the loops are done.

    Raises
    ------
    ValueError
        If the model has no certified box of responses.
    RuntimeError
        If there is no C compiler, or the exported inverse refuses a wanted pose.
    """
    plant, box = Plant(mechanism), certified_box(model)
    inverse = compiled(model, folder)
    wanted = trajectories(box, size.samples, REACH)
    forward = [
        Controller(THESIS, thesis()),
        Controller(AT_REST, linear := at_rest(mechanism)),
        Controller(AFFINE, best_affine(plant, inverse, box, np.random.default_rng(SEED))),
        Controller(OURS, inverse),
    ]
    loops = [Controller(AT_REST + LOOP, linear, GAIN), Controller(OURS + LOOP, inverse, GAIN)]
    plants = disturbances(model.factors.names)
    tracked = [feed_forward(plant, lane) for lane in _lanes(wanted, plants, forward, [None])]
    seeds = [SEED + i for i in range(size.seeds)]
    tracked += integral_loops(plant, _lanes(wanted, plants, loops, seeds), told)
    timing = inverse.timing(np.concatenate([t.poses for t in wanted]), size.repeats)
    found = _in_order([errors(runs) for runs in grouped(tracked)])
    return Campaign(model, tuple(tracked), found, timing)


def _lanes(
    wanted: Sequence[Trajectory],
    plants: Sequence[Disturbance],
    controllers: Sequence[Controller],
    seeds: Sequence[int | None],
) -> list[Lane]:
    return [Lane(*row) for row in product(wanted, plants, controllers, seeds)]


def _in_order(found: Sequence[Errors]) -> tuple[Errors, ...]:
    """By trajectory, then plant, then controller, each in the order in which it first appears."""
    seen = [list(dict.fromkeys(names)) for names in zip(*(_names(e) for e in found), strict=True)]
    return tuple(sorted(found, key=lambda e: [all_.index(n) for all_, n in zip(seen, _names(e), strict=True)]))


def _names(e: Errors) -> tuple[str, str, str]:
    return e.trajectory, e.disturbance, e.controller

"""Answers of the nonlinear solver, read in SI units."""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from jax import Array
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from .arrays import FrameArrays
from .conclusion import Conclusion
from .condensed import Problem, Space, State, Topology
from .kernel import Settled
from .model import Frame
from .results import Centreline
from .scaling import Units
from .stress import bending_stress, fibres, normal_stress

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Equilibria:
    """Equilibria of a batch of cases, under large displacements and rotations; NaN where a case has none.

    The arrays have the cases last, as the solver has them; the methods and properties give cases first.

    Parameters
    ----------
    frame : Frame
    arrays : FrameArrays
    coordinates : ndarray, shape (3, n_nodes, n_cases or 1)
        Of the nodes at rest, m.
    motion : ndarray, shape (6, n_blocks, n_cases)
        Translation, m, and rotation vector, rad, of the origin of each block.
    force : ndarray, shape (6, n_blocks, n_cases)
        What members and loads exert on each block about its origin, N and N m: zero but where it is held.
    internal : ndarray, shape (6, n_steps + 1, n_members, n_cases)
        N, Vy, Vz, T, My, Mz at the ends of the steps along the members, N and N m: what the part beyond
        exerts, in the axes of the section.
    centre, rest_centre : ndarray, shape (3, n_steps + 1, n_members, n_cases or 1)
        Where the centres of those sections are, and where they are at rest, m.
    energy : ndarray, shape (n_cases,)
        Strain energy, J.
    ok : ndarray of bool, shape (n_cases,)
    reasons : tuple of str
        Why a case has no answer; empty where it has.
    iterations : ndarray of int, shape (n_cases,)
        Newton's corrections, those of attempts that were given up included.
    residual : ndarray, shape (n_cases,)
        Largest force that is left over the largest force in a member, or gap over the length of members.
    unstable : ndarray of int, shape (n_cases,)
        Unstable modes of the equilibrium. Under moments of constant direction, which have no potential in
        space, the count is that of the tangent's negative pivots.
    """

    frame: Frame
    arrays: FrameArrays
    coordinates: Floats
    motion: Floats
    force: Floats
    internal: Floats
    centre: Floats
    rest_centre: Floats
    energy: Floats
    ok: NDArray[np.bool_]
    reasons: tuple[str, ...]
    iterations: NDArray[np.int64]
    residual: Floats
    unstable: NDArray[np.int64]

    def __len__(self) -> int:
        return len(self.ok)

    def rotation(self, node: str) -> Rotation:
        """Rotations of a node in all cases; ``.as_euler("XYZ")`` gives intrinsic XYZ angles, rad.

        A case without an answer counts as not turned. ``ValueError`` if the node is unknown.
        """
        return Rotation.from_rotvec(np.nan_to_num(self.motion[3:, self._block(node)].T))

    def at(self, node: str) -> Floats:
        """Translation, m, and rotation vector, rad, of a node, shape (n_cases, 6); ``ValueError`` if it is unknown."""
        i = self.frame.index(node)
        motion = self.motion[:, self._block(node)].T
        arm = (self.coordinates[:, i] - self.coordinates[:, self.arrays.master[i]]).T
        if not arm.any():
            return motion.copy()
        turn = self.rotation(node)
        carried = turn.apply(arm + np.zeros((len(self), 3))) - arm
        return motion + np.hstack([carried, np.zeros_like(carried)])

    @cached_property
    def displacements(self) -> Floats:
        """Translations and rotation vectors of all nodes, shape (n_cases, n_nodes, 6), m and rad."""
        return np.stack([self.at(node) for node in self.frame.nodes], axis=1)

    @property
    def reactions(self) -> Floats:
        """What each clamp exerts on the frame, at its node, shape (n_cases, n_clamps, 6), N and N m."""
        return -self.force[:, self.arrays.n_free :].T

    @property
    def support_reactions(self) -> Floats:
        """What each support exerts, at its node, shape (n_cases, n_supports, 6); zero where it does not hold."""
        blocks = [self._block(support.node) for support in self.frame.supports]
        return np.where(self.arrays.held[blocks], -self.force[:, blocks].T, 0.0)

    @property
    def end_forces(self) -> Floats:
        """What the nodes exert on both ends of each member, in the axes of its end sections as they stand.

        Shape (n_cases, n_members, 2, 6), N and N m.
        """
        return np.stack([-self.internal[:, 0].T, self.internal[:, -1].T], axis=2)

    @cached_property
    def bending_stress(self) -> Floats:
        """Largest bending stress of each section, shape (n_cases, n_steps + 1, n_members), Pa."""
        return bending_stress(np, self.internal, fibres(self.frame.members)).transpose(2, 0, 1)

    @cached_property
    def normal_stress(self) -> Floats:
        """Largest bending stress and axial stress together, shape (n_cases, n_steps + 1, n_members), Pa."""
        return normal_stress(np, self.internal, fibres(self.frame.members)).transpose(2, 0, 1)

    def largest_stress(self) -> tuple[Floats, NDArray[np.int64], Floats]:
        """Largest bending stress of each case, Pa, the number of its member, and where along that, in [0, 1].

        Three arrays of shape (n_cases,), from the ends of the steps along the members.
        """
        _, n_sections, n_members = self.bending_stress.shape
        flat = self.bending_stress.reshape(len(self), -1)
        peak = np.where(np.isnan(flat), -np.inf, flat).argmax(axis=1)
        return flat[np.arange(len(self)), peak], peak % n_members, peak // n_members / (n_sections - 1)

    def centrelines(self, case: int = 0) -> tuple[Centreline, ...]:
        """One centreline per member in one case; ``ValueError`` if there is no such case."""
        if not 0 <= case < len(self):
            raise ValueError(f"case {case} does not exist: there are {len(self)}, from 0 on")
        rest = self.rest_centre[..., min(case, self.rest_centre.shape[-1] - 1)]
        moved = self.centre[..., case] - rest
        return tuple(Centreline(m.name, rest[:, :, i].T, moved[:, :, i].T) for i, m in enumerate(self.frame.members))

    def _block(self, node: str) -> int:
        return int(self.arrays.block[self.frame.index(node)])


@dataclass(frozen=True, eq=False)
class Path:
    """Equilibria along a path from rest.

    Parameters
    ----------
    level : ndarray, shape (n_points,)
        Fraction of the load.
    arc : ndarray, shape (n_points,)
        Length of the path, in mean lengths of members and radians.
    equilibria : Equilibria
        Its cases are the points; ``.unstable`` counts the unstable modes of each.
    is_limit : ndarray of bool, shape (n_points,)
        Points at which the load has an extremum along the path.
    ended : str
        Why the path ended.
    missed : tuple of str
        Limit points that were passed and not found: between which levels, and why.
    """

    level: Floats
    arc: Floats
    equilibria: Equilibria
    is_limit: NDArray[np.bool_]
    ended: str
    missed: tuple[str, ...] = ()

    def __len__(self) -> int:
        return len(self.level)


def everything(topology: Topology, problem: Problem, state: State, found: Conclusion) -> Conclusion:
    """The view of the solver that :func:`equilibria` reads."""
    return found


class Described(NamedTuple):
    """What was solved; the coordinates at rest, m, have the shape (3, n_nodes, n_points or 1)."""

    frame: Frame
    arrays: FrameArrays
    space: Space
    units: Units
    coordinates: Floats


def equilibria(what: Described, settled: Settled, rest_centre: Array, only_stable: bool) -> Equilibria:
    """What the kernel found, in SI units; the view is :func:`everything`."""
    frame, arrays, space, units, coordinates = what
    found: Conclusion = settled.seen
    ok = settled.is_sound(only_stable)
    forces = np.repeat([units.force, units.force * units.length], 3)
    motions = np.repeat([units.length, 1.0], 3)

    def real(values: Any, scale: Floats) -> Floats:
        values = np.asarray(values)
        if len(values) == 6:
            full = values.copy()
        else:
            full = np.zeros((6, *values.shape[1:]))
            full[list(space.motions)] = values
        full *= scale.reshape(6, *(1,) * (full.ndim - 1))
        full[..., ~ok] = np.nan
        return full

    height = coordinates[2, 0]

    def points(values: Any) -> Floats:
        values = np.array(values) * units.length
        return values if len(values) == 3 else np.concatenate([values, np.zeros_like(values[:1]) + height])

    centre = points(found.centre)
    centre[..., ~ok] = np.nan
    return Equilibria(
        frame,
        arrays,
        coordinates,
        real(found.motion, motions),
        real(found.force, forces),
        real(found.internal, forces),
        centre,
        points(rest_centre),
        np.where(ok, found.energy * units.force * units.length, np.nan),
        ok,
        settled.reasons(only_stable),
        settled.iterations,
        settled.residual,
        settled.unstable,
    )


def joined(chunks: list[Equilibria]) -> Equilibria:
    """Chunks of the same frame as one."""
    first = chunks[0]
    last_axis = ("motion", "force", "internal", "centre", "energy", "ok", "iterations", "residual", "unstable")
    arrays = {name: np.concatenate([getattr(chunk, name) for chunk in chunks], axis=-1) for name in last_axis}
    for name in ("rest_centre", "coordinates"):
        if getattr(first, name).shape[-1] > 1:
            arrays[name] = np.concatenate([getattr(chunk, name) for chunk in chunks], axis=-1)
    return replace(first, **arrays, reasons=tuple(reason for chunk in chunks for reason in chunk.reasons))

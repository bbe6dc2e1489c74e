"""Large displacements: condense a frame once, solve many cases.

Every case is tried at one go; where Newton's method does not contract, where the equilibrium is
unstable, or where no smooth path leads from rest to it, it is tried again in steps along the load.
What then has no stable equilibrium is reported as such.
"""

import os
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax.typing import ArrayLike
from numpy.typing import NDArray

from . import scaling
from .arrays import FrameArrays, frame_arrays
from .blockloads import dead_loads, follower_loads, prescribed
from .condensed import Problem, topology
from .directions import Toward, directions, spread
from .equilibria import Described, Equilibria, Path, equilibria, everything, joined
from .kernel import Kernel, Settled, View, taken
from .loads import checked, checked_motions
from .mechanisms import check_held
from .model import MOTIONS, Frame
from .path import Follower, gathered
from .planar import Planar
from .planes import check_planar, check_rotations
from .precision import in_float64
from .rods import Rods
from .scaling import Geometry, Units
from .sensitivity import Read, Reading, differentiating, reading
from .spatial import Spatial

Floats = NDArray[np.float64]
Given = tuple[Floats, Floats, Floats]
"""Loads, motions and followers, each (n_cases, n_nodes, 6)."""

CHUNK = 256
"""Cases that are solved together. Fixed, so that one shape is compiled and a case does not depend on its batch."""

N_STEPS = 8
"""Steps along each member: the error of a displacement is about 1e-5 of it where a member turns by half a radian."""


@dataclass(frozen=True, eq=False)
class NonlinearSolver:
    """A condensed frame; made by :func:`condense`.

    Parameters
    ----------
    frame : Frame
    arrays : FrameArrays
    kernel : Kernel
        What is compiled.
    units : Units
        What one means in the kernel's arrays.
    """

    frame: Frame
    arrays: FrameArrays
    kernel: Kernel
    units: Units

    def solve(
        self,
        loads: ArrayLike | None = None,
        motions: ArrayLike | None = None,
        followers: ArrayLike | None = None,
        geometry: Geometry | None = None,
        only_stable: bool = True,
    ) -> Equilibria:
        """Equilibria of all cases; the number of cases is that of whatever is given.

        Parameters
        ----------
        loads : array-like, shape (n_cases, n_nodes, 6), optional
            Loads that keep their direction, N and N m; :func:`.load_array` makes them.
        motions : array-like, shape (n_cases, n_nodes, 6), optional
            Translations, m, and rotation vectors, rad, of supported nodes; :func:`.motion_array` makes them.
        followers : array-like, shape (n_cases, n_nodes, 6), optional
            Loads that turn with their node, N and N m, in global axes at rest.
        geometry : Geometry, optional
            Instead of the frame's, for all cases or for each: the last axes are 1 or n_cases.
        only_stable : bool
            Refuse an equilibrium from which the mechanism would snap or buckle away.

        Returns
        -------
        Equilibria
            A case without a stable equilibrium on the way from rest has ``ok`` false and a reason.

        Raises
        ------
        ValueError
            If an array has another shape or is not finite, a motion is prescribed where none is held,
            or a planar frame is loaded out of its plane.
        """
        return joined(list(self.stream(loads, motions, followers, geometry, only_stable)))

    def stream(
        self,
        loads: ArrayLike | None = None,
        motions: ArrayLike | None = None,
        followers: ArrayLike | None = None,
        geometry: Geometry | None = None,
        only_stable: bool = True,
    ) -> Iterator[Equilibria]:
        """The same as :meth:`solve`, :data:`CHUNK` cases at a time, so that memory does not grow with their number."""
        given = self._checked(loads, motions, followers)

        def solved(rows: NDArray[np.int64]) -> Equilibria:
            settled, centre = self._settled(everything, given, geometry, rows, only_stable)
            coordinates = None if geometry is None else taken(geometry.coordinates, rows)
            return equilibria(self._described(coordinates), settled, centre, only_stable)

        yield from in_threads(solved, chunks(len(given[0])))

    def read(
        self,
        read: Read,
        loads: ArrayLike | None = None,
        motions: ArrayLike | None = None,
        geometry: Geometry | None = None,
    ) -> Reading:
        """What `read` reads off stable equilibria, and nothing else: the fastest way to a few numbers of many cases.

        Parameters
        ----------
        read : callable
            From :class:`.sensitivity.Answer` to values, (n_values, n_points); traceable, and the same object
            in every call, since it is compiled with the solver.
        loads, motions, geometry
            As for :meth:`solve`.
        """
        given = self._checked(loads, motions, None)

        def solved(rows: NDArray[np.int64]) -> Reading:
            settled, _ = self._settled(reading(read, self.units), given, geometry, rows, True)
            ok = settled.is_sound(only_stable=True)
            return Reading(np.where(ok, settled.seen, np.nan).T, ok, settled.reasons(only_stable=True))

        parts = list(in_threads(solved, chunks(len(given[0]))))
        reasons = tuple(reason for part in parts for reason in part.reasons)
        return Reading(np.concatenate([p.values for p in parts]), np.concatenate([p.ok for p in parts]), reasons)

    def differentiate(
        self,
        read: Read,
        loads: ArrayLike | None = None,
        motions: ArrayLike | None = None,
        geometry: Geometry | None = None,
        *,
        load_directions: ArrayLike | None = None,
        motion_directions: ArrayLike | None = None,
        geometry_directions: Geometry | None = None,
    ) -> Floats:
        """Derivatives of what `read` reads along m directions of loads, prescribed motions, geometry and material.

        Parameters
        ----------
        read, loads, motions, geometry
            As for :meth:`read`. What `read` holds constant, say a distance of fibres, stays constant.
        load_directions, motion_directions : array-like, shape (m, n_nodes, 6), optional
        geometry_directions : Geometry, optional
            Changes of each array of a geometry, with m as first axis and 1 or n_cases as last;
            :func:`.parameters.geometry_rates` makes them from a function that builds the frame. Scalars
            and axes of 1 are repeated.

        Returns
        -------
        ndarray, shape (n_cases, n_values, m)
            NaN where a case has no stable equilibrium.

        Raises
        ------
        ValueError
            As :meth:`solve`, or if there is no direction, or not as many of each.
        """
        given = self._checked(loads, motions, None)
        toward = self._toward(load_directions, motion_directions, geometry_directions)
        view = differentiating(read, self.units)

        def solved(rows: NDArray[np.int64]) -> Floats:
            settled, _ = self._settled(view, given, geometry, rows, True, toward)
            return np.where(settled.is_sound(only_stable=True), settled.seen, np.nan).transpose(2, 0, 1)

        return np.concatenate(list(in_threads(solved, chunks(len(given[0])))))

    @in_float64
    def follow(
        self,
        loads: ArrayLike | None = None,
        motions: ArrayLike | None = None,
        followers: ArrayLike | None = None,
        *,
        step: float = 0.1,
        most: int = 200,
        levels: tuple[float, float] = (-np.inf, np.inf),
    ) -> Path:
        """The equilibrium path of one case from rest, through limit points, unstable branches included.

        Parameters
        ----------
        loads, motions, followers : array-like, shape (1, n_nodes, 6), optional
            As for :meth:`solve`; the level 1 is this much.
        step : float
            Largest arc length between points: motions of all bodies, in mean lengths of members and radians.
        most : int
            Points after which the path ends.
        levels : tuple of 2 float
            Fractions of the load at which it ends.

        Raises
        ------
        ValueError
            If there is more than one case, or a setting is out of its range.
        """
        given = self._checked(loads, motions, followers)
        if len(given[0]) != 1:
            raise ValueError(f"a path is that of one case, got {len(given[0])}: follow them one by one")
        problem, centre = self.problem(*given)
        points, why, missed = Follower(step, most, levels).follow(self.kernel.topology, problem)
        worth, iterations = gathered(points)
        true = np.ones(len(points), dtype=bool)
        level = np.array([point.level for point in points])
        settled = Settled(worth, true, level, worth.residual, worth.astray, worth.unstable, iterations)
        found = equilibria(self._described(None), settled, centre, False)
        arc = np.array([point.arc for point in points])
        return Path(level, arc, found, np.array([point.is_limit for point in points]), why, tuple(missed))

    def _described(self, coordinates: Any) -> Described:
        own = self.arrays.coordinates.T[..., None] if coordinates is None else np.asarray(coordinates)
        return Described(self.frame, self.arrays, self.kernel.topology.space, self.units, own)

    @in_float64
    def _settled(
        self,
        view: View,
        given: Given,
        geometry: Geometry | None,
        rows: NDArray[np.int64],
        only_stable: bool,
        toward: Toward | None = None,
    ) -> tuple[Settled, Any]:
        """One chunk, filled up with its last case, and the centres of its sections at rest."""
        full = filled(rows)
        loads, motions, followers = (array[full] for array in given)
        here = taken(geometry, full)
        problem, centre = self.problem(loads, motions, followers, here)
        if toward is not None:
            toward = toward._replace(geometry=taken(toward.geometry, full))
            at = scaling.geometry(self.arrays) if here is None else here
            along = directions(self.arrays, self.kernel.topology, self.units, toward, at, loads)
            problem = problem._replace(along=along)
        settled = self.kernel.settle(problem, view, only_stable, len(rows))
        return taken(settled, np.arange(len(rows))), taken(centre, np.arange(len(rows)))

    def problem(
        self, loads: Floats, motions: Floats, followers: Floats, geometry: Geometry | None = None
    ) -> tuple[Problem, Any]:
        """The condensed problem of arrays as in :meth:`solve`, and the centres of the sections at rest."""
        a, space, unit = self.arrays, self.kernel.topology.space, self.units
        rods, rest, centre = self._own if geometry is None else self._condensed(geometry)
        coordinates = a.coordinates.T[..., None] if geometry is None else np.asarray(geometry.coordinates)
        problem = Problem(
            rods,
            rest,
            jnp.asarray(dead_loads(a, space, unit, coordinates, loads)),
            jnp.asarray(follower_loads(a, space, unit, coordinates, followers)),
            jnp.asarray(prescribed(a, space, unit, motions)),
        )
        return problem, centre

    def _toward(self, loads: ArrayLike | None, motions: ArrayLike | None, geometry: Geometry | None) -> Toward:
        """Directions as they are given, as many of each."""
        given = [part for part in (loads, motions, *jax.tree.leaves(geometry)) if part is not None]
        parts = [np.asarray(part) for part in given if np.ndim(part)]
        if not parts:
            raise ValueError(
                "there is no direction: give load_directions, motion_directions or geometry_directions, "
                "with the directions as first axis"
            )
        none = np.zeros((len(parts[0]), len(self.frame.nodes), 6))
        wrong = [len(part) for part in parts if len(part) != len(none)]
        if wrong:
            raise ValueError(f"there are {len(none)} directions of one kind and {wrong[0]} of another: give as many")
        pulls, turns, _ = self._checked(none if loads is None else loads, none if motions is None else motions, None)
        if geometry is not None:
            own = scaling.geometry(self.arrays)
            geometry = jax.tree.map(lambda g, d: spread(np.atleast_1d(d), g, len(none)), own, geometry)
        return Toward(pulls, turns, geometry)

    @cached_property
    def _condensed(self) -> Any:
        kernel = self.kernel.topology
        return jax.jit(partial(scaling.condensed, self.arrays, kernel.space, self.units, kernel.n_steps))

    @cached_property
    def _own(self) -> tuple[Rods, Any, Any]:
        """Rods, poses and centres at rest of the frame as it is."""
        return self._condensed(scaling.geometry(self.arrays))

    def _checked(self, *given: ArrayLike | None) -> Given:
        """Loads, motions and followers of the same number of cases, zero where none are given."""
        frame = self.frame
        number = next((len(np.asarray(array)) for array in given if array is not None), 0)
        none = np.zeros((number, len(frame.nodes), 6))
        if not number:
            raise ValueError("there is nothing to solve: give loads, motions or followers of at least one case")
        loads, motions, followers = (none if array is None else array for array in given)
        loads, followers = checked("loads", frame, loads), checked("loads", frame, followers)
        if len(followers) != len(loads):
            raise ValueError(
                f"there are {len(loads)} cases of loads and {len(followers)} of followers: give as many of both"
            )
        motions = checked_motions(frame, motions, len(loads))
        if isinstance(self.kernel.topology.space, Planar):
            for what, array in (("load", loads), ("follower", followers), ("motion", motions)):
                _check_in_plane(frame, what, array)
        return loads, motions, followers


@in_float64
def condense(frame: Frame, *, planar: bool = False, n_steps: int = N_STEPS) -> NonlinearSolver:
    """Prepare `frame` for :meth:`NonlinearSolver.solve`.

    Parameters
    ----------
    frame : Frame
    planar : bool
        Move in the xy-plane only: half the unknowns, an eighth of the work. All nodes have the same z
        and all members their local z along global z.
    n_steps : int
        Steps of the integration along each member, an even number; the error falls with its fourth power.

    Raises
    ------
    ValueError
        If a part of the frame is free to move, `n_steps` is not even and positive, or the frame is not
        what `planar` asks for. In space a support must hold all three rotations or none: to hold one
        while the others are large has no meaning that does not depend on the path.
    """
    # Two steps would be a loop of one round, which XLA opens and fuses into something a thousand times slower.
    if n_steps < 4 or n_steps % 2:
        raise ValueError(f"n_steps must be an even number from 4 on, got {n_steps}")
    arrays = frame_arrays(frame)
    if planar:
        check_planar(frame, arrays)
    else:
        check_held(frame, arrays)
        check_rotations(frame)
    space = Planar() if planar else Spatial()
    return NonlinearSolver(frame, arrays, Kernel(topology(arrays, space, n_steps)), scaling.units(arrays))


def chunks(n_cases: int) -> list[NDArray[np.int64]]:
    """The rows of each chunk."""
    return [np.arange(start, min(start + CHUNK, n_cases)) for start in range(0, n_cases, CHUNK)]


def filled(rows: NDArray[np.int64]) -> NDArray[np.int64]:
    """The rows of a chunk, the last repeated until it is full."""
    return rows[np.minimum(np.arange(CHUNK), len(rows) - 1)]


def in_threads(function: Callable[[NDArray[np.int64]], Any], parts: list[NDArray[np.int64]]) -> Iterator[Any]:
    """`function` of each of `parts`, in order, some ahead in other threads: compiled code does not hold the lock."""
    if not parts:
        return
    yield function(parts[0])  # the first compiles
    n_threads = os.cpu_count() or 1
    with ThreadPoolExecutor(n_threads) as pool:
        ahead = deque(pool.submit(function, part) for part in parts[1 : 1 + 2 * n_threads])
        for part in parts[1 + 2 * n_threads :]:
            yield ahead.popleft().result()
            ahead.append(pool.submit(function, part))
        while ahead:
            yield ahead.popleft().result()


def _check_in_plane(frame: Frame, what: str, array: Floats) -> None:
    out = [2, 3, 4]
    bad = np.argwhere(array[:, :, out])
    if bad.size:
        case, node, part = bad[0]
        raise ValueError(
            f"{what} case {case} acts out of the plane at node {frame.node_names[node]!r} "
            f"({MOTIONS[out[part]]!r} is not zero): condense the frame without planar, or leave it zero"
        )

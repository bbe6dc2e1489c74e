"""Algorithm 1: kinematics, statics and deflection in turn until geometry and torques stay.

At its fixed point the flexures' tips and moments fit the very geometry and forces that they cause: an
exact equilibrium of rigid links on elastic leaves. Source: thesis, Algorithm 1.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from .acceleration import Anderson
from .batch import pick, store
from .elastica import Deflection, deflect
from .kinematics import Poses, flexure_rotations, modular_kinematics, rest_poses
from .layout import Layout
from .statics import Wrench, modular_statics

CLOSED = 1e-9  # gap over the shortest leaf above which a module does not close
RESOLVED = 1e-3  # rad; share of the highest polynomials in a leaf's angle above which it needs more nodes


@dataclass(frozen=True)
class Settings:
    """How the fixed point is sought.

    Parameters
    ----------
    nodes : int
        Gauss nodes on each leaf, at least 2.
    extensible : bool
        Whether the axial force stretches the leaves; the thesis neglects it.
    memory : int
        Steps that Anderson's acceleration remembers; 0 for the thesis's plain iteration.
    relaxation : float
        Share of each step that is taken, in (0, 1].
    max_iterations : int
        Passes after which a point is given up.
    retries : tuple of int
        A point that fails is tried again with angles and loads raised in so many increments, then in so
        many; empty for one attempt alone.
    torque_tolerance : float
        Largest change of a driving torque between the last two passes, N m; the thesis's 1e-6 N mm.
    tolerance : float
        Largest change in the last pass of a tip's place over the flexure's length, and of M L / E I.

    Raises
    ------
    ValueError
        If a value lies outside its range.
    """

    nodes: int = 12
    extensible: bool = False
    memory: int = 5
    relaxation: float = 1.0
    max_iterations: int = 100
    retries: tuple[int, ...] = (4, 16, 64)
    torque_tolerance: float = 1e-9
    tolerance: float = 1e-9

    def __post_init__(self) -> None:
        for name, least in (("nodes", 2), ("memory", 0), ("max_iterations", 1)):
            value = getattr(self, name)
            if isinstance(value, bool) or not isinstance(value, int) or value < least:
                raise ValueError(f"{name} must be a whole number of at least {least}, got {value!r}")
        object.__setattr__(self, "retries", tuple(self.retries))
        if not all(isinstance(k, int) and k > 1 for k in self.retries):
            raise ValueError(f"retries must be whole numbers above 1, got {self.retries}")
        if not 0 < self.relaxation <= 1:
            raise ValueError(f"relaxation must lie above 0 and at most at 1, got {self.relaxation}")
        for name in ("torque_tolerance", "tolerance"):
            if not getattr(self, name) > 0:
                raise ValueError(f"{name} must be positive, got {getattr(self, name)}")


@dataclass(frozen=True, eq=False)
class Pass:
    """One pass through steps 1–3; the points come first in each array.

    Parameters
    ----------
    poses : Poses
        Step 1.
    rotations : numpy.ndarray, shape (n_points, n_flexures)
        Θ, rad.
    forces : numpy.ndarray of complex, shape (n_points, n_flexures)
        Step 2: on the flexures' tips in global axes, N.
    torques : numpy.ndarray, shape (n_points, n_drivers)
        N m.
    local : numpy.ndarray of complex, shape (n_points, n_flexures)
        The same forces in the flexures' axes, N.
    deflection : Deflection
        Step 3.
    """

    poses: Poses
    rotations: np.ndarray
    forces: np.ndarray
    torques: np.ndarray
    local: np.ndarray
    deflection: Deflection


@dataclass(frozen=True, eq=False)
class Outcome:
    """The last pass of every point and how it ended, arrays of shape (n_points,).

    Parameters
    ----------
    last : Pass
    iterations : numpy.ndarray of int
    residual : numpy.ndarray
        Largest change of a tip over its flexure's length or of M L / E I in the last pass.
    torque_change : numpy.ndarray
        Of the last pass, N m.
    converged : numpy.ndarray of bool
    """

    last: Pass
    iterations: np.ndarray
    residual: np.ndarray
    torque_change: np.ndarray
    converged: np.ndarray


def one_pass(
    lay: Layout,
    tips: np.ndarray,
    moments: np.ndarray,
    angles: np.ndarray,
    loads: Sequence[Wrench],
    settings: Settings,
    before: Pass | None = None,
) -> Pass:
    """Steps 1–3 from the flexures' tips (u + i v, m) and tip moments (N m), (n_points, n_flexures) each."""
    poses = modular_kinematics(lay, tips, angles, before.poses if before else rest_poses(lay, len(tips)))
    rotations = flexure_rotations(lay, poses)
    forces, torques = modular_statics(lay, poses, moments, loads)
    local = forces * np.exp(-1j * poses.turn[:, lay.clamped]) / lay.direction
    axial = lay.axial if settings.extensible else np.inf
    start = before.deflection.angles if before else None
    deflection = deflect(rotations, local, lay.length, lay.bending, axial, nodes=settings.nodes, start=start)
    return Pass(poses, rotations, forces, torques, local, deflection)


def iterate(
    lay: Layout, angles: np.ndarray, loads: Sequence[Wrench], settings: Settings, start: Outcome | None = None
) -> Outcome:
    """Run Algorithm 1; `angles` are rotations from rest, shape (n_points, n_drivers). Starts from rest by itself."""
    n, f = len(angles), len(lay.length)
    now, outcome, rows = start.last if start else None, None, np.arange(n)
    x = _state(lay, now.deflection) if now else np.concatenate([np.ones((n, f)), np.zeros((n, 2 * f))], axis=1)
    torques, anderson = np.full((n, angles.shape[1]), np.inf), Anderson(settings.memory, settings.relaxation)
    for iteration in range(1, settings.max_iterations + 1):
        tips, moments = (x[:, :f] + 1j * x[:, f : 2 * f]) * lay.length, x[:, 2 * f :] * lay.bending / lay.length
        now = one_pass(lay, tips, moments, angles[rows], _rows_of(loads, rows), settings, now)
        step = _state(lay, now.deflection) - x
        residual, change = _largest(step), _largest(now.torques - torques)
        settled = (residual < settings.tolerance) & (change < settings.torque_tolerance)
        over = settled | ~np.isfinite(residual) | (iteration == settings.max_iterations)
        found = Outcome(now, np.full(len(rows), iteration), residual, change, settled & sound(lay, now))
        outcome = outcome or pick(found, np.arange(n))
        store(outcome, found, rows, over)
        left, rows = ~over, rows[~over]
        if not len(rows):
            break
        x, torques, now = anderson.next(x, step)[left], now.torques[left], pick(now, left)
        anderson.keep(left)
    assert outcome is not None  # there is at least one pass
    return outcome


def iterate_in_steps(
    lay: Layout, angles: np.ndarray, loads: Sequence[Wrench], settings: Settings, increments: int
) -> Outcome:
    """Raise angles and loads together in equal increments, each solved from the one before.

    A point that fails on the way has failed: what it found later could belong to another branch.
    """
    raised = [(link, force / increments, point, moment / increments) for link, force, point, moment in loads]
    outcome = iterate(lay, angles / increments, raised, settings)
    for count in range(2, increments + 1):
        rows, share = np.flatnonzero(outcome.converged), count / increments
        if not len(rows):
            break
        raised = [(link, share * force[rows], point, share * moment[rows]) for link, force, point, moment in loads]
        now = iterate(lay, share * angles[rows], raised, settings, pick(outcome, rows))
        now = replace(now, iterations=outcome.iterations[rows] + now.iterations)
        store(outcome, now, rows, np.ones(len(rows), bool))
    return outcome


def iterate_stubbornly(lay: Layout, angles: np.ndarray, loads: Sequence[Wrench], settings: Settings) -> Outcome:
    """In one go; points that fail again in the increments of ``settings.retries``, one count after the other."""
    outcome = iterate(lay, angles, loads, settings)
    for increments in settings.retries:
        rows = np.flatnonzero(~outcome.converged)
        if not len(rows):
            break
        again = iterate_in_steps(lay, angles[rows], _rows_of(loads, rows), settings, increments)
        again = replace(again, iterations=outcome.iterations[rows] + again.iterations)
        store(outcome, again, rows, again.converged | (increments == settings.retries[-1]))
        outcome.iterations[rows] = again.iterations
    return outcome


def _state(lay: Layout, deflection: Deflection) -> np.ndarray:
    """What is iterated on: u / L, v / L and M L / E I of each flexure, shape (n_points, 3 n_flexures)."""
    tip = deflection.tip / lay.length
    return np.concatenate([tip.real, tip.imag, deflection.moment * lay.length / lay.bending], axis=1)


def _largest(change: np.ndarray) -> np.ndarray:
    """Largest magnitude in each row; 0 where there are no columns."""
    return np.abs(change).max(axis=1, initial=0)


def sound(lay: Layout, now: Pass) -> np.ndarray:
    """Points whose modules close in their assembly modes and whose leaves are all solved and resolved."""
    closed = (now.poses.gap < CLOSED * lay.length.min()) & now.poses.kept
    found = now.deflection.solved & (now.deflection.tail < RESOLVED)
    return closed.all(axis=1) & found.all(axis=1)


def _rows_of(loads: Sequence[Wrench], rows: np.ndarray) -> list[Wrench]:
    return [(link, force[rows], point, moment[rows]) for link, force, point, moment in loads]

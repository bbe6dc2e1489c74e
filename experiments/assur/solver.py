"""Solve a mechanism at many points: the checks, the chunks, the words for what failed."""

from collections.abc import Sequence

import numpy as np

from .checks import check_angles, check_loads
from .elastica import moments_along
from .groups import Mechanism
from .iteration import CLOSED, RESOLVED, Outcome, Settings, iterate_stubbornly
from .layout import Layout, layout, wrenches
from .model import Load
from .results import Solution, joined

CHUNK = 1024  # points at a time; more only leave the processor's cache


def solve(
    mechanism: Mechanism, angles: object, loads: Sequence[Load] = (), settings: Settings | None = None
) -> Solution:
    """Equilibrium of a mechanism at prescribed angles of its driving links, by Algorithm 1.

    Parameters
    ----------
    mechanism : Mechanism
    angles : array_like, shape (n_points, n_drivers)
        Orientations q, rad; ``mechanism.rest`` holds them at rest.
    loads : sequence of Load
        The external loads P.
    settings : Settings, optional

    Returns
    -------
    Solution
        A point that does not converge has ``ok`` False, a reason and NaN. The reason is that of the last
        attempt, which may have ended on the way from rest.

    Raises
    ------
    ValueError
        If angles or loads do not fit the mechanism.

    Notes
    -----
    Whether the equilibrium is stable is not asked. Source: thesis, Algorithm 1.
    """
    settings = settings or Settings()
    angles = check_angles(angles, mechanism.drivers)
    check_loads(loads, mechanism.links, len(angles))
    lay, forces = layout(mechanism), wrenches(mechanism, loads, len(angles))
    turns, parts = angles - mechanism.rest, []
    for first in range(0, max(len(angles), 1), CHUNK):
        rows = slice(first, first + CHUNK)
        here = [(link, force[rows], point, moment[rows]) for link, force, point, moment in forces]
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):  # a lost point is told by its reason
            outcome = iterate_stubbornly(lay, turns[rows], here, settings)
        parts.append(_solution(mechanism, lay, angles[rows], outcome, settings))
    return joined(parts)


def _solution(mechanism: Mechanism, lay: Layout, angles, outcome: Outcome, settings: Settings) -> Solution:
    last, lost = outcome.last, ~outcome.converged
    axial = lay.axial if settings.extensible else np.inf
    moments = moments_along(last.deflection, last.local, lay.length, lay.bending, axial)
    thickness = np.array([f.leaf.thickness for f in mechanism.flexures])
    young = np.array([f.leaf.young for f in mechanism.flexures])
    values = {
        "torques": last.torques,
        "shifts": _pair(last.poses.shift),
        "rotations": last.poses.turn,
        "forces": _pair(last.forces),
        "moments": last.deflection.moment,
        "root_moments": last.deflection.root_moment,
        "tips": _pair(last.deflection.tip),
        "stress": np.abs(moments).max(axis=-1, initial=0) * young * thickness / (2 * lay.bending),
        "leaf_angles": last.deflection.angles,
    }
    blank = {name: np.where(lost.reshape(-1, *[1] * (v.ndim - 1)), np.nan, v) for name, v in values.items()}
    return Solution(
        mechanism=mechanism,
        angles=angles,
        ok=outcome.converged,
        reasons=_reasons(mechanism, lay, outcome),
        iterations=outcome.iterations,
        residual=outcome.residual,
        torque_change=outcome.torque_change,
        **blank,
    )


def _pair(z: np.ndarray) -> np.ndarray:
    """Complex numbers as two columns."""
    return np.stack([np.real(z), np.imag(z)], axis=-1)


def _reasons(mechanism: Mechanism, lay: Layout, outcome: Outcome) -> tuple[str, ...]:
    """A sentence for each point that failed, nothing for the others."""
    return tuple("" if ok else _reason(mechanism, lay, outcome, k) for k, ok in enumerate(outcome.converged))


def _reason(mechanism: Mechanism, lay: Layout, outcome: Outcome, k: int) -> str:
    poses, solved = outcome.last.poses, outcome.last.deflection.solved[k]
    for name, gap, kept in zip(lay.names, poses.gap[k], poses.kept[k], strict=True):
        if gap >= CLOSED * lay.length.min():
            return f"{name} cannot be assembled there: its joints stay {gap:.2g} m apart; turn the drivers less"
        if np.isfinite(gap) and not kept:
            return f"{name} leaves the assembly mode that it has at rest: turn the drivers less"
    if not np.isfinite(outcome.residual[k]):
        return "the iteration left the finite numbers: a group came to a dead point, or the loads are far too large"
    if not solved.all():
        flexure = mechanism.flexures[int(np.argmin(solved))].name
        return f"flexure {flexure!r} finds no deflected shape: its load is far beyond that of buckling"
    if outcome.last.deflection.tail[k].max() >= RESOLVED:
        flexure = mechanism.flexures[int(np.argmax(outcome.last.deflection.tail[k]))].name
        return f"flexure {flexure!r} bends too sharply for the Gauss nodes: raise nodes"
    return (
        f"not settled after {outcome.iterations[k]} passes: the last changed the flexures' tips or moments by "
        f"{outcome.residual[k]:.2g} and a torque by {outcome.torque_change[k]:.2g} N m; allow more iterations or relax"
    )

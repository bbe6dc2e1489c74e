"""Planar frames with limit points in OpenSeesPy, followed by control of a displacement that grows all along."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import openseespy.opensees as ops
from numpy.typing import NDArray

from .solving import Builder, divided, static_analysis

Vector = NDArray[np.float64]
Stage = tuple[int, float, int]
TRANSFORMATION, SECTION = 1, 1


@dataclass(frozen=True)
class FrameProblem:
    """A planar frame: a chain of nodes, its ends held, a dead load of reference size 1 on one node.

    Parameters
    ----------
    points : ndarray, shape (n_nodes, 2)
    axial, bending : float
        EA and EI.
    held : tuple of tuple of int
        1 where a freedom (x, y, rotation) is held, of the first and of the last node.
    loaded : int
        Index of the loaded node.
    load : tuple of float
        Fx, Fy, M for the load factor 1.
    """

    points: Vector
    axial: float
    bending: float
    held: tuple[tuple[int, int, int], tuple[int, int, int]]
    loaded: int
    load: tuple[float, float, float]


def lee(n: int) -> FrameProblem:
    """Lee's frame: two members of 120 cm, pinned, `n` elements per 24 cm, load on the beam 24 cm from the corner.

    Units N and cm: section 3 cm × 2 cm, E = 7.2e6 N/cm².
    """
    corner, elbow, pin = np.array([[0.0, 0.0], [0.0, 120.0], [120.0, 120.0]])
    points = np.vstack([corner, divided(corner, elbow, 5 * n), divided(elbow, pin, 5 * n)])
    pinned = (1, 1, 0)
    return FrameProblem(points, 7.2e6 * 6, 7.2e6 * 2, (pinned, pinned), 6 * n, (0.0, -1.0, 0.0))


def williams(n: int, half_span: float = 12.943, rise: float = 0.386) -> FrameProblem:
    """Williams's toggle, clamped, loaded at the apex, `n` elements a member; lb and in."""
    left, apex, right = np.array([[-half_span, 0.0], [0.0, rise], [half_span, 0.0]])
    points = np.vstack([left, divided(left, apex, n), divided(apex, right, n)])
    clamped = (1, 1, 1)
    return FrameProblem(points, 1.885e6, 9.27e3, (clamped, clamped), n, (0.0, -1.0, 0.0))


def deep_arch(n: int, axial: float = 1e8) -> FrameProblem:
    """The 215° circular arch of DaDeppo and Schmidt: R = 100, EI = 1e6, left end clamped, right end hinged.

    `n` elements on each half, apex load downwards.
    """
    angles = np.deg2rad(90 + 107.5 * np.linspace(1.0, -1.0, 2 * n + 1))
    points = 100.0 * np.column_stack([np.cos(angles), np.sin(angles)])
    return FrameProblem(points, axial, 1e6, ((1, 1, 1), (1, 1, 0)), n, (0.0, -1.0, 0.0))


def follow(problem: FrameProblem, stages: Sequence[Stage], tolerance: float = 1e-10) -> Vector:
    """Equilibrium path under displacement control of the loaded node.

    Parameters
    ----------
    problem : FrameProblem
    stages : sequence of (int, float, int)
        Freedom (1, 2, 3) of the loaded node, its increment and how many; one stage after the other.
    tolerance : float
        On the last correction of Newton's method, in the problem's units.

    Returns
    -------
    ndarray, shape (1 + all increments, 4)
        Load factor and the loaded node's displacements, from rest.

    Raises
    ------
    RuntimeError
        If a step does not converge.
    """
    builder = Builder(2, 3)
    ops.geomTransf("Corotational", TRANSFORMATION)
    ops.section("Elastic", SECTION, 1.0, problem.axial, problem.bending)
    first = builder.node(problem.points[0])
    last, _ = builder.chain(first, problem.points[1:], "elasticBeamColumn", SECTION, TRANSFORMATION)
    for node, held in zip((first, last), problem.held, strict=True):
        ops.fix(node, *held)
    ops.pattern("Plain", 1, 1)
    ops.load(first + problem.loaded, *problem.load)
    static_analysis(1, tolerance)
    path = [(0.0, 0.0, 0.0, 0.0)]
    for freedom, increment, n in stages:
        ops.integrator("DisplacementControl", first + problem.loaded, freedom, increment)
        for _ in range(n):
            if ops.analyze(1) != 0:
                raise RuntimeError(f"OpenSees: no convergence at point {len(path)}; {path[-1]}")
            path.append((ops.getTime(), *ops.nodeDisp(first + problem.loaded)))
    ops.wipe()
    return np.array(path)


def limit_points(path: Vector, width: int = 4) -> Vector:
    """Extrema of the load factor along a path, shape (n, 4), as `follow` returns them.

    A polynomial of degree 6 through the 2 `width` + 1 points around each extremum, in their number along the path.
    """
    load = path[:, 0]
    turning = 1 + np.flatnonzero(np.diff(np.sign(np.diff(load))))
    found = []
    for k in turning[(turning >= width) & (turning < len(path) - width)]:
        s = np.arange(-width, width + 1)
        fits = [np.polynomial.Polynomial.fit(s, column, 6) for column in path[k - width : k + width + 1].T]
        roots = fits[0].deriv().roots()
        root = roots[np.argmin(np.abs(roots))].real
        found.append([fit(root) for fit in fits])
    return np.array(found)

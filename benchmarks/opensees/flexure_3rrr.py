"""The planar 3-RRR flexure mechanism in OpenSeesPy: corotational beams, prescribed crank rotations, wrench.

Rigid links are stiff corotational beams: OpenSees's ``rigidLink`` and the joint offsets of its planar
``Corotational`` transformation are linearised in the rotation, so both lengthen a link that turns by t by t²/2.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import openseespy.opensees as ops
from numpy.typing import ArrayLike, NDArray

from .solving import Builder, advance, divided, static_analysis

Vector = NDArray[np.float64]
CENTRE = 1
BEAM = "elasticBeamColumn"
FLEXURE, RIGID, TRANSFORMATION = 1, 2, 1
TURNS = 2 * np.pi / 3 * np.array([0.0, 1.0, -1.0])


@dataclass(frozen=True)
class Flexure3RRR:
    """Dimensions in SI units, angles in rad; the defaults are those of the case study.

    `rigidity` is the bending stiffness of a rigid link over that of a flexure, `axial_rigidity` the same for
    stretching.
    """

    flexure: float = 0.010
    crank: float = 0.020
    coupler: float = 0.030
    platform_side: float = 0.040
    base_side: float = 0.100
    width: float = 0.005
    thickness: float = 0.0001
    young: float = 70e9
    crank_angle: float = -0.599365
    rigidity: float = 1e8
    axial_rigidity: float = 1e5

    @property
    def area(self) -> float:
        """m²."""
        return self.width * self.thickness

    @property
    def second_moment(self) -> float:
        """m⁴."""
        return self.width * self.thickness**3 / 12

    def leg(self, turn: float) -> Vector:
        """Ends of the five links of a leg from ground to platform, m, shape (6, 2)."""
        radii = np.array([self.base_side, self.platform_side]) / np.sqrt(3)
        ground, corner = np.outer(radii, _direction(np.deg2rad(-150)))
        crank = _direction(self.crank_angle)
        elbow = ground + (2 * self.flexure + self.crank) * crank
        coupler = (corner - elbow) / np.linalg.norm(corner - elbow)
        along = np.array([0.0, self.flexure, self.flexure + self.crank])
        points = [*(ground + np.outer(along, crank)), elbow, elbow + self.coupler * coupler, corner]
        c, s = np.cos(turn), np.sin(turn)
        return np.array(points) @ np.array([[c, s], [-s, c]])


@dataclass(frozen=True)
class Solution:
    """Poses (x [m], y [m], psi [rad]), crank torques [N m], both (n, 3), and largest bending stress [Pa], (n,)."""

    poses: Vector
    torques: Vector
    stresses: Vector


def solve(
    points: ArrayLike,
    force_point: ArrayLike = (0.0, 0.0),
    n_elements: int = 10,
    n_steps: int = 5,
    mechanism: Flexure3RRR | None = None,
    rebuild: bool = False,
) -> Solution:
    """Equilibria of the mechanism.

    Parameters
    ----------
    points : array_like, shape (n, 6)
        Crank rotations from rest (rad) and platform wrench Fx, Fy (N), Mz (N m); the force keeps its direction.
    force_point : array_like, shape (2,)
        Where the force acts, m from the platform's centre at rest; it moves with the platform.
    n_elements : int
        Elements per flexure.
    n_steps : int
        Equal steps of rotations and wrench together, from rest.
    mechanism : Flexure3RRR, optional
    rebuild : bool
        Build the model anew for every point instead of resetting it.

    Returns
    -------
    Solution
    """
    points = np.atleast_2d(np.asarray(points, dtype=np.float64))
    mechanism = mechanism or Flexure3RRR()
    poses, torques, stresses = np.empty((len(points), 3)), np.empty((len(points), 3)), np.empty(len(points))
    model = None
    for i, point in enumerate(points):
        if model is None or rebuild:
            model = _build(mechanism, np.asarray(force_point, dtype=np.float64), n_elements)
        else:
            ops.reset()
            ops.remove("loadPattern", 1)
        cranks, loaded, flexures = model
        ops.pattern("Plain", 1, 1)
        for crank, rotation in zip(cranks, point[:3].tolist(), strict=True):
            ops.sp(crank, 3, rotation)
        ops.load(loaded, *point[3:5].tolist(), 0.0)
        ops.load(CENTRE, 0.0, 0.0, float(point[5]))
        static_analysis(n_steps)
        advance(n_steps)
        ops.reactions()
        poses[i] = ops.nodeDisp(CENTRE)
        torques[i] = [ops.nodeReaction(crank, 3) for crank in cranks]
        moments = [ops.basicForce(tag)[1:] for tag in flexures]
        stresses[i] = np.abs(moments).max() * mechanism.thickness / 2 / mechanism.second_moment
    ops.wipe()
    return Solution(poses, torques, stresses)


def _direction(angle: float) -> Vector:
    return np.array([np.cos(angle), np.sin(angle)])


def _build(m: Flexure3RRR, force_point: Vector, n_elements: int) -> tuple[list[int], int, list[int]]:
    """The model at rest; returns the crank nodes, the loaded node and the elements of the flexures."""
    builder = Builder(2, 3)
    ops.geomTransf("Corotational", TRANSFORMATION)
    ops.section("Elastic", FLEXURE, m.young, m.area, m.second_moment)
    ops.section("Elastic", RIGID, m.young, m.area * m.axial_rigidity, m.second_moment * m.rigidity)
    centre = builder.node((0.0, 0.0))
    cranks, flexures = [], []
    for turn in TURNS:
        points = m.leg(turn)
        node = builder.node(points[0])
        ops.fix(node, 1, 1, 1)
        for k, (start, end) in enumerate(pairwise(points)):
            n, section = (n_elements, FLEXURE) if k % 2 == 0 else (1, RIGID)
            node, elements = builder.chain(node, divided(start, end, n), BEAM, section, TRANSFORMATION)
            flexures += elements if section == FLEXURE else []
            cranks += [node] if k == 0 else []
        builder.element(BEAM, centre, node, RIGID, TRANSFORMATION)
    if not np.any(force_point):
        return cranks, centre, flexures
    loaded, _ = builder.chain(centre, force_point[None], BEAM, RIGID, TRANSFORMATION)
    return cranks, loaded, flexures

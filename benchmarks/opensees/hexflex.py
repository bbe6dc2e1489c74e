"""The HexFlex in OpenSeesPy: corotational beams under dead loads, or linear beams.

OpenSees's ``elasticBeamColumn`` has no shear flexibility, and its ``ElasticTimoshenkoBeam`` under a
``Corotational`` transformation falls back to P-Delta with a warning. Shear-flexible corotational beams are had from
``elasticForceBeamColumn`` with an ``Elastic`` section that has shear areas, exact in two Gauss points. The
spatial ``Corotational`` transformation has no joint offsets: the platform is a star of stiff corotational beams.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
import openseespy.opensees as ops
from numpy.typing import ArrayLike, NDArray

from .sections import Rectangle
from .solving import Builder, advance, divided, static_analysis

Vector = NDArray[np.float64]
TURNS = np.deg2rad([0.0, -120.0, 120.0])
IN_PLANE = np.deg2rad([0.0, 60.0, 120.0])
TRANSFORMATION, SECTION, INTEGRATION = 1, 1, 1
RIGIDITY = 1e8
"""Stiffness of the platform's beams over that of the limbs."""


@dataclass(frozen=True)
class HexFlex:
    """Dimensions in SI units, angles in rad; the defaults are those identified from the thesis's Eq. 2.6.

    `shear` takes Timoshenko's beams, else Euler-Bernoulli's.
    """

    length_1: float = 0.0194289
    length_2: float = 0.0133253
    section: Rectangle = field(default_factory=lambda: Rectangle(0.000761, 0.0005753))
    bend_angle: float = float(np.deg2rad(-120))
    root_offset: float = 0.004
    root_radius: float = 0.025
    load_radius: float = 0.060
    young: float = 71.7e9
    poisson: float = 0.33
    shear: bool = True

    @property
    def shear_modulus(self) -> float:
        """Pa."""
        return self.young / (2 * (1 + self.poisson))

    def limb(self, mirror: float, turn: float) -> Vector:
        """Root, bend and clamp of a limb, m, shape (3, 3)."""
        root = np.array([self.root_offset, self.root_radius])
        bend = root + np.array([self.length_1, 0.0])
        clamp = bend + self.length_2 * np.array([np.cos(self.bend_angle), np.sin(self.bend_angle)])
        return turned(np.array([root, bend, clamp]) * [mirror, 1.0], turn)


@dataclass(frozen=True)
class Model:
    """Tags of the platform's centre and tabs; `tabs_at_rest` are the tabs' positions, m, shape (3, 3)."""

    centre: int
    tabs: Sequence[int]
    tabs_at_rest: Vector


def solve(
    forces: ArrayLike,
    n_elements: int = 8,
    n_steps: int = 1,
    mechanism: HexFlex | None = None,
    rigidity: float = RIGIDITY,
    rebuild: bool = False,
    tolerance: float = 1e-9,
) -> Vector:
    """Pose of the platform's centroid under dead loads at the tabs.

    Parameters
    ----------
    forces : array_like, shape (n, 6)
        T1D1, T1D2, T2D1, T2D2, T3D1, T3D2, N.
    n_elements : int
        Elements per leg of a limb.
    n_steps : int
        Equal load steps.
    mechanism : HexFlex, optional
    rigidity : float
        Stiffness of the platform's beams over that of the limbs.
    rebuild : bool
        Build the model anew for every point instead of resetting it.
    tolerance : float
        On Newton's last correction, m and rad mixed; the error left is a few times that.

    Returns
    -------
    ndarray, shape (n, 6)
        x, y, z (m) and intrinsic XYZ Euler angles (rad).
    """
    forces = np.atleast_2d(np.asarray(forces, dtype=np.float64))
    mechanism = mechanism or HexFlex()
    poses, model = np.empty((len(forces), 6)), None
    for i, point in enumerate(forces):
        if model is None or rebuild:
            model = build(mechanism, n_elements, "Corotational", rigidity)
        else:
            ops.reset()
            ops.remove("loadPattern", 1)
        load(model, point)
        static_analysis(n_steps, tolerance)
        advance(n_steps)
        poses[i] = _pose(model)
    ops.wipe()
    return poses


def build(m: HexFlex, n_elements: int, transformation: str, rigidity: float = RIGIDITY) -> Model:
    """The model at rest."""
    builder, s, shear = Builder(3, 6), m.section, m.shear_modulus
    ops.geomTransf(transformation, TRANSFORMATION, 0.0, 0.0, 1.0)
    elastic = (m.young, s.area, s.second_moment_z, s.second_moment_y, shear, s.torsion_constant)
    ops.section("Elastic", SECTION, *elastic, *([s.shear_coefficient] * 2 if m.shear else []))
    ops.beamIntegration("Legendre", INTEGRATION, SECTION, 2)
    prismatic = (s.area, m.young, shear, s.torsion_constant, s.second_moment_y, s.second_moment_z)
    limb = ("elasticForceBeamColumn", TRANSFORMATION, INTEGRATION)
    if not m.shear:
        limb = ("elasticBeamColumn", *prismatic, TRANSFORMATION)
    rigid = ("elasticBeamColumn", s.area, *(rigidity * x for x in prismatic[1:3]), *prismatic[3:], TRANSFORMATION)
    centre = builder.node((0.0, 0.0, 0.0))
    tabs_at_rest = np.array([turned(np.array([0.0, m.load_radius]), turn) for turn in TURNS])
    tabs = [builder.chain(centre, point[None], *rigid)[0] for point in tabs_at_rest]
    for turn in TURNS:
        for mirror in (1.0, -1.0):
            points = m.limb(mirror, turn)
            node, _ = builder.chain(centre, points[:1], *rigid)
            for start, end in pairwise(points):
                node, _ = builder.chain(node, divided(start, end, n_elements), *limb)
            ops.fix(node, 1, 1, 1, 1, 1, 1)
    return Model(centre, tabs, tabs_at_rest)


def load(model: Model, forces: Vector, pattern: int = 1, series: int = 1) -> None:
    """Apply the six dead loads, N, as a load pattern."""
    ops.pattern("Plain", pattern, series)
    for tab, angle, (d1, d2) in zip(model.tabs, IN_PLANE, forces.reshape(3, 2), strict=True):
        ops.load(tab, float(d1 * np.cos(angle)), float(d1 * np.sin(angle)), float(d2), 0.0, 0.0, 0.0)


def turned(points: Vector, angle: float) -> Vector:
    """Planar points turned about z by `angle` (rad), with z = 0 appended."""
    c, s = np.cos(angle), np.sin(angle)
    flat = points @ np.array([[c, s], [-s, c]])
    return np.concatenate([flat, np.zeros((*flat.shape[:-1], 1))], axis=-1)


def _pose(model: Model) -> Vector:
    """Displacement and Euler angles; the rotation from where the tabs are, not from the summed rotation freedoms."""
    shift = np.array(ops.nodeDisp(model.centre)[:3])
    rest, moves = model.tabs_at_rest, np.array([ops.nodeDisp(tab)[:3] for tab in model.tabs])
    r = _triad(rest + moves - shift) @ _triad(rest).T
    angles = np.arctan2(-r[1, 2], r[2, 2]), np.arcsin(r[0, 2]), np.arctan2(-r[0, 1], r[0, 0])
    return np.array([*shift, *angles])


def _triad(points: Vector) -> Vector:
    """Orthonormal columns from two of three points seen from the centre, shape (3, 3)."""
    e1 = points[0] / np.linalg.norm(points[0])
    across = points[2] - points[1]
    e3 = np.cross(e1, across)
    e3 /= np.linalg.norm(e3)
    return np.column_stack([e1, np.cross(e3, e1), e3])

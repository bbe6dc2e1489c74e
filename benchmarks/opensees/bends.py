"""Spatial cantilevers in OpenSeesPy: the 45° bend of Bathe and Bolourchi, and two members at a right angle."""

from dataclasses import dataclass

import numpy as np
import openseespy.opensees as ops
from numpy.typing import ArrayLike, NDArray

from .sections import Rectangle
from .solving import Builder, advance, divided, static_analysis

Vector = NDArray[np.float64]
TRANSFORMATION, SECTION, INTEGRATION = 1, 1, 1


@dataclass(frozen=True)
class Stiffness:
    """Of a section: EA, GA times the shear coefficient, EI about local y and z, GJ; N and N m² (or any system).

    `shear` None is Euler-Bernoulli's beam.
    """

    axial: float
    shear: float | None
    bending_y: float
    bending_z: float
    torsion: float


BEND = Stiffness(1e7, 1e7 / 2 * 5 / 6, 1e7 / 12, 1e7 / 12, 5e6 / 6)
"""Unit square section, E = 1e7, Poisson's ratio 0, torsion constant = polar second moment."""

_WIDTH, _THICKNESS, _YOUNG = 0.004, 0.002, 70e9
_SHEAR_MODULUS = _YOUNG / 2.6
RIGHT_ANGLE = Stiffness(
    _YOUNG * _WIDTH * _THICKNESS,
    _SHEAR_MODULUS * 5 / 6 * _WIDTH * _THICKNESS,
    _YOUNG * _WIDTH * _THICKNESS**3 / 12,
    _YOUNG * _THICKNESS * _WIDTH**3 / 12,
    _SHEAR_MODULUS * Rectangle(_WIDTH, _THICKNESS).torsion_constant,
)
"""4 mm in the plane of the members by 2 mm, E = 70 GPa, Poisson's ratio 0.3."""


def bend_points(n_elements: int, radius: float = 100.0, angle: float = np.pi / 4) -> Vector:
    """Nodes of the arc that starts at the origin along y and curves towards x, shape (n_elements + 1, 3)."""
    a = angle * np.arange(n_elements + 1) / n_elements
    return np.column_stack([radius * (1 - np.cos(a)), radius * np.sin(a), np.zeros_like(a)])


def right_angle_points(n_elements: int, length_1: float = 0.2, length_2: float = 0.15) -> Vector:
    """Nodes along x, then along y, m, shape (2 n_elements + 1, 3)."""
    start, corner, tip = np.array([[0, 0, 0], [length_1, 0, 0], [length_1, length_2, 0]], dtype=np.float64)
    return np.vstack([start, divided(start, corner, n_elements), divided(corner, tip, n_elements)])


def tip_displacements(points: Vector, stiffness: Stiffness, loads: ArrayLike, n_steps: int = 10) -> Vector:
    """Displacements of the tip under dead tip forces.

    Parameters
    ----------
    points : ndarray, shape (n_nodes, 3)
        The cantilever's nodes from its clamp; local z is global z.
    stiffness : Stiffness
    loads : array_like, shape (n, 3)
    n_steps : int
        Equal load steps.

    Returns
    -------
    ndarray, shape (n, 3)
    """
    answers = []
    for force in np.asarray(loads, dtype=np.float64).tolist():
        builder = Builder(3, 6)
        ops.geomTransf("Corotational", TRANSFORMATION, 0.0, 0.0, 1.0)
        tip, _ = builder.chain(_clamped(builder, points[0]), points[1:], *_element(stiffness))
        ops.pattern("Plain", 1, 1)
        ops.load(tip, *force, 0.0, 0.0, 0.0)
        static_analysis(n_steps, 1e-9 * np.ptp(points), 200, algorithm="NewtonLineSearch")
        advance(n_steps)
        answers.append(ops.nodeDisp(tip)[:3])
    ops.wipe()
    return np.array(answers)


def _clamped(builder: Builder, point: Vector) -> int:
    node = builder.node(point)
    ops.fix(node, 1, 1, 1, 1, 1, 1)
    return node


def _element(s: Stiffness) -> tuple:
    """Type and arguments of the elements; E = G = 1, so that the section's numbers are its stiffnesses."""
    if s.shear is None:
        prismatic = (s.axial, 1.0, 1.0, s.torsion, s.bending_y, s.bending_z)
        return ("elasticBeamColumn", *prismatic, TRANSFORMATION)
    coefficient = s.shear / s.axial
    elastic = (1.0, s.axial, s.bending_z, s.bending_y, 1.0, s.torsion, coefficient, coefficient)
    ops.section("Elastic", SECTION, *elastic)
    ops.beamIntegration("Legendre", INTEGRATION, SECTION, 2)
    return ("elasticForceBeamColumn", TRANSFORMATION, INTEGRATION)

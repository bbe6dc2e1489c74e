"""Linear HexFlexes of differing dimensions in OpenSeesPy: a model per mechanism, one element per leg.

One element is exact in linear statics. The platform is one rigid body by ``rigidLink``, exact for small rotations.
"""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
import openseespy.opensees as ops
from numpy.typing import NDArray

from .hexflex import TURNS, HexFlex, Model, load, turned
from .solving import Builder

Vector = NDArray[np.float64]
TRANSFORMATION = 1


def solve_linear(mechanisms: Sequence[HexFlex], loads: Vector) -> Vector:
    """Poses of the platforms' centroids.

    Parameters
    ----------
    mechanisms : sequence of HexFlex
    loads : ndarray, shape (len(mechanisms), n_cases, 6)
        Load cases of each mechanism, N.

    Returns
    -------
    ndarray, shape (len(mechanisms), n_cases, 6)
        m and rad.
    """
    poses = np.empty(loads.shape)
    for mechanism, cases, pose in zip(mechanisms, loads, poses, strict=True):
        model = _build(mechanism)
        for k, case in enumerate(cases, start=1):
            pulse = np.zeros(len(cases) + 2)
            pulse[k] = 1.0
            ops.timeSeries("Path", k + 1, "-dt", 1.0, "-values", *pulse.tolist())
            load(model, case, pattern=k, series=k + 1)
        _factorise_once()
        for k in range(len(cases)):
            if ops.analyze(1) != 0:
                raise RuntimeError("OpenSees: the linear analysis failed")
            pose[k] = ops.nodeDisp(model.centre)
    ops.wipe()
    return poses


def random_mechanisms(n: int, seed: int = 0, spread: float = 0.2) -> list[HexFlex]:
    """`n` mechanisms whose legs, width and thickness vary by up to ± `spread` of the defaults."""
    base = HexFlex()
    section = type(base.section)
    factors = 1 + np.random.default_rng(seed).uniform(-spread, spread, (n, 4))
    sizes = factors * [base.length_1, base.length_2, base.section.width, base.section.thickness]
    return [HexFlex(l1, l2, section(width, thickness)) for l1, l2, width, thickness in sizes.tolist()]


def _build(m: HexFlex) -> Model:
    builder, s, shear = Builder(3, 6), m.section, m.shear_modulus
    ops.geomTransf("Linear", TRANSFORMATION, 0.0, 0.0, 1.0)
    second = (s.second_moment_y, s.second_moment_z)
    areas = [s.shear_coefficient * s.area] * 2
    beam = ("ElasticTimoshenkoBeam", m.young, shear, s.area, s.torsion_constant, *second, *areas, TRANSFORMATION)
    if not m.shear:
        beam = ("elasticBeamColumn", s.area, m.young, shear, s.torsion_constant, *second, TRANSFORMATION)
    centre = builder.node((0.0, 0.0, 0.0))
    tabs_at_rest = np.array([turned(np.array([0.0, m.load_radius]), turn) for turn in TURNS])
    tabs = [builder.node(point) for point in tabs_at_rest]
    roots = []
    for turn in TURNS:
        for mirror in (1.0, -1.0):
            nodes = [builder.node(point) for point in m.limb(mirror, turn)]
            for start, end in pairwise(nodes):
                builder.element(beam[0], start, end, *beam[1:])
            ops.fix(nodes[-1], 1, 1, 1, 1, 1, 1)
            roots.append(nodes[0])
    for node in (*tabs, *roots):
        ops.rigidLink("beam", centre, node)
    return Model(centre, tabs, tabs_at_rest)


def _factorise_once() -> None:
    ops.constraints("Transformation")
    ops.numberer("RCM")
    ops.system("BandSPD")
    ops.algorithm("Linear", False, False, True)
    ops.integrator("LoadControl", 1.0)
    ops.analysis("Static", "-noWarnings")

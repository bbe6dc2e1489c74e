"""Mechanisms to begin with: the thesis's 3-RRR and a four-bar."""

import cmath
import math
from itertools import pairwise

from .checks import finite_point
from .groups import GROUND, DrivingLink, Dyad, Mechanism, Triad
from .model import Flexure, Leaf, Point

ALUMINIUM = 70e9  # Pa, the thesis's value for 7075


def flexure_3rrr(
    *,
    flexure: float = 0.010,
    crank: float = 0.020,
    coupler: float = 0.030,
    platform: float = 0.040,
    base: float = 0.100,
    width: float = 0.005,
    thickness: float = 0.0001,
    young: float = ALUMINIUM,
) -> Mechanism:
    """The 3-RRR of the thesis: a triangular platform on three cranks.

    Each leg is ground – flexure – crank – flexure – coupler – flexure – platform corner; legs 2 and 3 are the
    first turned by 120° and 240° about the common centre of both triangles, the origin.

    Parameters
    ----------
    flexure, crank, coupler : float
        Lengths l, L1, L2, m.
    platform, base : float
        Sides L3, L4 of the triangles, m.
    width, thickness : float
        Of all flexures, m.
    young : float
        Pa.

    Returns
    -------
    Mechanism
        Links crank1–3, platform, coupler1–3; flexures E, F, G at the base, H, I, J between crank and coupler,
        K, L, M at the platform. Crank angles are absolute; ``mechanism.rest`` has them at rest.

    Raises
    ------
    ValueError
        If a length is not positive or a leg cannot span from base to platform.

    Notes
    -----
    Source: thesis, Table 1.1 and 1.1.5.2; how the lengths add up was recovered from the printed joints.
    """
    lengths = {"flexure": flexure, "crank": crank, "coupler": coupler, "platform": platform, "base": base}
    for name, value in lengths.items():
        if not (math.isfinite(value) and value > 0):
            raise ValueError(f"{name} must be a positive length in m, got {value}")
    leaf = Leaf(width, thickness, young)
    corner, top = (side / math.sqrt(3) * cmath.exp(-5j * math.pi / 6) for side in (base, platform))
    near, far, span = 2 * flexure + crank, flexure + coupler, abs(top - corner)
    if not abs(near - far) < span < near + far:
        raise ValueError(f"legs of {near} m and {far} m cannot span {span} m from base to platform: change a length")
    opening = math.acos((near**2 + span**2 - far**2) / (2 * near * span))
    along = cmath.rect(1, cmath.phase(top - corner) - opening)
    knee = corner + near * along
    toward = (top - knee) / far
    flexures, rest = [], cmath.phase(along)
    for k, names in enumerate(("EHK", "FIL", "GJM")):
        links = (GROUND, f"crank{k + 1}", f"coupler{k + 1}", "platform")
        ends = (
            (corner, flexure * along),
            (knee - flexure * along, flexure * along),
            (top - flexure * toward, flexure * toward),
        )
        turn = cmath.rect(1, 2 * math.pi * k / 3)
        for name, first, second, (start, leap) in zip(names, links, links[1:], ends, strict=False):
            flexures.append(Flexure(name, first, second, _point(start * turn), _point((start + leap) * turn), leaf))
    angles = [math.remainder(rest + 2 * math.pi * k / 3, 2 * math.pi) for k in range(3)]
    drivers = [DrivingLink(f"crank{k + 1}", angle) for k, angle in enumerate(angles)]
    return Mechanism(tuple(flexures), (*drivers, Triad("platform", ("coupler1", "coupler2", "coupler3"))))


def flexure_four_bar(
    crank_base: Point, crank_tip: Point, rocker_tip: Point, rocker_base: Point, leaf: Leaf, length: float
) -> Mechanism:
    """A four-bar: a crank on the ground and a dyad of coupler and rocker.

    Parameters
    ----------
    crank_base, crank_tip, rocker_tip, rocker_base : tuple of 2 float
        Middles of the four flexures at rest, m.
    leaf : Leaf
    length : float
        Of each flexure, m. The outer two lie along crank and rocker, the inner two along the coupler.

    Returns
    -------
    Mechanism
        Links crank, coupler, rocker; flexures A, B, C, D from crank base to rocker base.

    Raises
    ------
    ValueError
        If two middles coincide, or the coupler is in line with the rocker.
    """
    named = {"crank_base": crank_base, "crank_tip": crank_tip, "rocker_tip": rocker_tip, "rocker_base": rocker_base}
    points = [complex(*finite_point(name, value)) for name, value in named.items()]
    spans = [b - a for a, b in pairwise(points)]
    if not all(abs(span) > length for span in spans):
        raise ValueError(f"neighbouring middles must be further apart than the flexure length {length} m")
    links = (GROUND, "crank", "coupler", "rocker", GROUND)
    flexures = []
    for k, (name, point, span) in enumerate(zip("ABCD", points, (spans[0], spans[1], spans[1], spans[2]), strict=True)):
        half = span / abs(span) * length / 2
        flexures.append(Flexure(name, links[k], links[k + 1], _point(point - half), _point(point + half), leaf))
    return Mechanism(tuple(flexures), (DrivingLink("crank"), Dyad("coupler", "rocker")))


def _point(place: complex) -> Point:
    return place.real, place.imag

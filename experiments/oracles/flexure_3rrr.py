"""The planar 3-RRR flexure mechanism of Durango et al.: crank angles and a wrench in, pose, torques and stress out."""

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, ClassVar

import jax.numpy as jnp
import numpy as np
from numpy.typing import ArrayLike, NDArray

from .. import assur
from ..factors import Factor, FactorSpace
from ..fea import Frame, Material, Member, RigidBody, Support, condense, rectangle
from ..fea.sensitivity import Answer
from ..fea.stress import bending_stress, fibres
from ..runs import Response, Status
from ..settings import parameter
from .base import Answers, Arrow, Line, Oracle, Shape
from .equilibrium import BATCH, EquilibriumMap, check_limit

LEGS = (1, 2, 3)
METHODS = ("beams", "assur")
CENTRE = "centre"


@dataclass(frozen=True)
class Flexure3RRR(Oracle):
    """A triangular platform on three legs; each is ground – flexure – crank – flexure – coupler – flexure – platform.

    The cranks are turned and may translate; a force and a moment act on the platform's centre. Leg 2 is
    leg 1 turned by 120°, leg 3 by 240°. All fields are parameters in SI units.

    Raises
    ------
    ValueError
        If a dimension or the stress limit is not positive, a leg does not span from base to platform, or
        the method is unknown.

    Notes
    -----
    Durango et al., section 1.1 of Durango's thesis, Table 1.1; how the lengths add up was recovered from
    its printed joints.
    """

    name: ClassVar[str] = "flexure_3rrr"
    summary: ClassVar[str] = "planar 3-RRR flexure mechanism, 3 crank angles and a wrench to pose, torques and stress"
    source: ClassVar[str] = "Durango et al., thesis section 1.1; geometry recovered from its printed joints"
    # What the nonlinear solver leaves undone is below 1e-11 of the answers; two digits are kept in hand.
    resolution: ClassVar[float] = 1e-9
    batch: ClassVar[int] = BATCH

    flexure: float = parameter(0.010, "m", "length of the flexures")
    crank: float = parameter(0.020, "m", "length of the rigid cranks")
    coupler: float = parameter(0.030, "m", "length of the rigid couplers")
    platform: float = parameter(0.040, "m", "side of the platform, an equilateral triangle")
    base: float = parameter(0.100, "m", "side of the base, an equilateral triangle")
    width: float = parameter(0.005, "m", "out-of-plane width of the flexures")
    thickness: float = parameter(0.0001, "m", "thickness of the flexures")
    young: float = parameter(70e9, "Pa", "Young's modulus, aluminium 7075")
    poisson: float = parameter(0.33, "1", "Poisson's ratio; it acts on shear only")
    shear: bool = parameter(False, "", "whether the flexures shear; the thesis's elastica does not")
    method: str = parameter("beams", "", "beams (geometrically exact) or assur (the thesis's Assur-group method)")
    n_steps: int = parameter(6, "1", "integration steps along each flexure, even; for beams")
    stress_limit: float | None = parameter(None, "Pa", "reject points with a larger bending stress")

    def __post_init__(self) -> None:
        for name in ("flexure", "crank", "coupler", "platform", "base", "width", "thickness", "young"):
            if not getattr(self, name) > 0.0:
                raise ValueError(f"oracle 'flexure_3rrr': {name} must be positive, got {getattr(self, name)}")
        if self.method not in METHODS:
            raise ValueError(f"oracle 'flexure_3rrr': method must be one of {', '.join(METHODS)}, got {self.method!r}")
        if abs(self._elbow) >= 1.0:
            raise ValueError("oracle 'flexure_3rrr': a leg cannot span from base to platform; change its lengths")
        check_limit(self.name, self.stress_limit)

    @property
    def limits(self) -> str:
        """What this model leaves out."""
        return (
            "Links are rigid and flexures are leaves without notches. The largest stress is that of bending, and is "
            "not smooth where its place jumps from one flexure to another"
        )

    @property
    def factors(self) -> FactorSpace:
        """Rotations of the cranks from rest, and a wrench on the centre of the platform."""
        turns = "Durango et al. 1.1.5.4: a range of 0.44 rad, placed so that the stress stays below 250 MPa"
        small = "ours: a fourth of the force of the published case, and a moment of like effect"
        return FactorSpace(
            (
                *(Factor(f"crank_{leg}", "rad", -0.195, 0.245, turns) for leg in LEGS),
                *(Factor(f"force_{axis}", "N", -0.1, 0.1, small) for axis in "xy"),
                Factor("moment", "N.m", -0.001, 0.001, small),
            )
        )

    @property
    def responses(self) -> tuple[Response, ...]:
        """Pose of the platform against rest, torques that hold the cranks, and the largest bending stress."""
        return (
            Response("x", "m", "mm", 1e3),
            Response("y", "m", "mm", 1e3),
            Response("psi", "rad", "mrad", 1e3, "ψ"),
            *(Response(f"torque_{leg}", "N.m", "N·mm", 1e3, f"τ{leg}") for leg in LEGS),
            Response("stress", "Pa", "MPa", 1e-6, "σ"),
        )

    @property
    def rest_angles(self) -> NDArray[np.float64]:
        """Absolute angles of the cranks at rest, shape (3,), rad."""
        reach = np.subtract(self._corner(self.platform), self._corner(self.base))
        return np.arctan2(reach[1], reach[0]) - np.arccos(self._elbow) + np.deg2rad([0.0, 120.0, 240.0])

    @cached_property
    def frame(self) -> Frame:
        """The mechanism as a planar frame, dimensions in m."""
        section, material = rectangle(self.thickness, self.width), Material(self.young, self.poisson)
        if not self.shear:
            section = replace(section, shear_area_y=math.inf, shear_area_z=math.inf)
        nodes: dict[str, tuple[float, float, float]] = {CENTRE: (0.0, 0.0, 0.0)}
        members, bodies, clamps, supports = [], [], [], []
        for leg, places in zip(LEGS, self._legs(), strict=True):
            names = [
                f"{part}{leg}" for part in ("base", "crank in", "crank out", "coupler in", "coupler out", "corner")
            ]
            nodes.update({name: (x, y, 0.0) for name, (x, y) in zip(names, places.tolist(), strict=True)})
            for letter, start, end in zip(("EFG", "HIJ", "KLM"), names[::2], names[1::2], strict=True):
                members.append(Member(f"flexure {letter[leg - 1]}", start, end, section, material))
            bodies.append(RigidBody(f"crank {leg}", names[1], (names[2],)))
            bodies.append(RigidBody(f"coupler {leg}", names[3], (names[4],)))
            clamps.append(names[0])
            supports.append(Support(names[1], ("rz",)))
        bodies.append(RigidBody("platform", CENTRE, tuple(f"corner{leg}" for leg in LEGS)))
        return Frame(nodes, tuple(members), tuple(bodies), tuple(clamps), tuple(supports))

    def prepare(self) -> None:
        """Condense the frame, or lay out the Assur groups."""
        _ = self._mechanism if self.method == "assur" else self._map

    def evaluate(self, points: NDArray[np.float64]) -> Answers:
        """Equilibria at points, shape (n, 6)."""
        return self._by_groups(points) if self.method == "assur" else self._map.evaluate(points)

    def jacobian(self, points: ArrayLike) -> NDArray[np.float64]:
        """d response / d factor at `points` (n, 6), shape (n, 7, 6), SI; by the beams, whatever the method."""
        return self._map.jacobian(points)

    def shape(self, point: ArrayLike) -> Shape:
        """Flexures, rigid links and the drives at `point`, shape (6,)."""
        found = self._map.equilibria(np.asarray(point, dtype=np.float64)[None])

        def moved(*names: str) -> Line:
            rest = np.array([self.frame.nodes[n] for n in names])
            return Line("link", rest, np.array([found.at(n)[0, :3] for n in names]), rigid=True)

        links = [moved(*body.all_nodes) for body in self.frame.bodies[:-1]]
        corners = [f"corner{leg}" for leg in (*LEGS, 1)]
        lines = [Line(c.member, c.points, c.displacement) for c in found.centrelines()]
        anchors = np.array([self.frame.nodes[name] for name in self.frame.clamps])
        return Shape((*lines, *links, moved(*corners)), self._arrows(found, point), anchors)

    def _arrows(self, found: Any, point: ArrayLike) -> tuple[Arrow, ...]:
        forces = {"force_x": np.array([1.0, 0.0, 0.0]), "force_y": np.array([0.0, 1.0, 0.0])}
        values = dict(zip(self.factors.names, np.asarray(point, dtype=np.float64), strict=True))
        moved = found.at(CENTRE)[0, :3]
        return tuple(
            Arrow(name, np.zeros(3), moved, np.sign(values[name]) * axis)
            for name, axis in forces.items()
            if values[name]
        )

    @property
    def _elbow(self) -> float:
        """Cosine of the angle at the base between a crank and the line to the platform's corner."""
        reach = float(np.hypot(*np.subtract(self._corner(self.platform), self._corner(self.base))))
        first, second = 2 * self.flexure + self.crank, self.flexure + self.coupler
        return (reach**2 + first**2 - second**2) / (2 * reach * first)

    @staticmethod
    def _corner(side: float) -> tuple[float, float]:
        """First corner of a triangle about the origin, at −150°."""
        return -side / 2, -side / (2 * np.sqrt(3.0))

    def _legs(self) -> list[NDArray[np.float64]]:
        """Ends of the three flexures of each leg, from base to platform, (6, 2) each."""
        start, end = np.array(self._corner(self.base)), np.array(self._corner(self.platform))
        angle = self.rest_angles[0]
        crank = np.array([np.cos(angle), np.sin(angle)])
        elbow = start + (2 * self.flexure + self.crank) * crank
        coupler = (end - elbow) / (self.flexure + self.coupler)
        steps = [0.0, self.flexure, self.flexure + self.crank, 2 * self.flexure + self.crank]
        first = np.array([*(start + s * crank for s in steps), elbow + self.coupler * coupler, end])
        turns = [np.array([[np.cos(t), np.sin(t)], [-np.sin(t), np.cos(t)]]) for t in np.deg2rad([0, 120, 240])]
        return [first @ turn for turn in turns]

    @cached_property
    def _map(self) -> EquilibriumMap:
        frame, shape = self.frame, (6, len(self.frame.nodes), 6)
        loads, motions = np.zeros(shape), np.zeros(shape)
        for leg in LEGS:
            motions[leg - 1, frame.index(f"crank in{leg}"), 5] = 1.0
        loads[[3, 4, 5], frame.index(CENTRE), [0, 1, 5]] = 1.0
        solver = condense(frame, planar=True, n_steps=self.n_steps)
        centre = solver.arrays.block[frame.index(CENTRE)]
        cranks = [solver.arrays.block[frame.index(f"crank in{leg}")] for leg in LEGS]
        sections = fibres(frame.members)

        def read(answer: Answer) -> Any:
            stress = bending_stress(jnp, answer.internal, sections).max(axis=(0, 1))
            pose = answer.motion[[0, 1, 5], centre]
            return jnp.concatenate([pose, -answer.force[5, jnp.array(cranks)], stress[None]])

        return EquilibriumMap(solver, loads, motions, read, len(self.responses), self.stress_limit)

    @cached_property
    def _mechanism(self) -> assur.Mechanism:
        lengths = {n: getattr(self, n) for n in ("flexure", "crank", "coupler", "platform", "base")}
        return assur.flexure_3rrr(**lengths, width=self.width, thickness=self.thickness, young=self.young)

    def _by_groups(self, points: NDArray[np.float64]) -> Answers:
        """The thesis's method."""
        load = assur.Load("platform", force=points[:, 3:5], at=(0.0, 0.0), moment=points[:, 5])
        found = assur.solve(self._mechanism, self._mechanism.rest + points[:, :3], [load])
        moved = found.displacement("platform", (0.0, 0.0))
        values = np.column_stack([moved, found.rotation("platform"), found.torques, found.max_stress])
        limit = np.inf if self.stress_limit is None else self.stress_limit
        status, reasons = [], []
        for ok, reason, stress in zip(found.ok, found.reasons, found.max_stress, strict=True):
            too_much = ok and stress > limit
            status.append(Status.NOT_CONVERGED if not ok else Status.REJECTED if too_much else Status.OK)
            more = f"bending stress of {stress / 1e6:.4g} MPa, more than stress_limit = {limit / 1e6:g} MPa"
            reasons.append(more if too_much else reason)
        return Answers(values, status, reasons)

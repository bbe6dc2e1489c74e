"""The HexFlex of Durango et al.: a monolithic nano-manipulator, six forces in, six pose components out."""

import json
from dataclasses import dataclass
from functools import cached_property
from importlib.resources import files
from typing import Any, ClassVar

import jax.numpy as jnp
import numpy as np
from jax import Array
from numpy.typing import ArrayLike, NDArray

from ..factors import Factor, FactorSpace
from ..fea import (
    Equilibria,
    Frame,
    LinearSolver,
    Material,
    Member,
    RigidBody,
    centrelines,
    condense,
    factorise,
    rectangle,
)
from ..fea.sensitivity import Answer
from ..runs import Response
from ..settings import parameter
from .base import Answers, Arrow, JaxOracle, Line, PublishedMap, Shape
from .equilibrium import BATCH, EquilibriumMap, check_limit, intrinsic_xyz

_DATA = json.loads((files("experiments.oracles") / "data" / "hexflex.json").read_text(encoding="utf-8"))
_GEOMETRY = _DATA["geometry"]

TABS = ("T1", "T2", "T3")
TURNS = np.deg2rad([0.0, -120.0, 120.0])
"""From the first tab, which points along +y, to each tab, about +z."""

D1_DIRECTIONS = np.deg2rad([0.0, 60.0, 120.0])
"""In-plane direction of each tab's D1, parallel to its connection beams, from +x."""

PIVOT = "centroid"
KINEMATICS = ("linear", "nonlinear")


@dataclass(frozen=True)
class HexFlex(JaxOracle):
    """Rigid platform with three tabs on six bent connection beams.

    Each tab carries two mirror-image limbs: from the root on the platform straight along the tab's
    D1, a bend, and on to a clamp. All fields are parameters in SI units and radians.

    Raises
    ------
    ValueError
        If a dimension or the stress limit is not positive, the kinematics is unknown, a stress limit is
        asked of linear kinematics, or the frame cannot be built; see :class:`experiments.fea.Frame`.

    Notes
    -----
    Durango, Restrepo, Ruiz and Acosta, "Design of computer experiments applied to modeling compliant
    mechanisms", chapter 2 of Durango's thesis. The dimensions are identified from its Eq. 2.6.
    """

    name: ClassVar[str] = "hexflex"
    summary: ClassVar[str] = "HexFlex nano-manipulator, 6 forces to 6 pose components, beam FEA, linear or nonlinear"
    source: ClassVar[str] = "Durango et al., thesis chapter 2; geometry identified from Eq. 2.6"
    # Float64 and a frame of condition 1e4: answers agree to about 1e-12; three digits are kept in hand.
    resolution: ClassVar[float] = 1e-9
    batch: ClassVar[int] = BATCH

    length_1: float = parameter(_GEOMETRY["length_1"], "m", "first leg of a limb, along D1")
    length_2: float = parameter(_GEOMETRY["length_2"], "m", "second leg, from the bend to the clamp")
    width: float = parameter(_GEOMETRY["width"], "m", "in-plane width of the beams")
    thickness: float = parameter(_GEOMETRY["thickness"], "m", "out-of-plane thickness of the beams")
    bend_angle: float = parameter(_GEOMETRY["bend_angle"], "rad", "direction of the second leg from the first")
    root_offset: float = parameter(_GEOMETRY["root_offset"], "m", "root from the tab's axis, along D1")
    root_radius: float = parameter(_GEOMETRY["root_radius"], "m", "root from the centroid, along the tab")
    load_radius: float = parameter(_GEOMETRY["load_radius"], "m", "load point from the centroid")
    young: float = parameter(_GEOMETRY["young"], "Pa", "Young's modulus, aluminium 7075")
    poisson: float = parameter(_GEOMETRY["poisson"], "1", "Poisson's ratio")
    kinematics: str = parameter("linear", "", "linear (the thesis's) or nonlinear (large displacements)")
    n_steps: int = parameter(8, "1", "integration steps along each leg, even; for nonlinear kinematics")
    stress_limit: float | None = parameter(None, "Pa", "reject points with a larger bending stress; nonlinear only")

    def __post_init__(self) -> None:
        for name in ("length_1", "length_2", "width", "thickness", "load_radius", "young"):
            if not getattr(self, name) > 0.0:
                raise ValueError(f"oracle 'hexflex': {name} must be positive, got {getattr(self, name)}")
        if self.kinematics not in KINEMATICS:
            raise ValueError(
                f"oracle 'hexflex': kinematics must be one of {', '.join(KINEMATICS)}, got {self.kinematics!r}"
            )
        if self.stress_limit is not None and not self.is_nonlinear:
            raise ValueError("oracle 'hexflex': stress_limit needs kinematics = 'nonlinear'")
        check_limit(self.name, self.stress_limit)

    @property
    def is_nonlinear(self) -> bool:
        """Whether displacements may be large."""
        return self.kinematics == "nonlinear"

    @property
    def limits(self) -> str:
        """What this model leaves out."""
        if self.is_nonlinear:
            return (
                "Beams of a linear elastic material on a rigid platform; stresses are those of beams, without notches"
            )
        return (
            "Linear finite elements, as in the thesis: the model is as linear as they are. With geometrically "
            'nonlinear beams (kinematics = "nonlinear") at ±1 N the best linear map leaves 19 % of the standard '
            "deviation of x and y (default geometry)"
        )

    @property
    def factors(self) -> FactorSpace:
        """In-plane (D1) and out-of-plane (D2) force on each tab, dead loads."""
        source = "Durango et al., Table 2.1: ±1 N, recommended by the designers of the HexFlex"
        return FactorSpace(tuple(Factor(f"{tab}{d}", "N", -1.0, 1.0, source) for tab in TABS for d in ("D1", "D2")))

    @property
    def responses(self) -> tuple[Response, ...]:
        """Pose of the platform's centroid against its pose at rest; large rotations as intrinsic XYZ Euler angles."""
        return (
            *(Response(name, "m", "µm", 1e6) for name in "xyz"),
            *(Response(f"theta_{axis}", "rad", "µrad", 1e6, f"θ{axis}") for axis in "xyz"),
        )

    @property
    def published(self) -> PublishedMap | None:
        """Eq. 2.6, for the default geometry and linear kinematics only."""
        if self != HexFlex():
            return None
        given = _DATA["published"]
        notes = {tuple(key.split(",")): text for key, text in given["notes"].items()}
        return PublishedMap(
            given["source"],
            tuple(given["rows"]),
            tuple(given["columns"]),
            given["units"]["scale"] * np.array(given["values"], dtype=np.float64),
            notes,
            tuple(given["remarks"]),
        )

    @cached_property
    def frame(self) -> Frame:
        """The mechanism as a frame of beams, dimensions in m."""
        section = rectangle(self.width, self.thickness)
        material = Material(self.young, self.poisson)
        nodes: dict[str, tuple[float, float, float]] = {PIVOT: (0.0, 0.0, 0.0)}
        members, roots, clamps = [], [], []
        for tab, turn in zip(TABS, TURNS, strict=True):
            nodes[tab] = _turned(np.array([0.0, self.load_radius]), turn)
            for side, mirror in (("right", 1.0), ("left", -1.0)):
                root, bend, clamp = (f"{tab} {side} {part}" for part in ("root", "bend", "clamp"))
                for node, point in zip((root, bend, clamp), self._limb(), strict=True):
                    nodes[node] = _turned(point * [mirror, 1.0], turn)
                members.append(Member(f"{tab} {side} leg 1", root, bend, section, material))
                members.append(Member(f"{tab} {side} leg 2", bend, clamp, section, material))
                roots.append(root)
                clamps.append(clamp)
        platform = RigidBody("platform", PIVOT, (*TABS, *roots))
        return Frame(nodes, tuple(members), (platform,), tuple(clamps))

    def prepare(self) -> None:
        """Factorise or condense the frame."""
        _ = self._map if self.is_nonlinear else (self._solver, self._unit_loads)

    def evaluate(self, points: NDArray[np.float64]) -> Answers:
        """Poses at points, shape (n, 6)."""
        return self._map.evaluate(points) if self.is_nonlinear else super().evaluate(points)

    def jacobian(self, points: ArrayLike) -> NDArray[np.float64]:
        """d pose / d force at `points` (n, 6), shape (n, 6, 6), SI."""
        return self._map.jacobian(points) if self.is_nonlinear else super().jacobian(points)

    def respond(self, point: Any) -> Any:
        """Linear kinematics: pose (x, y, z [m], θx, θy, θz [rad]) of the centroid under the six forces [N]."""
        loads = jnp.einsum("k,knd->nd", point, self._unit_loads)
        return self._solver.displacements(loads)[self.frame.index(PIVOT)]

    def shape(self, point: ArrayLike) -> Shape:
        """Connection beams, tabs and force arrows at the forces `point` [N]."""
        point = np.asarray(point, dtype=np.float64)
        loads = np.einsum("k,knd->nd", point, self._unit_loads)[None]
        solution = self._map.solver.solve(loads) if self.is_nonlinear else self._solver.solve(loads)
        lines = solution.centrelines() if isinstance(solution, Equilibria) else centrelines(solution)

        def moved(*names: str) -> Line:
            rest = np.array([self.frame.nodes[n] for n in names])
            return Line("platform", rest, np.array([solution.at(n)[0, :3] for n in names]), rigid=True)

        beams = [Line(c.member, c.points, c.displacement) for c in lines]
        body = [moved(*self._outline()), *(moved(PIVOT, tab) for tab in TABS)]
        arrows = [
            Arrow(
                factor.name,
                np.array(self.frame.nodes[factor.name[:2]]),
                solution.at(factor.name[:2])[0, :3],
                np.sign(force) * direction,
            )
            for factor, force, direction in zip(self.factors, point, self._directions, strict=True)
            if force != 0.0
        ]
        anchors = np.array([self.frame.nodes[name] for name in self.frame.clamps])
        return Shape((*beams, *body), tuple(arrows), anchors)

    def _outline(self) -> tuple[str, ...]:
        """Roots in the order in which they go round the platform, closed."""
        roots = [n for n in self.frame.nodes if n.endswith("root")]
        roots.sort(key=lambda n: np.arctan2(self.frame.nodes[n][1], self.frame.nodes[n][0]))
        return (*roots, roots[0])

    def _limb(self) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """Root, bend and clamp of the first tab's right limb, in its plane."""
        root = np.array([self.root_offset, self.root_radius])
        bend = root + np.array([self.length_1, 0.0])
        clamp = bend + self.length_2 * np.array([np.cos(self.bend_angle), np.sin(self.bend_angle)])
        return root, bend, clamp

    @cached_property
    def _solver(self) -> LinearSolver:
        return factorise(self.frame)

    @cached_property
    def _map(self) -> EquilibriumMap:
        solver = condense(self.frame, n_steps=self.n_steps)
        platform = solver.arrays.block[self.frame.index(PIVOT)]

        def read(answer: Answer) -> Array:
            place, turn = answer.motion[:3, platform], answer.motion[3:, platform]
            return jnp.concatenate([place, intrinsic_xyz(turn)])

        none = np.zeros_like(self._unit_loads)
        return EquilibriumMap(solver, self._unit_loads, none, read, len(self.responses), self.stress_limit)

    @property
    def _directions(self) -> NDArray[np.float64]:
        """Unit direction of each factor's force, shape (6, 3)."""
        in_plane = np.column_stack([np.cos(D1_DIRECTIONS), np.sin(D1_DIRECTIONS), np.zeros(3)])
        out_of_plane = np.tile([0.0, 0.0, 1.0], (3, 1))
        return np.stack([in_plane, out_of_plane], axis=1).reshape(6, 3)

    @cached_property
    def _unit_loads(self) -> NDArray[np.float64]:
        """Nodal loads of 1 N of each factor, shape (6, n_nodes, 6)."""
        loads = np.zeros((6, len(self.frame.nodes), 6))
        for row, (factor, direction) in enumerate(zip(self.factors, self._directions, strict=True)):
            loads[row, self.frame.index(factor.name[:2]), :3] = direction
        return loads


def _turned(point: NDArray[np.float64], angle: float) -> tuple[float, float, float]:
    c, s = np.cos(angle), np.sin(angle)
    return (float(c * point[0] - s * point[1]), float(s * point[0] + c * point[1]), 0.0)

"""Cantilevers of length, EI and therefore forces of order one, beside the equations of the rod; for the tests of the
nonlinear FEA. All cases of one solve share a frame and differ in geometry, section and load."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import jax
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from experiments.fea import Frame, Material, Member, RigidBody, Section, Support
from experiments.fea.elements import Properties
from experiments.fea.equilibria import Equilibria
from experiments.fea.nonlinear import NonlinearSolver
from experiments.fea.scaling import Geometry, geometry
from tests.rod_equations import Rod, loaded_end

Floats = NDArray[np.float64]

RIGID = 1e12
"""Stretching and shear stiffness over EI/L² of what counts as inextensible: strains of 1e-11."""

ORDER = (3.5, 4.6)
"""Where the order of a method of the fourth order may lie while h is not small; for the finest steps of a sequence."""

DRIVE = (2 / 3, -1 / 3, 2 / 3)
"""Of length one."""


@dataclass(frozen=True)
class Case:
    """One cantilever and what acts on its tip; the force `dead[:3]` acts at `arm` from the tip, carried rigidly."""

    name: str
    curve: Callable[[float], Floats] = lambda s: np.array([s, 0.0, 0.0])
    stiffness: Sequence[float] = (RIGID, RIGID, RIGID, 1.0, 1.0, 1.0)  # EA, GA_y, GA_z, GJ, EI_y, EI_z
    dead: Sequence[float] = field(default=(0.0,) * 6)
    follower: Sequence[float] = field(default=(0.0,) * 6)
    arm: Sequence[float] = (0.0, 0.0, 0.0)
    up: Sequence[float] = (0.0, 0.0, 1.0)

    @property
    def rod(self) -> tuple[Rod, Floats]:
        """The equations of the cantilever, and the directors of its tip at rest."""
        start, middle, end = (self.curve(s) for s in (0.0, 0.5, 1.0))
        chord, seen = end - start, np.cross(middle - start, end - middle)
        half = math.atan2(np.linalg.norm(seen), (middle - start) @ (end - middle))
        normal = seen / np.linalg.norm(seen) if half > 1e-12 else np.zeros(3)
        tangent = Rotation.from_rotvec(-half * normal).apply(chord / np.linalg.norm(chord))
        z = np.array(self.up) - tangent * (tangent @ self.up)
        z /= np.linalg.norm(z)
        turn = np.stack([tangent, np.cross(z, tangent), z], axis=1)
        length = np.linalg.norm(chord) * (half / math.sin(half) if half > 1e-12 else 1.0)
        rod = Rod(start, turn, length, 1 / np.array(self.stiffness), turn.T @ normal * 2 * half / length)
        return rod, Rotation.from_rotvec(2 * half * normal).as_matrix() @ turn

    def solved(self, guess: Floats) -> tuple[Floats, Rotation]:
        """Translation and rotation of the tip by SciPy; `guess` is the wrench at the clamp."""
        rod, rest = self.rod
        conditions = loaded_end(rest, self.dead, self.follower, self.arm)
        _, place, turn = rod.shoot(conditions, guess)
        return place - self.curve(1.0), Rotation.from_matrix(turn @ rest.T)


def arc(radius: float, angle: float, turn: Rotation | None = None) -> Callable[[float], Floats]:
    """From the origin along y, bending towards x, all of it turned."""
    turn = turn or Rotation.identity()

    def place(s: float) -> Floats:
        return turn.apply([radius * (1 - math.cos(s * angle)), radius * math.sin(s * angle), 0.0])

    return place


def frame(driven: Member | None = None) -> Frame:
    """A cantilever with a lever on its tip, of any shape, since all cases bring their own.

    Beside it, if asked, a member from a clamp, ``base``, at the origin to a driven end, ``drive``, at `DRIVE`: one
    program, which takes a minute to compile in space, serves both.
    """
    nodes = {"root": (0.0, 0.0, 0.0), "tip": (1.0, 0.0, 0.0), "arm": (1.0, 0.5, 0.0)}
    member = Member("m", "root", "tip", Section(1.0, 1.0, 1.0, 1.0), Material(1.0, 0.0), (0, 0, 1), (0.5, 0.1, 0))
    lever = RigidBody("lever", "tip", ("arm",))
    if driven is None:
        return Frame(nodes, [member], [lever], clamps=["root"])
    nodes |= {"base": (0.0, 0.0, 0.0), "drive": DRIVE}
    held = Support("drive", ("x", "y", "z", "rx", "ry", "rz"))
    return Frame(nodes, [member, driven], [lever], clamps=["root", "base"], supports=[held])


def geometries(solver: NonlinearSolver, n_cases: int) -> Geometry:
    """The frame's own for every case."""
    return jax.tree.map(lambda part: np.repeat(part, n_cases, axis=-1), geometry(solver.arrays))


def shaped(solver: NonlinearSolver, cases: Sequence[Case]) -> Geometry:
    """The cantilever with the curve and section of every case."""
    own = geometries(solver, len(cases))
    own.coordinates[:, :3] = np.transpose([[c.curve(0.0), c.curve(1.0), c.curve(1.0) + c.arm] for c in cases])
    own.through[:, 0] = np.transpose([c.curve(0.5) for c in cases])
    own.up[:, 0] = np.transpose([c.up for c in cases])
    ea, gy, gz, gj, ey, ez = np.transpose([c.stiffness for c in cases])
    one = np.ones_like(ea)
    for part, values in zip(own.properties, Properties(one, one, ea, ey, ez, gj, gy, gz), strict=True):
        part[0] = values
    return own


@dataclass(frozen=True)
class Tips:
    """Tips of all cases on each number of steps."""

    cases: tuple[Case, ...]
    found: dict[int, Equilibria]

    @property
    def steps(self) -> list[int]:
        return list(self.found)

    def all_found(self, name: str) -> tuple[int, list[Equilibria]]:
        """Number of the case, and the equilibria on each number of steps."""
        i = [case.name for case in self.cases].index(name)
        for steps, found in self.found.items():
            assert found.ok[i], f"{steps} steps: {found.reasons[i]}"
        return i, list(self.found.values())

    def motion(self, name: str) -> Floats:
        """Translation and rotation vector on each number of steps, (n, 6)."""
        i, found = self.all_found(name)
        return np.stack([one.at("tip")[i] for one in found])

    def errors(self, name: str, translation: Floats, rotation: Rotation) -> Floats:
        """Largest error of a translation or angle on each number of steps, (n,)."""
        i, found = self.all_found(name)
        turned = [(one.rotation("tip")[i] * rotation.inv()).magnitude() for one in found]
        return np.maximum(np.abs(self.motion(name)[:, :3] - translation).max(1), turned)

    def errors_by_scipy(self, name: str) -> Floats:
        """The same, beside the equations of the rod; what the clamp exerts is the guess."""
        i, found = self.all_found(name)
        return self.errors(name, *self.cases[i].solved(-found[-1].reactions[i, 0]))


def run(solvers: dict[int, NonlinearSolver], cases: Sequence[Case], only_stable: bool = True) -> Tips:
    """The cases on each number of steps."""
    n_nodes = len(next(iter(solvers.values())).frame.nodes)
    dead, follower = np.zeros((2, len(cases), n_nodes, 6))
    dead[:, 1, 3:] = [case.dead[3:] for case in cases]
    for row, case in zip(dead, cases, strict=True):
        row[2 if any(case.arm) else 1, :3] = case.dead[:3]
    follower[:, 1] = [case.follower for case in cases]
    found = {n: s.solve(dead, None, follower, shaped(s, cases), only_stable) for n, s in solvers.items()}
    return Tips(tuple(cases), found)


def assert_order(steps: Sequence[int], errors: Floats, floor: float = 1e-11) -> None:
    """Fourth order in the end, and better than second before h is small; down to what float64 leaves."""
    kept = errors > floor
    steps, errors = np.array(steps)[kept], errors[kept]
    seen = np.log(errors[:-1] / errors[1:]) / np.log(steps[1:] / steps[:-1])
    assert ORDER[0] < seen[-1] < ORDER[1], (errors, seen)
    assert np.all(seen > 2), (errors, seen)

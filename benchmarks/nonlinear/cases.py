"""Points and models of the comparison: ours as oracles, OpenSees's as functions of mesh and number of points."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from experiments import oracles
from experiments.fea.arrays import frame_arrays
from experiments.fea.elements import Properties
from experiments.fea.scaling import Geometry
from experiments.oracles.hexflex import D1_DIRECTIONS, TABS

Floats = NDArray[np.float64]
FINE = 32
"""Steps along each member of our reference."""

TOLERANCE = 1e-6
"""Of OpenSees on the HexFlex, m and rad: its tangent is not exact, and a smaller one costs more and gains nothing."""


@dataclass(frozen=True)
class Case:
    """One mechanism: what it is called, our oracle and its parameters, its points, and OpenSees's finest mesh."""

    title: str
    oracle: str
    parameters: dict[str, Any]
    points: Floats
    finest: tuple[int, int]

    def ours(self, n_steps: int) -> Any:
        """Our oracle with `n_steps` along each member."""
        return oracles.get(self.oracle, **self.parameters, n_steps=n_steps)

    def theirs(self, points: Floats, n_elements: int, n_steps: int) -> Floats:
        """OpenSees's responses, in the order of ours."""
        from ..opensees import flexure_3rrr, hexflex

        if self.oracle == "hexflex":
            return hexflex.solve(points, n_elements, n_steps, tolerance=TOLERANCE)
        found = flexure_3rrr.solve(points, n_elements=n_elements, n_steps=n_steps)
        return np.column_stack([found.poses, found.torques, found.stresses])


def flexure_3rrr(n: int) -> Case:
    """Random points of the workspace: the cranks turn, nothing loads the platform."""
    points = np.zeros((n, 6))
    points[:, :3] = np.random.default_rng(0).uniform(-0.195, 0.245, (n, 3))
    return Case("3-RRR, in its workspace", "flexure_3rrr", {}, points, (64, 2))


def hexflex(n: int, amplitude: float = 1.0) -> Case:
    """Random forces."""
    forces = np.random.default_rng(0).uniform(-amplitude, amplitude, (n, 6))
    return Case(f"HexFlex, ±{amplitude:g} N", "hexflex", {"kinematics": "nonlinear"}, forces, (96, 1))


def tab_loads(forces: Floats) -> Floats:
    """Nodal loads of the HexFlex, (n, n_nodes, 6), from its six forces, (n, 6), N."""
    frame = oracles.get("hexflex").frame
    loads = np.zeros((len(forces), len(frame.nodes), 6))
    for tab, angle, pair in zip(TABS, D1_DIRECTIONS, np.split(forces, 3, axis=1), strict=True):
        loads[:, frame.index(tab), 0] = np.cos(angle) * pair[:, 0]
        loads[:, frame.index(tab), 1] = np.sin(angle) * pair[:, 0]
        loads[:, frame.index(tab), 2] = pair[:, 1]
    return loads


def sizes(n: int, spread: float = 0.2) -> Floats:
    """Legs, width and thickness of HexFlexes that vary by up to ± `spread`, m, shape (n, 4)."""
    m = oracles.get("hexflex")
    factors = 1 + np.random.default_rng(0).uniform(-spread, spread, (n, 4))
    return factors * [m.length_1, m.length_2, m.width, m.thickness]


def geometry(some: Floats) -> Geometry:
    """Of HexFlexes of these sizes."""
    standard, names = oracles.get("hexflex"), ("length_1", "length_2", "width", "thickness")
    varied = (replace(standard, **dict(zip(names, row, strict=True))) for row in some.tolist())
    arrays = [frame_arrays(oracle.frame) for oracle in varied]
    return Geometry(
        np.stack([a.coordinates.T for a in arrays], -1),
        np.stack([a.through.T for a in arrays], -1),
        arrays[0].up.T[:, :, None],
        Properties(*(np.stack(p, -1) for p in zip(*(a.properties for a in arrays), strict=True))),
    )

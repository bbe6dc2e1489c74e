"""``python -m benchmarks.opensees.references``: writes the reference numbers of the tests, a few minutes.

Every number is extrapolated from three meshes, each half the size of the one before, in h² and h⁴. Its estimated
error is the last change of that extrapolation, or what rounding and Newton's tolerance leave where that is larger.
"""

import dataclasses
import json
import platform
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import openseespy.opensees as ops
from numpy.typing import NDArray

from . import bends, descriptions, flexure_3rrr, frames, hexflex
from .timing import random_flexure_points

Vector = NDArray[np.float64]
FOLDER = Path(__file__).parents[2] / "tests" / "reference"
SEED_3RRR, SEED_HEXFLEX = 2024, 2025
LEE = ((2, -0.5, 110), (1, 0.25, 160), (3, 0.001, 100), (2, -0.25, 40))
WILLIAMS = ((2, -0.005, 140),)
ARCH = ((2, -1.0, 105), (2, -0.5, 30))


def extrapolated(solve: Callable[[int], Vector], meshes: Sequence[int], floor: float = 1e-8) -> tuple[Vector, Vector]:
    """Answers at zero mesh size from three meshes, and their estimated errors.

    `floor` is the least relative error that rounding allows, of the largest answer in the same column.
    """
    coarse, middle, fine = (solve(n) for n in meshes)
    first, second = middle + (middle - coarse) / 3, fine + (fine - middle) / 3
    best = second + (second - first) / 15
    return best, np.maximum(np.abs(best - second), floor * np.abs(best).max(0))


def source(element: str, meshes: Sequence[int | str], what: str, more: str = "") -> str:
    """How the numbers came about."""
    return (
        f"OpenSeesPy {ops.version()}, Python {platform.python_version()}; {element}, geomTransf Corotational; "
        f"{'/'.join(map(str, meshes))} elements {what}, extrapolated in h^2 and h^4{more}"
    )


def flexure_numbers() -> dict[str, Any]:
    """The 3-RRR mechanism: the case with the exact elastica, and random points."""
    meshes = (16, 32, 64)
    rest = -0.599365 + flexure_3rrr.TURNS
    case = np.array([[*(np.array([-0.349, 1.745, -2.444]) - rest), -0.4, 0.0, 0.0]])
    midpoint = 0.04 / np.sqrt(12) * np.array([np.cos(np.pi / 6), np.sin(np.pi / 6)])
    answers: dict[str, Any] = {
        "source": source("elasticBeamColumn (Euler-Bernoulli)", meshes, "a flexure", "; 4 equal steps, Newton")
        + "; rigid links as stiff corotational beams, extrapolated in 1/stiffness from 1e7 and 1e8 times EI",
        "units": "rad, N, m, N m, Pa; points: three crank rotations from rest, Fx, Fy, Mz on the platform centre",
        "answers": ["x", "y", "psi", "tau1", "tau2", "tau3", "max_bending_stress"],
        "seed": f"timing.random_flexure_points(20, {SEED_3RRR})",
    }
    for name, points, force_point in (
        ("exact_case", case, midpoint),
        ("random", random_flexure_points(20, SEED_3RRR), np.zeros(2)),
    ):

        def run(n: int, stiff: float = 1e8, points: Vector = points, force_point: Vector = force_point) -> Vector:
            mechanism = flexure_3rrr.Flexure3RRR(rigidity=stiff, axial_rigidity=stiff / 1e3)
            s = flexure_3rrr.solve(points, force_point, n, 4, mechanism)
            return np.column_stack([s.poses, s.torques, s.stresses])

        best, error = extrapolated(run, meshes, 3e-7)
        best += (run(16) - run(16, 1e7)) / 9
        answers[name] = {"force_point": force_point, "points": points, "values": best, "estimated_error": error}
    return answers


def hexflex_numbers() -> dict[str, Any]:
    """20 load points at ±1 N and 10 at ±2 N, with and without shear flexibility."""
    meshes, rng = (16, 32, 64), np.random.default_rng(SEED_HEXFLEX)
    forces = np.vstack([rng.uniform(-1.0, 1.0, (20, 6)), rng.uniform(-2.0, 2.0, (10, 6))])
    answers: dict[str, Any] = {
        "units": "N, m, rad; forces T1D1, T1D2, T2D1, T2D2, T3D1, T3D2; pose x, y, z and intrinsic XYZ Euler angles",
        "seed": f"numpy default_rng({SEED_HEXFLEX}): uniform ±1 N (20, 6), then uniform ±2 N (10, 6)",
        "geometry": "experiments/oracles/data/hexflex.json",
        "forces": forces,
    }
    for name, element, shear in (
        ("timoshenko", "elasticForceBeamColumn, Elastic section with shear coefficient 5/6, 2 Gauss points", True),
        ("euler_bernoulli", "elasticBeamColumn", False),
    ):
        mechanism = hexflex.HexFlex(shear=shear)

        def run(n: int, stiff: float = 1e8, mechanism: hexflex.HexFlex = mechanism) -> Vector:
            return hexflex.solve(forces, n, 5, mechanism, stiff)

        best, error = extrapolated(run, meshes, 1e-7)
        best += (run(8) - run(8, 1e7)) / 9
        about = source(element, meshes, "a leg", descriptions.PLATFORM)
        answers[name] = {"source": about, "pose": best, "estimated_error": error}
    return answers


def frame_numbers() -> dict[str, Any]:
    """Limit points and paths of three planar frames."""
    answers: dict[str, Any] = {
        "source": source("elasticBeamColumn (Euler-Bernoulli), DisplacementControl", ("see meshes",), "")
        + "; limit points by a polynomial of degree 6 through 9 points of the path",
        "columns": ["load factor", "u_x", "u_y", "rotation of the loaded node"],
    }
    for name, problem, stages, meshes, about in (
        ("lee_frame", frames.lee, LEE, (8, 16, 32), descriptions.LEE),
        ("williams_toggle", frames.williams, WILLIAMS, (32, 64, 128), descriptions.WILLIAMS),
        (
            "williams_toggle_12.936",
            lambda n: frames.williams(n, 12.936),
            WILLIAMS,
            (32, 64, 128),
            descriptions.WILLIAMS_SHORT,
        ),
        ("deep_arch", frames.deep_arch, ARCH, (32, 64, 128), descriptions.ARCH),
        ("deep_arch_inextensible", lambda n: frames.deep_arch(n, 1e10), ARCH, (32, 64, 128), descriptions.ARCH_STIFF),
    ):
        paths = {n: frames.follow(problem(n), stages, 1e-8) for n in meshes}
        first = 1 + stages[0][2]
        stride = stages[0][2] // 14 if len(stages) == 1 else 10
        limits = extrapolated(lambda n, paths=paths: frames.limit_points(paths[n]), meshes, 1e-7)
        curve = extrapolated(lambda n, paths=paths, k=first, s=stride: paths[n][:k:s], meshes, 1e-7)
        answers[name] = {
            **about,
            "meshes": meshes,
            "limit_points": {"values": limits[0], "estimated_error": limits[1]},
            "curve": {"values": curve[0], "estimated_error": curve[1]},
        }
    return answers


def cantilever_numbers() -> dict[str, Any]:
    """Tip displacements of the 45° bend and of the right-angle cantilever."""
    arc, angle = (
        (bends.bend_points, bends.BEND, descriptions.BEND),
        (bends.right_angle_points, bends.RIGHT_ANGLE, descriptions.ANGLE),
    )
    arc_loads = np.outer([150.0, 300.0, 450.0, 600.0, 900.0], [0.0, 0.0, 1.0])
    angle_loads = np.outer([0.25, 0.5, 1.0, 2.0], [4.0, -6.0, 10.0])
    answers: dict[str, Any] = {}
    for name, (points, stiffness, about), loads, meshes in (
        ("bend_45", arc, arc_loads, (16, 32, 64)),
        ("right_angle", angle, angle_loads, (8, 16, 32)),
    ):
        elements = "elasticForceBeamColumn for timoshenko, elasticBeamColumn for euler_bernoulli"
        how = source(elements, meshes, "a member", "; 20 equal steps, NewtonLineSearch")
        answers[name] = {"source": how, "what": about, "stiffness": dataclasses.asdict(stiffness), "loads": loads}
        for theory, s in (("timoshenko", stiffness), ("euler_bernoulli", dataclasses.replace(stiffness, shear=None))):

            def run(n: int, points: Any = points, s: bends.Stiffness = s, loads: Any = loads) -> Vector:
                return bends.tip_displacements(points(n), s, loads, 20)

            best, error = extrapolated(run, meshes, 1e-8)
            answers[name][theory] = {"tip_displacement": best, "estimated_error": error}
    return answers


FILES: dict[str, Callable[[], dict[str, Any]]] = {
    "flexure_3rrr": flexure_numbers,
    "hexflex": hexflex_numbers,
    "frames": frame_numbers,
    "cantilevers": cantilever_numbers,
}


def main(names: Sequence[str]) -> None:
    """Write the files of those names, of all by default."""
    for name in names or FILES:
        text = json.dumps(FILES[name](), indent=1, default=np.ndarray.tolist, ensure_ascii=False)
        (FOLDER / f"opensees_{name}.json").write_text(text + "\n", encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1:])

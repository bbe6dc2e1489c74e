"""The text of a CalculiX input: a flat sheet of S8R shells, clamped, with forces on a stiff platform.

Lengths in mm, forces in N, stresses in MPa: with metres, coordinates would lose digits in the fixed columns of results.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .mesh import Mesh

STIFFENING = 1000.0
"""How much stiffer the platform is than the beams, where it is of elements."""

_TIGHT = ("*CONTROLS, PARAMETERS=FIELD", "1e-4, 1e-4, , , 1e-4")
"""Relative residual and correction at which Newton stops. ccx's own 5e-3 and 1e-2 leave errors of 1e-3 in an answer;
1e-6 is never met, for the rounding of a platform 1000 times stiffer."""

READ = "READ"
"""Set of the nodes whose displacements are printed."""


@dataclass(frozen=True)
class Material:
    """A linear elastic, isotropic material.

    Parameters
    ----------
    young : float
        Young's modulus, Pa.
    poisson : float
    """

    young: float
    poisson: float


@dataclass(frozen=True)
class Load:
    """A dead load on one node.

    Parameters
    ----------
    node : int
        Row of the mesh's nodes.
    direction : tuple of float
        Unit vector; a force in the plane or along z.
    value : float or str
        In N; a text goes into the deck as it is: a placeholder such as ``"{T1D1}"``.
    """

    node: int
    direction: tuple[float, float, float]
    value: float | str


def model_text(
    mesh: Mesh,
    thickness: float,
    material: Material,
    clamps: NDArray[np.int64],
    loads: Sequence[Load],
    *,
    stiff: str | None = None,
    stiffening: float = STIFFENING,
    rigid: str | None = None,
    read: NDArray[np.int64] | None = None,
    title: str = "shells",
) -> str:
    """The part of an input before its steps; the same for every point.

    Parameters
    ----------
    mesh : Mesh
        In mm.
    thickness : float
        In m.
    material : Material
    clamps : ndarray of int
        Rows of the nodes that are held in all six motions.
    loads : sequence of Load
        All that will act: their directions are needed, not their values.
    stiff : str, optional
        Region that is stiffer than the others, by the factor `stiffening`.
    stiffening : float
    rigid : str, optional
        Region whose nodes are one rigid body.
    read : ndarray of int, optional
        Rows of the nodes whose displacements are printed; all if not given.
    title : str

    Raises
    ------
    ValueError
        If a region is not in the mesh, or a node is loaded in two directions of the plane.
    """
    for name in (stiff, rigid):
        if name is not None and name not in mesh.regions:
            raise ValueError(f"the mesh has the regions {', '.join(mesh.regions)}; got {name!r}")
    lines = ["*HEADING", f"{title}; mm, N, MPa", "*NODE, NSET=ALL"]
    lines += [f"{i + 1}, {x:.12g}, {y:.12g}, 0" for i, (x, y) in enumerate(mesh.nodes)]
    for name, rows in mesh.regions.items():
        lines.append(f"*ELEMENT, TYPE=S8R, ELSET={name.upper()}")
        lines += [f"{e + 1}, " + ", ".join(str(n + 1) for n in mesh.elements[e]) for e in rows]
    lines += [*_set("CLAMPS", clamps), *_set(READ, np.arange(len(mesh.nodes)) if read is None else read)]
    for name in mesh.regions:
        modulus = 1e-6 * material.young * (stiffening if name == stiff else 1.0)
        lines += [f"*MATERIAL, NAME={name.upper()}", "*ELASTIC", f"{modulus:.12g}, {material.poisson:.12g}"]
        lines += [f"*SHELL SECTION, ELSET={name.upper()}, MATERIAL={name.upper()}", f"{1e3 * thickness:.12g}"]
    if rigid:
        lines += [*_set("RIGID", mesh.nodes_of(rigid)), *_rigid_body(mesh)]
    lines += [*_systems(loads), "*BOUNDARY", "CLAMPS, 1, 6"]
    return "\n".join(lines) + "\n"


def steps_text(steps: Sequence[Sequence[Load]], *, nonlinear: bool = False) -> str:
    """The steps of an input.

    Parameters
    ----------
    steps : sequence of sequence of Load
        Loads of each step. Each step starts from rest if the analysis is linear.
    nonlinear : bool
        Whether displacements are large (``NLGEOM``).

    Raises
    ------
    ValueError
        If there is no step, a step has no load, or several steps are asked for with large displacements.
    """
    if not steps or not all(steps):
        raise ValueError("every step needs a load, and there must be a step")
    if nonlinear and len(steps) > 1:
        raise ValueError(
            f"with large displacements a step goes on from the one before: give one step, not {len(steps)}"
        )
    return "\n".join(line for step in steps for line in _step(step, nonlinear)) + "\n"


def _step(loads: Sequence[Load], nonlinear: bool) -> list[str]:
    lines = [f"*STEP{', NLGEOM, INC=1000' if nonlinear else ''}", "*STATIC"]
    # The first increment is the whole load: ccx halves it itself where Newton does not converge.
    lines += ["1., 1.", *_TIGHT] if nonlinear else []
    lines += ["*CLOAD, OP=NEW"]
    for load in loads:
        dof = 3 if load.direction[2] else 1  # in the plane along the first axis of the node's own system
        value = load.value if isinstance(load.value, str) else f"{load.value:.12g}"
        lines.append(f"{load.node + 1}, {dof}, {value}")
    return [*lines, f"*NODE PRINT, NSET={READ}, GLOBAL=YES", "U", "*END STEP"]


def _systems(loads: Iterable[Load]) -> list[str]:
    """A system of axes at each node loaded in the plane, its first axis along the force: placeholders do no sums."""
    found: dict[int, tuple[float, float]] = {}
    for load in loads:
        if not load.direction[2] and found.setdefault(load.node, load.direction[:2]) != load.direction[:2]:
            raise ValueError(f"node {load.node + 1} is loaded in two directions of the plane; give each its own node")
    lines = []
    for node, (x, y) in found.items():
        lines += [f"*NSET, NSET=LOAD{node + 1}", f"{node + 1}"]
        lines += [f"*TRANSFORM, NSET=LOAD{node + 1}, TYPE=R", f"{x:.15g}, {y:.15g}, 0, {0.0 - y:.15g}, {x:.15g}, 0"]
    return lines


def _rigid_body(mesh: Mesh) -> list[str]:
    """A rigid body of the set RIGID with its reference at the origin; two further nodes carry its motion."""
    place, turn = len(mesh.nodes) + 1, len(mesh.nodes) + 2
    lines = ["*NODE", f"{place}, 0, 0, 0", f"{turn}, 0, 0, 0"]
    return [*lines, f"*RIGID BODY, NSET=RIGID, REF NODE={place}, ROT NODE={turn}"]


def _set(name: str, rows: NDArray[np.int64]) -> list[str]:
    ids = [str(row + 1) for row in rows]
    return [f"*NSET, NSET={name}", *(", ".join(ids[i : i + 16]) for i in range(0, len(ids), 16))]


def forces(values: Mapping[str, float | str], names: Sequence[str]) -> list[float | str]:
    """`values` in the order of `names`; zero where not given, ``ValueError`` for a name that is unknown."""
    unknown = [name for name in values if name not in names]
    if unknown:
        raise ValueError(f"forces are {', '.join(names)}; got {unknown[0]!r}")
    return [values.get(name, 0.0) for name in names]

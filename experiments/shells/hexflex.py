"""The HexFlex as a flat sheet of shells: dimensions to mesh, mesh to deck."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .deck import STIFFENING, Load, Material, forces, model_text, steps_text
from .mesh import Block, Mesh, block, join, mirrored, thirds

FACTORS = tuple(f"T{tab}D{direction}" for tab in (1, 2, 3) for direction in (1, 2))
"""Names of the six forces, those of the oracle ``hexflex``."""

LIMBS, PLATFORM = "limbs", "platform"
PLATFORMS = ("stiff", "rigid")
MODEL, POINT = "model.inp", "point.inp"

_ROOT3 = np.sqrt(3.0)
TABS = np.array([[0.0, 1.0], [_ROOT3 / 2.0, -0.5], [-_ROOT3 / 2.0, -0.5]])
"""Unit vectors from the centroid to each tab."""

D1 = np.array([[1.0, 0.0], [0.5, _ROOT3 / 2.0], [-0.5, _ROOT3 / 2.0]])
"""Unit vectors of each tab's force in the plane."""


@dataclass(frozen=True)
class Sheet:
    """Dimensions of the HexFlex in SI units and radians; fields as the parameters of the oracle ``hexflex``.

    The defaults are the dimensions with which this kind of model gives the published map, Eq. 2.6 of Durango et al.:
    identified with CalculiX S8R, 2 elements across a beam, platform stiffened 1000 times.

    Raises
    ------
    ValueError
        If a dimension is not positive, or the bend leaves no room for the legs.
    """

    length_1: float = 0.0201927
    length_2: float = 0.0142337
    width: float = 0.00079373
    thickness: float = 0.00058096
    bend_angle: float = -2.0943951023931953
    root_offset: float = 0.004
    root_radius: float = 0.025
    load_radius: float = 0.06
    young: float = 71.7e9
    poisson: float = 0.33

    def __post_init__(self) -> None:
        for name in ("length_1", "length_2", "width", "thickness", "root_offset", "root_radius", "young"):
            if not getattr(self, name) > 0.0:
                raise ValueError(f"HexFlex shells: {name} must be positive, got {getattr(self, name)}")
        if not self.load_radius > self.root_radius + self.width / 2.0:
            raise ValueError(f"HexFlex shells: load_radius must lie beyond the roots, got {self.load_radius}")
        if not 0.1 < abs(self.bend_angle) < np.pi - 0.1:
            raise ValueError(f"HexFlex shells: bend_angle must be between 0.1 and 3.04 rad, got {self.bend_angle}")
        if not min(self.length_1, self.length_2) > 1.01 * self.corner:
            raise ValueError(
                f"HexFlex shells: the corner takes {self.corner:.3g} m of each leg, too much for its length"
            )

    @property
    def corner(self) -> float:
        """How much of each leg the corner takes, from the bend, m."""
        return float(self.width / 2.0 * np.tan(abs(self.bend_angle) / 2.0))


@dataclass(frozen=True)
class Divisions:
    """Numbers of elements: across a beam, along its legs, and in the platform, which is stiff and needs few.

    Raises
    ------
    ValueError
        If one is less than 1.
    """

    across: int = 2
    leg_1: int = 24
    leg_2: int = 16
    platform: int = 2
    tab: int = 4

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if value < 1:
                raise ValueError(f"divisions: {name} must be 1 or more, got {value}")

    def refined(self, factor: int) -> "Divisions":
        """Every element of the beams divided into factor × factor; the platform as it is."""
        return Divisions(factor * self.across, factor * self.leg_1, factor * self.leg_2, self.platform, self.tab)


def sheet_mesh(sheet: Sheet, divisions: Divisions | None = None) -> Mesh:
    """The mesh in mm: one half of one third by blocks, mirrored and turned, so that it is symmetric to rounding."""
    divisions = divisions or Divisions()
    limb, body = _limb(sheet, divisions), _sixth(sheet, divisions)
    return join({LIMBS: thirds([*limb, *mirrored(limb)]), PLATFORM: thirds([*body, *mirrored(body)])})


def clamped(mesh: Mesh, sheet: Sheet) -> NDArray[np.int64]:
    """Rows of the nodes on the clamped ends of the limbs."""
    _, direction, end = _leg_2(sheet)
    found = []
    for mirror in (1.0, -1.0):
        for turn in thirds([np.array([end, direction])[:, None] * [mirror, 1.0]]):
            place, along = turn[:, 0]
            off = (mesh.nodes - place) @ np.column_stack([along, [-along[1], along[0]]])
            found.append(np.flatnonzero((np.abs(off[:, 0]) < 1e-6) & (np.abs(off[:, 1]) < 510.0 * sheet.width)))
    return np.unique(np.concatenate(found))


def hexflex_deck(
    values: Mapping[str, float | str],
    *,
    sheet: Sheet | None = None,
    divisions: Divisions | None = None,
    nonlinear: bool = False,
    platform: str = "stiff",
    stiffening: float = STIFFENING,
    unit_steps: bool = False,
) -> str:
    """The whole input of one point; see :func:`hexflex_files` for the parameters.

    Parameters
    ----------
    values : mapping of str to float or str
    sheet, divisions, nonlinear, platform, stiffening
    unit_steps : bool
        Six linear steps, one force of `values` each, for the compliance matrix.

    Raises
    ------
    ValueError
        If a force or the kind of platform is unknown, or unit steps are asked for with large displacements.
    """
    model, loads = _model(sheet or Sheet(), divisions, platform, stiffening, values)
    return model + steps_text([[load] for load in loads] if unit_steps else [loads], nonlinear=nonlinear)


def hexflex_files(
    values: Mapping[str, float | str],
    *,
    sheet: Sheet | None = None,
    divisions: Divisions | None = None,
    nonlinear: bool = False,
    platform: str = "stiff",
    stiffening: float = STIFFENING,
) -> dict[str, str]:
    """The same in two files: the model, which no force changes, and a short one with the forces that includes it.

    Parameters
    ----------
    values : mapping of str to float or str
        The six forces, N, by the names :data:`FACTORS`, zero if not given; a text is a placeholder.
    sheet : Sheet, optional
    divisions : Divisions, optional
    nonlinear : bool
        Large displacements.
    platform : str
        ``"stiff"``: of elements `stiffening` times stiffer; ``"rigid"``: besides, the middle plane is a rigid body.
    stiffening : float

    Returns
    -------
    dict of str to str
        Texts by file name, ``model.inp`` and ``point.inp``.

    Raises
    ------
    ValueError
        If a force or the kind of platform is unknown.
    """
    model, loads = _model(sheet or Sheet(), divisions, platform, stiffening, values)
    return {MODEL: model, POINT: f"*INCLUDE, INPUT={MODEL}\n" + steps_text([loads], nonlinear=nonlinear)}


def placeholders() -> dict[str, str]:
    """A placeholder of the oracle ``command`` for each force; 19 characters, as the fields of ccx take 20."""
    return {name: f"{{{{{name} [N]:.12e}}}}" for name in FACTORS}


def _model(
    sheet: Sheet, divisions: Divisions | None, platform: str, stiffening: float, values: Mapping[str, float | str]
) -> tuple[str, list[Load]]:
    """Text before the steps, and the six loads."""
    if platform not in PLATFORMS:
        raise ValueError(f"platform must be one of {', '.join(PLATFORMS)}, got {platform!r}")
    mesh = sheet_mesh(sheet, divisions)
    loads = [
        Load(node, direction, value)
        for (node, direction), value in zip(_places(mesh, sheet), forces(values, FACTORS), strict=True)
    ]
    text = model_text(
        mesh,
        sheet.thickness,
        Material(sheet.young, sheet.poisson),
        clamped(mesh, sheet),
        loads,
        stiff=PLATFORM,
        stiffening=stiffening,
        rigid=PLATFORM if platform == "rigid" else None,
        read=mesh.nodes_of(PLATFORM),
        title="HexFlex",
    )
    return text, loads


def _places(mesh: Mesh, sheet: Sheet) -> list[tuple[int, tuple[float, float, float]]]:
    """Node and direction of each of the six forces."""
    nodes = mesh.at(1e3 * sheet.load_radius * TABS)
    found = []
    for node, (x, y) in zip(nodes, D1, strict=True):
        found += [(int(node), (float(x), float(y), 0.0)), (int(node), (0.0, 0.0, 1.0))]
    return found


def _leg_2(sheet: Sheet) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Bend, unit vector to the clamp, and clamp of the first tab's right limb, mm."""
    bend = 1e3 * np.array([sheet.root_offset + sheet.length_1, sheet.root_radius])
    direction = np.array([np.cos(sheet.bend_angle), np.sin(sheet.bend_angle)])
    return bend, direction, bend + 1e3 * sheet.length_2 * direction


def _limb(sheet: Sheet, divisions: Divisions) -> list[Block]:
    """The first tab's right limb: two rectangles, and between them the kite of a sharp corner."""
    bend, direction, end = _leg_2(sheet)
    half, short = 500.0 * sheet.width, 1e3 * sheet.corner
    up, across = np.array([0.0, half]), half * np.array([-direction[1], direction[0]])
    root = 1e3 * np.array([sheet.root_offset, sheet.root_radius])
    before, after = bend - [short, 0.0], bend + short * direction
    n = divisions.across
    legs = [
        block([root - up, before - up, before + up, root + up], divisions.leg_1, n),
        block([after - across, end - across, end + across, after + across], divisions.leg_2, n),
    ]
    if sheet.bend_angle < 0.0:  # the inner corner is on the right
        kite = [before - up, after + across, bend + up + short * np.array([1.0, 0.0]), before + up]
    else:
        kite = [before - up, bend - up + short * np.array([1.0, 0.0]), after - across, before + up]
    return [*legs, block(kite, n, n)]


def _sixth(sheet: Sheet, divisions: Divisions) -> list[Block]:
    """Right half of the first tab and the kite from it to the centroid."""
    a, inner, outer = 1e3 * np.array(
        [sheet.root_offset, sheet.root_radius - sheet.width / 2.0, sheet.root_radius + sheet.width / 2.0]
    )
    tip = 1e3 * sheet.load_radius
    ray = np.array([_ROOT3 / 2.0, 0.5])
    middle = (np.array([a, inner]) @ ray) * ray
    n = divisions.platform
    return [
        block(np.array([(0.0, 0.0), middle, (a, inner), (0.0, inner)]), n, 2 * n),
        block([[0, inner], [a, inner], [a, outer], [0, outer]], n, divisions.across),
        block([[0, outer], [a, outer], [a, tip], [0, tip]], n, divisions.tab),
    ]

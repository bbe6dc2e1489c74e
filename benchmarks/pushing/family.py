"""Other HexFlexes that give the same linear map, and their stress: what the identified dimensions leave open."""

from collections.abc import Iterator
from dataclasses import replace
from itertools import product

import numpy as np
from scipy.optimize import least_squares

from experiments.fea import factorise
from experiments.oracles.hexflex import PIVOT, HexFlex

from ..nonlinear.cases import tab_loads
from .cases import Floats

ASSUMED = {
    "root_radius": (0.020, 0.030),
    "load_radius": (0.050, 0.070),
    "bend_angle": tuple(np.deg2rad([-100.0, -110.0, -130.0]).tolist()),
    "root_offset": (0.002, 0.008, 0.012),
}
"""One assumed dimension is changed, m and rad, and :data:`FITTED` fitted again."""

FITTED = ("length_1", "length_2", "width", "thickness")
THICKNESSES = (0.0007, 0.0008, 0.0010, 0.0012, 0.0014, 0.0017)
"""Each is given, m, and all else but the material fitted, from the one before."""

MOST_MISFIT = 1e-9
"""Largest difference of the maps over the largest of its row; what fits worse is another mechanism."""


def table() -> str:
    """Corners of ±1 N, linear finite elements."""
    rows = "".join(_row(shape) for shape in (HexFlex(), *fitting()))
    names = ("length_1", "length_2", "width", "thickness", "root_offset", "root_radius", "load_radius")
    head = " | ".join(f"{name} [mm]" for name in names)
    return (
        "### HexFlexes with one and the same linear map\n\nStress at the corners of ±1 N by linear finite elements; "
        f"the first are the default dimensions.\n\n| {head} | bend_angle [°] | stress [MPa] |\n{'|---' * 9}|\n{rows}"
    )


def fitting() -> Iterator[HexFlex]:
    """Those found with the map of the default dimensions."""
    for name, values in ASSUMED.items():
        for value in values:
            shape, misfit = fitted(replace(HexFlex(), **{name: value}), FITTED)
            if misfit < MOST_MISFIT:
                yield shape
    shape = HexFlex()
    for thickness in THICKNESSES:
        shape, misfit = fitted(replace(shape, thickness=thickness), (*FITTED[:3], *ASSUMED))
        if misfit < MOST_MISFIT:
            yield shape


def fitted(start: HexFlex, names: tuple[str, ...]) -> tuple[HexFlex, float]:
    """The dimensions called `names` fitted to the map of the default ones, and the misfit left."""
    wanted = compliance(HexFlex())
    scale = np.abs(wanted).max(axis=1, keepdims=True)

    def changed(factors: Floats) -> HexFlex:
        return replace(start, **{n: float(getattr(start, n) * f) for n, f in zip(names, factors, strict=True)})

    def misfit(factors: Floats) -> Floats:
        return ((compliance(changed(factors)) - wanted) / scale).ravel()

    found = least_squares(misfit, np.ones(len(names)), xtol=1e-12, ftol=1e-14, max_nfev=80)
    return changed(found.x), float(np.abs(found.fun).max())


def compliance(shape: HexFlex) -> Floats:
    """d pose / d force of linear finite elements, (6, 6), SI."""
    return factorise(shape.frame).solve(_loads(shape, np.eye(6))).at(PIVOT).T


def corner_stress(shape: HexFlex) -> float:
    """Largest bending stress at the corners of ±1 N, Pa."""
    corners = np.array(list(product((-1.0, 1.0), repeat=6)))
    return float(factorise(shape.frame).solve(_loads(shape, corners)).stress().bending.max())


def _loads(shape: HexFlex, forces: Floats) -> Floats:
    """Nodes keep their order whatever the dimensions."""
    if list(shape.frame.nodes) != list(HexFlex().frame.nodes):
        raise ValueError("the frame has other nodes than the default HexFlex; loads cannot be laid on it")
    return tab_loads(forces)


def _row(shape: HexFlex) -> str:
    lengths = (*FITTED, "root_offset", "root_radius", "load_radius")
    cells = [f"{1e3 * getattr(shape, name):.4g}" for name in lengths]
    return f"| {' | '.join([*cells, f'{np.rad2deg(shape.bend_angle):.1f}', f'{corner_stress(shape) / 1e6:.0f}'])} |\n"

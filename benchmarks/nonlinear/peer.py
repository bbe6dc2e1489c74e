"""Ours beside OpenSees in one process on one core: CPU time and error."""

import importlib.util
from importlib.metadata import version

import numpy as np

from experiments import oracles
from experiments.fea import factorise
from experiments.fea.varying import linear_displacements

from . import cases
from .processes import apart, cpu

MANY, FEW = 4096, 20
"""Points of ours that are timed, and of either whose error is taken."""

LOAD_CASES, VARIED = 1000, 1024
NOTE = (
    "OpenSeesPy {version}. CPU time on one core, the best of 5 runs of ours and of 3 of OpenSees. Errors are the "
    "largest over {few} random points and all responses, in standard deviations of the response: ours against ours "
    "with {fine} steps a member, OpenSees's against its own finest mesh ({mesh_flexure_3rrr} elements a flexure, "
    "{mesh_hexflex} a leg). Those two references differ by {apart_3rrr:.0e} (3-RRR) and {apart_hexflex:.0e} (HexFlex), "
    "rigid bodies of OpenSees being stiff beams. In the linear rows our error is the largest difference from OpenSees. "
    "Its models are built once and reset for every point but where dimensions vary; on the HexFlex it runs with the "
    "loosest tolerance that does not cost accuracy."
)
HEAD = "| | ours | µs | error | OpenSees | µs | error | ratio |\n|---|---|---|---|---|---|---|---|\n"


def table() -> str:
    has_peer = importlib.util.find_spec("openseespy") is not None
    flexures, about_flexures = apart(_nonlinear, "flexure_3rrr", (4,), ((16, 2), (9, 2)), 200, has_peer)
    hexflexes, about_hexflexes = apart(_nonlinear, "hexflex", (8, 4), ((16, 1), (48, 1)), 12, has_peer)
    rows = [*flexures, *hexflexes, *apart(_varying, has_peer), apart(_load_cases, has_peer)]
    if not has_peer:
        return "openseespy is not installed: without the peer there are our numbers only.\n\n" + HEAD + "".join(rows)
    finest = {f"mesh_{name}": _case(name, 1).finest[0] for name in ("flexure_3rrr", "hexflex")}
    note = NOTE.format(
        few=FEW,
        fine=cases.FINE,
        apart_3rrr=about_flexures,
        apart_hexflex=about_hexflexes,
        version=version("openseespy"),
        **finest,
    )
    return f"#### Beside OpenSees\n\n{note}\n\n{HEAD}{''.join(rows)}"


def _case(name: str, n: int) -> cases.Case:
    return cases.flexure_3rrr(n) if name == "flexure_3rrr" else cases.hexflex(n)


def _nonlinear(
    name: str, steps: tuple[int, ...], meshes: tuple[tuple[int, int], ...], n_peer: int, has_peer: bool
) -> tuple[list[str], float]:
    """Rows of the table, and how far the references are apart."""
    case = _case(name, MANY)
    fine = case.ours(cases.FINE).evaluate(case.points[:512]).values
    spread, few = fine.std(axis=0), case.points[:FEW]
    ours = []
    for n in steps:
        oracle = case.ours(n)
        error = np.abs(oracle.evaluate(few).values - fine[:FEW]).max(0) / spread
        ours.append((f"{n} steps", 1e6 * cpu(lambda o=oracle: o.evaluate(case.points)) / MANY, error.max()))
    if not has_peer:
        return [_row(case.title, o) for o in ours], np.nan
    finest, theirs = case.theirs(few, *case.finest), []
    for n, m in meshes:
        error = np.abs(case.theirs(few, n, m) - finest).max(0) / spread
        seconds = cpu(lambda n=n, m=m: case.theirs(case.points[:n_peer], n, m), 3) / n_peer
        theirs.append((f"{n} elements, {m} step{'s' * (m > 1)}", 1e6 * seconds, error.max()))
    rows = [_row(case.title, o, t) for o in ours for t in theirs]
    return rows, float((np.abs(finest - fine[:FEW]).max(0) / spread).max())


def _varying(has_peer: bool) -> list[str]:
    """Linear HexFlexes of differing dimensions; our error is the largest difference to OpenSees."""
    frame, rows, sizes = oracles.get("hexflex").frame, [], cases.sizes(VARIED)
    geometry = cases.geometry(sizes)
    for n_loads in (1, 6):
        forces = np.eye(6)[:n_loads]
        loads = cases.tab_loads(forces)
        found = linear_displacements(frame, loads, geometry, ("centroid",))[:, :, 0]
        seconds = cpu(lambda p=loads: linear_displacements(frame, p, geometry, ("centroid",)), 25)
        what = f"linear HexFlex, dimensions vary, {n_loads} load case{'s' * (n_loads > 1)}"
        ours = ("batched", 1e6 * seconds / VARIED)
        if not has_peer:
            rows.append(_row(what, (*ours, np.nan)))
            continue
        few = sizes[: VARIED // 4]
        miss = np.abs(_peer_linear(few, forces) - found[: len(few)]).max() / np.abs(found).max()
        theirs = 1e6 * cpu(lambda f=forces, s=few: _peer_linear(s, f), 3) / len(few)
        rows.append(_row(what, (*ours, miss), ("a model each", theirs, np.nan)))
    return rows


def _peer_linear(sizes: cases.Floats, forces: cases.Floats) -> cases.Floats:
    from ..opensees.hexflex import HexFlex
    from ..opensees.hexflex_linear import solve_linear
    from ..opensees.sections import Rectangle

    mechanisms = [HexFlex(l1, l2, Rectangle(width, thickness)) for l1, l2, width, thickness in sizes.tolist()]
    return solve_linear(mechanisms, np.broadcast_to(forces, (len(sizes), *forces.shape)))


def _load_cases(has_peer: bool) -> str:
    """One factorisation, many load cases; µs per load case."""
    forces = np.random.default_rng(0).uniform(-1.0, 1.0, (LOAD_CASES, 6))
    loads = cases.tab_loads(forces)
    solver = factorise(oracles.get("hexflex").frame)
    found = solver.solve(loads).at("centroid")
    ours = 1e6 * cpu(lambda: solver.solve(loads)) / LOAD_CASES
    what = f"linear HexFlex, {LOAD_CASES} load cases on one factorisation, each"
    if not has_peer:
        return _row(what, ("one solve", ours, np.nan))
    standard = cases.sizes(1, 0.0)
    miss = np.abs(_peer_linear(standard, forces)[0] - found).max() / np.abs(found).max()
    theirs = 1e6 * cpu(lambda: _peer_linear(standard, forces), 3) / LOAD_CASES
    return _row(what, ("one solve", ours, miss), ("one model", theirs, np.nan))


def _row(what: str, ours: tuple[str, float, float], theirs: tuple[str, float, float] | None = None) -> str:
    cells = [what, ours[0], f"{ours[1]:.3g}", _error(ours[2])]
    if theirs is None:
        cells += ["–"] * 4
    else:
        cells += [theirs[0], f"{theirs[1]:.4g}", _error(theirs[2]), f"{theirs[1] / ours[1]:.3g}"]
    return f"| {' | '.join(cells)} |\n"


def _error(error: float) -> str:
    return "–" if np.isnan(error) else f"{error:.0e}"

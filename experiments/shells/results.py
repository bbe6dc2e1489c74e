"""What is read off a run of CalculiX: displacements of the platform's nodes, and the pose they say.

CalculiX prints seven digits (``1PE13.6``), so a pose is good to about 1e-6 of itself.
"""

import re
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from .deck import READ

RESPONSES = ("x", "y", "z", "theta_x", "theta_y", "theta_z")
"""Names of the pose, those of the oracle ``hexflex``: m and rad."""

_HEAD = re.compile(rf"^ displacements \(vx,vy,vz\) for set {READ} and time\s+(\S+)\s*$", re.MULTILINE)


class SolverFailed(RuntimeError):
    """The solver did not arrive: the sentence says where it stopped and what to look at."""


def pose(folder: Path) -> dict[str, float]:
    """The parser for the oracle ``command``: pose of the platform after the whole load.

    Parameters
    ----------
    folder : Path
        Holds the files of :func:`~.hexflex.hexflex_files`, or one whole deck, and the ``.dat`` that ccx left there.

    Returns
    -------
    dict of str to float
        x, y, z [m] of the centroid and theta_x, theta_y, theta_z [rad]: rotation vector of the linear analysis,
        intrinsic XYZ Euler angles with large displacements.

    Raises
    ------
    SolverFailed
        If there is no result, or the load was not reached.
    """
    return dict(zip(RESPONSES, map(float, poses(folder)[-1]), strict=True))


def poses(folder: Path) -> NDArray[np.float64]:
    """Pose after each step, shape (n_steps, 6), m and rad; see :func:`pose`."""
    decks, tables = sorted(Path(folder).glob("*.inp")), sorted(Path(folder).glob("*.dat"))
    if not decks or len(tables) > 1:
        raise SolverFailed(
            f"the folder of a run must hold its *.inp and one *.dat; found {len(decks)} and {len(tables)}"
        )
    printed = tables[0].read_text(encoding="utf-8") if tables else ""
    return read_poses("".join(deck.read_text(encoding="utf-8") for deck in decks), printed)


def read_poses(deck: str, printed: str) -> NDArray[np.float64]:
    """Pose after each step from the text of a deck and of its ``.dat``, shape (n_steps, 6)."""
    if printed and not printed.endswith("\n"):
        raise SolverFailed("the .dat was cut short: its last line has no end")
    n_steps, nonlinear = len(re.findall(r"^\*STEP", deck, re.MULTILINE)), "NLGEOM" in deck
    nodes, found = coordinates(deck), displacements(printed)
    ends = [(time, table) for time, table in found if abs(time - round(time)) < 1e-9]
    if len(ends) < n_steps:
        last = f"the last time is {found[-1][0]:.4g} of {n_steps}" if found else "it printed no displacements"
        raise SolverFailed(f"CalculiX did not reach the whole load: {last}; its own output (.sta, stdout) says why")
    fit = moved if nonlinear else slightly_moved
    answers, wanted = [], _read_set(deck)
    for time, table in ends:
        if set(table) != wanted:
            raise SolverFailed(
                f"the table of time {time:g} holds {len(table)} of {len(wanted)} nodes: it was cut short"
            )
        rest = np.array([nodes[node] for node in table])
        place, angles = fit(rest, np.array(list(table.values())))
        answers.append(np.concatenate([1e-3 * place, angles]))
    return np.array(answers)


def coordinates(deck: str) -> dict[int, tuple[float, float, float]]:
    """Rest positions of the nodes, mm, from the first ``*NODE`` block of a deck."""
    body = re.search(r"^\*NODE[^\n]*\n(.*?)^\*", deck, re.MULTILINE | re.DOTALL)
    if body is None:
        raise SolverFailed("the deck has no *NODE block")
    rows = (line.split(",") for line in body[1].splitlines())
    return {int(n): (float(x), float(y), float(z)) for n, x, y, z in rows}


def _read_set(deck: str) -> set[int]:
    """Numbers of the nodes whose displacements a deck asks for."""
    body = re.search(rf"^\*NSET, NSET={READ}\n([^*]*)", deck, re.MULTILINE)
    return set(map(int, re.findall(r"\d+", body[1]))) if body else set()


def displacements(printed: str) -> list[tuple[float, Mapping[int, NDArray[np.float64]]]]:
    """Time and displacements by node, mm, of every print of the set that is read."""
    parts = _HEAD.split(printed)[1:]
    found = []
    for time, body in zip(parts[::2], parts[1::2], strict=True):
        table = {}
        for line in body.split("\n *", 1)[0].splitlines():
            cells = line.split()
            if len(cells) != 4:
                if table and cells:
                    break
                continue
            table[int(cells[0])] = np.array(cells[1:], dtype=np.float64)
        found.append((float(time), table))
    return found


def moved(
    rest: NDArray[np.float64], displacement: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Translation of the origin and intrinsic XYZ Euler angles of the rigid motion nearest to a displacement.

    Parameters
    ----------
    rest, displacement : ndarray, shape (n, 3)

    Notes
    -----
    Kabsch, W. (1976), Acta Cryst. A32, 922–923, as SciPy has it.
    """
    centre, now = rest.mean(axis=0), (rest + displacement).mean(axis=0)
    turn, _ = Rotation.align_vectors(rest + displacement - now, rest - centre)
    return now - turn.apply(centre), turn.as_euler("XYZ")


def slightly_moved(
    rest: NDArray[np.float64], displacement: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Translation of the origin and rotation vector by least squares of u = t + θ × r, the linear motion."""
    x, y, z = rest.T
    o, i = np.zeros_like(x), np.ones_like(x)
    matrix = np.concatenate(
        [
            np.column_stack([i, o, o, o, z, -y]),
            np.column_stack([o, i, o, -z, o, x]),
            np.column_stack([o, o, i, y, -x, o]),
        ]
    )
    found = np.linalg.lstsq(matrix, displacement.T.ravel(), rcond=None)[0]
    return np.asarray(found[:3], dtype=np.float64), np.asarray(found[3:], dtype=np.float64)

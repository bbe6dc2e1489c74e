"""Load cases and prescribed motions as arrays, and the refusals of bad ones."""

from collections.abc import Iterable

import numpy as np
from jax.typing import ArrayLike
from numpy.typing import NDArray

from .model import MOTIONS, Frame, Load, Motion


def load_array(frame: Frame, cases: Iterable[Iterable[Load]]) -> NDArray[np.float64]:
    """Load cases as an array, shape (n_cases, n_nodes, 6), N and N m; loads on the same node add up.

    Raises
    ------
    ValueError
        If a load names an unknown node.
    """
    cases = [tuple(case) for case in cases]
    loads = np.zeros((len(cases), len(frame.nodes), 6))
    for row, case in zip(loads, cases, strict=True):
        for load in case:
            row[frame.index(load.node)] += (*load.force, *load.moment)
    return loads


def motion_array(frame: Frame, cases: Iterable[Iterable[Motion]]) -> NDArray[np.float64]:
    """Prescribed motions as an array, shape (n_cases, n_nodes, 6), m and rad.

    Raises
    ------
    ValueError
        If a motion names an unknown node, or one case has two of the same node: large rotations do not add up.
    """
    cases = [tuple(case) for case in cases]
    motions = np.zeros((len(cases), len(frame.nodes), 6))
    for number, case in enumerate(cases):
        names = [motion.node for motion in case]
        for motion in case:
            if names.count(motion.node) > 1:
                raise ValueError(f"motion case {number} moves node {motion.node!r} twice: give it one motion")
            motions[number, frame.index(motion.node)] = (*motion.translation, *motion.rotation)
    return motions


def checked(what: str, frame: Frame, values: ArrayLike) -> NDArray[np.float64]:
    """Loads or motions as float64; ``ValueError`` if their shape is another or one is not finite."""
    values = np.array(values, dtype=np.float64)
    if values.ndim != 3 or values.shape[1:] != (len(frame.nodes), 6):
        raise ValueError(shape_sentence(what, frame, values.shape))
    bad = np.argwhere(~np.isfinite(values))
    if bad.size:
        case, node, _ = bad[0]
        of = {"loads": "load case {} on", "motions": "motion case {} of"}[what].format(case)
        raise ValueError(f"{of} node {frame.node_names[node]!r} is not finite: give finite {what}")
    return values


def checked_motions(frame: Frame, motions: ArrayLike, n_cases: int) -> NDArray[np.float64]:
    """Prescribed motions as float64; ``ValueError`` if one is not finite or no support holds it."""
    motions = checked("motions", frame, motions)
    if len(motions) != n_cases:
        raise ValueError(f"there are {n_cases} load cases and {len(motions)} motion cases: give as many of both")
    held = np.zeros(motions.shape[1:], dtype=bool)
    for support in frame.supports:
        held[frame.index(support.node)] = support.held
    bad = np.argwhere((motions != 0) & ~held)
    if bad.size:
        case, node, motion = bad[0]
        name = frame.node_names[node]
        why = "a clamp keeps at rest: make it a support" if name in frame.clamps else "no support holds: support it"
        raise ValueError(
            f"motion case {case} moves node {name!r} in {MOTIONS[motion]!r}, which {why} that holds "
            f"{MOTIONS[motion]!r}, or leave this motion zero"
        )
    return motions


def shape_sentence(what: str, frame: Frame, shape: tuple[int, ...]) -> str:
    """What is wrong with the shape of loads or motions."""
    each = {"loads": "three forces and three moments", "motions": "three translations and three rotations"}[what]
    return f"{what} must have shape (n_cases, {len(frame.nodes)}, 6), {each} a node; got shape {shape}"

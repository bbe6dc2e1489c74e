"""Frames that nothing holds, or that float64 cannot tell from such.

Members join rigidly and every stiffness of a section is positive, so a member without strain energy
moves with its two nodes as one rigid body. A frame is therefore a mechanism if and only if one of its
connected parts has no clamp: a question about the graph, answered exactly, whatever the scale and
however slender the members. What remains for the numbers is a stiffness too uneven for float64.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from .arrays import FrameArrays
from .model import Frame

RESOLVED = 1e-13  # reciprocal condition below which float64 keeps fewer than about three digits


def check_held(frame: Frame, arrays: FrameArrays) -> None:
    """Raise ``ValueError`` if a connected part of `frame` has no clamp and so is free to move."""
    if not frame.clamps:
        raise ValueError(
            f"nothing is clamped, so node {frame.node_names[0]!r} and all others are free to translate and "
            "rotate: clamp at least one node"
        )
    first, second = arrays.block[arrays.ends].T
    links = coo_array((np.ones(len(first)), (first, second)), shape=(arrays.n_blocks, arrays.n_blocks))
    part = connected_components(links, directed=False)[1][arrays.block]
    held = part[[frame.index(n) for n in frame.clamps]]
    loose = np.flatnonzero(~np.isin(part, held))
    if loose.size:
        node = frame.node_names[loose[0]]
        raise ValueError(
            f"node {node!r} is free to translate and rotate, because no members join it to a clamp: "
            "clamp a node of its part or join the part to the rest"
        )


def check_finite(reduced: NDArray[np.float64]) -> None:
    """Raise ``ValueError`` unless the reduced stiffness is finite with a positive diagonal."""
    if not (np.isfinite(reduced).all() and np.all(np.diag(reduced) > 0)):
        raise ValueError(
            "the stiffness of the frame is outside the range of float64: check the units, which are m and Pa"
        )


def check_resolved(
    frame: Frame,
    condition: float,
    scaled: NDArray[np.float64],
    scale: NDArray[np.float64],
    kinematics: NDArray[np.float64],
) -> None:
    """Raise ``ValueError`` if float64 cannot tell the stiffness from that of a mechanism.

    Parameters
    ----------
    frame : Frame
    condition : float
        Reciprocal condition of `scaled`.
    scaled : ndarray, shape (n, n)
        Reduced stiffness with unit diagonal, D K D.
    scale : ndarray, shape (n,)
        Diagonal of D.
    kinematics : ndarray, shape (6 n_nodes, n)
    """
    if condition > RESOLVED:
        return
    mode = np.linalg.eigh(scaled)[1][:, 0]
    motion = (kinematics @ (scale * mode)).reshape(-1, 2, 3)
    size = np.ptp(np.array(list(frame.nodes.values())), axis=0).max()
    translates = np.abs(motion[:, 0]).max() > 1e-6 * size * np.abs(motion[:, 1]).max()
    part = np.abs(motion[:, 0 if translates else 1])
    node, axis = np.unravel_index(np.argmax(part), part.shape)
    way = f"{'translate along' if translates else 'rotate about'} {'xyz'[axis]}"
    raise ValueError(
        f"node {frame.node_names[node]!r} is almost free to {way}, beside stiffnesses so high that float64 "
        f"cannot resolve it (reciprocal condition {condition:.0e}): make the stiffest members a rigid body"
    )

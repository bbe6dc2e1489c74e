"""Frames that nothing holds, or that float64 cannot tell from such.

Members join rigidly and every stiffness of a section is positive, so a member without strain energy
moves with its two nodes as one rigid body. A frame is therefore a mechanism if and only if one of its
connected parts can move as a rigid body. With a clamp it cannot: a question about the graph, answered
exactly, whatever the scale and however slender the members. Without one it cannot if the motions that
its supports hold have rank six on its rigid motions. What remains for the numbers is a stiffness too
uneven for float64.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from .arrays import FrameArrays
from .model import Frame

RESOLVED = 1e-13  # reciprocal condition below which float64 keeps fewer than about three digits
RANK = RESOLVED**0.5  # lever beside the size of a part, whose square is the stiffness that it gives


def check_held(frame: Frame, arrays: FrameArrays) -> None:
    """Raise ``ValueError`` if a connected part of `frame` is free to move as a rigid body."""
    if not frame.clamps and not frame.supports:
        raise ValueError(
            f"nothing is clamped, so node {frame.node_names[0]!r} and all others are free to translate and "
            "rotate: clamp at least one node"
        )
    first, second = arrays.block[arrays.ends].T
    links = coo_array((np.ones(len(first)), (first, second)), shape=(arrays.n_blocks, arrays.n_blocks))
    part = connected_components(links, directed=False)[1][arrays.block]
    clamped = part[[frame.index(n) for n in frame.clamps]]
    for loose in np.unique(part[~np.isin(part, clamped)]):
        _check_supported(frame, arrays, np.flatnonzero(part == loose))


def _check_supported(frame: Frame, arrays: FrameArrays, nodes: NDArray[np.int64]) -> None:
    """Raise ``ValueError`` unless the supports among the `nodes` of a part leave it no rigid motion."""
    supports = [(frame.index(s.node), s.held) for s in frame.supports if frame.index(s.node) in nodes]
    if not supports:
        raise ValueError(
            f"node {frame.node_names[nodes[0]]!r} is free to translate and rotate, because no members join it to a "
            "clamp: clamp a node of its part or join the part to the rest"
        )
    centre = arrays.coordinates[[node for node, _ in supports]].mean(axis=0)
    size = np.ptp(arrays.coordinates[nodes], axis=0).max() or 1.0
    moved = np.stack([_rigid_motion((x - centre) / size) for x in arrays.coordinates])
    held = np.concatenate([moved[node][list(held)] for node, held in supports])
    motions = _null_space(held)
    if not motions.size:
        return
    translations = _null_space(held[:, :3])
    if translations.size:
        way, axis = "translate along", _axis(translations)
        motion = np.r_[axis, np.zeros(3)]
    else:
        way, axis = "rotate about", _axis(motions[3:])
        motion = motions @ np.linalg.pinv(motions[3:]) @ axis
    node = nodes[np.argmax(np.round(np.linalg.norm(moved[nodes, :3] @ motion, axis=1), 9))]
    raise ValueError(
        f"node {frame.node_names[node]!r} is free to {way} {_direction(axis)}, because the supports of its part leave "
        "it that motion: let them hold more motions, or clamp a node"
    )


def _rigid_motion(arm: NDArray[np.float64]) -> NDArray[np.float64]:
    """Motion at `arm` from the centre per translation and rotation of a part, all over its size; (6, 6)."""
    x, y, z = arm
    motion = np.eye(6)
    motion[:3, 3:] = [[0, z, -y], [-z, 0, x], [y, -x, 0]]
    return motion


def _null_space(rows: NDArray[np.float64]) -> NDArray[np.float64]:
    """Orthonormal motions, as columns, at which `rows` are zero beside RANK."""
    padded = np.concatenate([rows, np.zeros((rows.shape[1], rows.shape[1]))])
    _, values, motions = np.linalg.svd(padded, full_matrices=False)
    return motions[values <= RANK].T


def _axis(directions: NDArray[np.float64]) -> NDArray[np.float64]:
    """The unit vector in the span of `directions`, shape (3, n), that is nearest to a global axis."""
    basis, values, _ = np.linalg.svd(directions, full_matrices=False)
    basis = basis[:, values > RANK]
    near = basis @ basis.T
    column = near[:, np.argmax(np.round(np.diag(near), 9))]
    return column / np.linalg.norm(column)


def _direction(axis: NDArray[np.float64]) -> str:
    """The name of a global axis, or the components of another one."""
    largest = np.argmax(np.abs(axis))
    if np.abs(axis[largest]) > 1 - 1e-9:
        return "xyz"[largest]
    return f"({', '.join(f'{part:.3g}' for part in axis + 0.0)})"


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

"""A frame as arrays: coordinates and properties apart from the topology that joins them."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .elements import Properties
from .model import Frame, Member

NEAR_VERTICAL = np.sin(np.radians(1.0))


@dataclass(frozen=True, eq=False)
class FrameArrays:
    """What the pure functions of :mod:`.assembly` take.

    Nodes that move as one form a block with six unknowns, those of its master: a free node's own, a
    rigid body's reference, or the clamped node. Free blocks come first, then one block a clamp, in
    the order of ``frame.clamps``.

    Parameters
    ----------
    coordinates : ndarray, shape (n_nodes, 3)
        m.
    ends : ndarray of int, shape (n_members, 2)
        Start and end node of each member.
    up : ndarray, shape (n_members, 3)
        Direction whose part normal to the member is local z.
    properties : Properties
        Arrays of shape (n_members,).
    master : ndarray of int, shape (n_nodes,)
        Node whose motion each node follows.
    block : ndarray of int, shape (n_nodes,)
        Block that each node belongs to.
    n_free, n_blocks : int
        Number of free blocks and of all.
    """

    coordinates: NDArray[np.float64]
    ends: NDArray[np.int64]
    up: NDArray[np.float64]
    properties: Properties
    master: NDArray[np.int64]
    block: NDArray[np.int64]
    n_free: int
    n_blocks: int


def frame_arrays(frame: Frame) -> FrameArrays:
    """The arrays of `frame`."""
    index = {name: i for i, name in enumerate(frame.nodes)}
    coordinates = np.array(list(frame.nodes.values()))
    ends = np.array([(index[m.start], index[m.end]) for m in frame.members])
    up = np.array([_up(frame, member) for member in frame.members])

    master = np.arange(len(index))
    for body in frame.bodies:
        clamped = [n for n in body.all_nodes if n in frame.clamps]
        master[[index[n] for n in body.all_nodes]] = index[(clamped or [body.reference])[0]]
    clamps = [index[n] for n in frame.clamps]
    free = [i for i in np.unique(master).tolist() if i not in clamps]
    block_of = {i: block for block, i in enumerate([*free, *clamps])}
    block = np.array([block_of[i] for i in master.tolist()])
    return FrameArrays(coordinates, ends, up, _properties(frame), master, block, len(free), len(free) + len(clamps))


def _properties(frame: Frame) -> Properties:
    rows = [
        (
            m.material.young,
            m.material.shear,
            m.section.area,
            m.section.second_moment_y,
            m.section.second_moment_z,
            m.section.torsion_constant,
            m.section.shear_area_y,
            m.section.shear_area_z,
        )
        for m in frame.members
    ]
    return Properties(*np.array(rows, dtype=np.float64).T)


def _up(frame: Frame, member: Member) -> NDArray[np.float64]:
    """The member's own `up`, or global z, or global y where the member is within one degree of z."""
    if member.up is not None:
        return np.array(member.up)
    along = np.subtract(frame.nodes[member.end], frame.nodes[member.start])
    near_vertical = np.hypot(along[0], along[1]) <= NEAR_VERTICAL * np.linalg.norm(along)
    return np.array([0.0, 1.0, 0.0] if near_vertical else [0.0, 0.0, 1.0])

"""A frame as arrays: coordinates and properties apart from the topology that joins them."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .elements import Properties
from .model import Frame, Member
from .shapes import arc_normal, shapes

NEAR_VERTICAL = np.sin(np.radians(1.0))


@dataclass(frozen=True, eq=False)
class FrameArrays:
    """What the pure functions of :mod:`.assembly` take.

    Nodes that move as one form a block with six unknowns, those of its master: a free node's own, a
    rigid body's reference, or the clamped or supported node. Free blocks come first, those of supports
    among them, then one block a clamp, in the order of ``frame.clamps``.

    Parameters
    ----------
    coordinates : ndarray, shape (n_nodes, 3)
        m.
    ends : ndarray of int, shape (n_members, 2)
        Start and end node of each member.
    up : ndarray, shape (n_members, 3)
        Direction whose part normal to the member is local z.
    through : ndarray, shape (n_members, 3)
        A point of each member between its ends, m; the middle of the chord if it is straight.
    lengths : ndarray, shape (n_members,)
        Along the member, m.
    axes : ndarray, shape (n_members, 3, 3)
        Local x, y and z at the start of each member, as rows.
    bends : ndarray, shape (n_members, 3)
        Rotation vector of the section from start to end, in local axes; zero for straight members.
    properties : Properties
        Arrays of shape (n_members,).
    master : ndarray of int, shape (n_nodes,)
        Node whose motion each node follows.
    block : ndarray of int, shape (n_nodes,)
        Block that each node belongs to.
    n_free, n_blocks : int
        Number of free blocks and of all.
    held : ndarray of bool, shape (n_blocks, 6)
        Motions that a support or clamp holds.
    """

    coordinates: NDArray[np.float64]
    ends: NDArray[np.int64]
    up: NDArray[np.float64]
    through: NDArray[np.float64]
    lengths: NDArray[np.float64]
    axes: NDArray[np.float64]
    bends: NDArray[np.float64]
    properties: Properties
    master: NDArray[np.int64]
    block: NDArray[np.int64]
    n_free: int
    n_blocks: int
    held: NDArray[np.bool_]

    @property
    def is_curved(self) -> NDArray[np.bool_]:
        """Which members are arcs, shape (n_members,)."""
        return np.asarray(self.bends.any(axis=1))


def frame_arrays(frame: Frame) -> FrameArrays:
    """The arrays of `frame`."""
    index = {name: i for i, name in enumerate(frame.nodes)}
    coordinates = np.array(list(frame.nodes.values()))
    ends = np.array([(index[m.start], index[m.end]) for m in frame.members])
    up = np.array([_up(frame, member) for member in frame.members])

    through = np.array([_through(frame, member) for member in frame.members])
    lengths, axes, bends = shapes(np, coordinates[ends[:, 0]].T, coordinates[ends[:, 1]].T, through.T, up.T)

    fixed = {*frame.clamps, *(s.node for s in frame.supports)}
    master = np.arange(len(index))
    for body in frame.bodies:
        held = [n for n in body.all_nodes if n in fixed]
        master[[index[n] for n in body.all_nodes]] = index[(held or [body.reference])[0]]
    clamps = [index[n] for n in frame.clamps]
    free = [i for i in np.unique(master).tolist() if i not in clamps]
    block_of = {i: block for block, i in enumerate([*free, *clamps])}
    block = np.array([block_of[i] for i in master.tolist()])
    held = np.array([[False] * 6] * len(free) + [[True] * 6] * len(clamps)).reshape(-1, 6)
    for support in frame.supports:
        held[block[index[support.node]]] = support.held
    return FrameArrays(
        coordinates,
        ends,
        up,
        through,
        lengths,
        axes.transpose(2, 0, 1),
        bends.T,
        _properties(frame),
        master,
        block,
        len(free),
        len(free) + len(clamps),
        held,
    )


def _through(frame: Frame, member: Member) -> NDArray[np.float64]:
    """A point that the member runs through: the middle of its chord, if it is straight."""
    if member.through is not None:
        return np.array(member.through)
    return np.add(frame.nodes[member.start], frame.nodes[member.end]) / 2


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
    """The member's own `up`, or global z, or global y where the member is within one degree of z.

    For an arc the normal of its plane, on the side of global z, y or x, whichever it leans to first.
    """
    if member.up is not None:
        return np.array(member.up)
    if member.through is not None:
        normal = arc_normal(frame.nodes[member.start], member.through, frame.nodes[member.end])
        normal /= np.linalg.norm(normal)
        leaning = next(part for part in normal[::-1] if abs(part) > NEAR_VERTICAL)
        return normal * np.sign(leaning)
    along = np.subtract(frame.nodes[member.end], frame.nodes[member.start])
    near_vertical = np.hypot(along[0], along[1]) <= NEAR_VERTICAL * np.linalg.norm(along)
    return np.array([0.0, 1.0, 0.0] if near_vertical else [0.0, 0.0, 1.0])

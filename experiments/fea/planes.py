"""Which frames move in a plane, and which supports make sense where rotations are large."""

import numpy as np

from .arrays import FrameArrays
from .mechanisms import check_held
from .model import Frame, Support

FLAT = 1e-9  # of the size of the frame, or as a sine


def check_planar(frame: Frame, arrays: FrameArrays) -> None:
    """Raise ``ValueError`` unless `frame` lies in a plane of constant z, has its local z upright, and is held."""
    heights = np.concatenate([arrays.coordinates[:, 2], arrays.through[:, 2]])
    size = np.ptp(arrays.coordinates, axis=0).max()
    if np.ptp(heights) > FLAT * size:
        node = frame.node_names[int(np.abs(arrays.coordinates[:, 2] - arrays.coordinates[0, 2]).argmax())]
        raise ValueError(
            f"a planar frame needs the same z for all nodes and arcs; node {node!r} has z = {frame.nodes[node][2]} "
            f"and node {frame.node_names[0]!r} has {arrays.coordinates[0, 2]}"
        )
    for member, axes in zip(frame.members, arrays.axes, strict=True):
        if axes[2, 2] < 1 - FLAT:
            raise ValueError(f"a planar frame needs local z along global z; give member {member.name!r} up = (0, 0, 1)")
    check_held(_held_in_plane(frame), arrays)


def check_rotations(frame: Frame) -> None:
    """Raise ``ValueError`` if a support holds one or two rotations of a node that may turn about the others."""
    for support in frame.supports:
        if sum(support.held[3:]) in (1, 2):
            raise ValueError(
                f"the support at node {support.node!r} holds {', '.join(m for m in support.motions if m[0] == 'r')} "
                "and not the other rotations: in space hold all three or none, or condense the frame as planar"
            )


def _held_in_plane(frame: Frame) -> Frame:
    """`frame` with supports that also hold what leads out of the plane."""
    out_of_plane = ("z", "rx", "ry")
    supports = [Support(s.node, tuple(dict.fromkeys((*s.motions, *out_of_plane)))) for s in frame.supports]
    return Frame(dict(frame.nodes), frame.members, frame.bodies, frame.clamps, tuple(supports))

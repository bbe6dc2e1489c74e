"""Step 2: the forces of each module, against the order of the generation principle.

A flexure passes its tip force F, acting at the equivalent joint, and its tip moment M to the link in which
it is clamped, and −F, −M to the other. Wrenches are taken about the global origin.
Source: thesis, 1.1.4.3, step 2, eq. 1.4.
"""

from collections.abc import Sequence

import numpy as np

from .batch import solve_each
from .kinematics import Poses
from .layout import Group, Layout

Wrench = tuple[int, np.ndarray, complex, np.ndarray]


def modular_statics(
    lay: Layout, poses: Poses, moments: np.ndarray, loads: Sequence[Wrench]
) -> tuple[np.ndarray, np.ndarray]:
    """Joint forces and driving torques.

    Parameters
    ----------
    lay : Layout
    poses : Poses
    moments : numpy.ndarray, shape (n_points, n_flexures)
        Tip moments M of the flexures, N m.
    loads : sequence of (link, force, point, moment)
        As from :func:`.layout.wrenches`.

    Returns
    -------
    forces : numpy.ndarray of complex, shape (n_points, n_flexures)
        Tip force of each flexure in global axes, N.
    torques : numpy.ndarray, shape (n_points, n_drivers)
        N m; the moment M of the driving link's own flexure is in them.
    """
    push, spin = _external(poses, loads)
    forces, torques = np.zeros(moments.shape, complex), []
    for group in reversed(lay.groups):
        for joint in group.joints:  # moments first: they are known
            spin[:, lay.clamped[joint]] += moments[:, joint]
            spin[:, lay.jointed[joint]] -= moments[:, joint]
        found = (_driver if group.kind == "driver" else _assur)(lay, poses, group, push, spin)
        for joint, force in zip(group.joints, found.T, strict=True):
            forces[:, joint] = force
            about = cross(poses.joints[:, joint], force)
            for link, sign in ((lay.clamped[joint], 1), (lay.jointed[joint], -1)):
                push[:, link] += sign * force
                spin[:, link] += sign * about
        if group.kind == "driver":
            link, joint = group.links[0], group.outer[0]
            torques.append(-spin[:, link])  # all the rest of the link's balance
            spin[:, lay.clamped[joint] + lay.jointed[joint] - link] -= torques[-1]
    return forces, np.stack(torques[::-1], axis=1) if torques else np.zeros((len(moments), 0))


def cross(arm: np.ndarray, force: np.ndarray) -> np.ndarray:
    """Moment of a force, both as complex numbers."""
    return np.imag(np.conj(arm) * force)


def _external(poses: Poses, loads: Sequence[Wrench]) -> tuple[np.ndarray, np.ndarray]:
    """Force and moment about the origin on each link, (n_points, n_links) each."""
    push, spin = np.zeros(poses.shift.shape, complex), np.zeros(poses.turn.shape)
    for link, force, point, moment in loads:
        push[:, link] += force
        spin[:, link] += cross(poses.place(link, point), force) + moment
    return push, spin


def _driver(lay: Layout, poses: Poses, group: Group, push, spin) -> np.ndarray:
    """Force on the tip of the one flexure, (n_points, 1): it carries all that pushes the link."""
    link = group.links[0]
    sign = 1 if lay.clamped[group.outer[0]] == link else -1
    return -sign * push[:, [link]]


def _assur(lay: Layout, poses: Poses, group: Group, push, spin) -> np.ndarray:
    """Joint forces (n_points, n_joints) from the equilibrium of each link, moments about its first joint."""
    joints = group.joints
    size = np.abs(lay.joint - lay.joint.mean()).max()  # brings moments to the scale of forces
    matrix = np.zeros((len(push), 3 * len(group.links), 2 * len(joints)))
    side = np.zeros(matrix.shape[:2])
    for row, link in enumerate(group.links):
        here = [k for k, j in enumerate(joints) if link in (lay.clamped[j], lay.jointed[j])]
        origin = poses.joints[:, joints[here[0]]]
        for k in here:
            sign = 1 if lay.clamped[joints[k]] == link else -1
            arm = (poses.joints[:, joints[k]] - origin) / size
            matrix[:, 3 * row, 2 * k] = matrix[:, 3 * row + 1, 2 * k + 1] = sign
            matrix[:, 3 * row + 2, 2 * k] = -sign * arm.imag
            matrix[:, 3 * row + 2, 2 * k + 1] = sign * arm.real
        side[:, 3 * row], side[:, 3 * row + 1] = -push[:, link].real, -push[:, link].imag
        side[:, 3 * row + 2] = -(spin[:, link] - cross(origin, push[:, link])) / size
    found = solve_each(matrix, side)
    return found[:, ::2] + 1j * found[:, 1::2]

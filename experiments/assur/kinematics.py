"""Step 1: the position of each module of the rigid equivalent, in the order of the generation principle.

The flexures' tips enter as given: they shape the links of the rigid equivalent. Arrays have the points
first. Source: thesis, 1.1.4.3, step 1, eq. 1.1–1.3.
"""

from dataclasses import dataclass

import numpy as np

from .batch import solve_each
from .layout import Group, Layout, lines

MAX_NEWTON = 30
LONGEST_TURN = 0.3  # rad; a longer Newton step of a platform is shortened, lest it leaps to another assembly mode


@dataclass(frozen=True, eq=False)
class Poses:
    """Where the links and the equivalent joints are.

    Parameters
    ----------
    shift : numpy.ndarray of complex, shape (n_points, n_links)
        d of each link, m.
    turn : numpy.ndarray, shape (n_points, n_links)
        ψ of each link, rotation from rest, rad.
    joints : numpy.ndarray of complex, shape (n_points, n_flexures)
        The equivalent joints in global axes, m.
    gap : numpy.ndarray, shape (n_points, n_groups)
        By how much each module does not close, m.
    kept : numpy.ndarray of bool, shape (n_points, n_groups)
        Whether each module is in the assembly mode that it has at rest.
    """

    shift: np.ndarray
    turn: np.ndarray
    joints: np.ndarray
    gap: np.ndarray
    kept: np.ndarray

    def place(self, link: int, point: complex | np.ndarray) -> np.ndarray:
        """Global place of a point given by its place at rest on `link`, shape (n_points,)."""
        return self.shift[:, link] + np.exp(1j * self.turn[:, link]) * point


def rest_poses(lay: Layout, n_points: int) -> Poses:
    """The mechanism at rest, `n_points` times."""
    n_links = 1 + sum(len(group.links) for group in lay.groups)
    shift, turn = np.zeros((n_points, n_links), complex), np.zeros((n_points, n_links))
    gap = np.zeros((n_points, len(lay.groups)))
    return Poses(shift, turn, np.tile(lay.joint, (n_points, 1)), gap, gap == 0)


def modular_kinematics(lay: Layout, tips: np.ndarray, angles: np.ndarray, before: Poses) -> Poses:
    """Solve the position problems one after the other.

    Parameters
    ----------
    lay : Layout
    tips : numpy.ndarray of complex, shape (n_points, n_flexures)
        u + i v of each flexure in its own axes, m.
    angles : numpy.ndarray, shape (n_points, n_drivers)
        Rotations of the driving links from rest, rad.
    before : Poses
        Where numerical position problems start.
    """
    now = rest_poses(lay, len(tips))
    bent = lay.clamp + lay.direction * tips  # the joints as seen from the links that clamp the flexures
    drivers = iter(angles.T)
    for index, group in enumerate(lay.groups):
        anchors = [_from_earlier(lay, now, bent, group, joint) for joint in group.outer]
        if group.kind == "driver":
            parent = lay.clamped[group.outer[0]] + lay.jointed[group.outer[0]] - group.links[0]
            turn = now.turn[:, parent] + next(drivers)
            _put(now, group.links[0], turn, anchors[0], _in_link(lay, bent, group.outer[0], group.links[0]))
        elif group.kind == "dyad":
            _place_dyad(lay, now, bent, group, anchors, index)
        else:
            _place_triad(lay, now, bent, group, anchors, index, before)
        for joint, anchor in zip(group.outer, anchors, strict=True):
            now.joints[:, joint] = anchor
        for joint in group.inner:
            now.joints[:, joint] = now.place(lay.clamped[joint], bent[:, joint])
    return now


def flexure_rotations(lay: Layout, poses: Poses) -> np.ndarray:
    """Θ of each flexure, eq. 1.3: how far its joint's link turns from its clamp's, (n_points, n_flexures), rad."""
    return poses.turn[:, lay.jointed] - poses.turn[:, lay.clamped]


def _in_link(lay: Layout, bent: np.ndarray, joint: int, link: int) -> np.ndarray:
    """Body coordinates of an equivalent joint in one of its two links, shape (n_points,)."""
    return bent[:, joint] if lay.clamped[joint] == link else np.full(len(bent), lay.joint[joint])


def _from_earlier(lay: Layout, now: Poses, bent: np.ndarray, group: Group, joint: int) -> np.ndarray:
    """Global place of an outer joint, found from the link that the group hangs on."""
    ends = lay.clamped[joint], lay.jointed[joint]
    parent = ends[1] if ends[0] in group.links else ends[0]
    return now.place(parent, _in_link(lay, bent, joint, parent))


def _put(now: Poses, link: int, turn: np.ndarray, place: np.ndarray, point: np.ndarray) -> None:
    """Set the pose of `link` so that it is turned by `turn` and its `point` lies at `place`."""
    now.turn[:, link] = turn
    now.shift[:, link] = place - np.exp(1j * turn) * point


def _place_dyad(lay: Layout, now: Poses, bent: np.ndarray, group: Group, anchors: list, index: int) -> None:
    """Intersect the circles that the arms describe about their outer joints, on the side kept from rest."""
    arms = [
        _in_link(lay, bent, group.inner[0], link) - _in_link(lay, bent, joint, link)
        for link, joint in zip(group.links, group.outer, strict=True)
    ]
    base = anchors[1] - anchors[0]
    along, height2 = _triangle(base, np.abs(arms[0]), np.abs(arms[1]))
    top = anchors[0] + base * (along + 1j * group.mode * np.sqrt(np.maximum(height2, 0)))
    for link, joint, arm, anchor in zip(group.links, group.outer, arms, anchors, strict=True):
        _put(now, link, np.angle((top - anchor) / arm), anchor, _in_link(lay, bent, joint, link))
    tops = [now.place(link, _in_link(lay, bent, group.inner[0], link)) for link in group.links]
    now.gap[:, index] = np.abs(tops[0] - tops[1])


def _triangle(base: np.ndarray, first: np.ndarray, second: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Foot and squared height over the base of a triangle with the other sides given, both over the base."""
    base2 = np.maximum(np.abs(base) ** 2, np.finfo(float).tiny)
    along = (1 + (first**2 - second**2) / base2) / 2
    return along, first**2 / base2 - along**2


def _place_triad(lay, now: Poses, bent, group: Group, anchors: list, index: int, before: Poses) -> None:
    """Newton's iteration on the platform's pose until each leg has its length; then the legs."""
    *legs, platform = group.links
    anchor = np.stack(anchors, axis=1)
    arms = np.stack(
        [
            _in_link(lay, bent, inner, leg) - _in_link(lay, bent, outer, leg)
            for leg, outer, inner in zip(legs, group.outer, group.inner, strict=True)
        ],
        axis=1,
    )
    corners = np.stack([_in_link(lay, bent, inner, platform) for inner in group.inner], axis=1)
    turn, place = _close_triad(corners, anchor, np.abs(arms), before.turn[:, platform], before.shift[:, platform])
    now.turn[:, platform], now.shift[:, platform] = turn, place
    tops = place[:, None] + np.exp(1j * turn)[:, None] * corners
    for k, (leg, outer) in enumerate(zip(legs, group.outer, strict=True)):
        angle = np.angle((tops[:, k] - anchor[:, k]) / arms[:, k])
        _put(now, leg, angle, anchor[:, k], _in_link(lay, bent, outer, leg))
    now.gap[:, index] = np.abs(np.abs(tops - anchor) - np.abs(arms)).max(axis=1)
    now.kept[:, index] = np.sign(np.linalg.det(lines(tops, anchor))) == group.mode


def _close_triad(corners, anchor, reach, turn, shift) -> tuple[np.ndarray, np.ndarray]:
    """Pose (ψ, d) at which the corners (n, 3) of a body are at distance `reach` from the anchors."""
    turn, shift = turn.copy(), shift.copy()
    size = np.abs(corners - corners.mean(axis=1, keepdims=True)).max(axis=1) + reach.max(axis=1)
    todo = np.arange(len(turn))
    for _ in range(MAX_NEWTON):
        tops = shift[todo, None] + np.exp(1j * turn[todo])[:, None] * corners[todo]
        centre = tops.mean(axis=1)
        excess = (np.abs(tops - anchor[todo]) ** 2 - reach[todo] ** 2) / 2
        step = solve_each(lines(tops, anchor[todo]), -excess)
        factor = np.minimum(1, LONGEST_TURN / np.maximum(_relative(step, size[todo]), 1e-300))
        move = factor * (step[:, 0] + 1j * step[:, 1])
        spin = factor * step[:, 2]
        shift[todo] = centre + move + np.exp(1j * spin) * (shift[todo] - centre)
        turn[todo] += spin
        left = ~(_relative(step, size[todo]) < 1e-9) & np.isfinite(spin)
        todo = todo[left]
        if not len(todo):
            break
    return turn, shift


def _relative(step: np.ndarray, size: np.ndarray) -> np.ndarray:
    """Largest turn or move over the size of the group."""
    return np.maximum(np.abs(step[:, 2]), np.hypot(step[:, 0], step[:, 1]) / size)

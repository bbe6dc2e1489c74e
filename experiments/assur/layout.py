"""A mechanism as arrays: indices, body coordinates, stiffnesses.

Points of the plane are complex numbers x + i y. A link's pose is (d, ψ): what lies at p at rest lies at
d + p e^(iψ). So body coordinates are the global coordinates at rest.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .groups import Dyad, Mechanism, Module, Triad
from .model import Flexure, Load


@dataclass(frozen=True, eq=False)
class Group:
    """One module by indices.

    Parameters
    ----------
    kind : {"driver", "dyad", "triad"}
    links : tuple of int
        Its arms, then the platform of a triad.
    outer : tuple of int
        The flexure by which each arm hangs on an earlier link.
    inner : tuple of int
        The flexures inside: none; one; one for each leg.
    mode : float
        Sign of the assembly mode at rest.
    """

    kind: str
    links: tuple[int, ...]
    outer: tuple[int, ...]
    inner: tuple[int, ...]
    mode: float

    @property
    def joints(self) -> tuple[int, ...]:
        """All its flexures, outer ones first."""
        return self.outer + self.inner


@dataclass(frozen=True, eq=False)
class Layout:
    """A mechanism as arrays over its n_flexures flexures.

    Parameters
    ----------
    names : tuple of str
        Of the groups, for messages.
    groups : tuple of Group
    clamped, jointed : numpy.ndarray of int, shape (n_flexures,)
        The link in which the flexure is clamped, and the one with the equivalent joint.
    clamp, joint : numpy.ndarray of complex, shape (n_flexures,)
        Body coordinates of the two edges, m.
    direction : numpy.ndarray of complex, shape (n_flexures,)
        Unit vector from clamp to joint at rest.
    length, bending, axial : numpy.ndarray, shape (n_flexures,)
        m, E I in N m², E A in N.
    """

    names: tuple[str, ...]
    groups: tuple[Group, ...]
    clamped: np.ndarray
    jointed: np.ndarray
    clamp: np.ndarray
    joint: np.ndarray
    direction: np.ndarray
    length: np.ndarray
    bending: np.ndarray
    axial: np.ndarray


def layout(mechanism: Mechanism) -> Layout:
    """The arrays of `mechanism`."""
    links, flexures = mechanism.links, mechanism.flexures
    clamp, joint = (np.array([complex(*f.edges[i]) for f in flexures]) for i in (0, 1))
    length = np.abs(joint - clamp)
    earlier, groups = [links[0]], []
    for module in mechanism.modules:
        groups.append(_group(mechanism, module, earlier, joint))
        earlier += module.links
    return Layout(
        names=tuple(f"{type(m).__name__} {', '.join(m.links)}" for m in mechanism.modules),
        groups=tuple(groups),
        clamped=np.array([links.index(f.links[0]) for f in flexures]),
        jointed=np.array([links.index(f.links[1]) for f in flexures]),
        clamp=clamp,
        joint=joint,
        direction=(joint - clamp) / length,
        length=length,
        bending=np.array([f.leaf.bending_stiffness for f in flexures]),
        axial=np.array([f.leaf.axial_stiffness for f in flexures]),
    )


def _group(mechanism: Mechanism, module: Module, earlier: Sequence[str], joint: np.ndarray) -> Group:
    hub = module.links[:1] if isinstance(module, Triad) else ()
    arms = module.links[len(hub) :]
    outer = _indices(mechanism, mechanism.flexures_between(arms, earlier))
    if isinstance(module, Triad):
        inner = _indices(mechanism, mechanism.flexures_between(arms, hub))
        kind, mode = "triad", np.sign(np.linalg.det(lines(joint[list(inner)], joint[list(outer)])))
    elif isinstance(module, Dyad):
        inner = _indices(mechanism, mechanism.flexures_between(arms[:1], arms[1:]))
        first, second = joint[list(outer)]
        kind, mode = "dyad", np.sign(((second - first).conjugate() * (joint[inner[0]] - first)).imag)
    else:
        kind, inner, mode = "driver", (), 1.0
    return Group(kind, tuple(mechanism.links.index(link) for link in (*arms, *hub)), outer, inner, float(mode))


def _indices(mechanism: Mechanism, flexures: Sequence[Flexure]) -> tuple[int, ...]:
    return tuple(mechanism.flexures.index(f) for f in flexures)


def lines(points: np.ndarray, others: np.ndarray) -> np.ndarray:
    """Rows (x, y, moment about the mean point) of the vectors from `others` to `points`, shape (..., 3, 3).

    They are the gradients of half the squared distances with respect to a motion of the points as one body.
    """
    arm = points - others
    lever = points - points.mean(axis=-1, keepdims=True)
    return np.stack([np.real(arm), np.imag(arm), np.imag(np.conj(lever) * arm)], axis=-1)


def wrenches(
    mechanism: Mechanism, loads: Sequence[Load], n_points: int
) -> list[tuple[int, np.ndarray, complex, np.ndarray]]:
    """Loads as (link, force, point, moment); force (n_points,) complex, moment (n_points,)."""
    found = []
    for load in loads:
        force = np.broadcast_to(load.force, (n_points, 2))
        moment = np.broadcast_to(load.moment, (n_points,))
        found.append((mechanism.links.index(load.link), force[:, 0] + 1j * force[:, 1], complex(*load.at), moment))
    return found

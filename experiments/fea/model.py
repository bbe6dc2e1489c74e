"""What is built and what acts on it: materials, members, rigid bodies, supports, frames, loads, motions.

A description only: it holds no stiffness and knows no solver.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from ..naming import suggestion
from .checks import check_frame, finite_vector
from .sections import Section

Vector = tuple[float, float, float]

MOTIONS = ("x", "y", "z", "rx", "ry", "rz")
"""The six motions of a node, in the order of its unknowns: translations in m, rotations in rad."""


@dataclass(frozen=True)
class Material:
    """A linear elastic isotropic material.

    Parameters
    ----------
    young : float
        Young's modulus, Pa.
    poisson : float
        Poisson's ratio, in (−1, 0.5].

    Raises
    ------
    ValueError
        If Young's modulus is not positive or Poisson's ratio lies outside (−1, 0.5].
    """

    young: float
    poisson: float

    def __post_init__(self) -> None:
        if not (math.isfinite(self.young) and self.young > 0):
            raise ValueError(f"young must be a positive modulus in Pa, got {self.young}")
        if not -1 < self.poisson <= 0.5:
            raise ValueError(f"poisson must lie above -1 and at most at 0.5, got {self.poisson}")

    @property
    def shear(self) -> float:
        """Shear modulus E / (2 (1 + ν)), Pa."""
        return self.young / (2 * (1 + self.poisson))


@dataclass(frozen=True)
class Member:
    """A straight or circular beam between two nodes.

    Parameters
    ----------
    name : str
    start, end : str
        Names of its nodes; local x runs from start to end.
    section : Section
    material : Material
    up : tuple of 3 float, optional
        Any vector whose part normal to the member is local z. Without it, global z is taken, or
        global y where the member is within one degree of global z; for an arc, the normal of its plane.
    through : tuple of 3 float, optional
        A point between the ends, m, through which the member runs as a circular arc, free of stress.
        The local axes turn with the arc; those of the member are those at its start.

    Raises
    ------
    ValueError
        If start and end are the same node, or `up` or `through` is not a vector of finite numbers.
    """

    name: str
    start: str
    end: str
    section: Section
    material: Material
    up: Vector | None = None
    through: Vector | None = None

    def __post_init__(self) -> None:
        if self.start == self.end:
            raise ValueError(f"member {self.name!r} starts and ends at node {self.start!r}: give it two nodes")
        if self.up is not None:
            object.__setattr__(self, "up", finite_vector(f"up of member {self.name!r}", self.up))
        if self.through is not None:
            object.__setattr__(self, "through", finite_vector(f"through of member {self.name!r}", self.through))


@dataclass(frozen=True)
class RigidBody:
    """Nodes that move as one: uᵢ = u_ref + θ × (xᵢ − x_ref), θᵢ = θ_ref, exactly.

    Parameters
    ----------
    name : str
    reference : str
        Name of the node whose motion describes the body's; one of the body's nodes, listed or not.
    nodes : tuple of str
        Names of the nodes that move with it.

    Raises
    ------
    ValueError
        If a node is listed twice, or there is none besides the reference.
    """

    name: str
    reference: str
    nodes: tuple[str, ...]

    def __post_init__(self) -> None:
        if isinstance(self.nodes, str):
            raise ValueError(f"nodes of rigid body {self.name!r} must be a sequence of names, got {self.nodes!r}")
        object.__setattr__(self, "nodes", tuple(self.nodes))
        repeated = [n for n in self.nodes if self.nodes.count(n) > 1]
        if repeated:
            raise ValueError(f"rigid body {self.name!r} lists node {repeated[0]!r} twice: name each node once")
        if len(self.all_nodes) < 2:
            raise ValueError(f"rigid body {self.name!r} has only its reference: name the nodes that move with it")

    @property
    def all_nodes(self) -> tuple[str, ...]:
        """Every node of the body, the reference first."""
        return (self.reference, *(n for n in self.nodes if n != self.reference))


@dataclass(frozen=True)
class Support:
    """Some motions of a node are held, or prescribed when the frame is solved: a pin, a slide, a drive.

    Parameters
    ----------
    node : str
        In a rigid body, the motions are those of this point of the body.
    motions : tuple of str
        Of "x", "y", "z" (translations) and "rx", "ry", "rz" (rotations), along and about global axes.

    Raises
    ------
    ValueError
        If no motion is named, one is unknown, or one is named twice.
    """

    node: str
    motions: tuple[str, ...]

    def __post_init__(self) -> None:
        if isinstance(self.motions, str):
            raise ValueError(f"motions of the support at {self.node!r} must be a sequence, got {self.motions!r}")
        object.__setattr__(self, "motions", tuple(self.motions))
        for motion in self.motions:
            if motion not in MOTIONS:
                raise ValueError(
                    f"support at node {self.node!r} holds an unknown motion {motion!r}: name some of "
                    f"{', '.join(MOTIONS)}"
                )
        if not self.motions or len(set(self.motions)) < len(self.motions):
            raise ValueError(f"support at node {self.node!r} must name motions, each once; got {self.motions!r}")

    @property
    def held(self) -> tuple[bool, ...]:
        """Which of the six motions it holds."""
        return tuple(motion in self.motions for motion in MOTIONS)


@dataclass(frozen=True)
class Load:
    """A force and a moment on a node, in global axes.

    Parameters
    ----------
    node : str
    force : tuple of 3 float
        N.
    moment : tuple of 3 float
        N m.

    Raises
    ------
    ValueError
        If a component is not a finite number.
    """

    node: str
    force: Vector = (0.0, 0.0, 0.0)
    moment: Vector = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        object.__setattr__(self, "force", finite_vector(f"force on node {self.node!r}", self.force))
        object.__setattr__(self, "moment", finite_vector(f"moment on node {self.node!r}", self.moment))


@dataclass(frozen=True)
class Motion:
    """A prescribed motion of a supported node, from its place at rest, in global axes.

    Parameters
    ----------
    node : str
    translation : tuple of 3 float
        m.
    rotation : tuple of 3 float
        Rotation vector, rad: the axis times the angle, of any size.

    Raises
    ------
    ValueError
        If a component is not a finite number.
    """

    node: str
    translation: Vector = (0.0, 0.0, 0.0)
    rotation: Vector = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        object.__setattr__(self, "translation", finite_vector(f"translation of {self.node!r}", self.translation))
        object.__setattr__(self, "rotation", finite_vector(f"rotation of {self.node!r}", self.rotation))


@dataclass(frozen=True, eq=False)
class Frame:
    """Members and rigid bodies joined at nodes, some of them clamped or supported.

    Members meet rigidly: there are no hinges, but a support may leave its node free to turn. A clamp
    holds all six motions of its node, always at zero; in a rigid body it holds the whole body, so a
    body takes at most one clamp or support (with two, the share of each in the reaction would be
    undetermined).

    Parameters
    ----------
    nodes : mapping of str to tuple of 3 float
        Coordinates of each node, m.
    members : iterable of Member
    bodies : iterable of RigidBody
    clamps : iterable of str
        Names of the clamped nodes.
    supports : iterable of Support
        Nodes held in some motions, or driven.

    Raises
    ------
    ValueError
        If the parts do not fit together; the sentence names the node or member and says what to do.
        Whether the clamps hold the frame is asked when it is factorised.
    """

    nodes: Mapping[str, Vector]
    members: tuple[Member, ...]
    bodies: tuple[RigidBody, ...] = ()
    clamps: tuple[str, ...] = ()
    supports: tuple[Support, ...] = ()

    def __post_init__(self) -> None:
        if isinstance(self.clamps, str):
            raise ValueError(f"clamps must be a sequence of node names, got {self.clamps!r}")
        nodes = {name: finite_vector(f"coordinates of node {name!r}", x) for name, x in self.nodes.items()}
        object.__setattr__(self, "nodes", MappingProxyType(nodes))
        for field in ("members", "bodies", "clamps", "supports"):
            object.__setattr__(self, field, tuple(getattr(self, field)))
        check_frame(self)

    def __reduce__(self) -> tuple[type["Frame"], tuple[object, ...]]:
        return Frame, (dict(self.nodes), self.members, self.bodies, self.clamps, self.supports)

    @property
    def node_names(self) -> tuple[str, ...]:
        """Node names in order; arrays of nodal values keep it."""
        return tuple(self.nodes)

    def index(self, node: str) -> int:
        """Position of `node`; ``ValueError`` with the nearest name if there is none."""
        if node not in self.nodes:
            raise ValueError(f"unknown node {node!r}{suggestion(node, self.nodes)}")
        return self.node_names.index(node)

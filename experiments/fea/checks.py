"""The refusals of a bad frame: one sentence each, naming the node or member and what to do."""

import math
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ..naming import suggestion
from .shapes import arc_normal, shapes

if TYPE_CHECKING:
    from .model import Frame, Member

PARALLEL = 1e-6  # sine of the angle below which `up` gives no direction normal to the member
ZERO_LENGTH = 1e-12  # length over largest coordinate below which float64 holds no direction


def finite_vector(what: str, value: Any) -> tuple[float, float, float]:
    """`value` as three floats; ``ValueError`` naming `what` if it is not three finite numbers."""
    try:
        x, y, z = (float(component) for component in value)
    except (TypeError, ValueError):
        raise ValueError(f"{what} must be three numbers, got {value!r}") from None
    if not all(map(math.isfinite, (x, y, z))):
        raise ValueError(f"{what} must be finite, got {(x, y, z)}")
    return x, y, z


def check_frame(frame: "Frame") -> None:
    """Raise ``ValueError`` unless the parts of `frame` fit together."""
    _check_names(frame)
    _check_references(frame)
    for member in frame.members:
        _check_member(frame, member)
    _check_bodies(frame)
    _check_connected(frame)


def _check_names(frame: "Frame") -> None:
    if not frame.nodes or not frame.members:
        raise ValueError("a frame needs nodes and at least one member")
    for kind, plural, names in (
        ("node", "nodes", tuple(frame.nodes)),
        ("member", "members", tuple(m.name for m in frame.members)),
        ("rigid body", "rigid bodies", tuple(b.name for b in frame.bodies)),
    ):
        for name in names:
            if not isinstance(name, str) or not name:
                raise ValueError(f"{kind} name {name!r} must be a text that is not empty")
        _refuse_repeated(names, f"two {plural} are called {{!r}}: give each its own name")
    _refuse_repeated(frame.clamps, "node {!r} is clamped twice: name it once")
    _refuse_repeated(
        (*frame.clamps, *(s.node for s in frame.supports)), "node {!r} is held twice: give it one clamp or support"
    )


def _refuse_repeated(names: Sequence[str], sentence: str) -> None:
    for name in names:
        if names.count(name) > 1:
            raise ValueError(sentence.format(name))


def _check_references(frame: "Frame") -> None:
    def check(user: str, nodes: Iterable[str]) -> None:
        for node in nodes:
            if node not in frame.nodes:
                raise ValueError(f"{user} names an unknown node {node!r}{suggestion(str(node), frame.nodes)}")

    for member in frame.members:
        check(f"member {member.name!r}", (member.start, member.end))
    for body in frame.bodies:
        check(f"rigid body {body.name!r}", body.all_nodes)
    check("a clamp", frame.clamps)
    check("a support", (s.node for s in frame.supports))


def _check_member(frame: "Frame", member: "Member") -> None:
    start, end = frame.nodes[member.start], frame.nodes[member.end]
    length = math.dist(start, end)
    if length <= ZERO_LENGTH * max(map(abs, (*start, *end))):
        raise ValueError(
            f"member {member.name!r} has zero length: move node {member.start!r} or {member.end!r}, "
            "or join them in a rigid body"
        )
    if member.through is not None and np.linalg.norm(arc_normal(start, member.through, end)) <= PARALLEL * length**2:
        raise ValueError(
            f"member {member.name!r}: through = {member.through} lies on the line of its ends; give a point off it, "
            "or leave it out for a straight member"
        )
    if member.up is not None:
        middle = np.add(start, end) / 2 if member.through is None else np.array(member.through)
        tangent = shapes(np, np.array(start), np.array(end), middle, np.ones(3)).axes[0]
        normal = np.cross(tangent, member.up)
        if np.linalg.norm(normal) <= PARALLEL * math.hypot(*member.up):
            raise ValueError(
                f"member {member.name!r}: up = {member.up} is parallel to the member or zero; give a vector across it"
            )


def _check_bodies(frame: "Frame") -> None:
    owner: dict[str, str] = {}
    for body in frame.bodies:
        for node in body.all_nodes:
            if node in owner:
                raise ValueError(
                    f"node {node!r} is in two rigid bodies, {owner[node]!r} and {body.name!r}: "
                    "make them one body or take the node out of one"
                )
            owner[node] = body.name
        held = [n for n in body.all_nodes if n in frame.clamps or n in {s.node for s in frame.supports}]
        if len(held) > 1:
            raise ValueError(
                f"rigid body {body.name!r} is clamped at nodes {held[0]!r} and {held[1]!r}: "
                "one clamp or support holds the body, so keep one"
            )
    for member in frame.members:
        body = owner.get(member.start)
        if body is not None and body == owner.get(member.end):
            raise ValueError(
                f"member {member.name!r} joins two nodes of rigid body {body!r} and cannot deform: remove it"
            )


def _check_connected(frame: "Frame") -> None:
    used = {n for m in frame.members for n in (m.start, m.end)} | {n for b in frame.bodies for n in b.all_nodes}
    for node in frame.nodes:
        if node not in used:
            raise ValueError(
                f"node {node!r} is connected to nothing: join it to a member or a rigid body, or remove it"
            )

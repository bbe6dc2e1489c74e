"""What a flexure mechanism is made of and what acts on it: leaves, flexures, loads.

A description only; it knows no solver.
"""

import math
from dataclasses import dataclass, fields
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from .checks import finite_point

Point = tuple[float, float]


@dataclass(frozen=True)
class Leaf:
    """The cross-section and material of a leaf spring.

    Parameters
    ----------
    width : float
        Out of the plane, m.
    thickness : float
        In the plane, m.
    young : float
        Young's modulus, Pa.

    Raises
    ------
    ValueError
        If a value is not positive and finite.
    """

    width: float
    thickness: float
    young: float

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if not (math.isfinite(value) and value > 0):
                raise ValueError(f"{field.name} of a leaf must be positive and finite in SI units, got {value}")

    @property
    def bending_stiffness(self) -> float:
        """E I = E w t³ / 12, N m²."""
        return self.young * self.width * self.thickness**3 / 12

    @property
    def axial_stiffness(self) -> float:
        """E A = E w t, N."""
        return self.young * self.width * self.thickness


@dataclass(frozen=True)
class Flexure:
    """A straight leaf between two links, drawn where it is at rest.

    The equivalent rotational joint sits on one of its two edges: there the flexure is the free end of a
    cantilever that is clamped in the other link. The choice changes the iterates, not the answer.

    Parameters
    ----------
    name : str
    start_link, end_link : str
        Names of the two links.
    start, end : tuple of 2 float
        Where the leaf leaves `start_link` and meets `end_link` at rest, global axes, m.
    leaf : Leaf
    joint : {"end", "start"}
        The edge of the equivalent joint.

    Raises
    ------
    ValueError
        If the links are the same, the leaf has no length, or `joint` is another word.

    Notes
    -----
    Source: thesis, 1.1.4.2 and Fig. 1.3–1.5.
    """

    name: str
    start_link: str
    end_link: str
    start: Point
    end: Point
    leaf: Leaf
    joint: Literal["end", "start"] = "end"

    def __post_init__(self) -> None:
        for field in ("start", "end"):
            object.__setattr__(self, field, finite_point(f"{field} of flexure {self.name!r}", getattr(self, field)))
        if self.start_link == self.end_link:
            raise ValueError(f"flexure {self.name!r} joins link {self.start_link!r} to itself: give it two links")
        if not self.length > 0:
            raise ValueError(f"flexure {self.name!r} starts and ends at {self.start}: give it a length")
        if self.joint not in ("end", "start"):
            raise ValueError(f"joint of flexure {self.name!r} must be 'end' or 'start', got {self.joint!r}")

    @property
    def length(self) -> float:
        """Distance from start to end, m."""
        return math.dist(self.start, self.end)

    @property
    def links(self) -> tuple[str, str]:
        """The clamped link, then the link that carries the equivalent joint."""
        return (self.start_link, self.end_link) if self.joint == "end" else (self.end_link, self.start_link)

    @property
    def edges(self) -> tuple[Point, Point]:
        """The clamped edge, then the edge of the equivalent joint, m."""
        return (self.start, self.end) if self.joint == "end" else (self.end, self.start)


@dataclass(frozen=True, eq=False)
class Load:
    """A dead force at a point fixed on a link, and a moment on it.

    Parameters
    ----------
    link : str
    force : array_like, shape (2,) or (n_points, 2)
        Global axes, N; it keeps its direction while the link turns.
    at : tuple of 2 float
        Where on the link the force acts, by its place at rest in global axes, m.
    moment : array_like, shape () or (n_points,)
        Anticlockwise, N m.

    Raises
    ------
    ValueError
        If a shape is wrong or a value is not finite.
    """

    link: str
    force: ArrayLike = (0.0, 0.0)
    at: Point = (0.0, 0.0)
    moment: ArrayLike = 0.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "at", finite_point(f"at of the load on {self.link!r}", self.at))
        for field, ndim, shape in (("force", 1, "(2,) or (n_points, 2)"), ("moment", 0, "() or (n_points,)")):
            try:
                value = np.array(getattr(self, field), float)
            except (TypeError, ValueError):
                raise ValueError(f"{field} on link {self.link!r} must be numbers of shape {shape}") from None
            if value.ndim not in (ndim, ndim + 1) or (ndim and value.shape[-1] != 2):
                raise ValueError(f"{field} on link {self.link!r} must have shape {shape}, got {value.shape}")
            if not np.isfinite(value).all():
                raise ValueError(f"{field} on link {self.link!r} must be finite, got {value}")
            value.setflags(write=False)
            object.__setattr__(self, field, value)

"""The flexible member as an initial value problem: from the wrench at its start to the pose of its end.

No load acts along a member, so its internal wrench, seen from the section, obeys an equation of its
own, whatever the pose: N' = N × κ, M' = M × κ + N × γ, with the strains γ = γ₀ + C N and κ = κ₀ + C M.
That is integrated by the classical Runge–Kutta method; the pose follows from the strains by Magnus'
fourth-order exponential, which keeps rotations rotations and makes a member of constant strain exact.
What comes out depends on the wrench in the axes of the start alone: turn the mechanism, and the
answer turns with it.

Sources: Antman, Nonlinear Problems of Elasticity, 2nd ed. (2005), ch. 8 (the equations of the rod);
Iserles, Munthe-Kaas, Nørsett and Zanna, Acta Numerica 9 (2000), 215–365 (Magnus expansion);
Selig, Geometric Fundamentals of Robotics, 2nd ed. (2005), ch. 12 (compliances that are carried).
"""

import math
from typing import Any, NamedTuple, Protocol

import jax
import jax.numpy as jnp
from jax import Array

Components = tuple[Array, ...]
"""The components of a vector, apart, each with the shape of the batch: XLA then runs along the batch."""


class Rods(NamedTuple):
    """Members as arrays; the last two axes are (n_members, n_points), either of which may be 1.

    With D the number of motions, three in the plane and six in space, and P numbers in a pose:

    Parameters
    ----------
    start : Array, shape (P, n_members, ...)
        Pose of the first section at rest in the axes of the body that it sits on.
    end : Array, shape (P, n_members, ...)
        Pose of the other body in the axes of the last section.
    length : Array, shape (n_members, ...)
    compliance : Array, shape (D, n_members, ...)
        Strain per internal force and moment; zero for what does not give.
    strain : Array, shape (D, n_members, ...)
        At rest: (1, 0, ...) and the curvature.
    """

    start: Array
    end: Array
    length: Array
    compliance: Array
    strain: Array


class Along(NamedTuple):
    """What is met along the members.

    Parameters
    ----------
    internal : Array, shape (D, n_steps + 1, n_members, n_points)
        Force and moment that the part beyond a section exerts on it, in the axes of the section; at the ends of steps.
    pose : Array, shape (P, n_steps + 1, n_members, n_points)
        Of the section, in the axes of the body at the start.
    twist : Array, shape (D, D, n_steps / 2, n_members, n_points)
        Of the section per change of the wrench, at the end of every second step; see :func:`integrate`.
    """

    internal: Array
    pose: Array
    twist: Array


class Section(Protocol):
    """What the integration asks of the plane or of space; see :mod:`.planar` and :mod:`.spatial`."""

    def rates(self, internal: Components, strain: Components) -> Components:
        """Change of the internal wrench per length."""
        ...

    def bracket(self, first: Components, second: Components) -> Components:
        """Commutator of two strains."""
        ...

    def screwed(self, pose: Components, screw: Components) -> Components:
        """The pose after a finite screw in its own axes."""
        ...

    def carried(self, wrench: Components, twist: Components) -> Components:
        """Change of a wrench on a body that moves by a twist."""
        ...

    def yielding(self, pose: Components, compliance: Components, wrench: Components) -> Components:
        """Twist per length about the origin under a wrench about the origin, of a section at `pose`."""
        ...


class Reached(NamedTuple):
    """End of an integration: pose and twist of the last section; D components of the latter of shape (D, …)."""

    pose: Components
    twist: Components


def integrate(
    section: Section, wrench: Components, internal: Components, pose: Components, rods: Rods, n_steps: int
) -> tuple[Reached, Any]:
    """Integrate from the first section to the last: what is reached, and what is met at the ends of the steps.

    With the pose comes how it changes with the wrench. That about the origin of the start, W, is the
    same all along; the twist η of a section about that origin grows by η' = H (δW + P η), where H is
    the compliance of the section carried to the origin and P η the change of the wrench on a body that
    moves by η. This is integrated over pairs of steps with the poses that they give: half the work of
    differentiating the law, and alike up to the error of the law itself.

    Parameters
    ----------
    section : Section
    wrench : Components
        About the origin of the start body.
    internal, pose : Components
        Of the first section.
    rods : Rods
    n_steps : int
        Even.
    """
    h, at_rest, compliance = rods.length / n_steps, tuple(rods.strain), tuple(rods.compliance)
    size = len(wrench)
    shape = (size, *wrench[0].shape)
    units = tuple(jnp.zeros(shape).at[i].set(1.0) for i in range(size))

    def strains(internal: Components) -> Components:
        return tuple(e + c * x for e, c, x in zip(at_rest, compliance, internal, strict=True))

    def rates(internal: Components) -> Components:
        return section.rates(internal, strains(internal))

    def step(now: tuple[Components, Components], _: None) -> tuple[tuple[Components, Components], Any]:
        here, pose = now
        there, middle = _runge_kutta(rates, here, h)
        first, half, last = strains(here), strains(middle), strains(there)
        turn = section.bracket(first, last)
        screw = tuple(
            h / 6 * (a + 4 * b + c) + h * h / 12 * t for a, b, c, t in zip(first, half, last, turn, strict=True)
        )
        pose = section.screwed(pose, screw)
        return (there, pose), (there, pose)

    def slope(pose: Components, twist: Components) -> Components:
        change = tuple(u + c for u, c in zip(units, section.carried(wrench, twist), strict=True))
        return section.yielding(pose, compliance, change)

    def two_steps(now: tuple[Components, Components, Components], _: None) -> tuple[Any, Any]:
        here, pose, twist = now
        (there, last), met = jax.lax.scan(step, (here, pose), None, length=2)
        twist = _runge_kutta_known(slope, twist, (pose, tuple(part[0] for part in met[1]), last), h)
        return (there, last, twist), (*met, twist)

    rest = tuple(jnp.zeros(shape) for _ in range(size))
    (_, pose, twist), met = jax.lax.scan(two_steps, (internal, pose, rest), None, length=n_steps // 2)
    return Reached(pose, twist), met


def _runge_kutta_known(slope: Any, value: Components, poses: tuple[Components, ...], h: Array) -> Components:
    """`value` two steps on, its slope depending on poses that are known at the ends and in the middle."""

    def ahead(by: Any, slope: Components) -> Components:
        return tuple(x + by * s for x, s in zip(value, slope, strict=True))

    first, middle, last = poses
    k1 = slope(first, value)
    k2 = slope(middle, ahead(h, k1))
    k3 = slope(middle, ahead(h, k2))
    k4 = slope(last, ahead(2 * h, k3))
    return ahead(h / 3, tuple(a + 2 * b + 2 * c + d for a, b, c, d in zip(k1, k2, k3, k4, strict=True)))


def along(start: tuple[Components, Components], met: tuple[Components, Components, Components]) -> Along:
    """What an integration met, with its start."""
    internal, pose, twist = met

    def joined(first: Components, then: Components) -> Array:
        pairs = (part.reshape(-1, *part.shape[2:]) for part in then)
        return jnp.stack([jnp.concatenate([a[None], b]) for a, b in zip(first, pairs, strict=True)])

    return Along(joined(start[0], internal), joined(start[1], pose), jnp.stack(twist).swapaxes(1, 2))


def _runge_kutta(rates: Any, here: Components, h: Array) -> tuple[Components, Components]:
    """The next internal wrench and, by Hermite's cubic, that in the middle of the step."""

    def ahead(slope: Components, by: Array) -> Components:
        return tuple(x + by * s for x, s in zip(here, slope, strict=True))

    k1 = rates(here)
    k2 = rates(ahead(k1, h / 2))
    k3 = rates(ahead(k2, h / 2))
    k4 = rates(ahead(k3, h))
    mean = tuple((a + 2 * b + 2 * c + d) / 6 for a, b, c, d in zip(k1, k2, k3, k4, strict=True))
    there = ahead(mean, h)
    middle = tuple((x + y) / 2 + h / 8 * (a - b) for x, y, a, b in zip(here, there, k1, rates(there), strict=True))
    return there, middle


def even_series(square: Array, first: int, n_terms: int = 10) -> Array:
    """Σ (−1)ᵏ x²ᵏ first! / (2k + first)!: cos x for 0, sin x / x for 1, 2 (1 − cos x) / x² for 2, and so on.

    To rounding for |x| ≤ 2; a step along a member turns less. It costs no call of a library and has
    no singular point.
    """
    total = jnp.full_like(square, _coefficient(n_terms - 1, first))
    for k in range(n_terms - 2, -1, -1):
        total = _coefficient(k, first) + square * total
    return total


def _coefficient(k: int, first: int) -> float:
    return (-1) ** k * math.factorial(first) / math.factorial(2 * k + first)

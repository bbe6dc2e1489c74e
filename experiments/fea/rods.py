"""The flexible member as an initial value problem: from the wrench at its start to the pose of its end.

No load acts along a member, so its internal wrench, seen from the section, obeys an equation of its
own, whatever the pose: N' = N × κ, M' = M × κ + N × γ, with the strains γ = γ₀ + C N and κ = κ₀ + C M.
That is integrated by the classical Runge–Kutta method; the pose follows from the strains by Magnus'
fourth-order exponential, which keeps rotations rotations and makes a member of constant strain exact.
What comes out depends on the wrench in the axes of the start alone: turn the mechanism, and the
answer turns with it.

Sources: Antman, Nonlinear Problems of Elasticity, 2nd ed. (2005), ch. 8 (the equations of the rod);
Iserles, Munthe-Kaas, Nørsett and Zanna, Acta Numerica 9 (2000), 215–365 (Magnus expansion).
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
    """What is met along the members, at the ends of the steps.

    Parameters
    ----------
    internal : Array, shape (D, n_steps + 1, n_members, n_points)
        Force and moment that the part beyond a section exerts on it, in the axes of the section.
    pose : Array, shape (P, n_steps + 1, n_members, n_points)
        Of the section, in the axes of the body at the start.
    """

    internal: Array
    pose: Array


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


def integrate(
    section: Section, internal: Components, pose: Components, rods: Rods, n_steps: int, trace: bool
) -> tuple[Components, Any]:
    """Pose of the last section from the first's pose and internal wrench; with `trace`, what is met on the way."""
    h = rods.length / n_steps

    def strains(internal: Components) -> Components:
        return tuple(e + c * x for e, c, x in zip(rods.strain, rods.compliance, internal, strict=True))

    def rates(internal: Components) -> Components:
        return section.rates(internal, strains(internal))

    def step(now: tuple[Components, Components], _: None) -> tuple[tuple[Components, Components], Any]:
        here, pose = now
        there, middle = _runge_kutta(rates, here, h)
        first, half, last = strains(here), strains(middle), strains(there)
        twist = section.bracket(first, last)
        screw = tuple(
            h / 6 * (a + 4 * b + c) + h * h / 12 * t for a, b, c, t in zip(first, half, last, twist, strict=True)
        )
        pose = section.screwed(pose, screw)
        return (there, pose), ((there, pose) if trace else None)

    (_, end), met = jax.lax.scan(step, (internal, pose), None, length=n_steps)
    return end, met


def with_start(start: Components, met: Components) -> Array:
    """The components at the ends of the steps with those at the start before them, (n, n_steps + 1, ...)."""
    return jnp.stack([jnp.concatenate([a[None], b]) for a, b in zip(start, met, strict=True)])


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

"""Step 3: large deflection of a leaf, the boundary value problem of eq. 1.8–1.9.

Tip force (Fx, Fy) in the leaf's axes and tip rotation Θ are given; tip moment M and tip place (u, v) are
sought. With κ = dθ/ds and lengths over L, forces over E I / L², moments over E I / L, eq. 1.5–1.7 read

    θ' = κ,   κ' = f(θ) = −(1 + c N) (Fy cos θ − Fx sin θ),   N = Fx cos θ + Fy sin θ,
    θ(0) = 0,   θ(1) = Θ,   u = ∫ (1 + c N) cos θ ds,   v = ∫ (1 + c N) sin θ ds,   M = κ(1).

c = E I / (E A L²) adds the stretch by the axial force; the thesis has c = 0. One step of the p-stage Gauss
collocation covers the leaf; its error falls like the 2p-th power of the step.

Source: thesis, eq. 1.5–1.9, after Venanzi et al.; Hairer, Lubich & Wanner, Geometric Numerical Integration, II.1.3.
"""

from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from .batch import solve_each

MAX_NEWTON = 40
LONGEST_STEP = 0.5  # rad; a Newton step that turns any point of the leaf by more is shortened
CLOSE = 1e-7  # rad; Newton's error is squared by the step that follows, so this one was the last needed


class Rule(NamedTuple):
    """Gauss collocation on [0, 1].

    Parameters
    ----------
    nodes, weights : numpy.ndarray, shape (p,)
    integrals : numpy.ndarray, shape (p, p)
        Row i integrates the interpolating polynomial from 0 to node i.
    tail : numpy.ndarray, shape (2, p)
        The last two Legendre coefficients of the interpolating polynomial, over p².
    """

    nodes: np.ndarray
    weights: np.ndarray
    integrals: np.ndarray
    tail: np.ndarray


@lru_cache
def gauss(p: int) -> Rule:
    """The rule with `p` nodes, from Legendre polynomials."""
    x, w = np.polynomial.legendre.leggauss(p)
    coefficients = np.linalg.inv(np.polynomial.legendre.legvander(x, p - 1))
    return Rule((1 + x) / 2, w / 2, integrals_to(x, p), coefficients[-2:] / p**2)


def integrals_to(stations: np.ndarray, p: int) -> np.ndarray:
    """Integrals from −1 to each of `stations` in [−1, 1] of the p basis polynomials, halved; (n_stations, p)."""
    x, _ = np.polynomial.legendre.leggauss(p)
    values = np.polynomial.legendre.legvander(x, p - 1)
    high = np.polynomial.legendre.legvander(stations, p)
    k = np.arange(1, p)
    primitive = np.column_stack([stations + 1, (high[:, 2:] - high[:, :-2]) / (2 * k + 1)])
    return np.linalg.solve(values.T, primitive.T).T / 2


@dataclass(frozen=True, eq=False)
class Deflection:
    """Deflected leaves, all arrays of one shape (...); `angles` has the nodes as its last axis.

    Parameters
    ----------
    tip : numpy.ndarray of complex
        u + i v in the leaf's axes, m.
    moment, root_moment : numpy.ndarray
        M at the tip and at the clamp, N m.
    angles : numpy.ndarray, shape (..., p)
        θ at the Gauss nodes, rad.
    solved : numpy.ndarray of bool
        Whether Newton's iteration closed.
    tail : numpy.ndarray
        Share in θ of the two highest polynomials, rad. Tip and moment are off by about its square.
    """

    tip: np.ndarray
    moment: np.ndarray
    root_moment: np.ndarray
    angles: np.ndarray
    solved: np.ndarray
    tail: np.ndarray


def deflect(
    rotation: np.ndarray,
    force: np.ndarray,
    length: np.ndarray,
    bending: np.ndarray,
    axial: np.ndarray | float = np.inf,
    *,
    nodes: int = 12,
    start: np.ndarray | None = None,
) -> Deflection:
    """Solve eq. 1.8–1.9 for many leaves at once.

    Parameters
    ----------
    rotation : numpy.ndarray, shape (...)
        Θ, rad.
    force : numpy.ndarray of complex, shape (...)
        Fx + i Fy on the tip in the leaf's axes, N.
    length, bending, axial : numpy.ndarray, broadcast to (...)
        m; E I in N m²; E A in N, infinite for the inextensible leaf.
    nodes : int
        Gauss nodes p on the leaf.
    start : numpy.ndarray, shape (..., nodes), optional
        Angles to start from; an arc without.

    Returns
    -------
    Deflection
    """
    rule, shape = gauss(nodes), np.shape(rotation)
    length, bending = np.broadcast_to(length, shape), np.broadcast_to(bending, shape)
    stretch = (bending / (np.broadcast_to(axial, shape) * length**2)).reshape(-1)
    pull = (force * length**2 / bending).reshape(-1)
    turn = np.reshape(rotation, -1)
    angles = turn[:, None] * rule.nodes if start is None else start.reshape(-1, nodes).copy()
    solved = _newton(angles, turn, pull, stretch, rule)
    f, _, along = _curving(angles, pull, stretch)
    root = turn - f @ (rule.weights * (1 - rule.nodes))
    return Deflection(
        tip=((1 + stretch[:, None] * along) * np.exp(1j * angles) @ rule.weights).reshape(shape) * length,
        moment=(root + f @ rule.weights).reshape(shape) * bending / length,
        root_moment=root.reshape(shape) * bending / length,
        angles=angles.reshape(*shape, nodes),
        solved=solved.reshape(shape),
        tail=np.abs(f @ rule.tail.T).sum(axis=1).reshape(shape),
    )


def _curving(angles, pull, stretch):
    """f(θ), its derivative, and the axial force, each (n, p)."""
    local = pull[:, None] * np.exp(-1j * angles)  # axial + i transverse
    along, across, c = local.real, local.imag, stretch[:, None]
    return -(1 + c * along) * across, (1 + c * along) * along - c * across**2, along


def _newton(angles, turn, pull, stretch, rule: Rule) -> np.ndarray:
    """Bring `angles` (n, p) to the solution in place; says which were brought there, (n,) bool.

    With κ(0) eliminated, θ = Θ s + G f(θ), where G is Green's function of θ'' = f between fixed ends.
    """
    nodes, weights, integrals, _ = rule
    green = integrals @ integrals - np.outer(nodes, weights * (1 - nodes))
    solved = np.zeros(len(turn), bool)
    todo = np.flatnonzero(np.isfinite(turn) & np.isfinite(pull))
    for _ in range(MAX_NEWTON):
        theta = angles[todo]
        f, slope, _ = _curving(theta, pull[todo], stretch[todo])
        residual = theta - turn[todo, None] * nodes - f @ green.T
        jacobian = np.eye(len(nodes)) - green * slope[:, None, :]
        step = solve_each(jacobian, residual)
        size = np.abs(step).max(axis=1)
        angles[todo] = theta - step * np.minimum(1, LONGEST_STEP / np.maximum(size, 1e-300))[:, None]
        solved[todo[size < CLOSE]] = True
        todo = todo[~(size < CLOSE) & np.isfinite(size)]
        if not len(todo):
            break
    angles[~solved] = turn[~solved, None] * nodes  # what comes next starts afresh
    return solved


def moments_along(
    deflection: Deflection,
    force: np.ndarray,
    length: np.ndarray,
    bending: np.ndarray,
    axial: np.ndarray | float = np.inf,
    stations: int = 33,
) -> np.ndarray:
    """Bending moment at equidistant stations from clamp to tip, shape (..., stations), N m."""
    p = deflection.angles.shape[-1]
    shape = deflection.moment.shape
    pull = (force * length**2 / bending).reshape(-1)
    stretch = np.broadcast_to(bending / (axial * length**2), shape).reshape(-1)
    f, _, _ = _curving(deflection.angles.reshape(-1, p), pull, stretch)
    inside = f @ integrals_to(np.linspace(-1, 1, stations), p).T
    scale = np.broadcast_to(bending / length, shape)[..., None]
    return deflection.root_moment[..., None] + inside.reshape(*shape, stations) * scale

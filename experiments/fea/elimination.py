"""Block elimination with a plan made beforehand: the cost grows with the number of bodies, not its cube.

Bodies are the vertices of a graph, members its edges. In every round a set of bodies of low degree
that are not neighbours is eliminated at once, so a chain of n bodies takes log₂ n rounds and each
round is a few array operations. Whole numbers are settled here; the numbers come as blocks.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import jax.numpy as jnp
import numpy as np
from jax import Array
from numpy.typing import NDArray

from .blocks import inverse, multiply

Pair = tuple[int, int]


@dataclass(frozen=True, eq=False)
class Sum:
    """``out[e] = Σ_k source[terms[k][e]]``: entries with most terms first, so that term k is a prefix."""

    terms: tuple[NDArray[np.int64], ...]
    order: NDArray[np.int64]
    size: int

    @staticmethod
    def of(contributions: list[list[int]]) -> "Sum":
        """The sums of `contributions`, one list of source positions for each entry."""
        order = sorted(range(len(contributions)), key=lambda e: -len(contributions[e]))
        most = len(contributions[order[0]]) if order else 0
        terms = tuple(np.array([contributions[e][k] for e in order if len(contributions[e]) > k]) for k in range(most))
        return Sum(terms, np.argsort(np.array(order, dtype=int)), len(contributions))

    def __call__(self, source: Array) -> Array:
        """Of `source`, shape (..., n_source, n_points), to (..., n_entries, n_points)."""
        total = jnp.zeros((*source.shape[:-2], self.size, source.shape[-1]))
        for term in self.terms:
            pad = [(0, 0)] * (source.ndim - 2) + [(0, self.size - len(term)), (0, 0)]
            total = total + jnp.pad(source[..., term, :], pad)
        return total[..., self.order, :]


@dataclass(frozen=True, eq=False)
class Round:
    """Bodies of one degree that are eliminated together; positions are among the bodies and entries left.

    Parameters
    ----------
    bodies : ndarray of int, shape (k,)
    neighbours : ndarray of int, shape (k, degree)
    pivots : ndarray of int, shape (k,)
        Entries of the eliminated blocks.
    to, fro : ndarray of int, shape (k, degree)
        Entries (body, neighbour) and (neighbour, body).
    kept_bodies : ndarray of int
    kept_entries : ndarray of int
        Entries that existed before, and one past the last for those that fill in.
    updates : Sum
        Over the products of the round, for the entries kept; order (body, neighbour i, neighbour j).
    right_updates : Sum
        The same for the right-hand sides; order (body, neighbour).
    """

    bodies: NDArray[np.int64]
    neighbours: NDArray[np.int64]
    pivots: NDArray[np.int64]
    to: NDArray[np.int64]
    fro: NDArray[np.int64]
    kept_bodies: NDArray[np.int64]
    kept_entries: NDArray[np.int64]
    updates: Sum
    right_updates: Sum


@dataclass(frozen=True, eq=False)
class Plan:
    """How blocks of a matrix are summed from those of members, and eliminated.

    Parameters
    ----------
    entries : tuple of (int, int)
        Block row and column of each entry: the diagonal first, then the couplings.
    rounds : tuple of Round
    """

    entries: tuple[Pair, ...]
    rounds: tuple[Round, ...]


def plan(n_bodies: int, edges: Iterable[Pair]) -> Plan:
    """A plan for `n_bodies` joined by `edges`; an edge may repeat or join a body to itself."""
    pairs = {pair for a, b in edges if a != b for pair in ((a, b), (b, a))}
    entries = [(i, i) for i in range(n_bodies)] + sorted(pairs)
    first = tuple(entries)
    names, rounds = list(range(n_bodies)), []
    while names:
        chosen = _independent(names, entries)
        rounds.append(_round(names, entries, chosen))
        names, entries = _after(names, entries, chosen)
    return Plan(first, tuple(rounds))


def _neighbours(names: list[int], entries: list[Pair]) -> dict[int, list[int]]:
    found: dict[int, list[int]] = {v: [] for v in names}
    for row, column in entries:
        if row != column:
            found[row].append(column)
    return found


def _independent(names: list[int], entries: list[Pair]) -> list[int]:
    """Bodies of the lowest degree (but all of degree two where there is one) of which no two are neighbours."""
    around = _neighbours(names, entries)
    degree = min(len(n) for n in around.values())
    if degree == 1 and any(len(n) == 2 for n in around.values()):
        inner = _spread([v for v in names if len(around[v]) == 2], around)
        if len(inner) > sum(len(n) == 1 for n in around.values()):
            return inner
    return _spread([v for v in names if len(around[v]) == degree], around)


def _spread(candidates: list[int], around: dict[int, list[int]]) -> list[int]:
    chosen: list[int] = []
    barred: set[int] = set()
    for v in candidates:
        if v not in barred:
            chosen.append(v)
            barred.update(around[v])
    return chosen


def _after(names: list[int], entries: list[Pair], chosen: list[int]) -> tuple[list[int], list[Pair]]:
    """Bodies and entries left once `chosen` are eliminated, with the entries that fill in at the end."""
    gone, around = set(chosen), _neighbours(names, entries)
    kept = [e for e in entries if not gone.intersection(e)]
    known = set(kept)
    for v in chosen:
        for i in around[v]:
            for j in around[v]:
                if (i, j) not in known:
                    known.add((i, j))
                    kept.append((i, j))
    return [v for v in names if v not in gone], kept


def _round(names: list[int], entries: list[Pair], chosen: list[int]) -> Round:
    around = _neighbours(names, entries)
    place, entry = {v: i for i, v in enumerate(names)}, {e: i for i, e in enumerate(entries)}
    names_left, entries_left = _after(names, entries, chosen)
    new_entry, new_place = {e: i for i, e in enumerate(entries_left)}, {v: i for i, v in enumerate(names_left)}
    updates: list[list[int]] = [[] for _ in entries_left]
    right: list[list[int]] = [[] for _ in names_left]
    n_products = n_rights = 0
    for v in chosen:
        for i in around[v]:
            right[new_place[i]].append(n_rights)
            n_rights += 1
            for j in around[v]:
                updates[new_entry[i, j]].append(n_products)
                n_products += 1
    shape = (len(chosen), len(around[chosen[0]]))

    def array(values: Iterable[int]) -> NDArray[np.int64]:
        return np.array(list(values), dtype=np.int64)

    return Round(
        array(place[v] for v in chosen),
        array(place[i] for v in chosen for i in around[v]).reshape(shape),
        array(entry[v, v] for v in chosen),
        array(entry[v, i] for v in chosen for i in around[v]).reshape(shape),
        array(entry[i, v] for v in chosen for i in around[v]).reshape(shape),
        array(place[v] for v in names_left),
        array(entry.get(e, len(entries)) for e in entries_left),
        Sum.of(updates),
        Sum.of(right),
    )


def solve(plan: Plan, blocks: Array, right: Array) -> tuple[Array, Array]:
    """Solve the block system of `plan`.

    Parameters
    ----------
    plan : Plan
    blocks : Array, shape (n, n, n_entries, n_points)
        In the order of ``plan.entries``.
    right : Array, shape (n, m, n_bodies, n_points)
        m right-hand sides.

    Returns
    -------
    Array, shape (n, m, n_bodies, n_points)
        The solutions.
    Array of int, shape (n_points,)
        Number of negative pivots: of negative eigenvalues, where the matrix is symmetric.
    """
    if not plan.rounds:
        return right, jnp.zeros(right.shape[-1:], int)
    return _eliminate(plan.rounds, blocks, right)


def _eliminate(rounds: tuple[Round, ...], blocks: Array, right: Array) -> tuple[Array, Array]:
    now, later = rounds[0], rounds[1:]
    k, degree = now.neighbours.shape
    pivot, pivots = inverse(blocks[:, :, now.pivots])
    negative = jnp.sum(pivots < 0, axis=(0, 1))
    own = multiply(pivot, right[:, :, now.bodies])
    if not later:
        return own[:, :, np.argsort(now.bodies)], negative

    # products[v, i, j] = K[i, v] K[v, v]⁻¹ K[v, j], in that order along the axis of entries
    fro = blocks[:, :, now.fro.ravel()]
    to = multiply(jnp.repeat(pivot, degree, axis=2), blocks[:, :, now.to.ravel()])
    i, j = (index.ravel() for index in np.indices((degree, degree)))
    base = degree * np.arange(k)[:, None]
    products = multiply(fro[:, :, (base + i).ravel()], to[:, :, (base + j).ravel()])
    padded = jnp.pad(blocks, [(0, 0), (0, 0), (0, 1), (0, 0)])
    blocks_left = padded[:, :, now.kept_entries] - now.updates(products)
    rights = multiply(fro, jnp.repeat(own, degree, axis=2))
    right_left = right[:, :, now.kept_bodies] - now.right_updates(rights)

    solution, more = _eliminate(later, blocks_left, right_left)
    where = np.empty(right.shape[2], dtype=int)
    where[now.kept_bodies] = np.arange(len(now.kept_bodies))
    known = solution[:, :, where[now.neighbours.ravel()]]
    back = multiply(to, known).reshape(*right.shape[:2], k, degree, right.shape[-1]).sum(axis=3)
    joined = jnp.concatenate([solution, own - back], axis=2)
    return joined[:, :, np.argsort(np.concatenate([now.kept_bodies, now.bodies]))], negative + more

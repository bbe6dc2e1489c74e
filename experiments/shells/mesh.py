"""Structured meshes of eight-node quadrilaterals in a plane, from blocks that are mirrored, turned and joined.

A *block* is a grid of points, shape (2n + 1, 2m + 1, 2): n × m elements, every other point a middle of a side. The
points at the middles of elements are not used: the element is the serendipity one.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

Block = NDArray[np.float64]

_CORNERS = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]], dtype=np.float64)
_SIDES = np.array([[0, -1], [1, 0], [0, 1], [-1, 0]], dtype=np.float64)
_WITHIN = np.sqrt(0.6) * np.array([[a, b] for a in (-1, 0, 1) for b in (-1, 0, 1)])
_WEIGHTS = np.outer([5, 8, 5], [5, 8, 5]).ravel() / 81.0


@dataclass(frozen=True, eq=False)
class Mesh:
    """Eight-node quadrilaterals in the plane.

    Parameters
    ----------
    nodes : ndarray, shape (n_nodes, 2)
        In the unit of the blocks.
    elements : ndarray of int, shape (n_elements, 8)
        Rows of `nodes`: corners anticlockwise, then the middles of the sides 1–2, 2–3, 3–4, 4–1 (S8R's order).
    regions : mapping of str to ndarray of int
        Rows of `elements`, by the name of the blocks they come from.
    """

    nodes: NDArray[np.float64]
    elements: NDArray[np.int64]
    regions: Mapping[str, NDArray[np.int64]]

    @cached_property
    def _tree(self) -> cKDTree:
        return cKDTree(self.nodes)

    def nodes_of(self, region: str) -> NDArray[np.int64]:
        """Rows of the nodes that the elements of a region use, ascending."""
        return np.unique(self.elements[self.regions[region]])

    def at(self, points: ArrayLike) -> NDArray[np.int64]:
        """Rows of the nodes at `points`, shape (n, 2).

        Raises
        ------
        ValueError
            If there is no node at one of them.
        """
        points = np.atleast_2d(np.asarray(points, dtype=np.float64))
        distance, row = self._tree.query(points)
        far = np.flatnonzero(distance > 1e-6 * np.ptp(self.nodes, axis=0).max())
        if far.size:
            raise ValueError(f"no node at {points[far[0]]}: the nearest is {distance[far[0]]:.3g} away")
        return np.asarray(row, dtype=np.int64)


def between(start: ArrayLike, end: ArrayLike, n: int) -> Block:
    """2n + 1 points from `start` to `end`, evenly, shape (2n + 1, 2)."""
    t = np.linspace(0.0, 1.0, 2 * n + 1)[:, None]
    return (1.0 - t) * np.asarray(start, dtype=np.float64) + t * np.asarray(end, dtype=np.float64)


def block(corners: ArrayLike, n: int, m: int) -> Block:
    """n × m elements in a straight-sided quadrilateral.

    Parameters
    ----------
    corners : array_like, shape (4, 2)
        Anticlockwise; n elements from the first to the second, m from the second to the third.
    n, m : int
    """
    a, b, c, d = np.asarray(corners, dtype=np.float64)
    t = np.linspace(0.0, 1.0, 2 * m + 1)[None, :, None]
    return (1.0 - t) * between(a, b, n)[:, None] + t * between(d, c, n)[:, None]


def mirrored(blocks: Sequence[Block]) -> list[Block]:
    """Mirror images, x to −x, with their orientation kept."""
    return [grid[::-1] * [-1.0, 1.0] for grid in blocks]


def thirds(blocks: Sequence[Block]) -> list[Block]:
    """The blocks and their images turned by −120° and 120° about the origin."""
    c, s = -0.5, np.sqrt(3.0) / 2.0  # cos(120°) computed is off by rounding, and the symmetry with it
    turns = (np.eye(2), np.array([[c, s], [-s, c]]), np.array([[c, -s], [s, c]]))
    return [grid @ turn.T for turn in turns for grid in blocks]


def join(regions: Mapping[str, Sequence[Block]]) -> Mesh:
    """One mesh of all blocks: points at the same place become one node.

    Raises
    ------
    ValueError
        If an element is inverted or degenerate.
    """
    points, elements, found = [np.empty((0, 2))], [], {}
    n_points, n_elements = 0, 0
    for name, blocks in regions.items():
        first = n_elements
        for grid in blocks:
            own = _quadrilaterals(grid.shape[0], grid.shape[1]) + n_points
            points.append(grid.reshape(-1, 2))
            elements.append(own)
            n_points, n_elements = n_points + grid[..., 0].size, n_elements + len(own)
        found[name] = np.arange(first, n_elements)
    nodes, table = _merged(np.concatenate(points), np.concatenate(elements))
    mesh = Mesh(nodes, table, found)
    if not least_jacobian(mesh).min() > 0.0:
        bad = int(least_jacobian(mesh).argmin())
        raise ValueError(
            f"element {bad + 1} is inverted or degenerate; its corners are {nodes[table[bad, :4]].tolist()}"
        )
    return mesh


def areas(mesh: Mesh) -> NDArray[np.float64]:
    """Area of each element, shape (n_elements,)."""
    return _determinants(mesh, _WITHIN) @ _WEIGHTS


def least_jacobian(mesh: Mesh) -> NDArray[np.float64]:
    """Smallest Jacobian determinant of each element, over its nodes and integration points, shape (n_elements,)."""
    return _determinants(mesh, np.vstack([_CORNERS, _SIDES, _WITHIN])).min(axis=1)


def _quadrilaterals(rows: int, columns: int) -> NDArray[np.int64]:
    """Elements of a grid of points, shape (n_elements, 8)."""
    index = np.arange(rows * columns).reshape(rows, columns)
    i, j = np.meshgrid(np.arange(0, rows - 2, 2), np.arange(0, columns - 2, 2), indexing="ij")
    around = [(0, 0), (2, 0), (2, 2), (0, 2), (1, 0), (2, 1), (1, 2), (0, 1)]
    return np.stack([index[i + a, j + b].ravel() for a, b in around], axis=1)


def _merged(points: NDArray[np.float64], elements: NDArray[np.int64]) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Nodes without doubles and without what no element uses, in order of first use."""
    close = cKDTree(points).query_pairs(1e-7 * np.ptp(points, axis=0).max(), output_type="ndarray")
    graph = coo_matrix((np.ones(len(close)), (close[:, 0], close[:, 1])), shape=(len(points), len(points)))
    _, group = connected_components(graph, directed=False)
    used, first, inverse = np.unique(group[elements.ravel()], return_index=True, return_inverse=True)
    order = np.argsort(first)
    rank = np.empty(len(used), dtype=np.int64)
    rank[order] = np.arange(len(used))
    return points[elements.ravel()[first[order]]], rank[inverse].reshape(elements.shape)


def _determinants(mesh: Mesh, places: NDArray[np.float64]) -> NDArray[np.float64]:
    """Jacobian determinants of all elements at `places` (n, 2) of the unit square, shape (n_elements, n)."""
    tangents = np.einsum("nkd,ekx->endx", _shape_gradients(places), mesh.nodes[mesh.elements])
    return tangents[..., 0, 0] * tangents[..., 1, 1] - tangents[..., 0, 1] * tangents[..., 1, 0]


def _shape_gradients(places: NDArray[np.float64]) -> NDArray[np.float64]:
    """Gradients of the eight serendipity functions (Zienkiewicz & Taylor, vol. 1, §8.6), shape (n, 8, 2)."""
    r, s = places[:, :1], places[:, 1:]
    a, b = _CORNERS.T
    corners = [
        0.25 * a * (1.0 + s * b) * (2.0 * r * a + s * b),
        0.25 * b * (1.0 + r * a) * (2.0 * s * b + r * a),
    ]
    c, d = _SIDES.T
    along = c == 0.0
    sides = [
        np.where(along, -r * (1.0 + s * d), 0.5 * c * (1.0 - s**2)),
        np.where(along, 0.5 * d * (1.0 - r**2), -s * (1.0 + r * c)),
    ]
    return np.stack([np.hstack(pair) for pair in zip(corners, sides, strict=True)], axis=2)

"""Exchange of runs for the largest determinant of the information matrix."""

from collections.abc import Callable
from itertools import product

import numpy as np
from numpy.typing import NDArray

LARGEST_CANDIDATE_SET = 1024
"""Up to so many points of the grid, a run is exchanged for any of them; beyond, one coordinate of it changes."""

RIDGE = 1e-7
"""Added to the information matrix while exchanging, so that a start from which terms cannot be told apart improves."""

MOST_SWEEPS = 100

Expand = Callable[[NDArray[np.float64]], NDArray[np.float64]]


class Exchange:
    """A grid of equally spaced levels, a model on it, and the runs that are fixed.

    Parameters
    ----------
    n_factors, levels : int
    expand : callable
        Coded settings, shape (n, n_factors), to the model matrix, shape (n, n_terms).
    fixed : ndarray, shape (n_fixed, n_factors)
        Runs that stay, in coded units.
    replicates : bool
        Whether a run may equal another.

    Notes
    -----
    Fedorov (1972), *Theory of Optimal Experiments*, chapter 3: exchanging run x for y multiplies the
    determinant by (1 + d(y))(1 − d(x)) + d(x, y)², with d(x, y) = f(x)ᵀ M⁻¹ f(y). One run at a time
    takes its best exchange (Cook and Nachtsheim 1980, Technometrics 22, 315–324); on large grids one
    coordinate of it (Meyer and Nachtsheim 1995, Technometrics 37, 60–69).
    """

    def __init__(
        self, n_factors: int, levels: int, expand: Expand, fixed: NDArray[np.float64], replicates: bool
    ) -> None:
        self.n_factors, self.levels, self.expand, self.replicates = n_factors, levels, expand, replicates
        small = levels**n_factors <= LARGEST_CANDIDATE_SET
        self.grid = np.array(list(product(range(levels), repeat=n_factors))) if small else None
        self.fixed = expand(fixed)
        self.of_fixed = self.fixed.T @ self.fixed
        # A point's key is a sum modulo 2^64: exact on small grids, and as good as unique on large ones.
        self.weights = np.random.default_rng(0).integers(-(2**62), 2**62, n_factors)
        position = (fixed + 1.0) * 0.5 * (levels - 1)
        on_grid = (np.abs(position - np.round(position)) < 1e-9).all(axis=1)
        self.taken = np.round(position[on_grid]).astype(np.int64) @ self.weights
        self.expanded = None if self.grid is None else expand(self.coded(self.grid))

    @property
    def room(self) -> int:
        """Points of the grid at which no fixed run is."""
        return self.levels**self.n_factors - len(np.unique(self.taken))

    def coded(self, points: NDArray[np.int64]) -> NDArray[np.float64]:
        """Level numbers to coded units."""
        return -1.0 + 2.0 * points / (self.levels - 1)

    def start(self, n_runs: int, rng: np.random.Generator) -> NDArray[np.int64]:
        """Random level numbers, shape (n_runs, n_factors); different points where replicates are forbidden."""
        if self.replicates:
            return rng.integers(0, self.levels, (n_runs, self.n_factors))
        if self.grid is not None:
            free = self.grid[~np.isin(self.grid @ self.weights, self.taken)]
            return rng.permutation(free)[:n_runs]
        found = np.empty((0, self.n_factors), dtype=np.int64)
        while len(found) < n_runs:
            found = np.vstack([found, rng.integers(0, self.levels, (n_runs, self.n_factors))])
            _, first = np.unique(found @ self.weights, return_index=True)
            found = found[np.sort(first)]
            found = found[~np.isin(found @ self.weights, self.taken)]
        return found[:n_runs]

    def improve(self, points: NDArray[np.int64]) -> NDArray[np.int64]:
        """Exchange runs until none gains, shape (n_runs, n_factors)."""
        points = points.copy()
        rows = self.expand(self.coded(points))
        for _ in range(MOST_SWEEPS):
            improved = False
            for i in range(len(points)):
                candidates, expanded = self._candidates(points[i])
                allowed = self._allowed(candidates, points, i)
                if not allowed.any():
                    continue
                information = self.of_fixed + rows.T @ rows + RIDGE * np.eye(rows.shape[1])
                inverse = np.asarray(np.linalg.inv(information), dtype=np.float64)
                gain = _gain(inverse, rows[i], expanded)
                best = int(np.argmax(np.where(allowed, gain, -np.inf)))
                if gain[best] > 1.0 + 1e-8:
                    points[i], rows[i], improved = candidates[best], expanded[best], True
            if not improved:
                break
        return points

    def log_determinant(self, points: NDArray[np.int64]) -> float:
        """Logarithm of the determinant of the information matrix of fixed and new runs; −inf if it is singular."""
        rows = np.vstack([self.fixed, self.expand(self.coded(points))])
        singular = np.linalg.svd(rows, compute_uv=False)
        if len(singular) < rows.shape[1] or singular[-1] <= 1e-9 * singular[0]:
            return -np.inf
        return float(2.0 * np.log(singular).sum())

    def _candidates(self, point: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
        if self.grid is not None and self.expanded is not None:
            return self.grid, self.expanded
        moved = np.repeat(point[None], self.n_factors * self.levels, axis=0)
        column = np.repeat(np.arange(self.n_factors), self.levels)
        moved[np.arange(len(moved)), column] = np.tile(np.arange(self.levels), self.n_factors)
        return moved, self.expand(self.coded(moved))

    def _allowed(self, candidates: NDArray[np.int64], points: NDArray[np.int64], i: int) -> NDArray[np.bool_]:
        if self.replicates:
            return np.ones(len(candidates), dtype=bool)
        others = np.delete(points, i, axis=0) @ self.weights
        return ~np.isin(candidates @ self.weights, np.concatenate([others, self.taken]))


def _gain(inverse: NDArray[np.float64], row: NDArray[np.float64], expanded: NDArray[np.float64]) -> NDArray[np.float64]:
    """Factor by which the determinant grows if `row` is exchanged for each row of `expanded`."""
    weighed = expanded @ inverse
    new = np.einsum("ij,ij->i", weighed, expanded)
    return (1.0 + new) * (1.0 - row @ inverse @ row) + (weighed @ row) ** 2

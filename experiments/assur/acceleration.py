"""Anderson acceleration of a fixed-point iteration, for many points at once.

Of the last steps, the combination with the smallest residual is taken. With no memory it is the plain
iteration. Source: Walker & Ni, SIAM J. Numer. Anal. 49 (2011) 1715–1735, eq. 2.2 in differences.
"""

import numpy as np

from .batch import solve_each

RIDGE = 1e-12  # of the mean square of the stored residual differences; keeps dependent ones harmless


class Anderson:
    """The memory of an iteration x ← g(x).

    Parameters
    ----------
    memory : int
        Number of earlier steps kept; 0 for the plain iteration.
    relaxation : float
        Share of the step x → g(x) that is taken.
    """

    def __init__(self, memory: int, relaxation: float) -> None:
        self._memory, self._relaxation = memory, relaxation
        self._last: tuple[np.ndarray, np.ndarray] | None = None
        self._steps: list[np.ndarray] = []
        self._changes: list[np.ndarray] = []

    def next(self, x: np.ndarray, residual: np.ndarray) -> np.ndarray:
        """The next iterate from x and g(x) − x, all of shape (n_points, n)."""
        if self._last is not None and self._memory:
            self._steps = [*self._steps, x - self._last[0]][-self._memory :]
            self._changes = [*self._changes, residual - self._last[1]][-self._memory :]
        self._last = x, residual
        plain = x + self._relaxation * residual
        if not self._steps:
            return plain
        steps, changes = np.stack(self._steps, axis=1), np.stack(self._changes, axis=1)
        gram = changes @ changes.transpose(0, 2, 1)
        ridge = RIDGE * np.einsum("nkk->n", gram) / len(self._steps) + np.finfo(float).tiny
        gram += ridge[:, None, None] * np.eye(len(self._steps))
        share = solve_each(gram, (changes @ residual[..., None])[..., 0])
        return plain - (share[:, None] @ (steps + self._relaxation * changes))[:, 0]

    def keep(self, rows: np.ndarray) -> None:
        """Forget all points but `rows`, (n_points,) bool."""
        if self._last is not None:
            self._last = self._last[0][rows], self._last[1][rows]
        self._steps = [s[rows] for s in self._steps]
        self._changes = [c[rows] for c in self._changes]

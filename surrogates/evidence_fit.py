"""Fits by maximum evidence: all candidates at once, each as large as smoothness and the runs allow, then trimmed."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from .evidence import Floats, Rows, Scales, learned_scales
from .fits import Fit, root_mean_square
from .selection import penalised_fit

MOST_LEARNED = 300
"""Rows from which scales are learned: a few dozen numbers need no more. Coefficients are fitted to all rows."""

DROPPED = 0.3
"""Root mean square of all that trimming takes away, beside the leave-one-out error: adds 5 % to it at most."""

EXACT = 0.1
"""Least squares replaces the shrunken fit where it lowers the leave-one-out error to this part: the truth is found."""

DEPENDENT = 1e-13
"""Terms are taken for dependent, and not solved for, below this ratio of the diagonal of their decomposition."""

SINGULAR = 1e-13
"""A point that the fit follows to this part of its change cannot be left out."""

NEGLIGIBLE = 1e-24
"""Prior variances below this fraction of the largest are zero."""


def evidence_fit(
    matrix: Floats,
    y: Floats,
    exponents: NDArray[np.int64],
    gradient: Floats | None = None,
    slopes: Floats | None = None,
    floor: float = 0.0,
) -> tuple[Fit, Scales | None]:
    """The trimmed polynomial of largest evidence, and the scales that gave it; none for a response that does not move.

    Parameters
    ----------
    matrix : ndarray, shape (n_runs, n_terms)
        Legendre polynomials of mean square one; may have more columns than rows.
    y : ndarray, shape (n_runs,)
    exponents : ndarray of int, shape (n_terms, n_factors)
    gradient : ndarray, shape (n_runs, n_terms, n_factors), optional
        Derivatives of `matrix` by the coded factors.
    slopes : ndarray, shape (n_runs, n_factors), optional
        Derivatives of `y` by them: taught with a noise of their own, that is, with a weight learned from the data.
    floor : float
        Error that counts as none.

    Notes
    -----
    The basis is orthonormal on the box, so that the root of the sum of the squares of coefficients taken away is the
    error that this adds, over the box. Terms go, the smallest first, as long as that stays below :data:`DROPPED` of
    the leave-one-out error; those that stay keep their values, for solving again would make them stand in for the
    others. Plain least squares on them replaces the fit where it is far better: then the truth is such a polynomial.
    """
    size = _size(y, slopes)
    if size <= floor:
        return _constant(matrix, y, exponents, floor), None
    rows = Rows.of(matrix, y / size, gradient, None if slopes is None else slopes / size)
    level = float(np.mean(y / size))
    centred = replace(rows, target=np.where(rows.kind == 0, rows.target - level, rows.target))
    scales = learned_scales(centred.some(MOST_LEARNED), exponents)
    columns = np.flatnonzero(scales.variance > NEGLIGIBLE * scales.variance.max())
    found = _solved(centred, columns, scales, len(y))
    if len(rows.target) > MOST_LEARNED:
        scales, found = _noise_of_all(centred, columns, scales, found, len(y))
    found = found.raised(level, exponents)
    found = found.keeping(_worth_keeping(found, floor / size), rows)
    plain = _exact(rows, found, scales, floor / size, len(y))
    return (plain or found).fit(size), scales


def _size(y: Floats, slopes: Floats | None) -> float:
    """How far a response moves: its standard deviation, or the root mean square of its slopes if it takes one value."""
    with np.errstate(over="ignore"):
        largest = float(np.abs(y).max(initial=0.0)) or 1.0
        moved = largest * float((y / largest).std())
    if moved == 0.0 and slopes is not None:
        return float(np.sqrt(np.mean(slopes**2)))
    return moved


def _constant(matrix: Floats, y: Floats, exponents: NDArray[np.int64], floor: float) -> Fit:
    """A response that does not move: its value, or nothing where that is zero."""
    columns = np.flatnonzero(exponents.sum(axis=1) == 0) if np.abs(y).max(initial=0.0) > floor else np.array([], int)
    return penalised_fit(matrix, y, columns.astype(np.int64), (0.0,), floor)


@dataclass(frozen=True, eq=False)
class _Solution:
    """Coefficients, what leaving out each point changes them by, and a root of their covariance."""

    columns: NDArray[np.int64]
    coefficients: Floats
    changes: Floats
    root: Floats
    loo: Floats
    penalty: float

    @property
    def loo_rmse(self) -> float:
        return root_mean_square(self.loo)

    def raised(self, level: float, exponents: NDArray[np.int64]) -> "_Solution":
        """The solution for values that are larger by `level`."""
        is_constant = exponents[self.columns].sum(axis=1) == 0
        return replace(self, coefficients=self.coefficients + level * is_constant)

    def keeping(self, keep: NDArray[np.bool_], rows: Rows) -> "_Solution":
        """Some terms with the values that they have; residuals are those of doing so without each point."""
        columns, left_out = self.columns[keep], self.coefficients[keep] - self.changes[:, keep]
        is_value = rows.kind == 0
        loo = rows.target[is_value] - (rows.matrix[is_value][:, columns] * left_out).sum(axis=1)
        loo = np.where(np.isfinite(self.loo), loo, np.inf)
        return _Solution(columns, self.coefficients[keep], self.changes[:, keep], self.root[keep], loo, self.penalty)

    def fit(self, size: float) -> Fit:
        """In the units of the response, whose standard deviation is `size`."""
        spread = np.sqrt((self.root**2).sum(axis=1))
        strength = np.abs(self.coefficients) / np.where(spread > 0.0, spread, np.inf)
        root = size * self.root
        return Fit(self.columns, size * self.coefficients, self.penalty, size * self.loo, strength, root)


def _exact(rows: Rows, found: _Solution, scales: Scales, floor: float, n_points: int) -> _Solution | None:
    """Least squares on the terms found, trimmed again and again, where that is far better than what was found."""
    flat = replace(scales, variance=np.full(rows.matrix.shape[1], np.inf))
    best = None
    while len(found.columns) and (best is None or len(found.columns) < len(best.columns)):
        plain = _solved(rows, found.columns, flat, n_points)
        if not plain.loo_rmse <= max(EXACT * found.loo_rmse, floor):
            break
        best = plain
        found = plain.keeping(_worth_keeping(plain, floor), rows)
    return best


def _noise_of_all(
    rows: Rows, columns: NDArray[np.int64], scales: Scales, found: _Solution, n_points: int
) -> tuple[Scales, _Solution]:
    """The noise by leaving out each point: scales learned from few rows do not show what more rows leave unexplained.

    A pattern search in decades, by kind of row.
    """
    step = 100.0
    while step > 3.0:
        better = False
        for kind in range(len(scales.noise)):
            for factor in (step, 1.0 / step):
                noise = scales.noise * np.where(np.arange(len(scales.noise)) == kind, factor, 1.0)
                trial_scales = replace(scales, noise=noise)
                trial = _solved(rows, columns, trial_scales, n_points)
                if trial.loo_rmse < found.loo_rmse:
                    scales, found, better = trial_scales, trial, True
                    break
        step = step if better else np.sqrt(step)
    return scales, found


def _worth_keeping(solution: _Solution, floor: float) -> NDArray[np.bool_]:
    """Which terms stay: the smallest go while the squares gone stay below the allowance."""
    error = solution.loo_rmse
    allowance = max(DROPPED * error if np.isfinite(error) else 0.0, floor)
    order = np.argsort(np.abs(solution.coefficients))
    gone = np.sqrt(np.cumsum(solution.coefficients[order] ** 2))
    keep = np.ones(len(order), dtype=bool)
    keep[order[gone <= allowance]] = False
    return keep


def _solved(rows: Rows, columns: NDArray[np.int64], scales: Scales, n_points: int) -> _Solution:
    """Most probable coefficients of some columns, with the residuals of leaving out one point after the other.

    By an orthogonal decomposition of the rows and, below them, the priors; infinite variances stand for none. With
    S Sᵀ the smoother's block of a point, its residuals without it are (I − S Sᵀ)⁻¹ times its residuals.
    """
    sigma = np.sqrt(scales.noise)[rows.kind]
    a, b = rows.matrix[:, columns] / sigma[:, None], rows.target / sigma
    shrunk = bool(np.isfinite(scales.variance[columns]).all()) and len(columns) > 0
    lengths = np.linalg.norm(a, axis=0)
    unit = np.sqrt(scales.variance[columns]) if shrunk else 1.0 / np.where(lengths > 0.0, lengths, 1.0)
    scaled = a * unit
    left, right = np.linalg.qr(np.vstack([scaled, np.eye(len(columns))]) if shrunk else scaled)
    size = np.abs(np.diag(right))
    if len(right) < len(columns) or size.min(initial=1.0) <= DEPENDENT * size.max(initial=1.0):
        return _unsolved(columns, n_points)
    inverse = unit[:, None] * np.linalg.solve(right, np.eye(len(columns)))
    coefficients = inverse @ (left[: len(b)].T @ b)
    residuals = b - a @ coefficients
    smoother, own = left[: len(b)].reshape(n_points, -1, len(columns)), residuals.reshape(n_points, -1)
    blocks = np.eye(own.shape[1]) - smoother @ smoother.transpose(0, 2, 1)
    sure = np.linalg.eigvalsh(blocks)[:, 0] > SINGULAR
    left_out = np.full_like(own, np.inf)
    left_out[sure] = np.linalg.solve(blocks[sure], own[sure][..., None])[..., 0]
    changes = np.zeros((n_points, len(columns)))
    changes[sure] = np.einsum("nrp,nr->np", smoother[sure], left_out[sure]) @ inverse.T
    squares = residuals @ residuals + (np.sum((coefficients / unit) ** 2) if shrunk else 0.0)
    free = len(b) - (0 if shrunk else len(columns))
    noise = float(np.sqrt(squares / free)) if free > 0 else np.nan
    root = np.asarray(inverse * noise, dtype=np.float64)
    penalty = float(scales.noise[0]) if shrunk else 0.0
    return _Solution(columns, coefficients, changes, root, left_out[:, 0] * sigma[0], penalty)


def _unsolved(columns: NDArray[np.int64], n_points: int) -> _Solution:
    """Columns that depend on each other tell nothing."""
    nothing = np.zeros(len(columns))
    loo = np.full(n_points, np.inf)
    return _Solution(columns, nothing, np.zeros((n_points, len(columns))), nothing[:, None], loo, 0.0)

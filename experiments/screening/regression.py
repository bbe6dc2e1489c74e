"""Least squares where runs of a two-level design are missing: main effects, and what is left to measure the error."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

DEPENDENT = 1e-9
"""A column of which less than this share of its length is new adds nothing: among so few ±1 it is exactly none."""


@dataclass(frozen=True, eq=False)
class LeastSquares:
    """Coefficients of a model matrix of full rank, and how well its settings determine them.

    Parameters
    ----------
    basis : ndarray, shape (n, p)
        Orthonormal, spanning the columns of the matrix.
    covariance : ndarray, shape (p, p)
        (X'X)⁻¹: of the coefficients, in units of the variance of one run.
    inverse : ndarray, shape (p, n)
        Takes answers to coefficients.
    """

    basis: NDArray[np.float64]
    covariance: NDArray[np.float64]
    inverse: NDArray[np.float64]

    @classmethod
    def of(cls, matrix: NDArray[np.float64]) -> "LeastSquares":
        """By QR; the matrix, shape (n, p), must have rank p."""
        basis, triangle = np.linalg.qr(matrix)
        inverse = np.linalg.inv(triangle)
        return cls(basis, inverse @ inverse.T, inverse @ basis.T)

    @property
    def variances(self) -> NDArray[np.float64]:
        """Of the coefficients, in units of the variance of one run, shape (p,)."""
        return np.diag(self.covariance)

    @property
    def correlations(self) -> NDArray[np.float64]:
        """Of the coefficients, shape (p, p)."""
        root = np.sqrt(self.variances)
        return self.covariance / np.outer(root, root)

    def residuals(self, columns: NDArray[np.float64]) -> NDArray[np.float64]:
        """What the matrix leaves of some columns, shape (n, ·); taken twice, so that it is orthogonal to rounding."""
        once = columns - self.basis @ (self.basis.T @ columns)
        return once - self.basis @ (self.basis.T @ once)

    def left_over(self, answers: NDArray[np.float64], n_whole: int) -> NDArray[np.float64]:
        """Standard deviation that the matrix leaves of some answers, as over `n_whole` runs, shape (n_responses,).

        The fewer runs the less is left of them, whatever hides there: so the squares are taken per degree of freedom,
        times as many of these as `n_whole` runs have. Nothing where no degree of freedom is left.
        """
        n, p = self.basis.shape
        squares = (self.residuals(answers) ** 2).sum(axis=0)
        return np.sqrt(squares / max(n - p, 1) * (n_whole - p) / n_whole)


def rank(matrix: NDArray[np.float64]) -> int:
    """Rank of a matrix of ±1 and ones; 0 if it is empty."""
    return int(np.linalg.matrix_rank(matrix)) if matrix.size else 0


def inflation_factors(columns: NDArray[np.float64]) -> NDArray[np.float64]:
    """Variance inflation 1/(1 − R²) of each column by the others and a constant, shape (k,).

    Parameters
    ----------
    columns : ndarray, shape (n, k)
        With a constant before them, of rank k + 1.

    Notes
    -----
    The diagonal of the inverse of the columns' correlation matrix: Marquardt (1970), "Generalized inverses, ridge
    regression, biased linear estimation, and nonlinear estimation", Technometrics 12, 591–612 (from memory).
    """
    centred = columns - columns.mean(axis=0)
    gram = centred.T @ centred
    return np.diag(np.linalg.inv(gram)) * np.diag(gram)


def error_columns(fitted: LeastSquares, dummies: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.intp]]:
    """Orthonormal columns in what the model leaves, as near to the dummy columns as such columns can be.

    Parameters
    ----------
    fitted : LeastSquares
        Of the mean and the factors at the n completed runs.
    dummies : ndarray, shape (n, m)
        The dummy columns at these runs, those to be kept first.

    Returns
    -------
    columns : ndarray, shape (n, ν)
        Each stands for one dummy; ν is the rank of what is left of them.
    kept : ndarray, shape (ν,)
        Which.

    Notes
    -----
    Every lost run takes one contrast with it, and the last ones are given up: Draper and Stoneman (1964), "Estimating
    missing values in unreplicated two-level factorial and fractional factorial designs", Biometrics 20, 443–458, give
    up those of the highest order (by title and from memory). Those kept are orthogonalised all at once, so that none
    is preferred: with the singular values S replaced by one, U S V' becomes U V', the orthonormal matrix nearest to
    it (Löwdin 1950, J. Chem. Phys. 18, 365–375; from memory).
    """
    left = fitted.residuals(dummies)
    known, kept = np.empty((len(left), 0)), []
    for i, column in enumerate(left.T):
        new = column - known @ (known.T @ column)
        new -= known @ (known.T @ new)
        size = float(np.linalg.norm(new))
        if size > DEPENDENT * np.sqrt(len(left)):
            known, kept = np.column_stack([known, new / size]), [*kept, i]
    chosen = np.array(kept, dtype=np.intp)
    if not chosen.size:
        return known, chosen
    u, _, v = np.linalg.svd(left[:, chosen], full_matrices=False)
    return u @ v, chosen

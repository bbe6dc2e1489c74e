"""Many points at once: small linear systems, and results of which some points are picked or replaced."""

from dataclasses import fields, is_dataclass, replace
from typing import Any, TypeVar

import numpy as np

Result = TypeVar("Result")


def solve_each(matrices: np.ndarray, sides: np.ndarray) -> np.ndarray:
    """Solve A x = b for each leading index; NaN where A is singular.

    Parameters
    ----------
    matrices : numpy.ndarray, shape (..., n, n)
    sides : numpy.ndarray, shape (..., n)

    Returns
    -------
    numpy.ndarray, shape (..., n)
    """
    try:
        return np.linalg.solve(matrices, sides[..., None])[..., 0]
    except np.linalg.LinAlgError:  # LAPACK met a pivot of exactly zero somewhere in the batch
        singular = np.linalg.det(matrices) == 0
        safe = np.where(singular[..., None, None], np.eye(matrices.shape[-1]), matrices)
        return np.where(singular[..., None], np.nan, np.linalg.solve(safe, sides[..., None])[..., 0])


def pick(result: Result, rows: np.ndarray) -> Result:
    """A copy of a dataclass of arrays, and of such dataclasses, with `rows` of each array alone."""
    parts: dict[str, Any] = {f.name: getattr(result, f.name) for f in fields(result)}  # type: ignore[arg-type]
    return replace(result, **{k: pick(v, rows) if is_dataclass(v) else v[rows] for k, v in parts.items()})  # type: ignore[type-var]


def store(into: object, result: object, rows: np.ndarray, where: np.ndarray) -> None:
    """Write the points `where` (bool) of `result` over the rows ``rows[where]`` of `into`, array by array."""
    for field in fields(into):  # type: ignore[arg-type]
        old, new = getattr(into, field.name), getattr(result, field.name)
        if is_dataclass(old):
            store(old, new, rows, where)
        else:
            old[rows[where]] = new[where]

"""The largest box in a polytope."""

import numpy as np

from .enclosures import Floats

NEARNESS = 1e-2
"""Price, in log volume, of a box's distance from the centre's response: of boxes about as large, the nearest counts."""


def largest_box(sides: Floats, room: Floats) -> tuple[Floats, Floats] | None:
    """Middle and half-widths of the box of largest volume with ``sides @ y ≤ room``; None if there is none.

    Parameters
    ----------
    sides : ndarray, shape (m, n)
        Of full column rank, in units in which the box's middle is of size one at most.
    room : ndarray, shape (m,)

    Returns
    -------
    middle, half : ndarray, shape (n,)

    Notes
    -----
    Maximises Σ log hⱼ − NEARNESS |c|²/2 with ``sides @ c + |sides| @ h ≤ room``, a concave problem (Bemporad, Filippi
    and Torrisi, 2004, "Inner and outer approximations of polytopes using boxes", Comput. Geom. 27, 151–178), by
    Newton steps with a logarithmic barrier (Boyd and Vandenberghe, 2004, Convex Optimization, §11.3).
    """
    from scipy.optimize import linprog

    n = sides.shape[1]
    table = np.hstack([sides, np.abs(sides)])
    cube = np.column_stack([sides, np.abs(sides).sum(axis=1)])
    start = linprog(-np.eye(n + 1)[n], cube, room, bounds=[(None, None)] * n + [(0.0, None)])
    if not start.success or not start.x[n] > 0.0:
        return None
    at = np.concatenate([start.x[:n], np.full(n, 0.5 * start.x[n])])
    for weight in 10.0 ** np.arange(9.0):
        at = _centred(table, room, at, weight)
    return at[:n], at[n:]


def _centred(table: Floats, room: Floats, at: Floats, weight: float) -> Floats:
    """Minimum of weight (NEARNESS |c|²/2 − Σ log h) − Σ log(room − table @ (c, h)), by damped Newton steps."""
    n = len(at) // 2
    for _ in range(50):
        slack, middle, half = room - table @ at, at[:n], at[n:]
        gradient = table.T @ (1.0 / slack)
        gradient += weight * np.concatenate([NEARNESS * middle, -1.0 / half])
        curvature = table.T @ (table / slack[:, None] ** 2)
        curvature += weight * np.diag(np.concatenate([np.full(n, NEARNESS), 1.0 / half**2]))
        step = -np.linalg.solve(curvature, gradient)
        decrement = float(np.sqrt(max(-gradient @ step, 0.0)))
        trial = at + step / (1.0 + (decrement if decrement > 0.25 else 0.0))
        if not ((table @ trial < room).all() and (trial[n:] > 0.0).all()):
            return at
        at = trial
        if decrement < 1e-8:
            break
    return at

"""CPU time of OpenSeesPy per load point, one process, one thread."""

import time

import numpy as np

from . import flexure_3rrr, hexflex
from .hexflex_linear import random_mechanisms, solve_linear

SEED = 0


def time_flexure_3rrr(n_points: int, n_elements: int = 16, n_steps: int = 2) -> float:
    """CPU seconds per point of the 3-RRR mechanism: pose, torques and largest stress.

    The model is built once and reset for each point, which is faster than building it anew.
    """
    points = random_flexure_points(n_points)
    begin = time.process_time()
    flexure_3rrr.solve(points, n_elements=n_elements, n_steps=n_steps)
    return (time.process_time() - begin) / n_points


def time_hexflex(n_points: int, n_elements: int = 8, n_steps: int = 1, amplitude: float = 1.0) -> float:
    """CPU seconds per point of the geometrically nonlinear HexFlex under forces within ± `amplitude` N."""
    forces = np.random.default_rng(SEED).uniform(-amplitude, amplitude, (n_points, 6))
    begin = time.process_time()
    hexflex.solve(forces, n_elements=n_elements, n_steps=n_steps)
    return (time.process_time() - begin) / n_points


def time_hexflex_linear(n_points: int, n_cases: int = 1) -> float:
    """CPU seconds per linear HexFlex, each with dimensions of its own and `n_cases` load cases.

    One case is a random load; six are the unit loads.
    """
    mechanisms = random_mechanisms(n_points, SEED)
    loads = np.random.default_rng(SEED).uniform(-1.0, 1.0, (n_points, n_cases, 6))
    if n_cases == 6:
        loads = np.broadcast_to(np.eye(6), (n_points, 6, 6))
    begin = time.process_time()
    solve_linear(mechanisms, loads)
    return (time.process_time() - begin) / n_points


def random_flexure_points(n: int, seed: int = SEED) -> np.ndarray:
    """Crank rotations in [-0.195, 0.245] rad, forces within 0.4 N in any direction, moments within ± 5 N mm."""
    rng = np.random.default_rng(seed)
    cranks = rng.uniform(-0.195, 0.245, (n, 3))
    size, angle = 0.4 * np.sqrt(rng.uniform(0.0, 1.0, n)), rng.uniform(0.0, 2 * np.pi, n)
    moments = rng.uniform(-5e-3, 5e-3, n)
    return np.column_stack([cranks, size * np.cos(angle), size * np.sin(angle), moments])

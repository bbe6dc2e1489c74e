"""Surrogates with known coefficients that several tests share."""

from collections.abc import Sequence

import numpy as np

from experiments import Factor, FactorSpace, Response, Terms
from surrogates import Surrogate


def box(*ranges: tuple[str, float, float], unit: str = "N") -> FactorSpace:
    return FactorSpace(tuple(Factor(name, unit, low, high) for name, low, high in ranges))


def unit_box(n: int) -> FactorSpace:
    return box(*((f"f{i}", -1.0, 1.0) for i in range(n)), unit="1")


def surrogate(factors: FactorSpace, terms: Sequence[str], coefficients, units: str | Sequence[str] = "m") -> Surrogate:
    """A surrogate from one row of coefficients per response."""
    table = np.atleast_2d(np.asarray(coefficients, dtype=float)).T
    units = [units] * table.shape[1] if isinstance(units, str) else units
    responses = tuple(Response(f"r{j}", unit) for j, unit in enumerate(units))
    return Surrogate(factors, responses, Terms.parse(terms, factors.names), table)


def hexflex_like() -> Surrogate:
    """Six forces, three displacements of micrometres and three rotations of centiradians, offsets not zero."""
    rng = np.random.default_rng(6)
    slope = rng.normal(size=(6, 6)) + 2.0 * np.eye(6)
    rows = np.column_stack([rng.normal(size=6), slope]) * np.array([[1e-6]] * 3 + [[1e-2]] * 3)
    factors = box(*((f"T{i}D{k}", -5.0 * k, 3.0 + i) for i in (1, 2, 3) for k in (1, 2)))
    return surrogate(factors, ["1", *factors.names], rows, ["m"] * 3 + ["rad"] * 3)


def block_map() -> Surrogate:
    """Affine 4 to 4 in two blocks: half of the map and of its inverse is zero."""
    factors = box(("a", -1.0, 1.0), ("b", -2.0, 4.0), ("c", 0.0, 1.0), ("d", 0.1, 0.3))
    rows = [[0, 2, 1, 0, 0], [0, 1, -3, 0, 0], [1e-3, 0, 0, 2e-6, 1e-6], [0, 0, 0, -1e-6, 3e-6]]
    return surrogate(factors, ["1", *factors.names], rows)


def square_quadratic() -> Surrogate:
    """Nonlinear, three factors to three responses, injective on the box."""
    factors = box(("a", 0.0, 2.0), ("b", -3.0, 1.0), ("c", 1e-3, 2e-3))
    terms = ["1", "a", "b", "c", "a^2", "a:b", "b:c", "c^2"]
    rows = [
        [0.5, 1.0, 0.1, -0.2, 0.10, 0.05, 0.00, 0.02],
        [0.0, 0.2, 1.1, 0.1, 0.00, 0.08, -0.04, 0.00],
        [-1.0, -0.1, 0.3, 0.9, -0.05, 0.00, 0.06, 0.07],
    ]
    return surrogate(factors, terms, rows * np.array([[1e-6], [1e-2], [3.0]]))


def cantilever_like() -> Surrogate:
    """Nonlinear, four factors to two responses, shaped like the second-order model of a loaded leaf spring."""
    factors = box(
        ("length", 0.0475, 0.0525), ("width", 0.0095, 0.0105), ("thickness", 9.5e-4, 1.05e-3), ("load", 0.8, 1.2)
    )
    terms = ["1", *factors.names, "length^2", "length:load", "thickness^2", "thickness:load", "width:load"]
    rows = [
        [6.97e-4, 1.06e-4, -3.5e-5, -1.05e-4, 1.41e-4, 5.4e-6, 2.06e-5, 1.17e-5, -2.0e-5, -6.9e-6],
        [2.09e-2, 2.11e-3, -1.05e-3, -3.15e-3, 4.21e-3, 5.0e-5, 4.19e-4, 3.46e-4, -6.0e-4, -2.0e-4],
    ]
    return surrogate(factors, terms, rows, ["m", "rad"])


def overdetermined() -> Surrogate:
    """Affine, two factors to three responses."""
    factors = box(("a", -1.0, 3.0), ("b", 10.0, 20.0))
    return surrogate(factors, ["1", "a", "b"], [[1e-6, 2e-6, 1e-6], [0.0, -1e-6, 3e-6], [1e-2, 1e-2, -2e-2]])


def underdetermined() -> Surrogate:
    """Affine, four factors to two responses."""
    factors = box(("a", -1.0, 3.0), ("b", 10.0, 20.0), ("c", -5.0, 5.0), ("d", 0.0, 1e-3))
    return surrogate(factors, ["1", *factors.names], [[1.0, 2.0, -1.0, 0.5, 0.1], [3.0, 0.3, 1.0, 0.7, -2.0]])


def constant() -> Surrogate:
    """Nothing acts on either response."""
    return surrogate(unit_box(2), ["1"], [[3.0], [0.0]])


def quintic() -> Surrogate:
    """One factor, one response, degree five."""
    return surrogate(box(("f", 2.0, 6.0)), ["1", "f", "f^2", "f^5"], [[1.0, 2.0, -0.125, 0.25]])


def dead_parts() -> Surrogate:
    """Nonlinear with a factor that does not act, a response that does not move, and a term nobody uses."""
    rows = [[1.0, 2.0, 0.0, 0.1, 0.2, 0.0], [5.0, 0.0, 0.0, 0.0, 0.0, 0.0], [0.0, 0.5, 0.0, 0.0, 1.0, 0.0]]
    return surrogate(unit_box(3), ["1", "f0", "f1", "f0:f2", "f2", "f1^2"], rows)


def many() -> Surrogate:
    """Five factors to three responses, every term up to degree three, small against the linear part."""
    factors = box(*((f"v{i}", -1.0 - i, 2.0 * i + 1.0) for i in range(5)))
    terms = Terms.polynomial(factors.names, 3).labels
    rng = np.random.default_rng(3)
    rows = rng.uniform(-1.0, 1.0, (3, len(terms))) * np.where(np.arange(len(terms)) <= 5, 1.0, 0.01)
    return surrogate(factors, terms, rows)


def more_responses() -> Surrogate:
    """Nonlinear, two factors to three responses: only targets on a surface can be reached."""
    return surrogate(
        unit_box(2), ["1", "f0", "f1", "f0:f1"], [[0.0, 1.0, 0.2, 0.1], [1.0, -0.3, 1.0, 0.0], [0.0, 0.5, 0.5, 0.2]]
    )


def folded() -> Surrogate:
    """One response from two settings each: which one is found depends on the path of the steps."""
    return surrogate(box(("f", 0.0, 1.0)), ["f", "f^2", "f^3", "f^4"], [[0.2, -1.0, -0.6, -0.1]])


def dependent() -> Surrogate:
    """Nonlinear, three responses of which the last follows from the others: the Jacobian never has full rank."""
    rows = np.array([[0.1, 1.0, 0.3, 0.2, 0.05], [0.0, -0.2, 1.0, 0.4, 0.1]])
    return surrogate(unit_box(3), ["1", "f0", "f1", "f2", "f0:f2"], [*rows, rows[0] - 0.7 * rows[1]])


AFFINE = {
    "hexflex_like": hexflex_like,
    "block_map": block_map,
    "overdetermined": overdetermined,
    "underdetermined": underdetermined,
    "constant": constant,
}
NONLINEAR = {
    "square_quadratic": square_quadratic,
    "cantilever_like": cantilever_like,
    "quintic": quintic,
    "dead_parts": dead_parts,
    "many": many,
    "more_responses": more_responses,
    "folded": folded,
    "dependent": dependent,
}
ALL = {**AFFINE, **NONLINEAR}


def points(model: Surrogate, n: int, seed: int = 0, reach: float = 1.0):
    """Random settings in the box, stretched by `reach` about its centre."""
    coded = np.random.default_rng(seed).uniform(-reach, reach, (n, len(model.factors)))
    return model.factors.decode(coded)

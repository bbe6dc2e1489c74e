"""How many operations a call of the exported C takes at most: known before it runs, whatever the arguments."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .source import Parts

Counts = tuple[int, int, int]
"""Multiplications, additions or subtractions, divisions."""


def operations(parts: "Parts") -> list[str]:
    """A line for each function, for the header's comment."""
    rows = {"forward": forward(parts), "forward_jacobian": with_jacobian(parts)}
    if parts.has_inverse:
        rows["inverse"] = inverse(parts)
    width = max(map(len, rows))
    functions = "exp or log of each response that the model gives by its logarithm comes on top"
    return [
        *(f"{name:<{width}}  {m} multiplications, {a} additions, {d} divisions" for name, (m, a, d) in rows.items()),
        *([functions] if parts.model.has_logs else []),
    ]


def forward(parts: "Parts") -> Counts:
    """Of ``forward``: coding the settings, and the polynomials."""
    n, one = len(parts.model.factors), parts.forward.count(slopes=False)
    return one.multiplications + n, one.additions + n, 0


def with_jacobian(parts: "Parts") -> Counts:
    """Of ``forward_jacobian``; an affine map's Jacobian is constant."""
    if parts.model.is_affine_map:
        return forward(parts)
    n, m, one = len(parts.model.factors), len(parts.model.responses), parts.forward.count(slopes=True)
    chained = n * sum(link != "identity" for link in parts.model.links)
    return one.multiplications + n + n * m + chained, one.additions + n, 0


def inverse(parts: "Parts") -> Counts:
    """Of ``inverse`` when it takes all the steps that it may: the first one, the others, and the check."""
    n, m = len(parts.model.factors), len(parts.model.responses)
    gain, check = int((parts.plan.gain != 0.0).sum()), forward(parts)
    step, plan = _step(parts), parts.plan
    chord = parts.moved.count(slopes=False) if parts.moved else (0, 0)
    return (
        gain + n + check[0] + plan.steps * step[0] + plan.chords * chord[0],
        gain + m + n + check[1] + m + plan.steps * step[1] + plan.chords * (chord[1] + 2 * n),
        check[2] + plan.steps * step[2],
    )


def _step(parts: "Parts") -> Counts:
    n, m = len(parts.model.factors), len(parts.model.responses)
    if parts.plan.affine:
        return 0, 0, 0
    if parts.moved is not None:
        one = parts.moved.count(slopes=True)
        # Elimination: row by row factors, the rest of the matrix and the right side; then substitution.
        eliminated = sum((n - 1 - k) * (n - 1 - k) + 2 * (n - 1 - k) for k in range(n))
        substituted = n * (n - 1) // 2 + n
        inner = sum((n - 1 - k) * (n - k) for k in range(n)) + n * (n - 1) // 2
        return one.multiplications + eliminated + substituted, one.additions + inner + 2 * n, n
    one, rank = parts.forward.count(slopes=True), min(n, m)
    # Gram–Schmidt: for each row taken, all squares, then the step and the other rows without their share.
    per_row = (m * n + n + m * 2 * n + m, m * n + n + m * 2 * n + m, 1 + m * n)
    scaled = m + m * n
    return (
        one.multiplications + scaled + rank * per_row[0],
        one.additions + m + rank * per_row[1] + n,
        rank * per_row[2],
    )

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
    coding, one = _coding(parts), parts.forward.count(slopes=False)
    return one.multiplications + coding[0], one.additions + coding[1], 0


def _coding(parts: "Parts") -> Counts:
    """Of the settings; in single precision the centre is taken off in two parts where one cannot hold it."""
    rests = sum(parts.rest_of(c) != 0.0 for c in parts.model.factors.centre)
    return len(parts.model.factors), len(parts.model.factors) + rests, 0


def with_jacobian(parts: "Parts") -> Counts:
    """Of ``forward_jacobian``; an affine map's Jacobian is constant."""
    if parts.constant_slope:
        return forward(parts)
    n, m, one = len(parts.model.factors), len(parts.model.responses), parts.forward.count(slopes=True)
    chained = n * sum(link != "identity" for link in parts.model.links)
    coding = _coding(parts)
    return one.multiplications + coding[0] + n * m + chained, one.additions + coding[1], 0


def inverse(parts: "Parts") -> Counts:
    """Of ``inverse`` when it takes all the steps that it may: the first one, the others, and the check."""
    n, m = len(parts.model.factors), len(parts.model.responses)
    gain, check, again = int((parts.plan.gain != 0.0).sum()), forward(parts), _coding(parts)
    step, plan = _step(parts), parts.plan
    chord = parts.moved.count(slopes=False) if parts.moved else (0, 0)
    return (
        gain + n + check[0] + again[0] + plan.steps * step[0] + plan.chords * chord[0],
        gain + m + n + check[1] + again[1] + m + plan.steps * step[1] + plan.chords * (chord[1] + 2 * n),
        check[2] + plan.steps * step[2],
    )


def _step(parts: "Parts") -> Counts:
    n, m = len(parts.model.factors), len(parts.model.responses)
    if parts.plan.affine:
        return 0, 0, 0
    if parts.moved is not None:
        one = parts.moved.count(slopes=True)
        # Factors: multipliers and the rest of the matrix. Then, as the worst, two substitutions and a value more.
        again = parts.moved.count(slopes=False)
        inner = sum((n - 1 - k) * (n - 1 - k) for k in range(n))
        factors, substituted = inner + n * (n - 1) // 2, n * (n - 1)
        return (
            one.multiplications + again.multiplications + factors + 2 * (substituted + n),
            one.additions + again.additions + inner + 2 * substituted + 4 * n,
            n,
        )
    one, rank = parts.forward.count(slopes=True), min(n, m)
    # Gram–Schmidt: for each row taken, all squares, then the step and the other rows without their share.
    per_row = (m * n + 2 * n + m * (2 * n + 2), m * n + n + m * (2 * n + 1), 1)
    scaled = m + m * n
    return (
        one.multiplications + scaled + rank * per_row[0],
        one.additions + m + rank * per_row[1] + n,
        rank * per_row[2],
    )

"""Elimination without pivoting, written out: for few unknowns compilers make quicker code of it than of loops."""

from .printing import Printer

MOST = 8
"""Unknowns up to which it is written out."""

INDENT = "    "


def factor_text(n: int, c: Printer) -> str:
    """Statements that overwrite ``slope`` with its factors.

    Below the diagonal the multipliers, on it one over the pivots, above it what elimination left. Every intermediate
    number has a name of its own: ``a<i>_<j>_<k>`` is entry i, j after k columns were eliminated.
    """
    lines = [_let(c, f"a{i}_{j}_0", f"slope[{i}][{j}]") for i in range(n) for j in range(n)]
    for k in range(n):
        lines += ["", _let(c, f"p{k}", f"{c.number(1.0)} / a{k}_{k}_{k}")]
        for i in range(k + 1, n):
            lines.append(_let(c, f"f{i}_{k}", f"a{i}_{k}_{k} * p{k}"))
            lines += [_let(c, f"a{i}_{j}_{k + 1}", f"a{i}_{j}_{k} - f{i}_{k} * a{k}_{j}_{k}") for j in range(k + 1, n)]
    lines.append("")
    for i in range(n):
        kept = [f"f{i}_{j}" if j < i else f"p{i}" if j == i else f"a{i}_{j}_{i}" for j in range(n)]
        lines += [f"{INDENT}slope[{i}][{j}] = {name};" for j, name in enumerate(kept)]
    return "\n".join(lines)


def substitute_text(n: int, c: Printer) -> str:
    """Statements that overwrite ``miss`` with the step that the factors in ``slope`` make of it."""
    lines = []
    for i in range(n):
        known = "".join(f" - slope[{i}][{j}] * b{j}" for j in range(i))
        lines.append(_let(c, f"b{i}", f"miss[{i}]{known}"))
    for i in reversed(range(n)):
        known = "".join(f" - slope[{i}][{j}] * x{j}" for j in range(i + 1, n))
        lines.append(_let(c, f"x{i}", f"(b{i}{known}) * slope[{i}][{i}]"))
    return "\n".join([*lines, "", *(f"{INDENT}miss[{k}] = x{k};" for k in range(n))])


def _let(c: Printer, name: str, value: str) -> str:
    return f"{INDENT}const {c.real} {name} = {value};"

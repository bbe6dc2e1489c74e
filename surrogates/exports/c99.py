"""C99: one header and one source file for a controller. No heap, no globals, no recursion; only ``math.h``."""

import textwrap
from collections.abc import Iterable
from dataclasses import dataclass
from string import Template
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from experiments.designs.base import check_count
from experiments.settings import parameter

from ..inversion import BOX_TOLERANCE, MAX_ITERATIONS, TARGET_TOLERANCE, affine_inverse, obstacle
from ..links import LOG, unit_of
from . import c99_text as text
from .base import WIDTH, about, check_prefix, number, plain
from .c99_inverse_text import (
    AFFINE_JACOBIAN,
    AFFINE_SEARCH,
    INVERSE,
    INVERSE_WITH_LOGARITHMS,
    POLYNOMIAL_JACOBIAN,
    POLYNOMIAL_SEARCH,
)

if TYPE_CHECKING:
    from ..model import Surrogate

STILL = 1e-12
"""Largest coded step that counts as none; the error left is its square, the convergence being quadratic."""

_MOVES = "    /* How far each response is from its value at the centre of the domain. */"

Product = tuple[float, tuple[str, ...]]
"""A coefficient and the names it multiplies."""


@dataclass(frozen=True)
class C99:
    """Forward map, Jacobian, domain check and inverse in C99, also valid C++.

    An affine map is inverted by one constant matrix. Any other model by the Gauss–Newton steps of
    :func:`surrogates.inversion.invert` from the centre of the domain, a bounded number of them;
    unlike Python, the C does not search the domain's boundary where they fail, it refuses. Where
    there is an :func:`surrogates.inversion.obstacle`, the code has no inverse and says why. Of a response that is
    given by its logarithm, the functions take and give the response itself.

    Parameters
    ----------
    max_iterations : int
        Most Gauss–Newton steps: bounds the time that an inversion takes.

    Raises
    ------
    ValueError
        If `max_iterations` is not a whole number of at least 1.
    """

    name: ClassVar[str] = "c99"
    summary: ClassVar[str] = "C99 header and source for a controller: forward, Jacobian, inverse, domain check"

    max_iterations: int = parameter(MAX_ITERATIONS, "steps", "most Gauss-Newton steps of one inversion")

    def __post_init__(self) -> None:
        check_count("max_iterations of the C99 export", self.max_iterations, 1)

    def render(self, model: "Surrogate", prefix: str) -> dict[str, str]:
        """``<prefix>.h`` and ``<prefix>.c``; see :class:`.Target`."""
        check_prefix(prefix, frozenset(text.RESERVED.split()))
        _check_locals(model, prefix)
        names = {"p": prefix, "P": prefix.upper()}
        body = _affine(model) if model.is_affine_map else _polynomial(model)
        settings = {"steps": str(self.max_iterations), "still": number(STILL)}
        settings["rank"] = str(min(len(model.factors), len(model.responses)))
        source = Template(_parts(model)).substitute(names, **_common(model), **body, **settings, **_logs(model, names))
        return {f"{prefix}.h": _header(model, names, settings), f"{prefix}.c": source}


def _header(model: "Surrogate", names: dict[str, str], settings: dict[str, str]) -> str:
    affine = model.is_affine_map
    unique = affine and len(model.factors) <= len(model.responses) and affine_inverse(model).condition < np.inf
    several = "" if unique else text.SEVERAL_NOTE
    note = Template(text.AFFINE_NOTE if affine else text.POLYNOMIAL_NOTE)
    logs = " and ".join(model.responses[j].name for j in _by_log(model))
    against = obstacle(model)
    example = text.EXAMPLE_WITHOUT_INVERSE if against else text.EXAMPLE_WITH_INVERSE
    inverse = Template(text.WITHOUT_INVERSE if against else text.WITH_INVERSE)
    return Template(text.HEADER).substitute(
        names,
        n=str(len(model.factors)),
        m=str(len(model.responses)),
        about="\n".join(f" * {line}".rstrip() for line in about(model)),
        logarithms=Template(text.LOGARITHMS).substitute(names=logs) if logs else "",
        centre=", ".join(number(c) for c in model.factors.centre),
        factor_indices=_indices(f"{names['P']}_FACTOR", model.factors.names),
        response_indices=_indices(f"{names['P']}_RESPONSE", tuple(r.name for r in model.responses)),
        example=Template(example).substitute(names),
        inverse=inverse.substitute(
            names,
            obstacle=textwrap.indent(textwrap.fill(f"There is no inverse: {against}.", WIDTH), " * "),
            inverse_note=note.substitute(settings, several=several),
            accuracy=f"{TARGET_TOLERANCE:g}",
            of_logarithms=f",\n * of {logs} in logarithms" if logs else "",
        ),
    )


def _parts(model: "Surrogate") -> str:
    """Templates of the source: what only the inverse needs is left out with it."""
    affine = model.is_affine_map
    jacobian, search = (AFFINE_JACOBIAN, AFFINE_SEARCH) if affine else (POLYNOMIAL_JACOBIAN, POLYNOMIAL_SEARCH)
    if obstacle(model):
        return text.SOURCE + text.FORWARD + jacobian
    inverse = INVERSE_WITH_LOGARITHMS if model.has_logs else INVERSE
    return text.SOURCE + text.CHECK + text.FORWARD + jacobian + search + inverse


def _by_log(model: "Surrogate") -> list[int]:
    """Positions of the responses that are given by their logarithm."""
    return [j for j, link in enumerate(model.links) if link == LOG]


def _logs(model: "Surrogate", names: dict[str, str]) -> dict[str, str]:
    """What the border between the polynomials and the responses adds to the source; nothing without logarithms."""
    logs = _by_log(model)
    if not logs:
        empty = dict.fromkeys(("exponentials", "values_here", "values_too", "chained", "logarithms"), "")
        return {**empty, "values": "Responses", "value": "response"}
    loop = f"\n    for (int j = 0; j < {names['P']}_N_FACTORS; ++j) {{"
    rows = "".join(f"\n        jacobian[{j}][j] *= exp(value[{j}]);" for j in logs)
    checks = [
        f"    if (!(responses[{j}] > 0.0)) {{\n        return {names['P']}_UNREACHABLE;\n    }}\n"
        f"    wanted[{j}] = log(responses[{j}]);"
        for j in logs
    ]
    return {
        "exponentials": "".join(f"\n        responses[{j}] = exp(responses[{j}]);" for j in logs),
        "values_here": f"\n    double value[{names['P']}_N_RESPONSES];",
        "values_too": f"\n    {names['p']}_evaluate(coded, value);",
        "chained": f"{loop}{rows}\n    }}",
        "logarithms": "\n".join(checks),
        "values": "Responses, of some the logarithm,",
        "value": "response (of some: d logarithm)",
    }


def _check_locals(model: "Surrogate", prefix: str) -> None:
    """Raise ``ValueError`` if a variable named after a factor or response would hide one of the functions."""
    powers = range(1, max(model.terms.degrees, default=0) + 1)
    local = {_power(n, e): n for n in model.factors.names for e in powers}
    local.update({f"d_{r.name}": r.name for r in model.responses})
    for word in text.OWN:
        if f"{prefix}_{word}" in local:
            raise ValueError(
                f"prefix {prefix!r} is not allowed: with {local[f'{prefix}_{word}']!r} it makes one name for two things"
            )


def _common(model: "Surrogate") -> dict[str, str]:
    """What the source of every model has: coding, polynomials, ranges, tolerances."""
    scaling = list(zip(model.factors, model.factors.centre, model.factors.half_range, strict=True))
    coding = []
    for i, (factor, centre, half) in enumerate(scaling):
        moved = f"(settings[{i}]{_less(centre)})" if centre else f"settings[{i}]"
        coding.append(f"    coded[{i}] = {moved} / {number(half)}; /* {factor.name} */")
    used, sums = [], []
    for j, response in enumerate(model.responses):
        rows = [(c, row) for c, row in zip(model.coefficients[:, j], model.terms.exponents, strict=True) if c]
        used += [row for _, row in rows]
        terms = [(c, _product(model, row)) for c, row in rows]
        unit = unit_of(model.links[j], response.name, plain(response.unit))
        sums.append(f"    /* {response.name} [{unit}] */\n{_sum(f'responses[{j}]', terms)}")
    return {
        "coding": "\n".join(coding),
        "polynomials": _powers(model, used) + "\n\n" + "\n".join(sums),
        "box": number(1.0 + BOX_TOLERANCE),
        "low": _list([f.low for f in model.factors]),
        "high": _list([f.high for f in model.factors]),
        "tolerance": _list(TARGET_TOLERANCE * model.scale),
    }


def _affine(model: "Surrogate") -> dict[str, str]:
    """Constant Jacobian and closed-form inverse."""
    centre = model.factors.centre
    slope, constant = model.jacobian(centre[None])[0], model.predict(centre[None])[0]
    gain = affine_inverse(model).gain
    moves = [
        f"    const double d_{r.name} = responses[{j}]{_less(constant[j])};"
        for j, r in enumerate(model.responses)
        if gain[:, j].any()
    ]
    rows = []
    for i, factor in enumerate(model.factors):
        terms = [(centre[i], ()), *((gain[i, j], (f"d_{r.name}",)) for j, r in enumerate(model.responses))]
        rows.append(f"    /* {factor.name} [{plain(factor.unit)}] */\n{_sum(f'settings[{i}]', terms)}")
    return {
        "slope": "\n".join(f"    jacobian[{j}][{i}] = {number(v)};" for (j, i), v in np.ndenumerate(slope)),
        "moves": "\n".join([_MOVES, *moves, "", ""]) if moves else "",
        "inverse": "\n".join(rows),
    }


def _polynomial(model: "Surrogate") -> dict[str, str]:
    """Derivatives of the polynomials by coded factors, and the numbers that the iteration needs."""
    used, lines = [], []
    for j, response in enumerate(model.responses):
        lines.append(f"    /* {response.name} */")
        for i in range(len(model.factors)):
            rows = [
                (c * row[i], (*row[:i], row[i] - 1, *row[i + 1 :]))
                for c, row in zip(model.coefficients[:, j], model.terms.exponents, strict=True)
                if c and row[i]
            ]
            used += [row for _, row in rows]
            lines.append(_sum(f"slope[{j}][{i}]", [(c, _product(model, row)) for c, row in rows]))
    scaling = enumerate(zip(model.factors.centre, model.factors.half_range, strict=True))
    return {
        "derivatives": _powers(model, used) + "\n\n" + "\n".join(lines),
        "half": _list(model.factors.half_range),
        "scale": _list(model.scale),
        "decoding": "\n".join(_sum(f"settings[{i}]", [(c, ()), (h, (f"coded[{i}]",))]) for i, (c, h) in scaling),
    }


def _product(model: "Surrogate", row: tuple[int, ...]) -> tuple[str, ...]:
    return tuple(_power(n, e) for n, e in zip(model.factors.names, row, strict=True) if e)


def _power(factor: str, exponent: int) -> str:
    # The prefix keeps factor names clear of C keywords and of everything else in the function.
    return f"x_{factor}" if exponent == 1 else f"x{exponent}_{factor}"


def _powers(model: "Surrogate", rows: list[tuple[int, ...]]) -> str:
    """Declarations of the powers that `rows` of exponents need, each one multiplication."""
    lines = []
    for i, factor in enumerate(model.factors.names):
        for e in range(1, max((row[i] for row in rows), default=0) + 1):
            value = f"{_power(factor, e - 1)} * {_power(factor, 1)}" if e > 1 else f"coded[{i}]"
            lines.append(f"    const double {_power(factor, e)} = {value};")
    return "\n".join(lines) or "    (void)coded; /* constant */"


def _sum(target: str, terms: list[Product]) -> str:
    """``target = sum of terms;`` with one term a line and zeros left out."""
    parts = []
    for coefficient, names in terms:
        if coefficient:
            sign = "-" if coefficient < 0.0 else "+"
            parts.append(f"{sign} {' * '.join((number(abs(coefficient)), *names))}")
    if not parts:
        return f"    {target} = 0.0;"
    first = parts[0].removeprefix("+ ").replace("- ", "-", 1)
    return f"    {target} = " + "\n        ".join((first, *parts[1:])) + ";"


def _less(value: float) -> str:
    return f" {'-' if value > 0.0 else '+'} {number(abs(value))}" if value else ""


def _list(values: Iterable[float]) -> str:
    numbers = ", ".join(number(v) for v in values)
    return numbers if len(numbers) <= 60 else "\n" + textwrap.indent(textwrap.fill(numbers, 92), " " * 8) + "\n    "


def _indices(kind: str, names: tuple[str, ...]) -> str:
    return ",\n".join(f"    {kind}_{name} = {i}" for i, name in enumerate(names))

"""Functions for MATLAB and GNU Octave, one file each: no toolbox, no syntax that only one of them has.

Source: MATLAB documentation, "Add Help for Your Program", "namelengthmax", "Compatible Array Sizes for Basic
Operations" (R2016b); GNU Octave 7 manual, sections 11.3 (functions), 19.1 (broadcasting).
"""

import textwrap
from collections.abc import Iterable
from dataclasses import dataclass
from string import Template
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from experiments.designs.base import check_count
from experiments.settings import parameter

from ...inversion import BOX_TOLERANCE, MAX_ITERATIONS, affine_inverse, obstacle
from ...links import logarithmic
from ..base import WIDTH, about, check_prefix, number
from ..inverse_plan import InversePlan, inverse_plan
from ..products import Term, chain
from . import text as text

if TYPE_CHECKING:
    from ...model import Surrogate

LONGEST_NAME = 63
"""Characters of a function's name (and of its file's, less ``.m``) that MATLAB tells apart."""


@dataclass(frozen=True)
class Matlab:
    """Forward map, Jacobian, domain check and inverse as functions of matrices with a row for each point.

    ``<prefix>_forward.m``, ``_jacobian.m``, ``_inside.m``, ``_inverse.m`` are public, ``_polynomials.m`` holds the
    table of terms that they share; ``help <prefix>_forward`` says what the model is. The inverse follows
    :class:`.InversePlan`; where there is an :func:`surrogates.inversion.obstacle`, there is none, and the help says
    why. Sizes follow from the arguments and no array grows, as MATLAB Coder wants it.

    Parameters
    ----------
    max_iterations : int
        Most Gauss–Newton steps where no certificate counts them: bounds the time that an inversion takes.

    Raises
    ------
    ValueError
        If `max_iterations` is not a whole number of at least 1.
    """

    name: ClassVar[str] = "matlab"
    summary: ClassVar[str] = "MATLAB and GNU Octave functions: forward, Jacobian, inverse, domain check"

    max_iterations: int = parameter(
        MAX_ITERATIONS, "steps", "most Gauss-Newton steps of an inverse without certificate"
    )

    def __post_init__(self) -> None:
        check_count("max_iterations of the MATLAB export", self.max_iterations, 1)

    def render(self, model: "Surrogate", prefix: str) -> dict[str, str]:
        """Texts of the functions by file name; see :class:`.Target`.

        Raises
        ------
        ValueError
            If `prefix` is a keyword or makes a name too long, or a number of the model overflows.
        """
        check_prefix(prefix, frozenset(text.RESERVED.split()))
        most = LONGEST_NAME - len("_polynomials")
        if len(prefix) > most:
            raise ValueError(
                f"prefix {prefix!r} is not allowed: MATLAB's names have at most {LONGEST_NAME} characters, and "
                f"'_polynomials' is added to it; use at most {most}"
            )
        fields = _sizes(model, prefix) | _documented(model, prefix) | _mapped(model) | _tables(model)
        files = {
            "forward": text.FORWARD,
            "jacobian": text.JACOBIAN,
            "inside": text.INSIDE,
            "polynomials": text.POLYNOMIALS,
        }
        if not obstacle(model):
            files["inverse"] = text.INVERSE
            fields |= _inverse(model, inverse_plan(model, self.max_iterations), fields)
        return {f"{prefix}_{word}.m": Template(body).substitute(fields) for word, body in files.items()}


def row(values: Iterable[float]) -> str:
    """A row vector, folded where it is long."""
    return _bracketed(number(float(v)) for v in values)


def whole_row(values: Iterable[int]) -> str:
    """The same of whole numbers."""
    return _bracketed(str(v) for v in values)


def _bracketed(items: Iterable[str]) -> str:
    text = ", ".join(items)
    if len(text) <= WIDTH - 20:
        return f"[{text}]"
    return "[ ...\n    " + " ...\n    ".join(_folded(text)) + "]"


def _matrix(rows: Iterable[Iterable[float]]) -> str:
    """Rows of a matrix without its brackets."""
    return "\n".join(f"    {_continued([number(float(v)) for v in values])};" for values in rows)


def _continued(items: list[str]) -> str:
    return " ...\n        ".join(_folded(", ".join(items)))


def _folded(numbers: str) -> list[str]:
    return textwrap.wrap(numbers, WIDTH - 8, break_long_words=False, break_on_hyphens=False)


def _comment(lines: Iterable[str]) -> str:
    """Lines of plain text as lines of a comment: what follows the mark and blanks cannot end it or open a block."""
    return "\n".join(f"%   {line}".rstrip() for line in lines)


def _logged(model: "Surrogate") -> list[int]:
    """Positions, from 1, of the responses that are given by their logarithm."""
    return [int(j) + 1 for j in np.flatnonzero(logarithmic(model.links))]


def _sizes(model: "Surrogate", prefix: str) -> dict[str, str]:
    factors = model.factors
    return {
        "p": prefix,
        "P": prefix.upper(),
        "n": str(len(factors)),
        "m": str(len(model.responses)),
        "box": number(1.0 + BOX_TOLERANCE),
        "centres": row(factors.centre),
        "half": row(factors.half_range),
        "per_half": row(1.0 / factors.half_range),
        "columns": _columns(factors.names),
        "response_columns": _columns(tuple(r.name for r in model.responses)),
    }


def _columns(names: tuple[str, ...]) -> str:
    """For an error's text: how many columns, and which if they are few. Names have no quotes or per cents."""
    listed = ", ".join(names)
    count = f"{len(names)} column{'s' * (len(names) > 1)}"
    return f"{count}: {listed}" if len(listed) <= 60 else f"{count}"


def _documented(model: "Surrogate", prefix: str) -> dict[str, str]:
    """What the help of the forward map says of the model."""
    against, names = obstacle(model), [model.responses[j - 1].name for j in _logged(model)]
    logs = (
        f"The polynomials give ln(response / unit) of {' and '.join(names)}: the exponential is taken here, with no "
        "correction of the mean, and the inverse takes logarithms. It refuses a target of theirs that is not positive."
    )
    why = textwrap.wrap(f"There is no inverse: {against}.", WIDTH)
    return {
        "about": _comment(about(model)),
        "centre": " ...\n%       ".join(_folded(", ".join(number(v) for v in model.factors.centre))),
        "about_logarithms": f"\n{_comment(textwrap.wrap(logs, WIDTH))}\n%" if names else "",
        "see_inverse": "" if against else f", {prefix}_inverse",
        "obstacle": f"\n%\n{_comment(why)}" if against else "",
    }


def _mapped(model: "Surrogate") -> dict[str, str]:
    """What the border between the polynomials and the responses adds; nothing without logarithms."""
    logs = whole_row(_logged(model))
    if not _logged(model):
        return {"exponentials": "", "chained": "", "values": "~", "kind": "responses"}
    return {
        "exponentials": f"\nresponses(:, {logs}) = exp(responses(:, {logs}));",
        "chained": (
            f"\nfor i = {logs}\n    jacobian(i, :, :) = jacobian(i, :, :) .* reshape(exp(value(:, i)), 1, 1, []);\nend"
        ),
        "values": "value",
        "kind": "responses, or of some the logarithm,",
    }


def _tables(model: "Surrogate") -> dict[str, str]:
    """The terms as a chain of products: positions from 1."""
    terms = chain(model)
    places = {term.positions: i + 1 for i, term in enumerate(terms)}
    return {
        "terms": str(len(terms)),
        "earlier": whole_row(places[t.positions[:-1]] if t.positions else 0 for t in terms),
        "setting": whole_row(t.positions[-1] + 1 if t.positions else 0 for t in terms),
        "coefficients": "\n".join(_term(term) for term in terms),
    }


def _term(term: Term) -> str:
    """A line of the table with its label, the label before it where they do not fit on one."""
    numbers = _continued([number(c) for c in term.coefficients])
    whole = f"    {numbers}; % {term.label}"
    return whole if len(whole) <= WIDTH and "\n" not in whole else f"    % {term.label}\n    {numbers};"


def _inverse(model: "Surrogate", plan: InversePlan, sizes: dict[str, str]) -> dict[str, str]:
    logs = whole_row(_logged(model))
    fields = {
        "constant": row(plan.constant),
        "gain": _matrix(plan.gain),
        "low": row(f.low for f in model.factors),
        "high": row(f.high for f in model.factors),
        "tolerance": row(plan.tolerance),
        "logarithms": Template(text.INVERSE_LOGARITHMS).substitute(logs=logs) if _logged(model) else "",
        "not_converged": "" if plan.affine else text.NOT_CONVERGED,
        "note": _note(model, plan),
    }
    return fields | {"search": "" if plan.affine else _search(model, plan, sizes)}


def _search(model: "Surrogate", plan: InversePlan, sizes: dict[str, str]) -> str:
    fields = {"p": sizes["p"], "limit": number(plan.limit), "chords": str(plan.chords)}
    chords = Template(text.CHORDS).substitute(fields) if plan.chords else ""
    return Template(text.SEARCH).substitute(
        fields
        | {
            "per_scale": row(1.0 / model.scale),
            "first": text.FIRST if plan.chords else "",
            "steps": str(plan.steps),
            "solved": text.CONTRACTING if plan.contracting else text.FREE,
            "still": number(plan.still),
            "chords": chords,
        }
    )


def _note(model: "Surrogate", plan: InversePlan) -> str:
    unique = model.is_affine_map and len(model.factors) <= len(model.responses)
    several = "" if unique and affine_inverse(model).condition < np.inf else text.SEVERAL
    kind = text.AFFINE_NOTE if plan.affine else text.CERTIFIED_NOTE if plan.certified else text.FREE_NOTE
    chords = f",\n%   and {plan.chords} chord steps if they do not end" if plan.chords else ""
    return Template(kind).substitute(steps=str(plan.steps), several=several, and_chords=chords)

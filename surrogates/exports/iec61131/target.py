"""IEC 61131-3 structured text: function blocks for programmable logic controllers, in one file.

Source: IEC 61131-3:2013 (3rd ed.), sections 6.4.4.5 (arrays), 6.5 (variables), 6.6.3 (function blocks) and 7.3
(structured text). No methods, references, pragmas, nested comments, nor types or functions of a vendor's.
"""

import re
from dataclasses import dataclass
from string import Template
from typing import TYPE_CHECKING, ClassVar

from experiments.designs.base import check_count
from experiments.settings import parameter

from ...inversion import BOX_TOLERANCE, MAX_ITERATIONS, obstacle
from ..base import about, check_prefix
from ..inverse_plan import InversePlan, inverse_plan
from . import inverse_text as inverse_text
from . import printing as st
from . import text as text
from .polynomials import gradients, values

if TYPE_CHECKING:
    from ...model import Surrogate

LARGEST = "1.79E+308"
"""What counts as infinite: the largest number of the type itself is rounded up by some compilers."""

DEPENDENT = 1e-24
"""Rows of the Jacobian whose square is less than this fraction of the longest are combinations of others."""


@dataclass(frozen=True)
class StructuredText:
    """Forward map, Jacobian, domain check and inverse as function blocks of type LREAL, in ``<prefix>.st``.

    Settings and responses are arrays, positions as in ``model.json``: axes are looped over, Jacobians have two
    subscripts, and names of factors may be reserved words of the language, or equal in it but for case. The inverse
    follows :class:`.InversePlan`; where there is an :func:`surrogates.inversion.obstacle`, there is none, and the file
    says why.

    Parameters
    ----------
    max_iterations : int
        Most Gauss–Newton steps where no certificate counts them: bounds the time that an inversion takes.

    Raises
    ------
    ValueError
        If `max_iterations` is not a whole number of at least 1.
    """

    name: ClassVar[str] = "iec61131"
    summary: ClassVar[str] = "IEC 61131-3 structured text for PLCs: forward, Jacobian, inverse, domain check"

    max_iterations: int = parameter(
        MAX_ITERATIONS, "steps", "most Gauss-Newton steps of an inverse without certificate"
    )

    def __post_init__(self) -> None:
        check_count("max_iterations of the IEC 61131-3 export", self.max_iterations, 1)

    def render(self, model: "Surrogate", prefix: str) -> dict[str, str]:
        """``<prefix>.st``; see :class:`.Target`.

        Raises
        ------
        ValueError
            If `prefix` is not an identifier of the language, which has no two underscores in a row and none at the
            end; or a number of the model overflows.
        """
        check_prefix(prefix, frozenset())
        if "__" in prefix or prefix.endswith("_"):
            raise ValueError(
                f"prefix {prefix!r} is not allowed in IEC 61131-3: an identifier has no two underscores in a row "
                "and none at its end; choose another"
            )
        plan = None if obstacle(model) else inverse_plan(model, self.max_iterations)
        parts = [text.HEADER, text.INSIDE, text.VALUE, text.GRADIENT, text.FORWARD, text.JACOBIAN]
        fields = {**_sizes(model, prefix), **_forward(model)}
        fields |= _header(model, plan, prefix)
        if plan:
            blocks, more = _inverse(model, plan, fields)
            parts, fields = [*parts, *blocks], fields | more
        whole = Template("".join(parts)).substitute(fields)
        return {f"{prefix}.st": re.sub(r"\n{3,}", "\n\n", whole)}


def _sizes(model: "Surrogate", prefix: str) -> dict[str, str]:
    n, m = len(model.factors), len(model.responses)
    return {
        "p": prefix,
        "n1": str(n - 1),
        "m1": str(m - 1),
        "rank": str(min(n, m)),
        "largest": LARGEST,
        "box": st.literal(1.0 + BOX_TOLERANCE),
    }


def _header(model: "Surrogate", plan: InversePlan | None, prefix: str) -> dict[str, str]:
    logs = " and ".join(model.responses[j].name for j in _logged(model))
    if plan is None:
        inverse, bound = st.comment_lines(["", f"There is no inverse: {obstacle(model)}."]), text.BOUND_NONE
    else:
        kind = text.AFFINE_KIND if plan.affine else text.CERTIFIED_KIND if plan.certified else text.FREE_KIND
        inverse = Template(text.WITH_INVERSE).substitute(p=prefix, kind=kind)
        chords = f" and {plan.chords} chord steps" if plan.chords else ""
        bound = text.BOUND_CLOSED if plan.affine else f"at most {plan.steps} Newton steps{chords}"
    return {
        "about": st.comment_lines(about(model)),
        "about_logarithms": Template(text.LOGARITHMS).substitute(names=logs) if logs else "",
        "inverse": inverse,
        "bound": bound,
    }


def _logged(model: "Surrogate") -> list[int]:
    return [j for j, link in enumerate(model.links) if link == "log"]


def _forward(model: "Surrogate") -> dict[str, str]:
    """What the blocks of the forward map need."""
    value_names, value_lines = values(model)
    gradient_names, gradient_lines = gradients(model)
    logs = _logged(model)
    ranges = zip(model.factors, model.factors.centre, model.factors.half_range, strict=True)
    chained = "".join(
        f"\n    FOR j := 0 TO {len(model.factors) - 1} DO"
        f"\n        jacobian[{i}, j] := jacobian[{i}, j] * responses[{i}];\n    END_FOR;"
        for i in logs
    )
    return {
        "coding": "\n".join(
            f"coded[{i}] := {st.difference(f'settings[{i}]', centre)} * {st.literal(1.0 / half)};"
            f" (* {st.comment(f'{factor.name} [{factor.unit}]')} *)"
            for i, (factor, centre, half) in enumerate(ranges)
        ),
        "values": "responses, of some the logarithm," if logs else "responses",
        "value_temporaries": st.temporaries(value_names),
        "value_body": "\n".join(value_lines),
        "gradient_temporaries": st.temporaries(gradient_names),
        "gradient_body": "\n".join(gradient_lines),
        "exponentials": "".join(f"\n    responses[{j}] := EXP(responses[{j}]);" for j in logs),
        "chained": chained,
        "per_half": st.constant("per_half", (1.0 / model.factors.half_range).tolist()),
    }


def _inverse(model: "Surrogate", plan: InversePlan, sizes: dict[str, str]) -> tuple[list[str], dict[str, str]]:
    """The blocks of the inverse, and what they need."""
    logs = "".join(
        f"\nIF NOT (responses[{j}] > 0.0) THEN\n    status := 2;\n    RETURN;\nEND_IF;"
        f"\nwanted[{j}] := LN(responses[{j}]);"
        for j in _logged(model)
    )
    constants = [
        st.matrix("gain", plan.gain.tolist()),
        st.constant("constant_part", plan.constant.tolist()),
        st.constant("centre", model.factors.centre.tolist()),
        st.constant("half", model.factors.half_range.tolist()),
        st.constant("low", [f.low for f in model.factors]),
        st.constant("high", [f.high for f in model.factors]),
        st.constant("tolerance", plan.tolerance.tolist()),
    ]
    if not (plan.affine or plan.contracting):
        constants.append(st.constant("per_scale", (1.0 / model.scale).tolist()))
    before, search = _search(plan)
    fields = {"constants": "\n".join(constants), "logarithms": logs, **_iteration(plan, sizes)}
    return [*before, inverse_text.BEGIN, *search, inverse_text.CHECK], fields


def _search(plan: InversePlan) -> tuple[list[str], list[str]]:
    """Blocks before that of the inverse, and what its body has between its first step and its check."""
    if plan.affine:
        return [], []
    solver = inverse_text.SOLVE if plan.contracting else inverse_text.LEAST_NORM
    chords = [inverse_text.CHORDS] if plan.chords else []
    return [inverse_text.WITHIN, solver], [inverse_text.STEPS, *chords]


def _iteration(plan: InversePlan, sizes: dict[str, str]) -> dict[str, str]:
    """What an iterative inverse adds to the closed one; nothing if the plan is affine."""
    if plan.affine:
        return dict.fromkeys(("blocks", "counters", "temporaries", "first", "not_moving", "not_moving_either"), "")
    first = inverse_text.CLIPPED_FIRST + (inverse_text.KEPT_FIRST if plan.chords else "")
    step = inverse_text.CONTRACTING_STEP if plan.contracting else inverse_text.FREE_STEP
    # What the Newton step solves is premultiplied by the gain where it contracts: then it has a row per factor.
    fields = {
        **sizes,
        "r1": sizes["n1"] if plan.contracting else sizes["m1"],
        "kept": Template(inverse_text.KEPT).substitute(sizes) if plan.chords else "",
    }
    return {
        "blocks": Template(inverse_text.BLOCKS).substitute(fields),
        "counters": inverse_text.COUNTERS[plan.contracting],
        "temporaries": Template(inverse_text.TEMPORARIES).substitute(fields),
        "first": Template(first).substitute(fields),
        "not_moving": inverse_text.NOT_MOVING,
        "not_moving_either": inverse_text.NOT_MOVING.replace("\n", "\n    "),
        "one_step": Template(step).substitute(fields),
        "steps": str(plan.steps),
        "chords": str(plan.chords),
        "limit": st.literal(plan.limit),
        "still": st.literal(plan.still),
        "dependent": st.literal(DEPENDENT),
    }

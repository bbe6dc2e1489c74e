"""Python: one readable file that needs NumPy alone, for analysis, simulation and tests beside a controller."""

import textwrap
from dataclasses import dataclass
from string import Template
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from experiments.designs.base import check_count
from experiments.settings import parameter

from ...inversion import BOX_TOLERANCE, MAX_ITERATIONS, TARGET_TOLERANCE, obstacle
from ...links import logarithmic
from ...multiplicity import at_most_one
from ..base import about, check_prefix, number
from ..inverse_plan import InversePlan, inverse_plan
from ..products import chain
from . import numpy_text as text
from .names import RESERVED
from .parts import WIDTH, escaped, factor_rows, numbers, python_table, response_rows

if TYPE_CHECKING:
    from ...model import Surrogate


@dataclass(frozen=True)
class NumPyFile:
    """Forward map, Jacobian, domain check and inverse in one Python file, all rows at once.

    The inverse takes the steps of :class:`.InversePlan`, as the C does: a target that they do not reach is refused
    with a status, without a search of the domain's boundary. Where there is an :func:`surrogates.inversion.obstacle`,
    the file has no inverse and says why.

    Parameters
    ----------
    max_iterations : int
        Most steps of an inversion where no certificate counts them.

    Raises
    ------
    ValueError
        If `max_iterations` is not a whole number of at least 1.
    """

    name: ClassVar[str] = "python"
    summary: ClassVar[str] = "Python file that needs NumPy alone: forward, Jacobian, inverse, domain check"

    max_iterations: int = parameter(
        MAX_ITERATIONS, "steps", "most steps of one inversion, where no certificate counts them"
    )

    def __post_init__(self) -> None:
        check_count("max_iterations of the Python export", self.max_iterations, 1)

    def render(self, model: "Surrogate", prefix: str) -> dict[str, str]:
        """``<prefix>.py``; see :class:`.Target`."""
        check_prefix(prefix, RESERVED)
        factors = model.factors
        source = Template(text.MODULE).substitute(
            p=prefix,
            n=str(len(factors)),
            m=str(len(model.responses)),
            about=escaped(about(model)),
            operations=_operations(model),
            factors=factor_rows(model, ranges=True),
            responses=response_rows(model, "Response"),
            centre=numbers(factors.centre),
            half=numbers(factors.half_range),
            box=number(1.0 + BOX_TOLERANCE),
            terms=python_table(chain(model)),
            **_logarithms(model),
            **_inverse(model, prefix, self.max_iterations),
        )
        return {f"{prefix}.py": source}


def _logarithms(model: "Surrogate") -> dict[str, str]:
    """What responses that are given by their logarithm add; nothing where there are none."""
    if not model.has_logs:
        return dict.fromkeys(("logarithms", "exponentials", "chained"), "")
    names = " and ".join(model.responses[j].name for j in _by_log(model))
    return {
        "logarithms": Template(text.LOGARITHMS).substitute(names=names),
        "exponentials": text.EXPONENTIALS,
        "chained": text.CHAINED,
    }


def _inverse(model: "Surrogate", prefix: str, max_iterations: int) -> dict[str, str]:
    """The inverse with its constants, or why there is none."""
    logs = Template(text.LOG_CONSTANT).substitute(logarithmic=str(_by_log(model))) if model.has_logs else ""
    if against := obstacle(model):
        why = textwrap.fill(f"There is no inverse: {against}.", WIDTH)
        parts = dict.fromkeys(("inverse", "search", "example"), "")
        return {**parts, "no_inverse": Template(text.NO_INVERSE).substitute(reason=why), "constants": logs}
    plan = inverse_plan(model, max_iterations)
    inverse = Template(text.INVERSE).substitute(
        n=str(len(model.factors)),
        m=str(len(model.responses)),
        note=_note(model, plan),
        accuracy=f"{TARGET_TOLERANCE:g}",
        refusals=text.REFUSE_LOGS if model.has_logs else "",
        logs=text.TAKE_LOGS if model.has_logs else "",
    )
    step = text.NEWTON_STEP if plan.certified else text.LEAST_NORM_STEP
    solved = text.CLOSED_SOLVED if plan.affine else text.ITERATED_SOLVED + step
    return {
        "inverse": inverse,
        "search": text.SEARCH + solved,
        "example": Template(text.EXAMPLE).substitute(p=prefix),
        "no_inverse": "",
        "constants": logs + _constants(model, plan),
    }


def _constants(model: "Surrogate", plan: InversePlan) -> str:
    iteration = ""
    if not plan.affine:
        iteration = Template(text.ITERATION).substitute(
            scale=numbers(model.scale), steps=str(plan.steps), limit=number(plan.limit), still=number(plan.still)
        )
    return Template(text.CONSTANTS).substitute(
        gain="\n".join(f"    {numbers(row)}," for row in plan.gain),
        constant=numbers(plan.constant),
        tolerance=numbers(plan.tolerance),
        in_link_units=", of some the logarithm" if model.has_logs else "",
        iteration=iteration,
    )


def _note(model: "Surrogate", plan: InversePlan) -> str:
    """How the inverse searches, for its docstring."""
    if plan.affine:
        return Template(text.CLOSED_NOTE).substitute(several="" if at_most_one(model) else text.SEVERAL)
    return Template(text.CERTIFIED_NOTE if plan.certified else text.FREE_NOTE).substitute(steps=str(plan.steps))


def _by_log(model: "Surrogate") -> list[int]:
    """Positions of the responses that are given by their logarithm."""
    return [int(j) for j in np.flatnonzero(logarithmic(model.links))]


def _operations(model: "Surrogate") -> str:
    """The work of forward() on one row, in a sentence."""
    terms, n, logs = chain(model), len(model.factors), len(_by_log(model))
    return Template(text.OPERATIONS).substitute(
        times=str(len(terms) * (1 + len(model.responses)) - 1),
        divisions=f"{n} division{'s' * (n > 1)}",
        ends=f" and {logs} exponential{'s' * (logs > 1)}" if logs else "",
    )

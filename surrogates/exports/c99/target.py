"""C99 for a controller: a header, a source file and a program that tests them. No heap, no globals, no recursion."""

import textwrap
from dataclasses import dataclass
from string import Template
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from experiments.designs.base import check_count
from experiments.settings import parameter

from ...inversion import MAX_ITERATIONS, affine_inverse, obstacle
from ..base import WIDTH, about, check_prefix
from . import text as text
from .operations import operations
from .precision import DOUBLE, SINGLE, Precision
from .selftest import selftest
from .source import Parts, logged

if TYPE_CHECKING:
    from ...model import Surrogate


@dataclass(frozen=True)
class C99:
    """Forward map, Jacobian, domain check and inverse in C99, also valid C++.

    The inverse follows :class:`.InversePlan`: closed form for an affine model, the certificate's count of Newton
    steps for a certified one, a bounded number of Gauss–Newton steps for any other; unlike Python, the C does not
    search the domain's boundary where they fail, it refuses. Where there is an :func:`surrogates.inversion.obstacle`,
    the code has no inverse and says why. Of a response that is given by its logarithm, the functions take and give the
    response itself.

    Parameters
    ----------
    max_iterations : int
        Most Gauss–Newton steps where no certificate counts them: bounds the time that an inversion takes.

    Raises
    ------
    ValueError
        If `max_iterations` is not a whole number of at least 1.
    """

    name: ClassVar[str] = "c99"
    summary: ClassVar[str] = "C99 header, source and self-test: forward, Jacobian, inverse, domain check"
    precision: ClassVar[Precision] = DOUBLE

    max_iterations: int = parameter(
        MAX_ITERATIONS, "steps", "most Gauss-Newton steps of an inverse without certificate"
    )

    def __post_init__(self) -> None:
        check_count("max_iterations of the C99 export", self.max_iterations, 1)

    def prefix_of(self, prefix: str) -> str:
        """What begins every public name and the files' names, given the prefix of the export."""
        return prefix + self.precision.ending

    def render(self, model: "Surrogate", prefix: str) -> dict[str, str]:
        """``<prefix>.h``, ``<prefix>.c`` and ``<prefix>_selftest.c``; see :class:`.Target`."""
        check_prefix(prefix, frozenset(text.RESERVED.split()))
        name = self.prefix_of(prefix)
        parts = Parts(model, name, self.precision, self.max_iterations)
        return {
            f"{name}.h": _header(parts),
            f"{name}.c": parts.source(),
            f"{name}_selftest.c": selftest(model, name, self.precision),
        }


@dataclass(frozen=True)
class C99Float(C99):
    """The same in single precision, for processors whose hardware has no other; names end in ``_float``.

    Settings count as inside to 1e-6 of the half-ranges, and targets as reached to 1e-5 of the responses' scale, or to
    what seven digits allow where a response changes little beside its size: the header says to what. Models for which
    that is too little are refused.
    """

    name: ClassVar[str] = "c99_float"
    summary: ClassVar[str] = "the same in single precision"
    precision: ClassVar[Precision] = SINGLE


def _header(parts: Parts) -> str:
    model, names, c = parts.model, parts.names, parts.precision.printer
    against = obstacle(model)
    example = text.EXAMPLE_WITHOUT_INVERSE if against else text.EXAMPLE_WITH_INVERSE
    inverse = Template(text.WITHOUT_INVERSE if against else text.WITH_INVERSE)
    logs = " and ".join(model.responses[j].name for j in logged(model))
    return Template(text.HEADER).substitute(
        names,
        n=str(len(model.factors)),
        m=str(len(model.responses)),
        about="\n".join(f" * {line}".rstrip() for line in about(model)),
        libraries="needs exp and log of math.h" if logs else "needs no library, not even math.h",
        logarithms=Template(text.LOGARITHMS).substitute(names=logs) if logs else "",
        operations="\n".join(f" *   {line}" for line in operations(parts)),
        centre=", ".join(c.number(v) for v in model.factors.centre),
        factor_indices=_indices(f"{names['P']}_FACTOR", model.factors.names),
        response_indices=_indices(f"{names['P']}_RESPONSE", tuple(r.name for r in model.responses)),
        example=Template(example).substitute(names),
        inverse=inverse.substitute(
            names,
            obstacle=textwrap.indent(textwrap.fill(f"There is no inverse: {against}.", WIDTH), " * "),
            inverse_note=_note(parts),
            accuracy=f"{parts.accuracy:.1g}",
            of_logarithms=f",\n * of {logs} in logarithms" if logs else "",
        ),
    )


def _note(parts: Parts) -> str:
    model, plan = parts.model, parts.plan
    unique = model.is_affine_map and len(model.factors) <= len(model.responses)
    several = "" if unique and affine_inverse(model).condition < np.inf else text.SEVERAL_NOTE
    kind = text.AFFINE_NOTE if plan.affine else text.CERTIFIED_NOTE if plan.certified else text.FREE_NOTE
    chords = Template(text.CHORDS_NOTE).substitute(count=str(plan.chords)) if plan.chords else ""
    return Template(kind).substitute(steps=str(plan.steps), several=several, chords=chords)


def _indices(kind: str, names: tuple[str, ...]) -> str:
    return ",\n".join(f"    {kind}_{name} = {i}" for i, name in enumerate(names))

"""CasADi: the forward map and its Jacobian as symbolic functions, for model predictive control and optimisation.

Source: CasADi's documentation, "Function objects" (named inputs and outputs, names of functions), 3.5 and later.
"""

import re
from dataclasses import dataclass
from string import Template
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from numpy.typing import NDArray

from ...inversion import BOX_TOLERANCE
from ...links import logarithmic
from ..base import about, check_prefix, number
from ..horner import edges, nest
from ..products import chain
from . import casadi_text as text
from .names import RESERVED
from .parts import escaped, factor_rows, numbers, python_table, response_rows

if TYPE_CHECKING:
    from ...model import Surrogate


@dataclass(frozen=True)
class CasADi:
    """Forward map, Jacobian and domain check as CasADi functions, built on import from a table of terms.

    One Python file that needs casadi alone, to run and not to be written. The polynomials are nested (Horner) and of
    type SX, so that they stay cheap inside larger expressions and in generated code. There is no inverse: whoever has
    a solver minimises, with the ranges as bounds.
    """

    name: ClassVar[str] = "casadi"
    summary: ClassVar[str] = "CasADi functions in Python for MPC and optimisation: forward, Jacobian, domain check"

    def render(self, model: "Surrogate", prefix: str) -> dict[str, str]:
        """``<prefix>_casadi.py``; see :class:`.Target`."""
        check_prefix(prefix, RESERVED)
        factors = model.factors
        logs = " and ".join(r.name for r, log in zip(model.responses, logarithmic(model.links), strict=True) if log)
        source = Template(text.MODULE).substitute(
            p=prefix,
            f=function_prefix(prefix),
            n=str(len(factors)),
            about=escaped(about(model)),
            operations=operations(model),
            logarithms=Template(text.LOGARITHMS).substitute(names=logs) if logs else "",
            factors=factor_rows(model, ranges=False),
            responses=response_rows(model),
            low=numbers([f.low for f in factors]),
            high=numbers([f.high for f in factors]),
            centre=numbers(factors.centre),
            half=numbers(factors.half_range),
            scale=numbers(response_scale(model)),
            box=number(1.0 + BOX_TOLERANCE),
            terms=python_table(chain(model, closed=False)),
            logarithmic=f"[{', '.join(str(bool(log)) for log in logarithmic(model.links))}]",
        )
        return {f"{prefix}_casadi.py": source}


def function_prefix(prefix: str) -> str:
    """`prefix` as CasADi wants names of functions: no underscores in a row, none at the end."""
    return re.sub("_+", "_", prefix).strip("_")


def operations(model: "Surrogate") -> str:
    """The work of one forward call in words; always the same, as there are no branches."""
    used = [np.flatnonzero(column) for column in model.coefficients.T]
    times = sum(edges(nest(model.terms.exponents, map(int, rows), len(model.factors))) for rows in used)
    n, logs = len(model.factors), int(logarithmic(model.links).sum())
    ends = f" and {logs} exponential{'s' * (logs > 1)}" if logs else ""
    return f"at most {times} multiplications, {n} division{'s' * (n > 1)}{ends}"


def response_scale(model: "Surrogate") -> NDArray[np.float64]:
    """Roughly how much each response changes in the domain, shape (n_responses,), SI: of logarithms to first order."""
    centre = model.predict(model.factors.centre[None])[0]
    return model.scale * np.where(logarithmic(model.links), centre, 1.0)

"""The C source file of a model, put together from the fixed text and what the model brings."""

from functools import cached_property
from string import Template
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ...inversion import obstacle
from ...links import LOG, unit_of
from ..base import plain
from ..inverse_plan import InversePlan, inverse_plan
from . import inverse_text as inverse_text
from . import text as text
from .elimination import MOST, factor_text, substitute_text
from .polynomials import Polynomials, body, columns_text, polynomials, table_text
from .precision import Precision, box, tolerance
from .printing import affine_sum

if TYPE_CHECKING:
    from ...model import Surrogate


SINGLE_REACH, SINGLE_MISS, SINGLE_EXPONENT = 2e3, 1.1e-3, 85.0
"""Largest centre over half-range, mismatch over scale and exponent that single precision is trusted with."""


def logged(model: "Surrogate") -> list[int]:
    """Positions of the responses that are given by their logarithm."""
    return [j for j, link in enumerate(model.links) if link == LOG]


class Parts:
    """A model, a prefix and a precision, with the pieces of code that they make.

    Parameters
    ----------
    model : Surrogate
    prefix : str
        Of every name in the code, the precision's ending included.
    precision : Precision
    max_iterations : int
        Most steps of an inverse without certificate.
    """

    def __init__(self, model: "Surrogate", prefix: str, precision: Precision, max_iterations: int) -> None:
        self.model, self.precision = model, precision
        self.names = {"p": prefix, "P": prefix.upper(), "real": precision.printer.real}
        self.plan: InversePlan = inverse_plan(model, max_iterations)
        self.has_inverse = not obstacle(model)
        if precision.ending:
            _check_single(model, tolerance(model, precision) / model.scale)

    @cached_property
    def forward(self) -> Polynomials:
        """The polynomials of the responses."""
        model = self.model
        labels = [
            f"{r.name} [{unit_of(link, r.name, plain(r.unit))}]"
            for r, link in zip(model.responses, model.links, strict=True)
        ]
        return polynomials(model.terms.exponents, model.coefficients, labels, model.terms.labels, len(model.factors))

    @cached_property
    def moved(self) -> Polynomials | None:
        """The same without constants, multiplied by the gain: what the contracting inverse iterates on."""
        if not (self.has_inverse and self.plan.contracting):
            return None
        mixed = self.model.coefficients @ self.plan.gain.T
        mixed[self.model.terms.degrees == 0] = 0.0
        names = [f"coded {name}" for name in self.model.factors.names]
        return polynomials(self.model.terms.exponents, mixed, names, self.model.terms.labels, len(self.model.factors))

    def source(self) -> str:
        """The text of the source file."""
        jacobian = text.CONSTANT_JACOBIAN if self.constant_slope else text.JACOBIAN
        template = text.SOURCE + text.FORWARD + jacobian
        values = {**self.names, **self._common(), **self._logarithms()}
        if self.has_inverse:
            template += inverse_text.CHECK + inverse_text.CENTRE_STEP + self._search() + inverse_text.INVERSE
            values |= self._inverse()
        return Template(template).substitute(values)

    @property
    def constant_slope(self) -> bool:
        """Whether the code has the Jacobian as numbers: nothing evaluates it, the inverse neither."""
        return self.model.is_affine_map and self.plan.affine

    @property
    def accuracy(self) -> float:
        """Largest mismatch of a reached target, in units of the scale."""
        return float((tolerance(self.model, self.precision) / self.model.scale).max())

    def rest_of(self, centre: float) -> float:
        """What single precision leaves of a factor's centre."""
        return float(centre) - float(np.float32(centre)) if self.precision.ending else 0.0

    def _search(self) -> str:
        if self.plan.affine:
            return inverse_text.CLOSED_SEARCH
        kind = inverse_text.CONTRACTING_SEARCH if self.plan.contracting else inverse_text.FREE_SEARCH
        return inverse_text.WITHIN + (inverse_text.MOVED_TO if self.plan.contracting else "") + kind

    def _common(self) -> dict[str, str]:
        c, model, p = self.precision.printer, self.model, self.names["p"]
        table, columns = f"{p}_coefficients", f"{self.names['P']}_COLUMNS"
        values = {
            "math": "#include <math.h>\n" if model.has_logs else "",
            "largest": c.limit,
            "tables": self._tables(),
            "coding": self._coding(),
            "box": c.number(box(self.model, self.precision)),
            "polynomials": body(self.forward, table, columns, c, slopes=False),
            "values": "Responses, of some the logarithm," if model.has_logs else "Responses",
            "value": "response (of some: d logarithm)" if model.has_logs else "response",
        }
        if self.constant_slope:
            slope = model.jacobian(model.factors.centre[None])[0]
            return values | {
                "slope": "\n".join(f"    jacobian[{j}][{i}] = {c.number(v)};" for (j, i), v in np.ndenumerate(slope))
            }
        return values | {
            "gradients": body(self.forward, table, columns, c, slopes=True),
            "per_half": c.list(1.0 / model.factors.half_range),
        }

    def _tables(self) -> str:
        """Tables of what is evaluated side by side; both have a column for each response."""
        p, columns, c = self.names["p"], f"{self.names['P']}_COLUMNS", self.precision.printer
        text = table_text(self.forward, f"{p}_coefficients", columns, c)
        if self.moved:
            text += table_text(self.moved, f"{p}_mixed", columns, c)
        return columns_text(self.forward.n, columns, self.precision.lanes) + text if text else ""

    def _coding(self) -> str:
        c, lines = self.precision.printer, []
        for i, (factor, centre, half) in enumerate(
            zip(self.model.factors, self.model.factors.centre, self.model.factors.half_range, strict=True)
        ):
            moved = c.difference(f"settings[{i}]", centre)
            if rest := self.rest_of(centre):
                moved = c.difference(f"({moved})", rest)  # what single precision leaves of the centre
            moved = f"({moved})" if " " in moved else moved
            lines.append(f"    coded[{i}] = {moved} * {c.number(1.0 / half)}; /* {factor.name} */")
        return "\n".join(lines)

    def _logarithms(self) -> dict[str, str]:
        """What the border between the polynomials and the responses adds; nothing without logarithms."""
        logs, P, c = logged(self.model), self.names["P"], self.precision.printer
        if not logs:
            names = ("exponentials", "chained", "logarithms", "wanted_here", "wanted_too", "in_link_units")
            return {**dict.fromkeys(names, ""), "wanted": "responses"}
        loop = f"\n    for (int j = 0; j < {P}_N_FACTORS; ++j) {{"
        checks = "".join(
            f"\n    if (!(responses[{j}] > {c.number(0.0)})) {{\n        return {P}_UNREACHABLE;\n    }}\n"
            f"    wanted[{j}] = log{c.suffix}(responses[{j}]);"
            for j in logs
        )
        return {
            "exponentials": "".join(f"\n        responses[{j}] = exp{c.suffix}(responses[{j}]);" for j in logs),
            "chained": loop + "".join(f"\n        jacobian[{j}][j] *= responses[{j}];" for j in logs) + "\n    }",
            "logarithms": checks,
            "wanted_here": f"\n    {c.real} wanted[{P}_N_RESPONSES];",
            "wanted_too": "\n        wanted[i] = responses[i];",
            "in_link_units": ", of some the logarithm",
            "wanted": "wanted",
        }

    def _inverse(self) -> dict[str, str]:
        c, model, plan, precision = self.precision.printer, self.model, self.plan, self.precision
        p = self.names["p"]
        coded = [f"coded[{i}]" for i in range(len(model.factors))]
        ranges = zip(model.factors.centre, model.factors.half_range, coded, strict=True)
        columns = f"{self.names['P']}_COLUMNS"
        moved, moved_to = (
            body(self.moved, f"{p}_mixed", columns, c, with_slope) if self.moved else "" for with_slope in (True, False)
        )
        return {
            "low": c.list([f.low for f in model.factors]),
            "high": c.list([f.high for f in model.factors]),
            "tolerance": c.list(tolerance(self.model, self.precision)),
            "moves": self._moves(),
            "decoding": "\n".join(
                f"    settings[{i}] = {c.sum(affine_sum(centre, [half], [name]), ' ' * 8)};"
                for i, (centre, half, name) in enumerate(ranges)
            ),
            "moved": moved,
            "moved_to": moved_to,
            "near": c.number(precision.near),
            **self._elimination(),
            "per_scale": c.list(1.0 / model.scale),
            "rank": str(min(len(model.factors), len(model.responses))),
            "steps": str(plan.steps),
            "chords": Template(inverse_text.CHORDS).substitute(
                self.names, count=str(plan.chords), limit=c.number(plan.limit)
            )
            if plan.chords
            else "",
            "limit": c.number(plan.limit),
            "still": c.number(precision.still_certified if plan.contracting else precision.still),
            "dependent": c.number(precision.dependent),
            "one": c.number(1.0),
            "zero": c.number(0.0),
        }

    def _elimination(self) -> dict[str, str]:
        """Factors and substitution, written out where the unknowns are few."""
        c, n = self.precision.printer, len(self.model.factors)
        if n <= MOST:
            return {"factor": factor_text(n, c), "substitute": substitute_text(n, c)}
        names = {**self.names, "one": c.number(1.0)}
        texts = {"factor": inverse_text.FACTOR, "substitute": inverse_text.SUBSTITUTE}
        return {key: Template(text).substitute(names) for key, text in texts.items()}

    def _moves(self) -> str:
        """``moves[i] = Σ gain · (response − value at the centre)``, structural zeros left out."""
        c, gain = self.precision.printer, self.plan.gain
        lines = [
            f"    const {c.real} d{j} = {c.difference(f'responses[{j}]', constant)}; /* {response.name} */"
            for j, (response, constant) in enumerate(zip(self.model.responses, self.plan.constant, strict=True))
            if gain[:, j].any()
        ]
        unused = [] if lines else ["    (void)responses; /* nothing moves */"]
        names = [f"d{j}" for j in range(gain.shape[1])]
        rows = [
            f"    moves[{i}] = {c.sum(affine_sum(0.0, row, names), ' ' * 8)}; /* {factor.name} */"
            for i, (row, factor) in enumerate(zip(gain, self.model.factors, strict=True))
        ]
        return "\n".join([*lines, *unused, "", *rows])


def _check_single(model: "Surrogate", accuracy: NDArray[np.float64]) -> None:
    """Raise ``ValueError`` if seven digits are too few for the model's ranges."""
    use = "use the double-precision target c99"
    for factor, centre, half in zip(model.factors, model.factors.centre, model.factors.half_range, strict=True):
        if abs(centre) > SINGLE_REACH * half:
            raise ValueError(
                f"this model cannot be exported in single precision: the range of {factor.name!r} is too narrow about "
                f"{centre:.6g} for seven digits; {use}"
            )
    constant = model.predict_coded(np.zeros((1, len(model.factors))))[0]
    for response, link, value, scale, miss in zip(
        model.responses, model.links, constant, model.scale, accuracy, strict=True
    ):
        lost = link == LOG and abs(value) + scale > SINGLE_EXPONENT
        if lost or miss > SINGLE_MISS:
            why = "spans more than float32 can hold" if lost else "changes too little beside its size for seven digits"
            raise ValueError(f"this model cannot be exported in single precision: {response.name!r} {why}; {use}")

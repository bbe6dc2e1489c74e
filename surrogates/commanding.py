"""A square model to invert: some responses are commanded, some factors are given, the others are sought."""

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from experiments.naming import suggestion
from experiments.runs import Response
from experiments.terms import Terms

from .links import IDENTITY

if TYPE_CHECKING:
    from .model import Surrogate


def commanding(model: "Surrogate", responses: Sequence[str], given: Sequence[str] = ()) -> "Surrogate":
    """The model with the named responses, and with the given factors as responses of their own.

    Its inverse has the settings of all factors for wanted responses where some factors are known, such as loads:
    ``commanding(m, ["x", "y", "psi"], ["force"]).invert([[x, y, psi, force]])``. Its certificate
    (:func:`.certify`) is about just that: with f the map from sought factors s and given ones g to the responses,
    (s, g) ↦ (f(s, g), g) takes no value twice if and only if, for every g, s ↦ f(s, g) takes none twice.

    Parameters
    ----------
    model : Surrogate
    responses : sequence of str
        Names of the responses to command, as many as there are factors that are not given.
    given : sequence of str
        Names of factors whose values are known whenever a target is.

    Returns
    -------
    Surrogate
        Of all factors; its responses are those named, then the given factors, in their units. Without errors and
        certificate: those of `model` are of other responses.

    Raises
    ------
    ValueError
        If a name is unknown or repeated, a response has the name of a given factor, or the counts disagree.
    """
    names = [r.name for r in model.responses]
    _check(model, names, responses, given)
    n = len(model.factors)
    rows = {exponents: row for row, exponents in enumerate(model.terms.exponents)}
    for exponents in [(0,) * n, *map(tuple, np.eye(n, dtype=int).tolist())]:
        rows.setdefault(exponents, len(rows))
    table = np.zeros((len(rows), len(names)))
    table[: len(model.terms)] = model.coefficients
    wanted = [names.index(name) for name in responses]
    errors = None
    if model.standard_errors is not None:  # a given factor is itself without error
        errors = np.zeros((len(rows), len(wanted) + len(given)))
        errors[: len(model.terms), : len(wanted)] = model.standard_errors[:, wanted]
    itself = np.zeros((len(rows), len(given)))
    for column, name in enumerate(given):
        k = model.factors.index(name)
        itself[rows[(0,) * n], column] = model.factors.centre[k]
        itself[rows[tuple(int(j == k) for j in range(n))], column] = model.factors.half_range[k]
    factors = [model.factors.factors[model.factors.index(name)] for name in given]
    return replace(
        model,
        responses=(
            *(model.responses[j] for j in wanted),
            *(Response(f.name, f.unit) for f in factors),
        ),
        terms=Terms(model.factors.names, tuple(rows)),
        coefficients=np.hstack([table[:, wanted], itself]),
        validation=(),
        certificate=None,
        standard_errors=errors,
        links=(*(model.links[j] for j in wanted), *(IDENTITY for _ in given)),
    )


def _check(model: "Surrogate", names: Sequence[str], responses: Sequence[str], given: Sequence[str]) -> None:
    for name in responses:
        if name not in names:
            raise ValueError(f"unknown response {name!r}{suggestion(name, names)}")
    for name in given:
        model.factors.index(name)
    wanted = [*responses, *given]
    if len(set(wanted)) < len(wanted):
        raise ValueError(f"each response and each given factor must be named once; got {', '.join(wanted)}")
    if len(wanted) != len(model.factors):
        raise ValueError(
            f"responses to command: {len(responses)}; factors to do it with: {len(model.factors) - len(given)} "
            f"({len(model.factors)} less {len(given)} given): make the numbers equal"
        )

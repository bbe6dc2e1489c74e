"""A model's polynomials as statements of structured text: nested products, one response after the other."""

from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING

import numpy as np

from ..horner import Assignment, Gradient, Node, gradient_of, nest, products_of, value_of, variable, variables_of
from .printing import assignment, comment, total

if TYPE_CHECKING:
    from ...model import Surrogate


def values(model: "Surrogate") -> tuple[list[str], list[str]]:
    """Names of temporaries, and statements that write ``value[i]`` from ``coded[j]``."""
    nodes = _nodes(model)
    return _written(model, nodes, value_of, ())


def gradients(model: "Surrogate") -> tuple[list[str], list[str]]:
    """The same with statements that write ``slope[i, j]``."""
    nodes = _nodes(model)
    return _written(model, nodes, gradient_of, products_of(nodes))


def _nodes(model: "Surrogate") -> list[Node]:
    n = len(model.factors)
    return [nest(model.terms.exponents, np.flatnonzero(column).tolist(), n) for column in model.coefficients.T]


def _written(
    model: "Surrogate",
    nodes: list[Node],
    written: Callable[[Node, Callable[[int], float]], Gradient],
    products: Iterable[Assignment],
) -> tuple[list[str], list[str]]:
    used = variables_of(nodes)
    names = [variable(k) for k in used] + [one.name for one in products]
    lines = [f"{variable(k)} := coded[{k}];" for k in used] + [assignment(one, "") for one in products]
    for i, (node, response) in enumerate(zip(nodes, model.responses, strict=True)):
        column = model.coefficients[:, i].tolist()
        found = written(node, column.__getitem__)
        names += [one.name for one in found.statements]
        lines += ["", f"(* {comment(f'{response.name} [{response.unit}]')}{_logarithm(model.links[i])} *)"]
        lines += [assignment(one, "") for one in found.statements]
        lines.append(f"value[{i}] := {total(found.value, '    ')};")
        lines += [f"slope[{i}, {j}] := {total(slope, '    ')};" for j, slope in enumerate(found.slopes)]
    return names, lines


def _logarithm(link: str) -> str:
    return ", its logarithm" if link == "log" else ""

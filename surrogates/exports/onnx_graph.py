"""ONNX: the forward map as one graph in double precision, for any runtime that speaks the format.

Source: Open Neural Network Exchange, operator set 13 and IR version 7 (ONNX 1.8, 2020).
"""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from importlib import import_module
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from ..artefact import schema_of
from ..inversion import BOX_TOLERANCE
from ..links import logarithmic
from .base import about, check_prefix
from .products import Term, chain
from .python.names import DEVICES

if TYPE_CHECKING:
    from ..model import Surrogate

OPSET, IR_VERSION = 13, 7
"""The oldest pair with all that is needed here. A runtime refuses files newer than itself by either number, and the
onnx package would write its own newest: said explicitly, onnxruntime since the end of 2020 reads the file."""

MISSING = "the ONNX export needs the package onnx, which is not installed: pip install onnx"


@dataclass(frozen=True)
class ONNX:
    """The forward map and the domain check as an ONNX graph in float64.

    Input ``settings`` (batch, n_factors), outputs ``responses`` (batch, n_responses) and ``inside`` (batch,) of bool.
    Settings outside the domain get the polynomials' values, which mean nothing there; ``inside`` says so, and is false
    for NaN. Responses that are given by their logarithm come out as the responses themselves. Names, units, ranges,
    certificate and provenance are in the metadata, JSON in ASCII. ONNX has no iteration that runtimes share, so there
    is no inverse.
    """

    name: ClassVar[str] = "onnx"
    summary: ClassVar[str] = "ONNX graph in float64 for onnxruntime and others: forward, domain check"

    def render(self, model: "Surrogate", prefix: str) -> dict[str, bytes]:
        """``<prefix>.onnx``; see :class:`.Target`.

        Raises
        ------
        ValueError
            If `prefix` is not allowed, or the package onnx is not installed.
        """
        check_prefix(prefix, DEVICES)
        graph = _Graph(_onnx())
        _coding(graph, model)
        _inside(graph)
        _responses(graph, model, *_features(graph, chain(model)))
        return {f"{prefix}.onnx": _whole(graph, model, prefix).SerializeToString(deterministic=True)}


def metadata(model: "Surrogate") -> dict[str, str]:
    """What a reader must know, each value a JSON text in ASCII: other text than ASCII is escaped, not changed."""
    certificate = model.certificate
    claim = {k: getattr(certificate, k) for k in ("verdict", "claim", "method", "reason")} if certificate else None
    return {
        "flexdoce.schema": _json(schema_of(model)),
        "flexdoce.factors": _json(
            [{"name": f.name, "unit": f.unit, "low": f.low, "high": f.high} for f in model.factors]
        ),
        "flexdoce.responses": _json([{"name": r.name, "unit": r.unit} for r in model.responses]),
        "flexdoce.certificate": _json(claim),
        "flexdoce.provenance": _json(dict(model.provenance)),
    }


def operations(model: "Surrogate") -> str:
    """A sentence on the work of one row; always the same, as there are no branches."""
    terms = chain(model)
    n, m, logs = len(model.factors), len(model.responses), int(logarithmic(model.links).sum())
    products = sum(len(term.positions) > 1 for term in terms)
    times = products + m * (n + products)
    ends = f" and {logs} exponential{'s' * (logs > 1)}" if logs else ""
    return f"One row takes {times} multiplications, {n} division{'s' * (n > 1)}{ends}."


def _onnx() -> Any:
    try:
        return import_module("onnx")
    except ImportError:
        raise ValueError(MISSING) from None


class _Graph:
    """Nodes and constants in the order they were made; names of tensors come from here, never from the model."""

    def __init__(self, onnx: Any) -> None:
        self.onnx = onnx
        self.nodes: list[Any] = []
        self.constants: list[Any] = []

    def node(self, operator: str, inputs: Sequence[str], output: str, **attributes: Any) -> str:
        """One operation; returns the name of its output."""
        made = self.onnx.helper.make_node(operator, list(inputs), [output], name=f"make_{output}", **attributes)
        self.nodes.append(made)
        return output

    def constant(self, name: str, values: Any, kind: type) -> str:
        """A tensor that every row shares; returns its name."""
        self.constants.append(self.onnx.numpy_helper.from_array(np.array(values, dtype=kind), name))
        return name

    def columns(self, given: str, positions: list[int], output: str) -> str:
        """Columns of a tensor (batch, n) at `positions`."""
        return self.node("Gather", [given, self.constant(f"{output}_at", positions, np.int64)], output, axis=1)


def _whole(graph: _Graph, model: "Surrogate", prefix: str) -> Any:
    """The model in ONNX's sense: the graph with its inputs, outputs, versions and metadata."""
    helper, kinds = graph.onnx.helper, graph.onnx.TensorProto
    n, m = len(model.factors), len(model.responses)
    made = helper.make_graph(
        graph.nodes,
        prefix,
        [helper.make_tensor_value_info("settings", kinds.DOUBLE, ["batch", n])],
        [
            helper.make_tensor_value_info("responses", kinds.DOUBLE, ["batch", m]),
            helper.make_tensor_value_info("inside", kinds.BOOL, ["batch"]),
        ],
        graph.constants,
        doc_string="\n".join([*about(model), "", operations(model)]),
    )
    whole = helper.make_model(made, opset_imports=[helper.make_opsetid("", OPSET)], producer_name="flexdoce")
    whole.ir_version = IR_VERSION
    helper.set_model_props(whole, metadata(model))
    return whole


def _coding(graph: _Graph, model: "Surrogate") -> None:
    moved = graph.node("Sub", ["settings", graph.constant("centre", model.factors.centre, np.float64)], "moved")
    graph.node("Div", [moved, graph.constant("half_range", model.factors.half_range, np.float64)], "coded")


def _inside(graph: _Graph) -> None:
    """All |coded| at most 1 + the tolerance. A comparison with NaN is false; a largest value may pass over it."""
    size = graph.node("Abs", ["coded"], "size")
    each = graph.node("LessOrEqual", [size, graph.constant("box", 1.0 + BOX_TOLERANCE, np.float64)], "each_inside")
    counted = graph.node("Cast", [each], "each_inside_as_int", to=graph.onnx.TensorProto.INT32)
    fewest = graph.node("ReduceMin", [counted], "all_inside_as_int", axes=[1], keepdims=0)
    graph.node("Cast", [fewest], "inside", to=graph.onnx.TensorProto.BOOL)


def _features(graph: _Graph, terms: tuple[Term, ...]) -> tuple[str, tuple[Term, ...]]:
    """The products, degree by degree, beside each other: the tensor's name, and its terms where not all settings.

    Each product is one of the degree before times one coded setting.
    """
    degree, made, before = 2, ["coded"], None
    above = tuple(term for term in terms if len(term.positions) > 1)
    while level := [term.positions for term in above if len(term.positions) == degree]:
        at = {positions: k for k, positions in enumerate(before)} if before else None
        parents = [at[p[:-1]] if at else p[0] for p in level]
        left = graph.columns(made[-1], parents, f"degree_{degree}_left")
        right = graph.columns("coded", [p[-1] for p in level], f"degree_{degree}_right")
        made.append(graph.node("Mul", [left, right], f"degree_{degree}"))
        before, degree = level, degree + 1
    return graph.node("Concat", made, "products", axis=1) if above else "coded", above


def _responses(graph: _Graph, model: "Surrogate", products: str, above: tuple[Term, ...]) -> None:
    """One product with the table of coefficients, the constants, and exponentials where the model gives logarithms."""
    table = {term.positions: term.coefficients for term in chain(model)}
    zeros = (0.0,) * len(model.responses)
    rows = [*(table.get((j,), zeros) for j in range(len(model.factors))), *(term.coefficients for term in above)]
    logs = [int(j) for j in np.flatnonzero(logarithmic(model.links))]
    summed = graph.node("MatMul", [products, graph.constant("coefficients", rows, np.float64)], "without_constants")
    constants = graph.constant("constants", table[()], np.float64)
    values = graph.node("Add", [summed, constants], "values" if logs else "responses")
    if logs:
        m = len(model.responses)
        exponentials = graph.node("Exp", [graph.columns(values, logs, "logarithms")], "exponentials")
        both = graph.node("Concat", [values, exponentials], "values_and_exponentials", axis=1)
        graph.columns(both, [m + logs.index(j) if j in logs else j for j in range(m)], "responses")


def _json(value: Any) -> str:
    """JSON in ASCII, the same for the same content; numbers that JSON does not have become text."""
    standard = json.loads(json.dumps(value, default=str), parse_constant=str)
    return json.dumps(standard, sort_keys=True)

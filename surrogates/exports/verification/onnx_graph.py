"""The ONNX export against the model: the format by the package onnx, the numbers by onnxruntime on the processor."""

from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from .base import DOUBLE, Finding, Outcome, Reference, agreement, not_checked, reference, statement
from .edges import at_faces

if TYPE_CHECKING:
    from ...model import Surrogate

FORMAT, RUNS = "the format, by onnx.checker with shapes", "the graph runs in onnxruntime"


def verify(model: "Surrogate", prefix: str, folder: Path) -> list[Finding]:
    """Findings on ``<prefix>.onnx`` in `folder`. The file is data: it is read here, and only read."""
    try:
        content = (folder / f"{prefix}.onnx").read_bytes()
    except OSError as error:
        return [Finding(FORMAT, Outcome.DIFFERS, f"{prefix}.onnx cannot be read: {error.strerror}")]
    return [_format(content), *_numbers(model, content)]


def _format(content: bytes) -> Finding:
    if find_spec("onnx") is None:
        return not_checked(FORMAT, "the package onnx is not installed: pip install onnx")
    onnx = import_module("onnx")
    try:
        onnx.checker.check_model(onnx.load_model_from_string(content), full_check=True)
    except Exception as error:  # the parser, the checker and the shape inference each raise a kind of their own
        return Finding(FORMAT, Outcome.DIFFERS, _first(error))
    return statement(FORMAT, True)


def _numbers(model: "Surrogate", content: bytes) -> list[Finding]:
    if find_spec("onnxruntime") is None:
        return [not_checked(RUNS, "the package onnxruntime is not installed: pip install onnxruntime")]
    points = reference(model)
    try:
        return _compared(model, points, _session(content))
    except Exception as error:  # onnxruntime's errors have no common class but this
        return [Finding(RUNS, Outcome.DIFFERS, _first(error))]


def _session(content: bytes) -> Any:
    onnxruntime = import_module("onnxruntime")
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = options.inter_op_num_threads = 1
    options.log_severity_level = 3
    return onnxruntime.InferenceSession(content, options, providers=["CPUExecutionProvider"])


def _compared(model: "Surrogate", points: Reference, session: Any) -> list[Finding]:
    def run(settings: Any) -> Any:
        return session.run(["responses", "inside"], {"settings": settings})

    k = len(model.factors)
    nans = np.where(np.eye(k, dtype=bool), np.nan, model.factors.centre)
    responses = run(points.settings)[0]
    alone = np.vstack([run(row[None])[0] for row in points.settings[:5]])
    anywhere = np.vstack([points.settings, points.outside, at_faces(model), nans])
    inside = run(anywhere)[1]
    doubles = responses.dtype == np.float64 and inside.dtype == np.bool_
    return [
        agreement("forward in onnxruntime", responses, points.responses, points.magnitude, DOUBLE),
        agreement("forward in onnxruntime, row by row", alone, points.responses[:5], points.magnitude[:5], DOUBLE),
        statement("the domain in onnxruntime, NaN outside", np.array_equal(inside, model.contains(anywhere))),
        statement("outputs are float64 and bool, one row per setting", bool(doubles and len(run(nans[:0])[1]) == 0)),
    ]


def _first(error: Exception) -> str:
    lines = str(error).strip().splitlines()
    return f"{type(error).__name__}: {lines[0] if lines else ''}"

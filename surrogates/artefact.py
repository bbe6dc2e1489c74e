"""``model.json``: the contract with the controller, in plain JSON that a person can read."""

import json
import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from experiments.factors import Factor, FactorSpace
from experiments.runs import Response
from experiments.settings import build
from experiments.terms import Terms

from .certificate import Certificate, Verdict
from .inversion import affine_inverse, affine_map
from .model import Surrogate
from .validation import ResponseError

SCHEMA = "flexdoce-model/1"


def dumps(model: Surrogate) -> str:
    """The model as JSON text, the same text for the same model.

    Numbers are written with the digits that round-trip float64. For an affine model the map and its
    inverse are spelled out in physical units under ``affine``; that part is for readers and is not
    read back.
    """
    document = {
        "schema": SCHEMA,
        "factors": [asdict(f) for f in model.factors],
        "responses": [asdict(r) for r in model.responses],
        "coding": "coded = (setting - (low + high)/2) / ((high - low)/2)",
        "domain": "every coded setting between -1 and 1",
        "terms": list(model.terms.labels),
        "coefficients": {r.name: [float(c) for c in model.coefficients[:, j]] for j, r in enumerate(model.responses)},
        "affine": _affine(model),
        "validation": [_error_dict(e) for e in model.validation],
        "certificate": asdict(model.certificate) if model.certificate else None,
        "provenance": dict(model.provenance),
    }
    return json.dumps(document, indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def loads(text: str) -> Surrogate:
    """The model in a JSON text written by :func:`dumps`.

    Raises
    ------
    ValueError
        If the text is not JSON, not this schema, or inconsistent; the sentence says where.
    """
    try:
        document = json.loads(text, parse_constant=_refuse_constant)
    except (ValueError, RecursionError) as error:
        raise ValueError(f"not valid JSON: {error}") from None
    try:
        json.dumps(document, ensure_ascii=False).encode()
    except UnicodeEncodeError:
        raise ValueError("it holds text that is not valid Unicode") from None
    if not isinstance(document, Mapping) or document.get("schema") != SCHEMA:
        found = document.get("schema") if isinstance(document, Mapping) else type(document).__name__
        raise ValueError(f"not a model this version reads: expected schema {SCHEMA!r}, found {found!r}")
    try:
        return _surrogate(document)
    except (KeyError, TypeError, AttributeError, OverflowError) as error:
        raise ValueError(f"a part of the model is missing or of the wrong kind: {error}") from None


def load(path: str | Path) -> Surrogate:
    """Read ``model.json``.

    Raises
    ------
    ValueError
        If the file cannot be read or is not a model; the sentence names the file.
    """
    try:
        text = Path(path).read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise ValueError(f"cannot read the model {path}: {getattr(error, 'strerror', None) or error}") from None
    try:
        return loads(text)
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from None


def _affine(model: Surrogate) -> dict[str, Any] | None:
    if not model.is_affine:
        return None
    matrix, offset = affine_map(model)
    inverse = affine_inverse(model)
    return {
        "form": "response = matrix · setting + offset; setting = inverse · response + inverse_offset",
        "rows": [r.label for r in model.responses],
        "columns": list(model.factors.labels),
        "matrix": matrix.tolist(),
        "offset": offset.tolist(),
        "inverse": inverse.gain.tolist(),
        "inverse_offset": inverse.offset.tolist(),
        "condition": inverse.condition if math.isfinite(inverse.condition) else None,
    }


def _surrogate(document: Mapping[str, Any]) -> Surrogate:
    factors = FactorSpace(tuple(build("factor", Factor, f) for f in _list(document, "factors")))
    responses = tuple(build("response", Response, r) for r in _list(document, "responses"))
    names, terms = [r.name for r in responses], _list(document, "terms")
    if set(document["coefficients"]) != set(names):
        raise ValueError(f"coefficients must be given for {', '.join(names)}")
    columns = [_numbers(_list(document["coefficients"], name), f"coefficients of {name}") for name in names]
    if any(len(column) != len(terms) for column in columns):
        raise ValueError("every response needs one coefficient per term")
    errors = tuple(_error(e) for e in _list(document, "validation"))
    if errors and [e.response for e in errors] != names:
        raise ValueError(f"validation must be empty or name {', '.join(names)} in this order")
    return Surrogate(
        factors,
        responses,
        Terms.parse(terms, factors.names),
        np.column_stack(columns),
        errors,
        _certificate(document["certificate"]),
        dict(document["provenance"]),
    )


def _certificate(given: Any) -> Certificate | None:
    if given is None:
        return None
    parts = dict(given)
    verdict, witness = Verdict(parts.pop("verdict")), _list(parts, "witness")
    del parts["witness"]
    numbers = {"condition": parts.pop("condition")}
    # Models written before curved ones could be certified lack these.
    numbers |= {name: parts.pop(name, None) for name in ("contraction", "sub_box")}
    steps = {name: parts.pop(name, None) for name in ("chord_iterations", "newton_iterations")}
    words = build("certificate", _CertificateWords, parts)
    return Certificate(
        words.claim,
        verdict,
        words.method,
        witness=tuple(float(v) for v in _numbers(witness, "witness")),
        reason=words.reason,
        **{name: None if value is None else float(_numbers([value], name)[0]) for name, value in numbers.items()},
        **{name: None if value is None else _whole(value, name) for name, value in steps.items()},
    )


def _whole(value: Any, what: str) -> int:
    if isinstance(value, bool) or not isinstance(value, int) or value < 0:
        raise ValueError(f"{what} must be a whole number of 0 or more, got {value!r}")
    return value


@dataclass(frozen=True)
class _CertificateWords:
    """The texts of a certificate, so that they are checked like every other object."""

    claim: str
    method: str
    reason: str


def _error_dict(error: ResponseError) -> dict[str, Any]:
    """JSON has no infinity: an undefined relative error is null."""
    parts = asdict(error)
    return {**parts, "max_relative": parts["max_relative"] if math.isfinite(error.max_relative) else None}


def _error(given: Any) -> ResponseError:
    undefined = given["max_relative"] is None
    error = build("validation", ResponseError, {**given, "max_relative": 0.0} if undefined else given)
    return replace(error, max_relative=math.inf) if undefined else error


def _list(document: Any, key: str) -> list[Any]:
    value = document[key]
    if not isinstance(value, list):
        raise ValueError(f"{key} must be a list, got {value!r}")
    return value


def _numbers(values: list[Any], what: str) -> NDArray[np.float64]:
    if any(isinstance(v, bool) or not isinstance(v, (int, float)) for v in values):
        raise ValueError(f"{what} must be numbers")
    return np.array([float(v) for v in values], dtype=np.float64)


def _refuse_constant(word: str) -> Any:
    raise ValueError(f"{word} is not a number")

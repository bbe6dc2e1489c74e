"""``model.json``: the contract with the controller, in plain JSON that a person can read."""

import json
import math
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from experiments.factors import Factor, FactorSpace
from experiments.runs import Response
from experiments.terms import Terms

from .certificate import Certificate, Verdict
from .inversion import affine_inverse
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
        "validation": [asdict(e) for e in model.validation],
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
    except json.JSONDecodeError as error:
        raise ValueError(f"not valid JSON: {error}") from None
    if not isinstance(document, Mapping) or document.get("schema") != SCHEMA:
        found = document.get("schema") if isinstance(document, Mapping) else type(document).__name__
        raise ValueError(f"not a model this version reads: expected schema {SCHEMA!r}, found {found!r}")
    try:
        return _surrogate(document)
    except (KeyError, TypeError, AttributeError) as error:
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
    centre = model.factors.centre[None]
    slope = model.jacobian(centre)[0]
    inverse = affine_inverse(model)
    return {
        "form": "response = matrix · setting + offset; setting = inverse · response + inverse_offset",
        "rows": [r.label for r in model.responses],
        "columns": list(model.factors.labels),
        "matrix": slope.tolist(),
        "offset": (model.predict(centre)[0] - slope @ centre[0]).tolist(),
        "inverse": inverse.gain.tolist(),
        "inverse_offset": inverse.offset.tolist(),
        "condition": inverse.condition if math.isfinite(inverse.condition) else None,
    }


def _surrogate(document: Mapping[str, Any]) -> Surrogate:
    factors = FactorSpace(tuple(Factor(**f) for f in document["factors"]))
    responses = tuple(Response(**r) for r in document["responses"])
    names = [r.name for r in responses]
    if set(document["coefficients"]) != set(names):
        raise ValueError(f"coefficients must be given for {', '.join(names)}")
    columns = [np.asarray(document["coefficients"][name], dtype=np.float64) for name in names]
    if any(column.shape != (len(document["terms"]),) for column in columns):
        raise ValueError("every response needs one coefficient per term")
    certificate = document["certificate"]
    if certificate is not None:
        parts = dict(certificate)
        parts["verdict"], parts["witness"] = Verdict(parts["verdict"]), tuple(parts["witness"])
        certificate = Certificate(**parts)
    return Surrogate(
        factors,
        responses,
        Terms.parse(document["terms"], factors.names),
        np.column_stack(columns),
        tuple(ResponseError(**e) for e in document["validation"]),
        certificate,
        dict(document["provenance"]),
    )


def _refuse_constant(word: str) -> Any:
    raise ValueError(f"not valid JSON: {word} is not a number")

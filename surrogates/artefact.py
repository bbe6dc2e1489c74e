"""``model.json``: the contract with the controller, in plain JSON that a person can read."""

import hashlib
import json
import math
from collections.abc import Mapping, Sequence
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
from .intervals import Interval
from .inversion import affine_inverse, affine_map
from .links import IDENTITY
from .model import Surrogate
from .reachable import Box
from .validation import ResponseError

SCHEMA = "flexdoce-model/1"
SCHEMA_WITH_LINKS = "flexdoce-model/2"
"""Of models with logarithms: a reader that knows none would take a logarithm for the response, and must refuse."""

MOST_NAMES, MOST_EXPONENTS, HIGHEST = 1000, 1_000_000, 64
"""Factors or responses, terms times either, and total degree of a term that are read: more than a study can have."""


def schema_of(model: Surrogate) -> str:
    """The schema that the model is written in."""
    return SCHEMA_WITH_LINKS if model.has_logs else SCHEMA


def dumps(model: Surrogate) -> str:
    """The model as JSON text, the same text for the same model.

    Numbers are written with the digits that round-trip float64. For an affine model the map and its
    inverse are spelled out in physical units under ``affine``; that part is for readers and is not
    read back. ``links`` are written only where a response is given by its logarithm, standard errors where they are
    known (null for one that is not).
    """
    document = {
        "schema": schema_of(model),
        "factors": [asdict(f) for f in model.factors],
        "responses": [asdict(r) for r in model.responses],
        "coding": "coded = (setting - (low + high)/2) / ((high - low)/2)",
        "domain": "every coded setting between -1 and 1",
        "terms": list(model.terms.labels),
        "coefficients": {r.name: [float(c) for c in model.coefficients[:, j]] for j, r in enumerate(model.responses)},
        **_standard_errors(model),
        **({"links": {r.name: k for r, k in zip(model.responses, model.links, strict=True)}} if model.has_logs else {}),
        "affine": _affine(model),
        "validation": [_error_dict(e) for e in model.validation],
        "certificate": asdict(model.certificate) if model.certificate else None,
        "provenance": dict(model.provenance),
    }
    document["digest"] = digest_of(json.loads(json.dumps(document, allow_nan=False)))
    return json.dumps(document, indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def digest_of(document: Mapping[str, Any]) -> str:
    """SHA-256 of what a JSON document says, however it is laid out, its own ``digest`` aside.

    It tells a changed number from an unchanged one; it is no signature: who can write the file can write the digest.
    """
    rest = {key: value for key, value in document.items() if key != "digest"}
    return "sha256:" + hashlib.sha256(json.dumps(rest, sort_keys=True).encode()).hexdigest()


def loads(text: str) -> Surrogate:
    """The model in a JSON text written by :func:`dumps`.

    Raises
    ------
    ValueError
        If the text is not JSON, not this schema, inconsistent, or changed since it was written; the sentence says
        where. Models written before there was a digest have none to be held to.
    """
    try:
        document = json.loads(text, parse_constant=_refuse_constant)
    except (ValueError, RecursionError) as error:
        raise ValueError(f"not valid JSON: {error}") from None
    try:
        json.dumps(document, ensure_ascii=False).encode()
    except UnicodeEncodeError:
        raise ValueError("it holds text that is not valid Unicode") from None
    except RecursionError:
        raise ValueError("not valid JSON: it is nested too deep") from None
    if not isinstance(document, Mapping) or document.get("schema") not in (SCHEMA, SCHEMA_WITH_LINKS):
        found = document.get("schema") if isinstance(document, Mapping) else type(document).__name__
        raise ValueError(
            f"not a model this version reads: expected schema {SCHEMA!r} or {SCHEMA_WITH_LINKS!r}, found {found!r}"
        )
    try:
        model = _surrogate(document)
    except (KeyError, TypeError, AttributeError, OverflowError) as error:
        raise ValueError(f"a part of the model is missing or of the wrong kind: {error}") from None
    if "digest" in document and document["digest"] != digest_of(document):
        raise ValueError(
            "the model was changed after it was written: what it says is not what its digest is of. Take the file that "
            "flexdoce wrote, or run the study again"
        )
    return model


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
    if not model.is_affine_map:
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
    _check_size(*(len(_list(document, key)) for key in ("factors", "responses", "terms")))
    factors = FactorSpace(tuple(build("factor", Factor, f) for f in document["factors"]))
    responses = tuple(build("response", Response, r) for r in document["responses"])
    names, terms = [r.name for r in responses], document["terms"]
    if len(set(names)) < len(names):
        raise ValueError(f"response names must differ; got {', '.join(names)}")
    parsed = Terms.parse(terms, factors.names)
    if (degree := max(map(sum, parsed.exponents), default=0)) > HIGHEST:
        raise ValueError(f"a term has degree {degree}; models of degree {HIGHEST} at most are read")
    errors = tuple(_error(e, len(factors)) for e in _list(document, "validation"))
    if errors and [e.response for e in errors] != names:
        raise ValueError(f"validation must be empty or name {', '.join(names)} in this order")
    return Surrogate(
        factors,
        responses,
        parsed,
        _table(document["coefficients"], "coefficient", names, len(terms)),
        errors,
        _certificate(document["certificate"], factors.names, names),
        dict(document["provenance"]),
        _read_errors(document, names, len(terms)),
        _links(document, names),
    )


def _check_size(n_factors: int, n_responses: int, n_terms: int) -> None:
    """Refuse what would fill the memory: a file of 1 MB can name 10,000 factors and as many terms of each."""
    if max(n_factors, n_responses) > MOST_NAMES:
        raise ValueError(f"models of at most {MOST_NAMES} factors and as many responses are read")
    if n_terms * max(n_factors, n_responses) > MOST_EXPONENTS:
        raise ValueError(f"{n_terms} terms are too many for {n_factors} factors and {n_responses} responses")


def _table(given: Any, what: str, names: Sequence[str], n_terms: int) -> NDArray[np.float64]:
    """A column per response, shape (n_terms, n_responses)."""
    if set(given) != set(names):
        raise ValueError(f"{what}s must be given for {', '.join(names)}")
    columns = [_numbers(_list(given, name), f"{what}s of {name}") for name in names]
    if any(len(column) != n_terms for column in columns):
        raise ValueError(f"every response needs one {what} per term")
    return np.column_stack(columns)


def _standard_errors(model: Surrogate) -> dict[str, Any]:
    errors = model.standard_errors
    if errors is None:
        return {}
    columns = [[None if math.isnan(e) else float(e) for e in column] for column in errors.T]
    return {"standard_errors": dict(zip((r.name for r in model.responses), columns, strict=True))}


def _read_errors(document: Mapping[str, Any], names: Sequence[str], n_terms: int) -> NDArray[np.float64] | None:
    """Models written before standard errors were kept lack them."""
    given = document.get("standard_errors")
    if given is None:
        return None
    known = {name: [math.nan if e is None else e for e in _list(given, name)] for name in given}
    return _table(known, "standard error", names, n_terms)


def _links(document: Mapping[str, Any], names: Sequence[str]) -> tuple[str, ...]:
    if document["schema"] == SCHEMA:
        if "links" in document:
            raise ValueError(f"links need schema {SCHEMA_WITH_LINKS!r}, found {SCHEMA!r}")
        return (IDENTITY,) * len(names)
    given = document["links"]
    if not isinstance(given, Mapping) or set(given) != set(names):
        raise ValueError(f"links must be given for {', '.join(names)}; got {given!r}")
    return tuple(given[name] for name in names)


def _certificate(given: Any, factors: Sequence[str], responses: Sequence[str]) -> Certificate | None:
    if given is None:
        return None
    parts = dict(given)
    verdict, witness = Verdict(parts.pop("verdict")), _list(parts, "witness")
    del parts["witness"]
    numbers = {"condition": parts.pop("condition")}
    # Models written before curved ones could be certified lack these.
    numbers |= {name: parts.pop(name, None) for name in ("contraction", "sub_box")}
    steps = {name: parts.pop(name, None) for name in ("chord_iterations", "newton_iterations")}
    factor_box = _box(parts.pop("factor_box", None), "factor_box", factors)
    response_box = _box(parts.pop("response_box", None), "response_box", responses)
    words = build("certificate", _CertificateWords, parts)
    return Certificate(
        words.claim,
        verdict,
        words.method,
        witness=tuple(float(v) for v in _numbers(witness, "witness")),
        reason=words.reason,
        **{name: None if value is None else float(_numbers([value], name)[0]) for name, value in numbers.items()},
        **{name: None if value is None else _whole(value, name) for name, value in steps.items()},
        factor_box=factor_box,
        response_box=response_box,
        box_reason=words.box_reason,
    )


def _box(given: Any, what: str, names: Sequence[str]) -> Box | None:
    """Low and high per name."""
    if given is None:
        return None
    if not isinstance(given, list) or any(not isinstance(ends, list) or len(ends) != 2 for ends in given):
        raise ValueError(f"{what} must be a list of pairs [low, high], got {given!r}")
    ends = _numbers([end for pair in given for end in pair], what).reshape(-1, 2)
    if len(ends) != len(names) or not (np.isfinite(ends).all() and (ends[:, 0] < ends[:, 1]).all()):
        raise ValueError(f"{what} must hold finite pairs low < high, one each for {', '.join(names)}; got {given!r}")
    return tuple((float(low), float(high)) for low, high in ends)


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
    box_reason: str = ""


INFINITE = {"max_relative": math.inf, "relative_rmse": math.inf, "q2": -math.inf}
"""What null stands for: JSON has no infinity, and these have no denominator where a response is always zero."""


def _error_dict(error: ResponseError) -> dict[str, Any]:
    """Without what is not known, as in models written before it was measured."""
    known = {name: value for name, value in asdict(error).items() if value is not None and value != ()}
    return {n: None if n in INFINITE and not math.isfinite(v) else v for n, v in known.items()}


def _error(given: Any, n_factors: int) -> ResponseError:
    parts = dict(given)
    point = _numbers(_list(parts, "worst_point"), "worst_point") if "worst_point" in parts else np.empty(0)
    intervals = _list(parts, "intervals") if "intervals" in parts else []
    if point.size and (len(point) != n_factors or not np.isfinite(point).all()):
        raise ValueError(f"worst_point must be {n_factors} finite numbers, one per factor; got {len(point)}")
    infinite = {name: value for name, value in INFINITE.items() if name in parts and parts[name] is None}
    plain = {name: value for name, value in parts.items() if name not in ("worst_point", "intervals")}
    error = build("validation", ResponseError, plain | dict.fromkeys(infinite, 0.0))
    return replace(
        error,
        worst_point=tuple(point.tolist()),
        intervals=tuple(build("interval", Interval, i) for i in intervals),
        **infinite,
    )


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

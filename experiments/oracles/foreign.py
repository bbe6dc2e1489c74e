"""What somebody else's oracle must be before it answers anything: one sentence for whatever is wrong."""

import json
from collections.abc import Mapping
from typing import Any

from ..factors import FactorSpace
from ..naming import check_name
from ..runs import Response
from ..settings import build
from .base import Oracle, OracleError, told


def oracle_class(what: str, found: object) -> type[Oracle]:
    """`found`, if it is a class that can be made and asked.

    Raises
    ------
    ValueError
        That begins with `what` and says what is there instead, or which methods are missing.
    """
    if not isinstance(found, type):
        raise ValueError(f"{what} is {_kind(found)}, not a class of oracles{_advice(found)}")
    if not issubclass(found, Oracle):
        raise ValueError(f"{what} is a class, but none of oracles; derive it from experiments.oracles.PointOracle")
    if lacking := sorted(getattr(found, "__abstractmethods__", ())):
        raise ValueError(f"{what} lacks {', '.join(lacking)}; docs/add-an-oracle.md shows a whole one")
    if not hasattr(found, "name"):
        raise ValueError(f"{what} has no name; write name = {found.__name__.lower()!r} into the class")
    try:
        check_name("oracle", found.name)
    except ValueError as error:
        raise ValueError(f"{what}: {error}") from None
    return found


def made(cls: type[Oracle], parameters: Mapping[str, Any]) -> Oracle:
    """An oracle of that class, whose factors, responses and other particulars are what they must be.

    Raises
    ------
    ValueError
        With one sentence: what is wrong with `parameters`, or with the class.
    """
    what = f"oracle {cls.name!r} ({cls.origin})"
    try:
        oracle = build(f"oracle {cls.name!r}", cls, parameters)
    except ValueError:
        raise
    except Exception as error:
        raise OracleError(f"{what} cannot be made: {told(error)}") from error
    if flaw := flaw_of(oracle):
        raise OracleError(f"{what}: {flaw}")
    return oracle


def flaw_of(oracle: Oracle) -> str:
    """What is wrong with how an oracle describes itself, as half a sentence; empty if nothing. It answers no point."""
    for look in (_factors, _responses, _particulars):
        try:
            flaw = look(oracle)
        except Exception as error:
            return f"{look.__name__.strip('_')}: {told(error)}"
        if flaw:
            return flaw
    return ""


def _factors(oracle: Oracle) -> str:
    space = oracle.factors
    if isinstance(space, FactorSpace):
        return ""
    return f"factors gave {_kind(space)}, not a FactorSpace; write FactorSpace((Factor(...), Factor(...)))"


def _responses(oracle: Oracle) -> str:
    given: Any = oracle.responses
    if isinstance(given, Response):
        return "responses gave one Response, not a tuple of them; write (Response(...),) with a comma"
    if not isinstance(given, tuple) or not all(isinstance(r, Response) for r in given):
        return f"responses gave {_kind(given)}, not a tuple of Response"
    if not given:
        return "it has no responses; declare at least one"
    names = [r.name for r in given]
    if twice := sorted({n for n in names if names.count(n) > 1}):
        return f"response names must differ; repeated: {', '.join(twice)}"
    if both := sorted(set(names) & set(oracle.factors.names)):
        return f"{', '.join(both)}: a factor and a response cannot share a name"
    return ""


def _particulars(oracle: Oracle) -> str:
    for key in ("name", "summary", "source", "version", "limits"):
        if not isinstance(getattr(oracle, key), str):
            return f"{key} must be a text, got {getattr(oracle, key)!r}"
    if not isinstance(oracle.batch, int) or isinstance(oracle.batch, bool) or oracle.batch < 1:
        return f"batch must be a whole number of at least 1, got {oracle.batch!r}"
    if not isinstance(oracle.resolution, int | float) or not 0.0 <= oracle.resolution < 1.0:
        return f"resolution must be a number from 0 to below 1, got {oracle.resolution!r}"
    try:
        json.dumps(oracle.parameters, allow_nan=False)
    except (TypeError, ValueError) as error:
        return f"parameters must be numbers, texts, true or false: {error}"
    return ""


def _kind(found: object) -> str:
    if isinstance(found, type(json)):
        return "a module"
    if callable(found) and hasattr(found, "__code__"):
        return "a plain function"
    return "None" if found is None else f"an object of type {type(found).__name__}"


def _advice(found: object) -> str:
    if callable(found) and hasattr(found, "__code__"):
        return "; put @point_oracle(factors=..., responses=...) before it"
    return f"; name its class, {type(found).__name__}" if isinstance(found, Oracle) else ""

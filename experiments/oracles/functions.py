"""An oracle from a function: factors are its arguments, parameters its keyword-only arguments."""

import inspect
import typing
from collections.abc import Callable, Sequence
from dataclasses import MISSING, field, make_dataclass
from typing import Any

import numpy as np

from ..factors import Factor, FactorSpace
from ..naming import check_name
from ..runs import Response
from .base import JaxOracle, Oracle, PointOracle


def point_oracle(
    factors: Sequence[Factor],
    responses: Sequence[Response],
    *,
    name: str = "",
    summary: str = "",
    source: str = "",
    version: str = "1",
    resolution: float = 0.0,
    jax: bool = False,
) -> Callable[[Callable[..., Any]], type[Oracle]]:
    """Decorator that makes an oracle of a function; the function itself stays at hand as ``.function``.

    Parameters
    ----------
    factors : sequence of Factor
        One per argument of the function, by the same names in the same order.
    responses : sequence of Response
        One per number that it returns, in order.
    name, summary : str
        By default the function's name and the first line of its docstring.
    source, version, resolution
        As in :class:`.Oracle`.
    jax : bool
        Whether the function is written in ``jax.numpy``: then points are answered in batches and there are Jacobians.

    Raises
    ------
    ValueError
        If arguments and factors do not agree, or a parameter cannot be one.

    Notes
    -----
    Keyword-only arguments (after a ``*``) are the oracle's parameters.
    """
    space, given = FactorSpace(tuple(factors)), tuple(responses)

    def decorate(function: Callable[..., Any]) -> type[Oracle]:
        ours = name or function.__name__
        check_name("oracle", ours)
        base = JaxOracle if jax else PointOracle
        parameters = _parameters(function, space, base)
        names = [p[0] for p in parameters]
        told = next(iter((inspect.getdoc(function) or "").splitlines()), "")
        space_of, responses_of = property(lambda self: space), property(lambda self: given)
        body = {
            "name": ours, "summary": summary or told, "source": source or f"the function {function.__name__}",
            "version": version, "resolution": resolution, "function": staticmethod(function),
            "factors": space_of, "responses": responses_of, "respond": _respond(function, names, jax),
            "__doc__": function.__doc__,
        }  # fmt: skip
        cls = make_dataclass(function.__name__, parameters, bases=(base,), namespace=body, frozen=True)
        # Where pickle looks for it.
        cls.__module__, cls.__qualname__ = function.__module__, function.__qualname__
        return cls

    return decorate


def _respond(function: Callable[..., Any], names: Sequence[str], jax: bool) -> Callable[[Any, Any], Any]:
    def in_python(self: Any, point: Any) -> Any:
        return np.atleast_1d(function(*point.tolist(), **{n: getattr(self, n) for n in names}))

    def in_jax(self: Any, point: Any) -> Any:
        import jax.numpy as jnp

        return jnp.atleast_1d(jnp.asarray(function(*point, **{n: getattr(self, n) for n in names})))

    return in_jax if jax else in_python


def _parameters(function: Callable[..., Any], space: FactorSpace, base: type[Oracle]) -> list[tuple[str, type, Any]]:
    """Keyword-only arguments as fields of a dataclass; ``ValueError`` if the others are not the factors."""
    signature = inspect.signature(function).parameters.values()
    arguments = [p.name for p in signature if p.kind in (p.POSITIONAL_ONLY, p.POSITIONAL_OR_KEYWORD)]
    if arguments != list(space.names):
        raise ValueError(
            f"the arguments of {function.__name__} are ({', '.join(arguments)}), its factors "
            f"({', '.join(space.names)}); they must agree, in this order. Parameters come after a *"
        )
    hints, fields = typing.get_type_hints(function), []
    for p in signature:
        if p.kind in (p.VAR_POSITIONAL, p.VAR_KEYWORD):
            raise ValueError(f"{function.__name__} takes {p}; an oracle must know the names of all its arguments")
        if p.kind is not p.KEYWORD_ONLY:
            continue
        if hasattr(base, p.name):
            raise ValueError(
                f"{function.__name__}: no parameter can be called {p.name!r}, for every oracle has a {p.name}"
            )
        if p.name not in hints and (p.default is p.empty or p.default is None):
            raise ValueError(f"{function.__name__}: say what {p.name} is, such as {p.name}: float")
        kind = hints.get(p.name, type(p.default))
        fields.append((p.name, kind, field() if p.default is p.empty else field(default=p.default)))
    # Those without a default come first, as a dataclass wants them.
    return sorted(fields, key=lambda f: f[2].default is not MISSING)

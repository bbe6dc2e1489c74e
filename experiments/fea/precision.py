"""Float64 for this package alone: the global setting ``jax_enable_x64`` stays as the caller has it."""

from collections.abc import Callable
from functools import wraps
from typing import ParamSpec, TypeVar

import jax

P = ParamSpec("P")
R = TypeVar("R")


def in_float64(function: Callable[P, R]) -> Callable[P, R]:
    """Run `function` in the scope ``jax.enable_x64(True)``; scopes nest, and the caller's setting returns."""

    @wraps(function)
    def scoped(*args: P.args, **kwargs: P.kwargs) -> R:
        with jax.enable_x64(True):
            return function(*args, **kwargs)

    return scoped


def check_float64_scope() -> None:
    """Raise ``ValueError`` outside float64, where JAX cuts what is traced to float32 without a word."""
    if not jax.config.read("jax_enable_x64"):
        raise ValueError(
            "displacements runs in float64 only: call it, or the outer jit, vmap or grad, inside "
            "'with jax.enable_x64(True):', or use solve"
        )

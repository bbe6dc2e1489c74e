"""The first call of each mechanism in a fresh process, with and without JAX's cache of compiled code on disk."""

import tempfile
import time

import jax
import numpy as np

from experiments import oracles

from .processes import apart

ORACLES: dict[str, tuple[str, dict[str, str]]] = {
    "3-RRR, beams": ("flexure_3rrr", {}),
    "HexFlex, nonlinear": ("hexflex", {"kinematics": "nonlinear"}),
    "HexFlex, linear": ("hexflex", {}),
}


def table() -> str:
    rows = "".join(_row(what, derivatives) for what in ORACLES for derivatives in (False, True))
    return (
        "#### First call\n\nWall seconds of the first answer in a fresh process, on all cores, and with JAX's "
        "persistent compilation cache (`jax_compilation_cache_dir`, "
        "`jax_persistent_cache_min_compile_time_secs = 0`) filled by an earlier process; imports excluded.\n\n"
        f"| | no cache | cache |\n|---|---|---|\n{rows}"
    )


def _row(what: str, derivatives: bool) -> str:
    name, parameters = ORACLES[what]
    with tempfile.TemporaryDirectory() as folder:
        plain, _, cached = (
            apart(_first, name, parameters, derivatives, c, one_core=False) for c in (None, folder, folder)
        )
    return f"| {what}{', Jacobian' * derivatives} | {plain:.1f} | {cached:.1f} |\n"


def _first(name: str, parameters: dict[str, str], derivatives: bool, cache: str | None) -> float:
    """Wall seconds from the oracle's name to its first answer."""
    if cache is not None:
        jax.config.update("jax_compilation_cache_dir", cache)
        jax.config.update("jax_persistent_cache_min_compile_time_secs", 0)
        jax.config.update("jax_persistent_cache_min_entry_size_bytes", -1)
    begin = time.perf_counter()
    oracle, point = oracles.get(name, **parameters), np.full((1, 6), 0.01)
    oracle.jacobian(point) if derivatives else oracle.evaluate(point)
    return time.perf_counter() - begin

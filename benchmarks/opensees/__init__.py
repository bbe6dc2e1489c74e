"""OpenSeesPy models: the independent peer of our beam engine, for reference numbers and for timings side by side.

OpenSeesPy is optional: only calling what is here imports it. pip takes 3.8 on Python 3.12 and 3.7.1 on Python 3.11;
both work and give the same times. The Linux wheel of 3.7.1 lacks BLAS: ``apt-get install libblas3 liblapack3``.

Modules
-------
flexure_3rrr, hexflex, hexflex_linear, bends, frames
    The models.
references, descriptions
    ``python -m benchmarks.opensees.references`` writes ``tests/reference/opensees_*.json``.
timing
    CPU seconds per point.
"""

from typing import Any

__all__ = ["time_flexure_3rrr", "time_hexflex", "time_hexflex_linear"]


def __getattr__(name: str) -> Any:
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from . import timing

    return getattr(timing, name)

"""Time of one call of an exported model, beside CasADi's generated C, onnxruntime and a scikit-learn pipeline.

``python -m benchmarks.exports [--flags="-O3 -march=native"] [--model model.json]`` prints Markdown. All C is compiled
with the same compiler and flags and is called in the same run, one core, through functions that the compiler cannot
see into.
"""

from .report import table

__all__ = ["table"]

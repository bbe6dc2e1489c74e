"""The tables of the exports' speed."""

import ctypes
import subprocess
import tempfile
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from surrogates import Surrogate
from surrogates.exports import get

from .cases import CASES
from .harness import Timing, timings
from .peers import casadi_sources, interpreted, ours

FLAGS = ("-O2", "-O3 -march=native")
ROWS = {
    "forward": ("ours_forward", "casadi_forward", "casadi_nested"),
    "forward and Jacobian": ("ours_both", "casadi_both", "casadi_nested_both"),
    "inverse": ("ours_inverse", "casadi_unrolled", "casadi_finder"),
}
"""Ours; CasADi's C of monomials, and of Newton steps unrolled; of our nesting, and its own root finder."""


def table(compiler: str, flags: str, more: Mapping[str, Surrogate] | None = None) -> str:
    """Times of all cases with one set of flags, as Markdown."""
    lines = [
        f"`{Path(compiler).name} -std=c99 {flags}`; nanoseconds a call: median of batches (99.99 % of a million single "
        "calls take at most; worst of them).",
        "",
        "| case | call | ours | CasADi: monomials, unrolled Newton | ratio | CasADi: nested, root finder | ratio |",
        "|---|---|---|---|---|---|---|",
    ]
    for name, model in {**{n: make() for n, make in CASES.items()}, **(more or {})}.items():
        lines += _rows(name, model, compiler, flags)
    return "\n".join([*lines, ""])


def _rows(name: str, model: Surrogate, compiler: str, flags: str) -> list[str]:
    rng = np.random.default_rng(1)
    x = model.factors.decode(rng.uniform(-0.9, 0.9, (1000, len(model.factors))))
    y = model.predict(x)
    sources, functions = ours(model)
    theirs, their_functions = casadi_sources(model)
    sources = {n: text for n, text in sources.items() if not n.endswith("_selftest.c")}
    found = timings(compiler, flags, {**sources, **theirs}, functions + their_functions, x, y)
    rows = []
    for call, (mine, *peers) in ROWS.items():
        cells = [f"{_told(found[p])} | {found[p].median / found[mine].median:.1f}" for p in peers]
        rows.append(f"| {name} | {call} | {_told(found[mine])} | {' | '.join(cells)} |")
        name = ""
    rows.append(f"| | inverse: worst error, coded | {_accuracy(model, compiler, flags, x, y):.1g} | | | | |")
    others = ", ".join(f"{n} {t:.0f}" for n, t in interpreted(model, x).items())
    return [*rows, f"| | forward, one point a call | {others} | | | | |"]


def _told(one: Timing) -> str:
    return f"{one.median:.0f} ({one.rare:.0f}; {one.worst:.0f})"


def _accuracy(model: Surrogate, compiler: str, flags: str, x: np.ndarray, y: np.ndarray) -> float:
    """Largest coded error of our inverse at the points timed; NaN if it refused one."""
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        for name, content in get("c99").render(model, "ours").items():
            (folder / name).write_text(content)
        shared = ["-shared", "-fPIC", "ours.c", "-o", "ours.so"]
        subprocess.run([compiler, "-std=c99", *flags.split(), *shared, "-lm"], cwd=folder, check=True)
        library, found = ctypes.CDLL(str(folder / "ours.so")), np.full_like(x, np.nan)
        for k in range(len(x)):
            pointers = (row.ctypes.data_as(ctypes.c_void_p) for row in (y[k], found[k]))
            library.ours_inverse(*pointers)
    return float((np.abs(found - x) / model.factors.half_range).max())

"""A C program that times functions: the median over batches, and the worst single call of a million."""

import subprocess
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

N_POINTS, BATCHES, SINGLE_CALLS = 1000, 400, 1_000_000

MAIN = """
#define _POSIX_C_SOURCE 199309L
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

{declarations}

static double X[{points}][{n}], Y[{points}][{m}], R[{m}], J[{m} * {n}];
static double spent[{singles}];

static double now(void)
{{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return 1e9 * (double)t.tv_sec + (double)t.tv_nsec;
}}

static int order(const void *a, const void *b)
{{
    const double d = *(const double *)a - *(const double *)b;
    return d < 0 ? -1 : d > 0;
}}

{wrappers}

typedef void call(const double *x, const double *y);

static void empty(const double *x, const double *y) {{ (void)x; (void)y; }}

static void timed(const char *name, call *volatile f)
{{
    static double batch[{batches}];
    double clock;

    for (int b = 0; b < {batches}; ++b) {{
        const double begin = now();
        for (int k = 0; k < {points}; ++k) f(X[k], Y[k]);
        batch[b] = (now() - begin) / {points};
    }}
    qsort(batch, {batches}, sizeof batch[0], order);
    for (int k = 0; k < {singles}; ++k) {{
        const double begin = now();
        empty(X[k % {points}], Y[k % {points}]);
        spent[k] = now() - begin;
    }}
    qsort(spent, {singles}, sizeof spent[0], order);
    clock = spent[{singles} / 2];
    for (int k = 0; k < {singles}; ++k) {{
        const double begin = now();
        f(X[k % {points}], Y[k % {points}]);
        spent[k] = now() - begin - clock;
    }}
    qsort(spent, {singles}, sizeof spent[0], order);
    printf("%s,%.2f,%.1f,%.1f\\n", name, batch[{batches} / 2], spent[{singles} / 10000 * 9999], spent[{singles} - 1]);
}}

int main(void)
{{
    if (fread(X, sizeof X, 1, stdin) != 1 || fread(Y, sizeof Y, 1, stdin) != 1) return 1;
{calls}
    return R[0] + J[0] > 1e300;
}}
"""


@dataclass(frozen=True)
class Timing:
    """Nanoseconds of a call: median of batch means, 99.99th percentile and worst of a million single calls."""

    median: float
    rare: float
    worst: float


@dataclass(frozen=True)
class Timed:
    """A function to time: C that declares it, and a statement that calls it with ``x``, ``y``, ``R`` and ``J``."""

    name: str
    declaration: str
    statement: str


def timings(
    compiler: str, flags: str, sources: dict[str, str], functions: list[Timed], x: np.ndarray, y: np.ndarray
) -> dict[str, Timing]:
    """Times of `functions`, compiled from `sources` by file name, at points `x` (n, k) with responses `y` (n, m)."""
    wrappers = [
        f"static void w{i}(const double *x, const double *y) {{ (void)x; (void)y; {f.statement} }}"
        for i, f in enumerate(functions)
    ]
    text = MAIN.format(
        declarations="\n".join(dict.fromkeys(f.declaration for f in functions)),
        wrappers="\n".join(wrappers),
        calls="\n".join(f'    timed("{f.name}", w{i});' for i, f in enumerate(functions)),
        points=N_POINTS, batches=BATCHES, singles=SINGLE_CALLS, n=x.shape[1], m=y.shape[1],
    )  # fmt: skip
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        for name, content in {**sources, "main.c": text}.items():
            (folder / name).write_text(content)
        objects = []
        for name in (n for n in (*sources, "main.c") if n.endswith(".c")):
            # One object each: no compiler sees through a call.
            subprocess.run(
                [compiler, "-std=c99", *flags.split(), "-c", name, "-o", f"{name}.o"], cwd=folder, check=True
            )
            objects.append(f"{name}.o")
        subprocess.run([compiler, *objects, "-o", "timed", "-lm"], cwd=folder, check=True)
        given = np.ascontiguousarray(x[:N_POINTS]).tobytes() + np.ascontiguousarray(y[:N_POINTS]).tobytes()
        told = subprocess.run([folder / "timed"], input=given, capture_output=True, check=True).stdout.decode()
    rows = (line.split(",") for line in told.splitlines())
    return {name: Timing(float(a), float(b), float(c)) for name, a, b, c in rows}

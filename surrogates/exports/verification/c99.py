"""The exported C, compiled by every compiler at hand, against the model."""

import sys
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..c99.precision import DOUBLE, SINGLE, Precision, tolerance
from .base import Finding, Outcome, agreement, invertible, not_checked, reference, round_trip, run_tool, statement, tool

if TYPE_CHECKING:
    from ...model import Surrogate

COMPILERS = ("gcc", "clang", "cc")
WARNINGS = ("-std=c99", "-Wall", "-Wextra", "-Wconversion", "-Wdouble-promotion", "-pedantic", "-Werror")
OUTSIDE_DOMAIN, NOT_FINITE = 1, 4

DRIVER = """
import ctypes, sys
import numpy as np
library, prefix, kind, given, taken, n, m, has_inverse = sys.argv[1:]
real, n, m = np.dtype(kind), int(n), int(m)
library = ctypes.CDLL(library)
data = np.load(given)
pointer = lambda a: a.ctypes.data_as(ctypes.c_void_p)
def each(name, rows, *shapes):
    rows = np.ascontiguousarray(rows, real)
    status = np.zeros(len(rows), int)
    answers = [np.full((len(rows), *shape), np.nan, real) for shape in shapes]
    function = getattr(library, prefix + "_" + name)
    for k in range(len(rows)):
        status[k] = function(pointer(rows[k]), *(pointer(a[k]) for a in answers))
    return [status, *answers]
out = {}
out["forward_status"], out["forward"] = each("forward", data["settings"], (m,))
out["jacobian_status"], out["jacobian"] = each("jacobian", data["settings"], (m, n))
out["both_status"], out["both"], out["both_jacobian"] = each("forward_jacobian", data["settings"], (m,), (m, n))
out["outside_status"], out["outside"] = each("forward", data["outside"], (m,))
out["odd_status"], out["odd"] = each("forward", data["odd"], (m,))
if has_inverse == "1":
    out["inverse_status"], out["inverse"] = each("inverse", data["targets"], (n,))
np.savez(taken, **out)
"""


def verify(model: "Surrogate", prefix: str, folder: Path) -> list[Finding]:
    """Findings of the double-precision files; see :class:`.base.Verifier`."""
    return _verify(model, prefix, folder, DOUBLE)


def verify_single(model: "Surrogate", prefix: str, folder: Path) -> list[Finding]:
    """Findings of the single-precision files."""
    return _verify(model, prefix + SINGLE.ending, folder, SINGLE)


def _verify(model: "Surrogate", name: str, folder: Path, precision: Precision) -> list[Finding]:
    found = list(dict.fromkeys(path for compiler in COMPILERS if (path := tool(compiler))))
    if not found:
        return [not_checked("compiled C", "no C compiler on PATH (looked for gcc, clang and cc): install one of them")]
    findings = []
    # cc is another name of one of the others where there are such.
    for compiler in found if len(found) == 1 else [path for path in found if not path.endswith("/cc")]:
        with tempfile.TemporaryDirectory() as temporary:
            findings += _with(compiler, model, name, folder.resolve(), Path(temporary), precision)
    return findings


def _with(
    compiler: str, model: "Surrogate", name: str, folder: Path, work: Path, precision: Precision
) -> list[Finding]:
    label, library = Path(compiler).name, work / f"{name}.so"
    shared = ["-O2", "-shared", "-fPIC", folder / f"{name}.c", "-o", library, "-lm"]
    built, said = run_tool([compiler, *WARNINGS, *shared], work)
    findings = [statement(f"{label}: compiles without a warning", built, "" if built else said.strip()[-500:])]
    if not built:
        return findings
    test = [folder / f"{name}.c", folder / f"{name}_selftest.c", "-o", work / "selftest", "-lm"]
    built, said = run_tool([compiler, *WARNINGS, "-O1", *test], work)
    passed, said = run_tool([work / "selftest"], work) if built else (built, said)
    findings.append(statement(f"{label}: self-test", passed, "" if passed else said.strip()[-500:]))
    return findings + _points(label, model, name, library, work, precision)


def _points(
    label: str, model: "Surrogate", name: str, library: Path, work: Path, precision: Precision
) -> list[Finding]:
    kind = np.dtype(np.float32 if precision.ending else np.float64)
    given = reference(model, seed=1)
    settings = given.settings.astype(kind).astype(np.float64)
    responses, slopes = model.predict(settings), model.jacobian(settings)
    targets, outside = (v.astype(kind).astype(np.float64) for v in (given.targets, given.outside))
    odd = np.repeat(settings[:1], 3, axis=0)
    odd[:, -1] = (np.nan, np.inf, -np.inf)
    np.savez(work / "given.npz", settings=settings, outside=outside, odd=odd, targets=targets)
    sizes = (str(len(model.factors)), str(len(model.responses)), str(int(invertible(model))))
    arguments = [library, name, kind.name, work / "given.npz", work / "taken.npz", *sizes]
    # In a process of its own: code that was tampered with may crash.
    well, said = run_tool([sys.executable, "-I", "-c", DRIVER, *arguments], work)
    if not well:
        return [Finding(f"{label}: at random points", Outcome.DIFFERS, said.strip()[-500:])]
    with np.load(work / "taken.npz") as answers:
        taken = dict(answers)
    n, limit = len(settings), precision.agreement
    findings = [
        agreement(f"{label}: forward at {n} points", taken["forward"], responses, given.magnitude, limit),
        agreement(f"{label}: Jacobian there", taken["jacobian"], slopes, given.slope_magnitude, limit),
        statement(
            f"{label}: both at once give the same",
            bool((taken["both_jacobian"] == taken["jacobian"]).all())
            and agreement("", taken["both"], responses, given.magnitude, limit).outcome is Outcome.AGREES,
        ),
        statement(
            f"{label}: settings outside and not finite are told",
            bool((taken["outside_status"] == OUTSIDE_DOMAIN).all() and (taken["odd_status"] == NOT_FINITE).all())
            and not any(taken[f"{call}_status"].any() for call in ("forward", "jacobian", "both"))
            and bool(np.isnan(taken["odd"]).all()),
        ),
    ]
    if invertible(model):
        ok = taken["inverse_status"] == 0
        # In single precision an end of a range is rounded, perhaps outwards, and the response is told in seven digits.
        miss = float((tolerance(model, precision) / model.scale).max())
        held = np.clip(taken["inverse"], [f.low for f in model.factors], [f.high for f in model.factors])
        found = held if precision.ending else taken["inverse"]
        findings.append(
            round_trip(
                model, f"{label}: inverse of {n} targets", targets, found, ok, 4.0 * miss if precision.ending else 0.0
            )
        )
    return findings

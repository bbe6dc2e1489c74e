"""Proof of the MATLAB export: GNU Octave runs it, which reads the same language. MATLAB itself was not at hand."""

import shutil
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from string import Template
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..base import about
from .base import (
    DOUBLE,
    Finding,
    Reference,
    agreement,
    invertible,
    not_checked,
    reference,
    round_trip,
    run_tool,
    statement,
    tool,
)

if TYPE_CHECKING:
    from ...model import Surrogate

OCTAVE = ("octave-cli", "octave")
OK, OUTSIDE_DOMAIN, UNREACHABLE, NOT_CONVERGED, NOT_FINITE = range(5)

FORWARD_SCRIPT = """\
given = load('${p}_given.mat');
[responses, status] = ${p}_forward(given.settings);
[jacobian, jacobian_status] = ${p}_jacobian(given.settings);
[~, outside] = ${p}_forward(given.outside);
outside_too = ${p}_inside(given.outside);
[bad_responses, bad_status] = ${p}_forward(given.bad);
one = ${p}_forward(given.settings(1, :));
none = ${p}_forward(given.settings([], :));
described = help('${p}_forward');
settings = []; found_status = []; bad_settings = []; refused = []; beyond = [];
"""
INVERSE_SCRIPT = """\
[settings, found_status] = ${p}_inverse(given.targets);
[bad_settings, refused] = ${p}_inverse(given.bad_targets);
[~, beyond] = ${p}_inverse(given.beyond);
"""
SAVE_SCRIPT = """\
warned = lastwarn();
save('-v6', '${p}_got.mat', 'responses', 'status', 'jacobian', 'jacobian_status', 'outside', 'outside_too', ...
    'bad_responses', 'bad_status', 'one', 'none', 'described', 'settings', 'found_status', 'bad_settings', ...
    'refused', 'beyond', 'warned');
clear -all
"""


@dataclass(frozen=True, eq=False)
class Given:
    """What the functions of one model are called with, a row each."""

    known: Reference
    bad: NDArray[np.float64]
    targets: NDArray[np.float64]
    bad_targets: NDArray[np.float64]
    beyond: NDArray[np.float64]


def verify(model: "Surrogate", prefix: str, folder: Path) -> list[Finding]:
    """Forward map, Jacobian, statuses, help and inverse in GNU Octave; see :class:`.Verifier`."""
    return verify_all([(model, prefix)], folder)[0]


def verify_all(models: Sequence[tuple["Surrogate", str]], folder: Path) -> list[list[Finding]]:
    """The findings of several models with different prefixes, whose files lie in one folder: Octave starts once."""
    program = tool(*OCTAVE)
    if program is None:
        why = "GNU Octave is not installed: apt install octave"
        return [[not_checked("all functions, in GNU Octave", why)] for _ in models]
    given = [_given(model) for model, _ in models]
    with tempfile.TemporaryDirectory() as name:
        work = Path(name)
        script: list[str] = []
        for (model, prefix), asked in zip(models, given, strict=True):
            for file in folder.glob(f"{prefix}_*.m"):
                shutil.copy(file, work)
            _write(work / f"{prefix}_given.mat", asked)
            body = FORWARD_SCRIPT + (INVERSE_SCRIPT if invertible(model) else "") + SAVE_SCRIPT
            script.append(Template(f"lastwarn('');\n{body}").substitute(p=prefix))
        (work / "run_all.m").write_text("\n".join(script), encoding="ascii")
        good, printed = run_tool([program, "--norc", "--quiet", "--no-gui", "run_all.m"], work)
        return [
            _findings(model, asked, work / f"{prefix}_got.mat", good, printed)
            for (model, prefix), asked in zip(models, given, strict=True)
        ]


def _given(model: "Surrogate") -> Given:
    known = reference(model)
    wanted = known.targets
    logs = np.array([link == "log" for link in model.links])
    beyond = np.where(logs, wanted[:1] * 1e30, wanted[:1] + 1e30 * model.scale)
    return Given(known, _spoiled(known.settings[0]), wanted, _spoiled(wanted[0]), beyond)


def _spoiled(row: NDArray[np.float64]) -> NDArray[np.float64]:
    """The row with each of its numbers replaced by NaN and the infinities, shape (3 n, n)."""
    rows = np.repeat(row[None], 3 * len(row), axis=0)
    for k in range(len(row)):
        rows[3 * k : 3 * k + 3, k] = np.nan, np.inf, -np.inf
    return rows


def _write(path: Path, given: Given) -> None:
    from scipy.io import savemat

    savemat(
        path,
        {
            "settings": given.known.settings,
            "outside": given.known.outside,
            "bad": given.bad,
            "targets": given.targets,
            "bad_targets": given.bad_targets,
            "beyond": given.beyond,
        },
    )


def _findings(model: "Surrogate", given: Given, answers: Path, good: bool, printed: str) -> list[Finding]:
    from scipy.io import loadmat

    if not answers.exists():
        return [statement("the functions run in GNU Octave", good, printed.strip()[-300:])]
    got = loadmat(answers)
    return _forward(model, given, got) + (_inverse(model, given, got) if invertible(model) else [])


def _forward(model: "Surrogate", given: Given, got: dict[str, Any]) -> list[Finding]:
    known, (n, k) = given.known, given.known.settings.shape
    jacobian = np.moveaxis(got["jacobian"].reshape(known.responses.shape[1], k, n), 2, 0)
    described, warned = (str(got[name][0]) if got[name].size else "" for name in ("described", "warned"))
    lines = [line for line in about(model) if line.strip()]
    empty_and_one = got["none"].shape == (0, known.responses.shape[1]) and _same(got["one"], got["responses"][:1])
    return [
        agreement("forward, in GNU Octave", got["responses"], known.responses, known.magnitude, DOUBLE),
        agreement("Jacobian, in GNU Octave", jacobian, known.jacobian, known.slope_magnitude, DOUBLE),
        statement("settings in the domain are said to be", _all(OK, got["status"], got["jacobian_status"])),
        statement("settings outside are said to be", _all(OUTSIDE_DOMAIN, got["outside"], got["outside_too"])),
        statement(
            "NaN and infinite settings are refused",
            _all(NOT_FINITE, got["bad_status"]) and bool(np.isnan(got["bad_responses"]).all()),
        ),
        statement("one row alone, and none, are as many", empty_and_one),
        statement("help tells the model", all(line.strip() in described for line in lines)),
        statement("no warning", not warned, warned),
    ]


def _inverse(model: "Surrogate", given: Given, got: dict[str, Any]) -> list[Finding]:
    ok = got["found_status"].ravel() == OK
    known_statuses = (UNREACHABLE, NOT_CONVERGED, OUTSIDE_DOMAIN)
    return [
        round_trip(model, "inverse, in GNU Octave", given.targets, got["settings"], ok, DOUBLE),
        statement(
            "NaN and infinite targets are refused",
            _all(NOT_FINITE, got["refused"]) and bool(np.isnan(got["bad_settings"]).all()),
        ),
        statement("a target beyond all reach is refused", bool(np.isin(got["beyond"], known_statuses).all())),
    ]


def _all(status: int, *found: NDArray[np.float64]) -> bool:
    return all(values.size > 0 and bool((values == status).all()) for values in found)


def _same(a: NDArray[np.float64], b: NDArray[np.float64]) -> bool:
    """Equal but for the last digits: sums of one row and of many are added in another order."""
    return a.shape == b.shape and bool((np.abs(a - b) <= 1e-13 * np.abs(b)).all())

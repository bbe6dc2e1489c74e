"""Proof of the IEC 61131-3 export: its grammar by blark, its numbers by an interpreter of ours.

There is no compiler of structured text in Debian, and no vendor's was at hand. blark (optional) reads the text by a
grammar that others wrote after TwinCAT's; the interpreter (:mod:`.structured_text_run`) checks types and runs it.
"""

import re
from functools import lru_cache
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from .base import DOUBLE, Finding, agreement, invertible, not_checked, reference, round_trip, statement
from .edges import at_faces
from .iec61131_parse import NotStructuredText, parse
from .iec61131_run import Program

if TYPE_CHECKING:
    from ...model import Surrogate

N_POINTS = 100
MOST_FOR_BLARK = 40_000
"""Characters of code beyond which blark, at about a second for 2000, is not asked."""

INTERPRETER = "our interpreter"
OK, OUTSIDE_DOMAIN, NOT_FINITE = 0, 1, 4

_COMMENT = re.compile(r"\(\*.*?\*\)", re.DOTALL)
_END = re.compile(r"(?<=END_FUNCTION_BLOCK\n)|(?<=END_FUNCTION\n)")


def verify(model: "Surrogate", prefix: str, folder: Path) -> list[Finding]:
    """Grammar, types, forward map, Jacobian, statuses and inverse of ``<prefix>.st``; see :class:`.Verifier`."""
    try:
        text = (folder / f"{prefix}.st").read_text(encoding="ascii")
    except (OSError, UnicodeDecodeError) as error:
        return [statement(f"{prefix}.st is ASCII text", False, str(error))]
    grammar = blark_finding(text)
    try:
        program = Program(text)
    except NotStructuredText as error:
        return [grammar, statement("grammar and types, by our interpreter", False, str(error))]
    found = [grammar, statement("grammar and types, by our interpreter", True, f"{len(program.blocks)} blocks")]
    checks = [_forward, _jacobian, _statuses, *([_inverse] if invertible(model) else [])]
    for check in checks:
        try:
            found += check(model, program, prefix)
        except (NotStructuredText, KeyError) as error:
            found.append(statement(f"{check.__name__.strip('_')} runs, in {INTERPRETER}", False, str(error)))
    return found


def blark_finding(text: str) -> Finding:
    """Whether blark reads the text, and reads of it what our parser reads."""
    what = "grammar, by blark"
    if find_spec("blark") is None:
        return not_checked(what, "blark is not installed: pip install blark")
    bare = _COMMENT.sub(" ", text)
    if len(bare) > MOST_FOR_BLARK:
        return not_checked(
            what, f"{len(bare)} characters of code would take blark minutes; it is asked up to {MOST_FOR_BLARK}"
        )
    answers = [_read_by_blark(part.strip() + "\n") for part in _END.split(bare) if part.strip()]
    wrong = [answer for answer in answers if answer]
    return statement(what, not wrong, "; ".join(wrong) or f"{len(answers)} blocks")


@lru_cache(maxsize=256)
def _read_by_blark(block: str) -> str:
    """What is wrong with one block without comments; nothing if all is well."""
    blark = import_module("blark")
    result = blark.parse_source_code(block)
    if result.tree is None:
        return str(result.exception).partition("\n")[0]
    # blark prints END_IF and END_FOR without the semicolon that they came with.
    printed = re.sub(r"\bEND_(IF|FOR)\b", r"END_\1;", str(result.transform()))
    try:
        same = parse(printed) == parse(block)
    except NotStructuredText as error:
        return f"what blark read is not what was written: {error}"
    return "" if same else "what blark read is not what was written"


def _forward(model: "Surrogate", program: Program, prefix: str) -> list[Finding]:
    known, run = reference(model, N_POINTS), program.instance(f"{prefix}_forward")
    answers = [run(settings=row) for row in known.settings]
    got = [answer["responses"] for answer in answers]
    return [
        agreement(f"forward, in {INTERPRETER}", got, known.responses, known.magnitude, DOUBLE),
        statement("forward's status in the domain", all(answer["status"] == OK for answer in answers)),
    ]


def _jacobian(model: "Surrogate", program: Program, prefix: str) -> list[Finding]:
    known, run = reference(model, N_POINTS), program.instance(f"{prefix}_jacobian")
    answers = [run(settings=row) for row in known.settings]
    slopes, got = [a["jacobian"] for a in answers], [a["responses"] for a in answers]
    return [
        agreement(f"Jacobian, in {INTERPRETER}", slopes, known.jacobian, known.slope_magnitude, DOUBLE),
        agreement("responses beside the Jacobian", got, known.responses, known.magnitude, DOUBLE),
    ]


def _statuses(model: "Surrogate", program: Program, prefix: str) -> list[Finding]:
    known, faces = reference(model, N_POINTS), at_faces(model)
    outside = {
        program.instance(f"{prefix}_{name}")(settings=row)["status"]
        for name in ("inside", "forward", "jacobian")
        for row in np.vstack([known.outside, faces[~model.contains(faces)]])
    }
    run = program.instance(f"{prefix}_forward")
    before = run(settings=known.settings[0])
    kept = []
    for k in range(len(model.factors)):
        for bad in (np.nan, np.inf, -np.inf):
            row = known.settings[0].copy()
            row[k] = bad
            after = run(settings=row)
            kept.append(after["status"] == NOT_FINITE and (after["responses"] == before["responses"]).all())
    return [
        statement("settings outside the domain are said to be", outside == {OUTSIDE_DOMAIN}),
        statement("NaN and infinite settings are refused, and outputs stay", all(kept)),
    ]


def _inverse(model: "Surrogate", program: Program, prefix: str) -> list[Finding]:
    wanted, run = reference(model, N_POINTS).targets, program.instance(f"{prefix}_inverse")
    answers = [run(responses=row) for row in wanted]
    found = np.array([answer["settings"] for answer in answers])
    ok = np.array([answer["status"] == OK for answer in answers])
    refused = []
    for bad in (np.nan, np.inf, -np.inf):
        row = wanted[0].copy()
        row[-1] = bad
        refused.append(run(responses=row)["status"] == NOT_FINITE)
    far = np.where(np.array(model.links) == "log", wanted[0] * 1e30, wanted[0] + 1e30 * model.scale)
    return [
        round_trip(model, f"inverse, in {INTERPRETER}", wanted, found, ok, DOUBLE),
        statement("NaN and infinite targets are refused", all(refused)),
        statement("a target beyond all reach is refused", run(responses=far)["status"] in (1, 2, 3)),
    ]

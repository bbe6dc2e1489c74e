"""The settings of a program as checked, frozen objects, made from plain data: from a config, or in Python."""

import copy
import hashlib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

from ...factors import Factor, FactorSpace
from ...runs import Response
from ...settings import build, parameter
from . import checks
from .parsers import Reader
from .template import Template

FOLDER, PYTHON = "folder", "python"
WORDS = (FOLDER, PYTHON)
"""What argv may name beside factors: the working folder, and the Python that runs flexdoce."""

MOST, LONGEST_ARGV = 1000, 128 * 2**10
"""Factors, responses or files of a program; characters of all its arguments (a single one on Linux)."""

KEEP = ("failed", "all", "none")
_RESPONSE_KEYS = ("unit", "shown_unit", "shown_scale", "symbol")


@dataclass(frozen=True)
class Program:
    """What is run, how long, with what around it, and what becomes of its folders."""

    argv: list | tuple = parameter((), "", "program, arguments; {{factor}}, {{folder}}, {{python}}")  # noqa: RUF009
    time_limit: float = parameter(3600.0, "s", "a run that takes longer is ended, with its children")
    grace: float = parameter(2.0, "s", "between asking a process to end and ending it")
    retries: int = parameter(0, "", "further tries, in new folders, of a run that crashed or timed out")
    exit_codes: list | tuple = parameter((0,), "", "exit codes that mean success")  # noqa: RUF009
    environment: dict | None = parameter(None, "", "environment variables that are added")  # noqa: RUF009
    inherit: list | tuple = parameter((), "", "environment variables passed on, beside PATH and the like")  # noqa: RUF009
    rejected_if: str = parameter("", "", "pattern in what it prints: the point makes no sense")
    not_converged_if: str = parameter("", "", "pattern in what it prints: it found no solution")
    keep: str = parameter("failed", "", "working folders that stay: failed, all or none")
    work_folder: str | None = parameter(None, "", "where working folders are made; a temporary place if not given")
    version: str = parameter("", "", "version of the program; change it when its answers change")
    resolution: float = parameter(0.0, "", "relative: differences below it are rounding, such as 1e-6 for 7 digits")
    source: str = parameter("", "", "where the physics comes from")

    def __post_init__(self) -> None:
        if sum(map(len, checks.texts("argv", self.argv))) > LONGEST_ARGV:
            raise ValueError(f"argv is longer than {LONGEST_ARGV} characters, which no system passes to a program")
        if not self.argv or not self.argv[0]:
            raise ValueError("argv needs the program and its arguments, as a list of texts")
        first = self.argv[0]
        if "{{" in first and first != "{{python}}":
            raise ValueError(f"argv: the program must be stated as it is, without placeholders, got {first!r}")
        if "/" in first and not first.startswith("/"):
            raise ValueError(
                f"argv: the program must be a name on PATH, an absolute path or {{{{python}}}}, got {first!r}"
            )
        if not 0.0 < self.time_limit <= 1e7:
            raise ValueError(f"time_limit must be above 0 and at most 1e7 s, got {self.time_limit}")
        if not 0.0 <= self.grace <= 600.0:
            raise ValueError(f"grace must be 0 to 600 s, got {self.grace}")
        if not 0 <= self.retries <= 100:
            raise ValueError(f"retries must be 0 to 100, got {self.retries}")
        if not 0.0 <= self.resolution < 1.0:
            raise ValueError(f"resolution must be at least 0 and below 1, got {self.resolution}")
        if not self.exit_codes or not all(type(c) is int and 0 <= c <= 255 for c in self.exit_codes):
            raise ValueError(f"exit_codes must be whole numbers from 0 to 255, got {self.exit_codes!r}")
        for name, value in (self.environment or {}).items():
            checks.variable(name, value)
        for name in checks.texts("inherit", self.inherit):
            checks.variable_name(name)
        for name in ("rejected_if", "not_converged_if"):
            checks.pattern(name, getattr(self, name))
        checks.one_of("keep", self.keep, KEEP)


class Settings(NamedTuple):
    """All of it: the program, its factors, responses with their readers, and files with their SHA-256."""

    program: Program
    factors: FactorSpace
    responses: tuple[Response, ...]
    readers: tuple[Reader, ...]
    argv: tuple[Template, ...]
    templates: dict[str, Template]
    files: dict[str, str]
    sums: dict[str, str]


@dataclass(frozen=True)
class _Text:
    """A file in the working folder, by its text; the name of the file that it was read from is for people."""

    text: str
    file: str = ""


def settings_from(kind: str, given: Mapping[str, Any]) -> Settings:
    """Check plain data and make settings of it.

    Parameters
    ----------
    kind : str
        What the settings are of, for messages.
    given : mapping
        The fields of :class:`Program`; tables of `factors`, `responses`, `templates` and `files` by name.

    Raises
    ------
    ValueError
        With one sentence on the first thing that is wrong.
    """
    given = copy.deepcopy(dict(given))
    tables = {name: _table(kind, name, given.get(name, {})) for name in ("factors", "responses", "templates", "files")}
    if large := [name for name, table in tables.items() if len(table) > MOST]:
        raise ValueError(f"{kind}: {len(tables[large[0]])} {large[0]} are too many; at most {MOST} are allowed")
    program = build(kind, Program, {k: v for k, v in given.items() if k not in tables})
    space = FactorSpace(tuple(_factor(kind, name, table) for name, table in tables["factors"].items()))
    found = [_response(kind, name, table) for name, table in tables["responses"].items()]
    if not found:
        raise ValueError(f"{kind} needs at least one response")
    if clash := set(space.names) & {*(r.name for r, _ in found), *WORDS}:
        raise ValueError(
            f"{kind}: no factor may be called {min(clash)!r}, which is a response or has a meaning of its own"
        )
    texts = {which: _texts(kind, which, tables[which]) for which in ("templates", "files")}
    _names_differ(kind, [*texts["templates"], *texts["files"]])
    templates = {n: Template.parse(f"template {n!r}", text, space) for n, text in texts["templates"].items()}
    argv = tuple(Template.parse(f"argv[{i}]", text, space, WORDS) for i, text in enumerate(program.argv))
    _all_used(space, [*templates.values(), *argv])
    sums = {n: hashlib.sha256(t.encode()).hexdigest() for which in texts.values() for n, t in which.items()}
    responses, readers = zip(*found, strict=True)
    return Settings(program, space, responses, readers, argv, templates, texts["files"], sums)


def _table(kind: str, name: str, value: object) -> Mapping[str, Any]:
    if not isinstance(value, Mapping) or not all(isinstance(v, Mapping) for v in value.values()):
        raise ValueError(f"{kind}: {name} must be a table with a table for every name, got {value!r}")
    return value


def _factor(kind: str, name: str, table: Mapping[str, Any]) -> Factor:
    given = {"source": "set by the user", **table}
    return build(f"{kind}: factor {name!r}", Factor, {"name": name, **{k: v for k, v in given.items() if k != "name"}})


def _response(kind: str, name: str, table: Mapping[str, Any]) -> tuple[Response, Reader]:
    """A response, and where it is read."""
    what = f"{kind}: response {name!r}"
    shown = {key: value for key, value in table.items() if key in _RESPONSE_KEYS}
    rest = {key: value for key, value in table.items() if key not in _RESPONSE_KEYS}
    response = build(what, Response, {**shown, "name": name})
    return response, build(what, Reader, {**rest, "response": name, "unit": response.unit})


def _texts(kind: str, which: str, table: Mapping[str, Any]) -> dict[str, str]:
    """Texts by the name that they have in the working folder."""
    for name, entry in table.items():
        checks.plain_relative(f"{kind}: {which}: the file name", name)
        if "text" not in entry:
            raise ValueError(f"{kind}: {which}: {name!r} needs its text; a config may name a file beside it: file = …")
    return {name: build(f"{kind}: {which}: {name!r}", _Text, entry).text for name, entry in table.items()}


def _names_differ(kind: str, names: Iterable[str]) -> None:
    seen = {checks.STDOUT, checks.STDERR}
    for name in (n.lower() for n in names):
        if name in seen:
            raise ValueError(f"{kind}: two files cannot both be called {name!r} in the working folder")
        seen.add(name)


def _all_used(space: FactorSpace, texts: Iterable[Template]) -> None:
    """Refuse a factor that the program would never hear of."""
    named = frozenset[str]().union(*(t.names for t in texts))
    if idle := [name for name in space.names if name not in named]:
        raise ValueError(
            f"no template and no argument names the factor {idle[0]!r}: write {{{{{idle[0]}}}}} where its value "
            "belongs, or remove the factor"
        )

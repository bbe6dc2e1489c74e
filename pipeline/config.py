"""The config: TOML parsed once into frozen settings, with one sentence for whatever is wrong."""

import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, get_args

import tomli_w
from pydantic import BaseModel, BeforeValidator, Field, PrivateAttr, ValidationError

from experiments.naming import suggestion
from experiments.oracles.files import is_file

from .errors import InputError
from .nesting import DEEPEST, excess
from .other_models import CompareTable, with_models
from .programs import embedded
from .sections import (
    CommandTable,
    ExecutorTable,
    ExportTable,
    FactorRange,
    FitTable,
    OracleTable,
    RequireTable,
    ScreeningTable,
    SweepTable,
    ValidationTable,
    named,
)
from .strict import Table

SHOWN = 120
"""Characters of a wrong value in a message."""


class Config(Table):
    """A study, as written by a person."""

    version: int = Field(default=1, ge=1, le=1, description="version of this format")
    name: str = Field(pattern=r"^[A-Za-z][A-Za-z0-9_]*$", description="short name: letters, digits, underscores")
    title: str = Field(default="", description="one line for the report")
    seed: int = Field(default=0, ge=0, le=2**63 - 1, description="seed of everything random")
    oracle: Annotated[OracleTable, BeforeValidator(named, json_schema_input_type=OracleTable | str)]
    factors: dict[str, FactorRange] = Field(default={}, description="ranges that replace the oracle's defaults")
    screening: ScreeningTable = ScreeningTable()
    fit: FitTable = FitTable()
    validation: ValidationTable = ValidationTable()
    require: RequireTable = RequireTable()
    command: CommandTable = CommandTable()
    export: ExportTable = ExportTable()
    compare: list[CompareTable] = Field(default=[], description="models of other studies that the report shows beside")
    executor: ExecutorTable = ExecutorTable()
    sweep: SweepTable | None = Field(
        default=None, description="lists of values by dotted key: the grid that flexdoce sweep runs"
    )

    @property
    def of_answers(self) -> "Config":
        """Without what changes no answer: two configs that agree in this belong to the same run folder."""
        return self.model_copy(update={"executor": ExecutorTable(), "sweep": None})

    _home: Path | None = PrivateAttr(default=None)

    @property
    def home(self) -> Path | None:
        """Folder of the file that it is from, if its oracle lies in a file below that; else None."""
        return self._home


def load_config(path: str | Path, overrides: Sequence[str] = ()) -> Config:
    """Read a config file and apply ``dotted.key=value`` overrides.

    Raises
    ------
    InputError
        If the file cannot be read, is not TOML, or a key or value is not allowed.
    """
    try:
        text = Path(path).read_text(encoding="utf-8-sig")
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or "it is not UTF-8 text"
        raise InputError(f"cannot read the config {path}: {reason}") from None
    config = parse_config(text, str(path), overrides)
    if is_file(config.oracle.name):
        config._home = Path(path).parent
    if config.compare:
        compare = with_models(config.compare, Path(path).parent, str(path))
        config = config.model_copy(update={"compare": compare})
    if config.oracle.command is None:
        return config
    # With the texts of its templates a config says all that it needs, wherever it is copied to.
    program = embedded(config.oracle.command, Path(path).parent, str(path))
    return config.model_copy(update={"oracle": config.oracle.model_copy(update={"command": program})})


def parse_config(text: str, origin: str = "config", overrides: Sequence[str] = ()) -> Config:
    """As :func:`load_config`, from text; `origin` names it in messages."""
    if why := excess(text):
        raise InputError(f"{origin} is no config: {why}")
    try:
        document = tomllib.loads(text)
    except RecursionError:
        raise InputError(f"{origin} is not valid TOML: it is nested too deep") from None
    except ValueError as error:
        raise InputError(f"{origin} is not valid TOML: {error}") from None
    if overrides and "oracle" in document:
        document["oracle"] = named(document["oracle"])
    for override in overrides:
        _apply(document, override)
    try:
        return Config.model_validate(document)
    except ValidationError as error:
        raise InputError(f"{origin}: {_sentence(error)}") from None


def assignments(overrides: Sequence[str]) -> dict[str, Any]:
    """Settings from ``key=value`` texts; ``InputError`` if one has another form."""
    document: dict[str, Any] = {}
    for override in overrides:
        _apply(document, override)
    return document


def dump_config(config: Config) -> str:
    """The config as resolved, in TOML; parsing it gives the same config."""
    text = tomli_w.dumps(config.model_dump(exclude_none=True))
    # All texts are basic strings: what a terminal must not be sent raw can be escaped in them.
    return "".join(c if c.isprintable() or c == "\n" else _escaped(c) for c in text)


def _escaped(character: str) -> str:
    number = ord(character)
    return f"\\u{number:04X}" if number < 2**16 else f"\\U{number:08X}"


def json_schema() -> dict[str, Any]:
    """JSON schema of the config, for editors."""
    schema = Config.model_json_schema()
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **schema}


def _apply(document: dict[str, Any], override: str) -> None:
    if not override.isprintable():
        raise InputError(f"--set {override!r} has characters that cannot be printed")
    key, equals, value = override.partition("=")
    parts = [p.strip() for p in key.split(".")]
    if not equals or not all(parts) or len(parts) > DEEPEST:
        raise InputError(f"--set {override!r} is not of the form dotted.key=value, such as fit.degree=3")
    try:
        if why := excess(value):
            raise InputError(f"--set {key}: {why}")
        parsed = written_value(value)
    except (ValueError, RecursionError) as error:
        raise InputError(f"--set {key}: {error}") from None
    table: Any = document
    for part in parts[:-1]:
        table = table.setdefault(part, {})
        if not isinstance(table, dict):
            raise InputError(f"--set {override!r}: {part!r} is a value, not a table")
    table[parts[-1]] = parsed


def written_value(text: str) -> Any:
    """A value as it is written on the command line: TOML, or a word without quotes.

    Raises
    ------
    ValueError, RecursionError
        If it is a number with too many digits, or nested too deep.
    """
    try:
        return tomllib.loads(f"value = {text}")["value"]
    except tomllib.TOMLDecodeError:
        return text.strip()


def _sentence(error: ValidationError) -> str:
    """The first problem, as one sentence that says where, what came and what is allowed."""
    problems = error.errors()
    first = next((p for p in problems if p["type"] == "extra_forbidden"), problems[0])
    where = ".".join(str(part) for part in first["loc"] if not _is_type_tag(part))
    if first["type"] == "extra_forbidden":
        known = _known_keys(first["loc"][:-1])
        return f"unknown key {where!r}{suggestion(str(first['loc'][-1]), known)}"
    if first["type"] == "missing":
        kind = "table" if first["loc"] == ("oracle",) else "key"
        return f"the {kind} {where!r} is missing"
    allowed = first["msg"].removeprefix("Input ").replace("valid ", "").replace("a integer", "a whole number")
    if first["type"] in {"model_type", "model_attributes_type", "dict_type"}:
        allowed = "should be a table"
    beside = [p for p in problems if p["loc"][:-1] == first["loc"][:-1]]
    words = [p.get("ctx", {}).get("expected", "") for p in beside if p["type"] == "literal_error"]
    if words and first["type"] != "literal_error":
        allowed += f" or {words[0]}"
    elif _is_type_tag(first["loc"][-1]):
        allowed = "should be a finite number, a text, true or false"
    if where == "version":
        allowed = "should be 1"
    if where == "compare":
        allowed = "should be a list of tables, each headed [[compare]]"
    if "pattern" in (first.get("ctx") or {}):
        allowed = "should be letters, digits and underscores, starting with a letter"
    return f"{where} {allowed}, got {_shown(first['input'])}"


def _shown(value: Any) -> str:
    """What came, as far as a message has room."""
    try:
        text = repr(value)
    except RecursionError:
        return "something nested too deep"
    return text if len(text) <= SHOWN else f"{text[:SHOWN]}…"


def _is_type_tag(part: Any) -> bool:
    """Whether pydantic put the name of a type, not a key, in an error's location."""
    plain = {"bool", "int", "float", "str", "constrained-int", "constrained-float"}
    return part in plain or str(part).startswith("literal[")


def _known_keys(location: Sequence[Any]) -> list[str]:
    """Keys of the table at `location`."""
    model: Any = Config
    for part in location:
        field = getattr(model, "model_fields", {}).get(part)
        # Below a table of tables, such as factors, comes a name first: the part after it is what has keys.
        model = _model_in(field.annotation) if field else model
    return list(getattr(model, "model_fields", {}))


def _model_in(hint: Any) -> Any:
    """The table that a type hint speaks of: itself, or what an optional one or a table of tables holds."""
    inner = [_model_in(part) for part in get_args(hint)]
    return next((m for m in (hint, *inner) if isinstance(m, type) and issubclass(m, BaseModel)), None)


def differences(ours: Config, theirs: Config) -> list[str]:
    """Dotted keys in which two configs differ, of those that answers may depend on."""
    return sorted(_differ(ours.of_answers.model_dump(), theirs.of_answers.model_dump(), ""))


def _differ(a: Mapping[str, Any], b: Mapping[str, Any], prefix: str) -> set[str]:
    found: set[str] = set()
    for key in {*a, *b}:
        here, there = a.get(key), b.get(key)
        if isinstance(here, Mapping) and isinstance(there, Mapping):
            found |= _differ(here, there, f"{prefix}{key}.")
        elif here != there:
            found.add(f"{prefix}{key}")
    return found

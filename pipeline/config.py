"""The config: TOML parsed once into frozen settings, with one sentence for whatever is wrong."""

import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, Literal, get_args

import tomli_w
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from experiments.naming import suggestion
from surrogates.candidates import HIGHEST

from .errors import InputError
from .nesting import DEEPEST, excess
from .programs import ProgramTable, embedded
from .strict import Number, Setting, Table

SHOWN = 120
"""Characters of a wrong value in a message."""


class FactorRange(Table):
    """A range that replaces an oracle's default."""

    low: Number = Field(description="low end, in the factor's unit")
    high: Number = Field(description="high end, in the factor's unit")
    unit: str | None = Field(default=None, description="the factor's unit, checked if given")


class DesignTable(Table):
    """A design method and its settings, which differ by method; ``flexdoce list`` names them."""

    model_config = ConfigDict(extra="allow", frozen=True, strict=True)
    __pydantic_extra__: dict[str, Setting] = Field(init=False)  # type: ignore[assignment]

    method: str = Field(description="name of the design method")

    @property
    def settings(self) -> dict[str, Any]:
        """The settings beside the method's name."""
        return dict(self.__pydantic_extra__ or {})


class ScreeningDesign(DesignTable):
    """An orthogonal two-level design."""

    method: str = Field(default="plackett_burman", description="name of the design method")


class FillDesign(DesignTable):
    """A filling design; without ``n_runs`` it is sized from the factors that act."""

    method: str = Field(default="uniform", description="name of the design method")


class OracleTable(Table):
    """What answers the runs."""

    name: str = Field(description="name of the oracle")
    parameters: dict[str, Setting] = Field(default={}, description="oracle inputs held fixed; defaults where not given")
    max_failed_fraction: float = Field(
        default=0.0, ge=0.0, le=1.0, description="failed runs tolerated in the fit and the validation"
    )
    command: ProgramTable | None = Field(default=None, description="the program, for name = 'command'")


class ScreeningTable(Table):
    """Which factors act."""

    design: ScreeningDesign = ScreeningDesign()
    alpha: float = Field(default=0.05, gt=0.0, lt=1.0, description="error rate of Lenth's margins")
    keep: list[str] = Field(default=[], description="factors kept whatever the screening says")
    follow: bool = Field(
        default=False, description="run the foldover too, where the screening asks for it: twice the screening runs"
    )
    tolerance: float = Field(
        default=0.05,
        ge=0.0,
        lt=1.0,
        description="share of a response's standard deviation that main effects may leave unexplained before factors "
        "without one are kept too",
    )


class FitTable(Table):
    """The polynomial and the design that it is fitted on."""

    design: FillDesign = FillDesign()
    degree: Annotated[int, Field(ge=1, le=HIGHEST)] | Literal["auto"] = Field(
        default=2, description="highest total degree of the candidate terms; auto: chosen for each response"
    )
    highest_degree: int = Field(default=5, ge=1, le=HIGHEST, description="up to which degree 'auto' looks")
    interactions: bool = Field(default=True, description="whether products of different factors are candidates")
    trim: bool = Field(default=True, description="whether terms that the data do not support are removed")
    selection: Literal["backward", "forward", "lars", "adaptive_lasso", "evidence"] = Field(
        default="backward",
        description="backward: from a fit of all candidates; evidence: all, each as large as smoothness allows; "
        "forward, lars, adaptive_lasso: term by term; all but backward do with fewer runs than candidates",
    )
    basis: Literal["monomial", "legendre", "chebyshev"] | None = Field(
        default=None, description="polynomials among which terms are chosen; Legendre's for evidence, else monomials"
    )
    heredity: Literal["none", "weak", "strong"] = Field(
        default="none", description="for forward selection: whether a product needs its parts in the model"
    )
    gradients: bool = Field(
        default=False, description="whether the oracle's Jacobian at each run teaches, too (evidence and forward)"
    )
    transform: Literal["none", "log", "auto"] = Field(
        default="none",
        description="log: logarithms of the responses are fitted, all of which must be positive; auto: where that "
        "predicts runs left out better",
    )
    runs_per_term: float = Field(
        default=1.5, ge=1.0, le=100.0, description="runs per candidate term, where n_runs is not given"
    )


class ValidationTable(Table):
    """Fresh random runs."""

    n_runs: int = Field(default=1000, ge=2, le=10_000_000, description="uniform random runs in the whole box")


class RequireTable(Table):
    """What must hold; the command ends with exit code 4 if it does not."""

    max_relative_error: Number | None = Field(
        default=None, gt=0.0, description="largest error on fresh runs over the response's range, every response"
    )
    max_runs: int | None = Field(
        default=None,
        ge=2,
        le=10_000_000,
        description="runs that the fit may grow to, terms first, until max_relative_error holds; not given: it does "
        "not grow",
    )
    certified_inverse: bool = Field(default=False, description="whether the inverse must be certified")


class CommandTable(Table):
    """What a controller will ask for, where it is not all responses: they may outnumber the factors."""

    responses: list[str] = Field(default=[], description="responses to command; all of them if empty")
    given: list[str] = Field(
        default=[], description="factors whose values are known whenever a target is, such as loads"
    )


class ExportTable(Table):
    """Code generated from the model."""

    targets: list[str] = Field(default=["c99"], description="export targets; flexdoce list names them")
    prefix: str | None = Field(default=None, description="prefix of generated names; the study's name if not given")
    verify: bool = Field(default=True, description="run what was generated against the model, with the tools at hand")


class Config(Table):
    """A study, as written by a person."""

    version: int = Field(default=1, ge=1, le=1, description="version of this format")
    name: str = Field(pattern=r"^[A-Za-z][A-Za-z0-9_]*$", description="short name: letters, digits, underscores")
    title: str = Field(default="", description="one line for the report")
    seed: int = Field(default=0, ge=0, le=2**63 - 1, description="seed of everything random")
    oracle: OracleTable
    factors: dict[str, FactorRange] = Field(default={}, description="ranges that replace the oracle's defaults")
    screening: ScreeningTable = ScreeningTable()
    fit: FitTable = FitTable()
    validation: ValidationTable = ValidationTable()
    require: RequireTable = RequireTable()
    command: CommandTable = CommandTable()
    export: ExportTable = ExportTable()


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
        parsed = tomllib.loads(f"value = {value}")["value"]
    except tomllib.TOMLDecodeError:
        parsed = value.strip()  # a word without quotes
    except (ValueError, RecursionError) as error:
        raise InputError(f"--set {key}: {error}") from None
    table: Any = document
    for part in parts[:-1]:
        table = table.setdefault(part, {})
        if not isinstance(table, dict):
            raise InputError(f"--set {override!r}: {part!r} is a value, not a table")
    table[parts[-1]] = parsed


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
    """Dotted keys in which two configs differ."""
    return sorted(_differ(ours.model_dump(), theirs.model_dump(), ""))


def _differ(a: Mapping[str, Any], b: Mapping[str, Any], prefix: str) -> set[str]:
    found: set[str] = set()
    for key in {*a, *b}:
        here, there = a.get(key), b.get(key)
        if isinstance(here, Mapping) and isinstance(there, Mapping):
            found |= _differ(here, there, f"{prefix}{key}.")
        elif here != there:
            found.add(f"{prefix}{key}")
    return found

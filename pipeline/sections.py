"""The tables of a config, each as a person writes it."""

from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, ConfigDict, Field, WithJsonSchema

from surrogates.candidates import HIGHEST

from .programs import ProgramTable
from .strict import Number, Setting, Table


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

    name: str = Field(description="name of the oracle, or path/to/file.py:name, relative to the config's folder")
    parameters: dict[str, Setting] = Field(default={}, description="oracle inputs held fixed; defaults where not given")
    max_failed_fraction: float = Field(
        default=0.0, ge=0.0, le=1.0, description="share of the runs of a stage that may fail, screening included"
    )
    command: ProgramTable | None = Field(default=None, description="the program, for name = 'command'")


def named(given: Any) -> Any:
    """``oracle = "name"`` for a table with that name alone."""
    return {"name": given} if isinstance(given, str) else given


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


class ExecutorTable(Table):
    """Where the points are answered. It changes no answer, so a run may be continued elsewhere."""

    name: Literal["in_process", "processes", "dask"] = Field(
        default="in_process",
        description="in_process: one after the other, or vectorised; processes: in workers on this machine; dask: on "
        "the workers of a Dask cluster",
    )
    workers: int | None = Field(default=None, ge=1, le=4096, description="worker processes; all cores if not given")
    address: str | None = Field(
        default=None,
        min_length=1,
        description="Dask scheduler, such as tcp://head:8786, or the path of its scheduler file, *.json; a cluster is "
        "started on this machine if not given",
    )
    batch: int | None = Field(
        default=None,
        ge=1,
        le=100_000,
        description="points per task; as many as the oracle answers together if not given",
    )


def flattened(table: Any) -> Any:
    """``[sweep]`` with whole dotted keys, however they were written: values are lists, so that a table is none."""
    if not isinstance(table, Mapping):
        return table
    found: dict[str, Any] = {}
    for key, value in table.items():
        below = flattened(value)
        found |= {f"{key}.{k}": v for k, v in below.items()} if isinstance(below, dict) else {str(key): value}
    return found


SweepTable = Annotated[
    dict[str, Annotated[list[Any], Field(min_length=1)]],
    BeforeValidator(flattened),
    WithJsonSchema({"type": "object", "additionalProperties": {"type": ["array", "object"]}}),
]

"""What answers a run: the oracle protocol and two ways to write one."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, field, is_dataclass
from functools import cached_property
from typing import Any, ClassVar, NamedTuple, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..designs.base import Design
from ..factors import FactorSpace
from ..runs import Response, Runs, Status

T = TypeVar("T")

CHUNK = 256
"""Points per compiled batch. Fixed, so that one shape is compiled and a point's answer never depends on its batch."""

LONGEST_REASON = 300
"""Characters of what somebody's own code raised."""

MOST_KEPT = 10_000
"""Characters of a reason: one that quotes a whole array would fill store and log."""


class Answers(NamedTuple):
    """Raw answers: values (n, n_responses), one status and one reason per point."""

    values: NDArray[np.float64]
    status: list[Status]
    reasons: list[str]


@dataclass(frozen=True, eq=False)
class PublishedMap:
    """A linear map that somebody published, to hold the fitted one against.

    Parameters
    ----------
    source : str
        Author, year, equation.
    responses, factors : tuple of str
        Names of rows and columns.
    values : ndarray, shape (n_responses, n_factors)
        Published entries, response unit per factor unit, SI.
    notes : mapping of (response, factor) to str
        Entries known to be misprinted, and why.
    remarks : tuple of str
        What else a reader must know of the source.
    """

    source: str
    responses: tuple[str, ...]
    factors: tuple[str, ...]
    values: NDArray[np.float64]
    notes: Mapping[tuple[str, str], str]
    remarks: tuple[str, ...] = ()

    def differences(self, ours: NDArray[np.float64]) -> NDArray[np.float64]:
        """How far a map is from the published one, entry by entry, shape (n_responses, n_factors).

        Relative to the published entry; where that is zero, to the largest of its row.
        """
        row = np.abs(self.values).max(axis=1, keepdims=True)
        return (ours - self.values) / np.where(self.values != 0.0, self.values, np.where(row > 0.0, row, 1.0))


@dataclass(frozen=True, eq=False)
class Line:
    """One polyline of a mechanism: `points` and their `displacement`, both (n, 3) in m."""

    name: str
    points: NDArray[np.float64]
    displacement: NDArray[np.float64]
    rigid: bool = False


@dataclass(frozen=True, eq=False)
class Arrow:
    """A load or drive: where it acts (3,) in m, how that point moves (3,) in m, and its unit direction (3,)."""

    label: str
    point: NDArray[np.float64]
    displacement: NDArray[np.float64]
    direction: NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Shape:
    """A mechanism at rest and displaced, for drawing; `anchors` are the clamped points, (n_anchors, 3) in m."""

    lines: tuple[Line, ...]
    arrows: tuple[Arrow, ...] = ()
    anchors: NDArray[np.float64] = field(default_factory=lambda: np.empty((0, 3)))


class OracleError(ValueError):
    """Somebody's own oracle raised what it should not have, or gave what it should not have given: one sentence."""


class Leave(SystemExit):
    """Raised where an oracle is at work in a process that was told to end; what an oracle itself exits with is not."""


class Oracle(ABC):
    """Answers a batch of points with a batch of responses and a status each.

    A subclass is usually a frozen dataclass whose fields are its parameters. The law: the same
    parameters and point give the same answer, whatever else is in the batch.

    Attributes
    ----------
    name, summary, source : str
        What it is called, what it answers, where the physics comes from.
    version : str
        Raised whenever the answers change.
    batch : int
        Points that are answered, and then stored, together.
    resolution : float
        Relative: differences below this fraction of a response's largest value are rounding.
    origin, code : str
        File or distribution that it was found in, and the first digits of the SHA-256 of that file; set by who finds
        it, empty for what is built in or registered.
    """

    name: ClassVar[str]
    summary: ClassVar[str] = ""
    source: ClassVar[str] = ""
    version: ClassVar[str] = "1"
    batch: ClassVar[int] = 1
    resolution: ClassVar[float] = 0.0
    origin: ClassVar[str] = ""
    code: ClassVar[str] = ""

    @property
    @abstractmethod
    def factors(self) -> FactorSpace:
        """Factors with their default ranges."""

    @property
    @abstractmethod
    def responses(self) -> tuple[Response, ...]:
        """Responses, n_responses of them."""

    @abstractmethod
    def evaluate(self, points: NDArray[np.float64]) -> Answers:
        """Answer points in physical units, shape (n, n_factors)."""

    def prepare(self) -> None:  # noqa: B027 - most oracles have nothing to prepare
        """Build once, before the first run and outside of tracing, what every point needs: a mesh, a factorisation.

        Raises
        ------
        ValueError
            If the parameters describe something that cannot be built.
        """

    @property
    def limits(self) -> str:
        """What the physics leaves out, for the report; it may depend on the parameters."""
        return ""

    @property
    def parameters(self) -> dict[str, Any]:
        """Inputs held fixed, as plain JSON-able values."""
        return asdict(self) if is_dataclass(self) and not isinstance(self, type) else {}

    @property
    def published(self) -> PublishedMap | None:
        """A published map of the same mechanism, if there is one for these parameters."""
        return None

    def shape(self, point: ArrayLike) -> Shape | None:
        """The mechanism displaced at `point`, shape (n_factors,), if it can be drawn."""
        return None

    def __call__(self, design: Design) -> Runs:
        """Run a design: one answer, status and reason per row.

        Raises
        ------
        ValueError
            If the design's factors are not this oracle's, in name, unit and order.
        OracleError
            If an oracle of somebody's own raises instead of answering, or its answers have another shape.
        """
        if design.space.labels != self.factors.labels:
            raise ValueError(
                f"oracle {self.name!r} has the factors {', '.join(self.factors.labels)}; "
                f"the design has {', '.join(design.space.labels)}"
            )
        values, status, reasons = self.answer(design.physical)
        return Runs(design, self.responses, values, tuple(status), tuple(reasons))

    def answer(self, points: NDArray[np.float64]) -> Answers:
        """Answer points in physical units, shape (n, n_factors); what is not finite has failed.

        Raises
        ------
        OracleError
            If an oracle of somebody's own raises instead of answering, or its answers have another shape.
        """
        return asked(self, "evaluate", lambda: self._complete(points))

    def _complete(self, points: NDArray[np.float64]) -> Answers:
        found, status, reasons = self.evaluate(points)
        values, expected = np.array(found, dtype=np.float64), (len(points), len(self.responses))
        if values.shape != expected:
            raise ValueError(f"values must have shape {expected} (points, responses); got {values.shape}")
        if not len(status) == len(reasons) == len(points):
            raise ValueError(f"need one status and one reason for each of {len(points)} points")
        for i in np.flatnonzero(~np.isfinite(values).all(axis=1)):
            if status[i] is Status.OK:
                bad = [r.name for r, v in zip(self.responses, values[i], strict=True) if not np.isfinite(v)]
                status[i], reasons[i] = Status.NON_FINITE, f"{', '.join(bad)} not finite"
        values[[s is not Status.OK for s in status]] = np.nan
        return Answers(values, status, [r if len(r) <= MOST_KEPT else r[: MOST_KEPT - 1] + "…" for r in reasons])

    def interrupt(self) -> None:  # noqa: B027 - what runs in this process ends with it
        """End what other threads run for this oracle outside of this process."""


def asked(oracle: Oracle, what: str, call: Callable[[], T]) -> T:
    """What `call` gives; whatever an oracle of somebody's own raises becomes an :class:`OracleError`.

    What a built-in one raises is a bug of ours and stays as it is.
    """
    try:
        return call()
    except Leave:
        raise
    except (Exception, SystemExit) as error:
        if not oracle.origin or isinstance(error, OracleError):
            raise
        raise OracleError(f"oracle {oracle.name!r} ({oracle.origin}): {what} raised {told(error)}") from error


def told(error: BaseException) -> str:
    """An exception in one line: its kind and the first line of what it says."""
    try:
        lines = str(error).splitlines()
    except Exception:  # somebody's own class of errors may be wrong, too
        lines = []
    said = next((line.strip() for line in lines if line.strip()), "")
    said = said if len(said) <= LONGEST_REASON else said[: LONGEST_REASON - 1] + "…"
    return f"{type(error).__name__}: {said}" if said else type(error).__name__


class PointOracle(Oracle):
    """An oracle in plain Python: one point in, one answer out. An exception fails its point, not the batch."""

    @abstractmethod
    def respond(self, point: NDArray[np.float64]) -> ArrayLike:
        """Responses (n_responses,) at `point`, shape (n_factors,)."""

    def evaluate(self, points: NDArray[np.float64]) -> Answers:
        """Answer point by point."""
        values = np.full((len(points), len(self.responses)), np.nan)
        status, reasons = [Status.OK] * len(points), [""] * len(points)
        for i, point in enumerate(points):
            try:
                answer = np.asarray(self.respond(point), dtype=np.float64)
                if answer.shape != values[i].shape:
                    raise ValueError(f"respond gave shape {answer.shape}, not {values[i].shape}")
                values[i] = answer
            except Leave:
                raise
            except (Exception, SystemExit) as error:  # sys.exit() in somebody's code must not end the study
                status[i], reasons[i] = Status.CRASHED, f"{type(error).__name__}: {error}"
        return Answers(values, status, reasons)


class JaxOracle(Oracle):
    """An oracle in JAX: write one traceable point, get batches and Jacobians in float64."""

    batch: ClassVar[int] = CHUNK

    @abstractmethod
    def respond(self, point: Any) -> Any:
        """Responses (n_responses,) at `point`, shape (n_factors,); traceable by JAX."""

    def evaluate(self, points: NDArray[np.float64]) -> Answers:
        """Answer in padded batches of :data:`CHUNK`."""
        self.prepare()
        values = _in_chunks(self._batched, points, (len(self.responses),))
        return Answers(values, [Status.OK] * len(points), [""] * len(points))

    def jacobian(self, points: ArrayLike) -> NDArray[np.float64]:
        """d response / d factor at `points` (n, n_factors), shape (n, n_responses, n_factors), SI."""
        self.prepare()
        shape = (len(self.responses), len(self.factors))
        return _in_chunks(self._batched_jacobian, np.asarray(points, dtype=np.float64), shape)

    @cached_property
    def _batched(self) -> Any:
        import jax

        return jax.jit(jax.vmap(self.respond))

    @cached_property
    def _batched_jacobian(self) -> Any:
        import jax

        return jax.jit(jax.vmap(jax.jacfwd(self.respond)))


def _in_chunks(function: Any, points: NDArray[np.float64], shape: tuple[int, ...]) -> NDArray[np.float64]:
    """`function` of all points, answers of `shape` each, in padded batches of one size."""
    import jax

    answers = [np.empty((0, *shape))]
    with jax.enable_x64(True):
        for start in range(0, len(points), CHUNK):
            chunk = points[start : start + CHUNK]
            padded = np.vstack([chunk, np.repeat(chunk[-1:], CHUNK - len(chunk), axis=0)])
            answers.append(np.asarray(function(padded))[: len(chunk)])
    return np.concatenate(answers)

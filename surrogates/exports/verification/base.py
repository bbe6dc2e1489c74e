"""What generated code is held to, whatever its language: the same points through it and through the model."""

import shutil
import subprocess
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...certificate import Verdict
from ...inversion import TARGET_TOLERANCE, obstacle
from ...links import logarithmic, to_link_units
from ..inverse_plan import inverse_plan

if TYPE_CHECKING:
    from ...model import Surrogate

DOUBLE, SINGLE = 1e-12, 1e-5
"""Largest difference allowed in double and in single precision, relative to what the polynomial adds up."""

N_POINTS = 200
TIME_LIMIT = 120.0
"""Seconds after which a tool is stopped."""


class Outcome(StrEnum):
    """What became of one check."""

    AGREES = "agrees"
    DIFFERS = "differs"
    NOT_CHECKED = "not checked"


@dataclass(frozen=True)
class Finding:
    """One check of one export.

    Parameters
    ----------
    what : str
        What was checked and with which tool.
    outcome : Outcome
    detail : str
        The number measured; or what differs, or which tool was missing.
    """

    what: str
    outcome: Outcome
    detail: str = ""


class Verifier(Protocol):
    """Runs one target's files, which lie in `folder` and are not touched, against the model they were made from."""

    def __call__(self, model: "Surrogate", prefix: str, folder: Path) -> list[Finding]:
        """The findings; a missing tool is one of them, never an error."""
        ...


@dataclass(frozen=True, eq=False)
class Reference:
    """Points and what the model says of them.

    Parameters
    ----------
    settings : ndarray, shape (n, n_factors)
        In the domain: its centre, some of its corners, random points.
    responses : ndarray, shape (n, n_responses)
        There, SI.
    jacobian : ndarray, shape (n, n_responses, n_factors)
        There, SI per factor unit.
    outside : ndarray, shape (k, n_factors)
        Settings outside the domain, near and far.
    targets : ndarray, shape (n, n_responses)
        Responses at settings inside the domain by 1 % of the half-ranges, so that rounding leaves them reachable.
    magnitude : ndarray, shape (n, n_responses)
        What the terms of each response add up to in size: what rounding errors are relative to. SI.
    slope_magnitude : ndarray, shape (n, n_responses, n_factors)
        The same of the derivatives.
    """

    settings: NDArray[np.float64]
    responses: NDArray[np.float64]
    jacobian: NDArray[np.float64]
    outside: NDArray[np.float64]
    targets: NDArray[np.float64]
    magnitude: NDArray[np.float64]
    slope_magnitude: NDArray[np.float64]


def reference(model: "Surrogate", n_points: int = N_POINTS, seed: int = 0) -> Reference:
    """`n_points` random points, the centre and up to 16 corners, with the model's answers; the same for a seed."""
    rng, k = np.random.default_rng(seed), len(model.factors)
    corners = rng.choice([-1.0, 1.0], (min(16, 2**k), k))
    coded = np.vstack([np.zeros((1, k)), corners, rng.uniform(-1.0, 1.0, (n_points, k))])
    beyond = rng.uniform(-1.0, 1.0, (20, k))
    beyond[np.arange(20), rng.integers(k, size=20)] = rng.choice([-1.0, 1.0], 20) * rng.uniform(1.001, 3.0, 20)
    settings = model.factors.decode(coded)
    responses = model.predict(settings)
    size = np.abs(model.coefficients).sum(axis=0)
    magnitude = np.broadcast_to(np.where(size > 0.0, size, 1.0), responses.shape).copy()
    logs = logarithmic(model.links)
    magnitude[:, logs] = np.abs(responses[:, logs]) * (1.0 + magnitude[:, logs])
    return Reference(
        settings,
        responses,
        model.jacobian(settings),
        model.factors.decode(beyond),
        model.predict(model.factors.decode(0.99 * coded)),
        magnitude,
        max(1, int(model.terms.degrees.max(initial=1))) * magnitude[:, :, None] / model.factors.half_range,
    )


def agreement(what: str, got: ArrayLike, expected: ArrayLike, size: ArrayLike, tolerance: float) -> Finding:
    """Whether |got − expected| ≤ `tolerance` × `size` everywhere; NaN differs."""
    got, expected = np.asarray(got, dtype=np.float64), np.asarray(expected, dtype=np.float64)
    if got.shape != expected.shape:
        return Finding(what, Outcome.DIFFERS, f"shape {got.shape} came back, not {expected.shape}")
    if not got.size:
        return Finding(what, Outcome.NOT_CHECKED, "there was nothing to compare")
    relative = np.abs(got - expected) / np.asarray(size, dtype=np.float64)
    worst = float(np.where(np.isnan(relative), np.inf, relative).max())
    outcome = Outcome.AGREES if worst <= tolerance else Outcome.DIFFERS
    return Finding(what, outcome, f"{worst:.2g} relative, allowed {tolerance:g}")


def statement(what: str, holds: bool, detail: str = "") -> Finding:
    """A check that is true or not."""
    return Finding(what, Outcome.AGREES if holds else Outcome.DIFFERS, detail)


def not_checked(what: str, why: str) -> Finding:
    """A check that could not be made."""
    return Finding(what, Outcome.NOT_CHECKED, why)


def round_trip(
    model: "Surrogate", what: str, targets: ArrayLike, found: ArrayLike, ok: ArrayLike, tolerance: float
) -> Finding:
    """Whether the settings `found` for `targets` give them, and lie in the domain, wherever the export says `ok`.

    `tolerance` is in units of the polynomials' scale, at least the :data:`.TARGET_TOLERANCE` that exports promise.
    That some are `ok` is asked for too; all of them where :func:`reaches_all`.

    Parameters
    ----------
    targets : array_like, shape (n, n_responses)
        Responses at settings in the domain.
    found : array_like, shape (n, n_factors)
    ok : array_like of bool, shape (n,)
    """
    targets, found, ok = np.asarray(targets), np.asarray(found), np.asarray(ok, dtype=bool)
    all_reached = reaches_all(model)
    if not ok.any() or (all_reached and not ok.all()):
        return Finding(what, Outcome.DIFFERS, f"{int((~ok).sum())} of {len(ok)} reachable targets were refused")
    if not model.contains(found[ok]).all():
        return Finding(what, Outcome.DIFFERS, "settings outside the domain were called good")
    reached, wanted = (to_link_units(model.links, v) for v in (model.predict(found[ok]), targets[ok]))
    refused = f"; {int((~ok).sum())} of {len(ok)} refused" if not ok.all() else ""
    answer = agreement(what, reached, wanted, model.scale, max(tolerance, TARGET_TOLERANCE))
    return Finding(what, answer.outcome, answer.detail + refused)


def invertible(model: "Surrogate") -> bool:
    """Whether exports of the model have an inverse."""
    return not obstacle(model)


def reaches_all(model: "Surrogate") -> bool:
    """Whether an export's inverse must find every target that the domain can give: its steps are counted by proof."""
    known = model.certificate
    if known is None or known.verdict is not Verdict.CERTIFIED:
        return False
    return inverse_plan(model, 1).certified


def tool(*names: str) -> str | None:
    """Path of the first program of these names that is there."""
    return next((found for name in names if (found := shutil.which(name))), None)


def run_tool(arguments: Sequence[str | Path], folder: Path, given: str | None = None) -> tuple[bool, str]:
    """Whether the program ended well, and what it printed; one that hangs is stopped and did not."""
    try:
        done = subprocess.run(
            [str(a) for a in arguments],
            cwd=folder,
            input=given,
            stdin=subprocess.DEVNULL if given is None else None,
            capture_output=True,
            text=True,
            errors="replace",
            timeout=TIME_LIMIT,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return False, f"it took more than {TIME_LIMIT:g} s and was stopped"
    except OSError as error:
        return False, f"it could not be started: {error.strerror}"
    return done.returncode == 0, done.stdout if done.returncode == 0 else (done.stderr or done.stdout)

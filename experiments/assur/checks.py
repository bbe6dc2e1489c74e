"""The refusals of bad input: one sentence each, naming the culprit and what to do."""

import math
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ..naming import suggestion

if TYPE_CHECKING:
    from .groups import Mechanism, Module
    from .model import Load

STRAIGHT = 1e-6  # sine of the angle between the arms of a dyad below which its assembly mode is unknown


def finite_point(what: str, value: Any) -> tuple[float, float]:
    """`value` as two floats; ``ValueError`` naming `what` if it is not two finite numbers."""
    try:
        x, y = (float(component) for component in value)
    except (TypeError, ValueError):
        raise ValueError(f"{what} must be two numbers, got {value!r}") from None
    if not (math.isfinite(x) and math.isfinite(y)):
        raise ValueError(f"{what} must be finite, got {(x, y)}")
    return x, y


def check_mechanism(mechanism: "Mechanism") -> None:
    """Raise ``ValueError`` unless the modules can be built one after the other from the flexures."""
    if not mechanism.modules:
        raise ValueError("a mechanism needs at least one module: begin with a driving link")
    _refuse_repeated([f.name for f in mechanism.flexures], "two flexures are called {!r}: give each its own name")
    _refuse_repeated(mechanism.links, "link {!r} belongs to two modules, or is the ground: name each link once")
    for flexure in mechanism.flexures:
        for link in flexure.links:
            if link not in mechanism.links:
                hint = suggestion(link, mechanism.links)
                raise ValueError(f"flexure {flexure.name!r} is on link {link!r}, which no module has{hint}")
    earlier = [mechanism.links[0]]
    for module in mechanism.modules:
        _check_module(mechanism, module, earlier)
        if len(module.links) > 1:
            _check_shape(mechanism, module, earlier)
        earlier += module.links


def _refuse_repeated(names: Sequence[str], sentence: str) -> None:
    for name in names:
        if names.count(name) > 1:
            raise ValueError(sentence.format(name))


def _check_module(mechanism: "Mechanism", module: "Module", earlier: Iterable[str]) -> None:
    """Each free link hangs on one flexure, and the links inside are joined as the module says."""
    kind, links = type(module).__name__, module.links
    hub = links[: len(links) > 1]  # the platform of a triad, the first link of a dyad
    arms = links[len(hub) :]
    inner = mechanism.flexures_between(arms, hub)
    free = arms if len(links) == 4 else links  # the platform of a triad hangs on its legs alone
    for link in free:
        found = [f.name for f in mechanism.flexures_between([link], earlier)]
        if len(found) != 1:
            raise ValueError(
                f"link {link!r} of the {kind} must hang on the ground or an earlier link by one flexure, "
                f"got {found}: mend the flexures or the order of the modules"
            )
    for arm in arms if hub else ():
        found = [f.name for f in mechanism.flexures_between([arm], hub)]
        if len(found) != 1:
            raise ValueError(f"the {kind} of {links[0]!r} needs one flexure from it to {arm!r}, got {found}")
    touching = mechanism.flexures_between(links, [*earlier, *links])
    wanted = {f.name for f in (*inner, *mechanism.flexures_between(free, earlier))}
    for flexure in touching:
        if flexure.name not in wanted:
            raise ValueError(
                f"flexure {flexure.name!r} between {flexure.links[0]!r} and {flexure.links[1]!r} is one too many "
                f"for the {kind} {links}: it takes {3 * len(links) // 2 if hub else 1}"
            )


def _check_shape(mechanism: "Mechanism", module: "Module", earlier: Iterable[str]) -> None:
    """Refuse a group at a dead point: its arms as lines, in line for a dyad, through one point for a triad.

    There neither the sense of assembly nor the joint forces of the rigid equivalent are determined.
    """
    links = module.links
    arms, hub = (links, ()) if len(links) == 2 else (links[1:], links[:1])
    outer = [complex(*f.edges[1]) for f in mechanism.flexures_between(arms, earlier)]
    inner = [complex(*f.edges[1]) for f in mechanism.flexures_between(arms, hub or links)]
    along, centre = np.subtract(inner, outer), np.mean(inner)
    if not np.abs(along).all():
        raise ValueError(f"an arm of the {type(module).__name__} {links} has no length between its equivalent joints")
    along /= np.abs(along)
    rows = [np.real(along), np.imag(along)]
    if hub:
        lever = np.subtract(inner, centre)
        rows.append(np.imag(np.conj(lever) * along) / np.abs(lever).max())
    if abs(np.linalg.det(rows)) < STRAIGHT:
        how = "lie on lines through one point or parallel" if hub else "are in line"
        raise ValueError(f"the arms of the {type(module).__name__} {links} {how} at rest: change its geometry")


def check_angles(angles: Any, drivers: Sequence[str]) -> np.ndarray:
    """Angles of the driving links as a float array of shape (n_points, n_drivers)."""
    wanted = f"shape (n_points, {len(drivers)}), one column each for {', '.join(drivers)}"
    try:
        angles = np.array(angles, float)
    except (TypeError, ValueError):
        raise ValueError(f"angles must be numbers of {wanted}") from None
    if angles.ndim != 2 or angles.shape[1] != len(drivers):
        raise ValueError(f"angles must have {wanted}, got shape {angles.shape}")
    if not np.isfinite(angles).all():
        raise ValueError(f"angles must be finite, row {int(np.argwhere(~np.isfinite(angles))[0, 0])} is not")
    return angles


def check_loads(loads: Sequence["Load"], links: Sequence[str], n_points: int) -> None:
    """Raise ``ValueError`` unless each load acts on a moving link and fits the number of points."""
    for load in loads:
        if load.link not in links[1:]:
            raise ValueError(f"a load acts on {load.link!r}, which is no moving link{suggestion(load.link, links[1:])}")
        for name, value, ndim in (("force", load.force, 2), ("moment", load.moment, 1)):
            if np.ndim(value) == ndim and len(np.atleast_1d(value)) != n_points:
                raise ValueError(
                    f"{name} on link {load.link!r} holds {len(np.atleast_1d(value))} points, the angles {n_points}: "
                    "give one value for all or one for each"
                )

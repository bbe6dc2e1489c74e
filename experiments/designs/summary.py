"""What a design can and cannot tell, in plain words."""

from typing import TYPE_CHECKING

import numpy as np

from ..terms import Terms, model_matrix

if TYPE_CHECKING:
    from .properties import Properties

MOST_TERMS = 600
"""Larger models are not tried: their rank would take seconds."""


def summary(found: "Properties") -> str:
    """Some twenty lines of text: the runs, the numbers, and what they allow to conclude."""
    return "\n".join([*_runs(found), *_numbers(found), *_can(found)])


def _runs(found: "Properties") -> list[str]:
    design = found.design
    centre = int(found.centre_runs.sum())
    lines = [
        f"{count(len(design), 'run')} of {count(len(design.space), 'factor')} ({design.method}), "
        f"{found.distinct_runs} different, {centre} at the centre; {count(design.dummies.shape[1], 'dummy column')}"
    ]
    if found.distinct_runs < len(design):
        lines.append(
            f"  {count(len(design) - found.distinct_runs, 'run')} repeated: measures noise, and nothing with a "
            "deterministic simulator"
        )
    levels = sorted(set(found.levels))
    spoken = f"{levels[0]}" if len(levels) == 1 else f"{levels[0]} to {levels[-1]}"
    uneven = [name for name, even in zip(design.space.names, found.balanced, strict=True) if not even]
    lines.append(
        f"  levels a factor: {spoken}; "
        + ("each equally often (balanced)" if not uneven else f"not equally often for {_listed(uneven)}")
    )
    return lines


def _numbers(found: "Properties") -> list[str]:
    k = len(found.design.space)
    off = np.abs(found.correlation - np.eye(k)).max()
    inflation = max(found.vif.values(), default=1.0)
    spread = ", ".join(f"{name} {value:.4g}" for name, value in found.discrepancies.items())
    strong = f"; any {found.strength} of them meet all combinations equally often" if found.strength > 1 else ""
    together = "orthogonal" if found.orthogonal else f"not orthogonal, largest correlation {off:.2f}"
    constant = [name for name, q in zip(found.design.space.names, found.levels, strict=True) if q < 2]
    distance = f"; nearest two runs {found.minimum_distance:.3g} apart (coded)" if len(found.design) > 1 else ""
    lines = [
        f"  factors are {together}{strong}" if k > 1 else "  one factor",
        *([f"  does not vary: {_listed(constant)}"] if constant else []),
        f"  model of {count(len(found.terms), 'term')}: "
        + (
            f"efficiency D {found.d_efficiency:.1%}, A {found.a_efficiency:.1%}, G {found.g_efficiency:.1%}, "
            f"I {found.i_efficiency:.1%}; largest variance inflation {inflation:.2f}"
            if found.estimable
            else "cannot be estimated, so it has no efficiency"
        ),
        f"  squared discrepancy: {spread}{distance}",
    ]
    if k > 2:
        share = found.projections(2)
        worst = min(share, key=lambda names: share[names])
        lines.append(
            f"  seen in two factors only, at least {share[worst]:.0%} of the runs stay different ({_listed(worst)})"
        )
    return lines


def _can(found: "Properties") -> list[str]:
    """One line on main effects, interactions, curvature and noise each."""
    return [_main_effects(found), _interactions(found), _curvature(found), _noise(found)]


def _main_effects(found: "Properties") -> str:
    names = found.design.space.names
    if not _estimable(found, Terms.polynomial(names, 1)):
        return "CANNOT tell the main effects apart: use more runs"
    if len(names) == 1:
        return "can tell the main effect"
    main = Terms.polynomial(names, 1)
    second = Terms.polynomial(names, 2)
    pairs = second.select(i for i, row in enumerate(second.exponents) if sum(row) == 2 and max(row) == 1)
    x, z = (model_matrix(terms, found.design.coded) for terms in (main, pairs))
    mixed = np.abs(np.linalg.lstsq(x, z, rcond=None)[0][1:])
    if mixed.max() < 1e-9:
        return "can tell main effects, clear of two-factor interactions"
    if _estimable(found, _without_squares(names)):
        return "can tell main effects, apart from two-factor interactions if both are fitted"
    factor, pair = np.unravel_index(int(np.argmax(np.round(mixed, 9))), mixed.shape)
    return (
        f"can tell main effects only where two-factor interactions are small: {names[factor]} carries "
        f"{mixed[factor, pair]:.2g} of {pairs.labels[pair]}"
        + ("; a foldover clears them" if max(found.levels) < 3 else "")
    )


def _interactions(found: "Properties") -> str:
    names = found.design.space.names
    if len(names) == 1:
        return "there are no interactions of one factor"
    terms = _without_squares(names)
    number = len(terms) - len(names) - 1
    spoken = "the two-factor interaction" if number == 1 else f"all {number} two-factor interactions"
    if _estimable(found, terms):
        return f"can tell {spoken}"
    return f"CANNOT tell {spoken} apart (with the main effects {len(terms)} terms, {count(len(found.design), 'run')})"


def _curvature(found: "Properties") -> str:
    names = found.design.space.names
    if min(found.levels) < 3:
        flat = [name for name, q in zip(names, found.levels, strict=True) if q < 3]
        return f"CANNOT see curvature in {_listed(flat)}: fewer than three levels; add a centre run to detect it"
    squares = Terms.polynomial(names, 2, interactions=False)
    if not _estimable(found, squares):
        main = model_matrix(Terms.polynomial(names, 1), found.design.coded)
        if np.linalg.matrix_rank(model_matrix(squares, found.design.coded)) == np.linalg.matrix_rank(main):
            return "CANNOT see curvature: squares are aliased with the main effects"
        return "can see that there is curvature, CANNOT tell of which factor: the squares are aliased"
    full = _estimable(found, Terms.polynomial(names, 2))
    return "can tell the curvature of each factor" + (
        ", and fit the full quadratic model" if full else "; CANNOT fit the full quadratic model"
    )


def _noise(found: "Properties") -> str:
    left = len(found.design) - np.linalg.matrix_rank(found.matrix)
    pure = len(found.design) - found.distinct_runs
    if not left:
        return "CANNOT judge the model's error: no run is left over"
    noise = f", noise by {count(pure, 'repeated run')}" if pure else ""
    return f"can judge the model's error by {count(int(left), 'run')} left over{noise}"


def _without_squares(names: tuple[str, ...]) -> Terms:
    second = Terms.polynomial(names, 2)
    return second.select(i for i, row in enumerate(second.exponents) if max(row) <= 1)


def _estimable(found: "Properties", terms: Terms) -> bool:
    if len(terms) > min(len(found.design), MOST_TERMS):
        return False
    return int(np.linalg.matrix_rank(model_matrix(terms, found.design.coded), rtol=1e-9)) == len(terms)


def count(number: int, noun: str) -> str:
    """A number with its noun: ``"1 run"``, ``"12 runs"``."""
    return f"{number} {noun}{'' if number == 1 else 's'}"


def _listed(names: "list[str] | tuple[str, ...]", most: int = 4) -> str:
    return ", ".join(names[:most]) + (f" and {len(names) - most} more" if len(names) > most else "")

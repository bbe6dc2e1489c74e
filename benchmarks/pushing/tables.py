"""What came out, as Markdown."""

from collections.abc import Iterator, Sequence

from surrogates.certificate import Certificate, Verdict

from .campaigns import N_FRESH, Pushing, Way
from .cases import STRESS_LIMITS, Case
from .limits import Limit, furthest, order

DEGREES = (2, 3, 4, 5)
MOST_ERROR = 0.01
"""Of a response's range over the fresh runs."""


def table(case: Case, degrees: Sequence[int]) -> str:
    """Errors and certificates by range, where each limit is met, and the boxes that may be commanded."""
    pushing = Pushing(case)
    limits = {degree: _limits(pushing, degree) for degree in degrees}
    parts = (_by_range(pushing, degrees), _by_degree(pushing, limits), _boxes(pushing, limits))
    return f"### {case.title} [{case.unit}]\n\n" + "\n".join("".join(part) for part in parts)


def _by_range(pushing: Pushing, degrees: Sequence[int]) -> Iterator[str]:
    case, ways = pushing.case, ", ".join(Way(0, *way).label for way in pushing.ways)
    yield (
        f"Largest error in % of its response's range over {N_FRESH} fresh runs, worst response. Models from {ways}, in "
        "this order; the certificate is the last one's: its rate of contraction, else how it was proven, else the "
        f"verdict and the share of the range that is certified. Stresses in MPa at the {len(pushing.corners)} corners "
        "and over all runs.\n\n"
    )
    errors = [f"degree {d}: errors | certificate" for d in degrees]
    yield f"| {case.title} | corners | runs | failed | {' | '.join(errors)} |\n{'|---' * (4 + 2 * len(degrees))}|\n"
    for reach in case.ranges:
        campaign = pushing.campaign(reach)
        cells = [f"{reach:g}", f"{pushing.corner_stress(reach) / 1e6:.0f}", f"{campaign.stress / 1e6:.0f}"]
        cells.append(str(campaign.n_failed))
        for degree in degrees:
            cells.append(" / ".join(f"{100 * pushing.error(reach, Way(degree, *way)):.2g}" for way in pushing.ways))
            cells.append(told(pushing.certificate(reach, pushing.best(degree))))
        yield _row(cells)


def told(certificate: Certificate) -> str:
    """A certificate in a few words."""
    if certificate.verdict is Verdict.CERTIFIED:
        rate = certificate.contraction
        return certificate.method.rsplit(", ", 1)[-1] if rate is None else f"{rate:.2f}"
    return f"{certificate.verdict}, {certificate.sub_box or 0.0:.2f}"


def _limits(pushing: Pushing, degree: int) -> dict[str, Limit]:
    """Where each limit is met, by its name."""
    case = pushing.case
    cheap, dear = case.precision
    found = {
        name: furthest(lambda reach, most=most: pushing.corner_stress(reach) <= most, case.ranges, cheap)
        for name, most in STRESS_LIMITS.items()
    }
    for way in (Way(degree, *way) for way in pushing.ways):
        found[_error(way)] = furthest(lambda reach, way=way: pushing.error(reach, way) <= MOST_ERROR, case.ranges, dear)
    found["certificate"] = furthest(lambda reach: _certified(pushing, reach, degree), case.ranges, dear)
    return found


def _error(way: Way) -> str:
    return f"{100 * MOST_ERROR:g} %, {way.label}"


def _certified(pushing: Pushing, reach: float, degree: int) -> bool:
    return pushing.certificate(reach, pushing.best(degree)).verdict is Verdict.CERTIFIED


def _by_degree(pushing: Pushing, limits: dict[int, dict[str, Limit]]) -> Iterator[str]:
    case, names = pushing.case, list(next(iter(limits.values())))
    yield (
        f"Up to which range each limit is kept, bisected to {case.precision[0]:g} {case.unit} for stresses at the "
        f"corners and to {case.precision[1]:g} {case.unit} for the error of {100 * MOST_ERROR:g} % and the "
        "certificate; and, for the model with most knowledge, in which order they are met.\n\n"
    )
    yield f"| degree | {' | '.join(names)} | order |\n{'|---' * (len(names) + 2)}|\n"
    others = {_error(Way(0, *way)) for way in pushing.ways[:-1]}
    for degree, found in limits.items():
        met = order({name: limit for name, limit in found.items() if name not in others})
        yield _row([str(degree), *map(str, found.values()), "; ".join(met)])


def _boxes(pushing: Pushing, limits: dict[int, dict[str, Limit]]) -> Iterator[str]:
    """At the ranges of each limit, for the lowest degree that keeps the error there."""
    case = pushing.case
    stresses = {name: limit.holds for name, limit in next(iter(limits.values())).items() if name in STRESS_LIMITS}
    useful = max(min(found[_error(pushing.best(d))].holds, found["certificate"].holds) for d, found in limits.items())
    reaches = {**stresses, "published": case.ranges[0], "error and certificate": useful}
    yield (
        "The largest certified boxes: every target in the last columns has exactly one setting in the range "
        f"({Way(0, *pushing.ways[-1]).label}, the lowest degree that keeps {100 * MOST_ERROR:g} %).\n\n"
    )
    units = " | ".join(f"{r.symbol} [{r.shown_unit}]" for r in pushing.responses)
    yield f"| range | {case.title} | degree | error [%] | certified share | {units} |\n"
    yield f"{'|---' * (5 + len(pushing.responses))}|\n"
    for name, reach in sorted(reaches.items(), key=lambda item: item[1]):
        kept = [d for d in limits if pushing.error(reach, pushing.best(d)) <= MOST_ERROR]
        if kept:
            yield _row([name, f"{reach:.3g}", *_box(pushing, reach, kept[0])])


def _box(pushing: Pushing, reach: float, degree: int) -> list[str]:
    way = pushing.best(degree)
    certificate = pushing.certificate(reach, way)
    whole = certificate.verdict is Verdict.CERTIFIED
    cells = [str(degree), f"{100 * pushing.error(reach, way):.2g}", f"{1.0 if whole else certificate.sub_box or 0.0:g}"]
    if certificate.response_box is None:
        return [*cells, *("none" for _ in pushing.responses)]
    for response, box in zip(pushing.responses, certificate.response_box, strict=True):
        cells.append(" … ".join(_number(response.shown_scale * end) for end in box))
    return cells


def _number(value: float) -> str:
    """Four digits, or all before the point."""
    return f"{value:.0f}" if abs(value) >= 1e3 else f"{value:.4g}"


def _row(cells: Sequence[str]) -> str:
    return f"| {' | '.join(cells)} |\n"

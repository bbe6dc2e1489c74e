"""The page of a sweep: one table, and what the model is worth against each swept key."""

from collections.abc import Sequence
from decimal import ROUND_CEILING, ROUND_FLOOR
from typing import Any
from urllib.parse import quote

from experiments.runs import Response
from surrogates import Verdict

from ..config import dump_config
from ..grid import shown
from ..sweep_rows import Found, Row, quotient_unit
from ..sweeping import Sweep
from .build import rendered
from .commanded import DIGITS, inwards
from .sweep_figures import axis_figure, dominant
from .views import number, percent

NONE = "–"


def sweep_html(found: Sweep) -> str:
    """The page as one HTML text that needs no other file; each member's row leads to its report."""
    keys = [key for axis in found.grid for key in axis.keys]
    first = next((row.found for row in found.rows if row.found), None)
    responses = first.responses if first else ()
    content = {
        "title": f"{found.config.title or found.config.name}: {len(found.rows)} members",
        "name": found.config.name,
        "oracle": found.config.oracle.name,
        "heads": [{"key": key.rpartition(".")[2] if n else key, "unit": found.units.get(key, "")}
                  for key, n in ((key, _is_alone(key, keys)) for key in keys)],
        "keys": keys,
        "cards": _cards(found.rows),
        "trouble": [row for row in found.rows if row.code],
        "rows": [_row(row) for row in found.rows],
        "figures": [axis_figure(found, i) for i in range(len(found.grid))] if first else [],
        "axes": [", ".join(axis.keys) for axis in found.grid],
        "n_failed": sum(row.found is None for row in found.rows),
        "responses": responses,
        "errors": [_errors(row, responses) for row in found.rows],
        "has_boxes": any(row.found and row.found.box for row in found.rows),
        "boxes": [_boxes(row, responses) for row in found.rows],
        "slopes": _slopes(found.rows, first),
        "stiffness": _stiffness(found.rows, first),
        "config": dump_config(found.config),
    }  # fmt: skip
    return rendered("sweep.html", content)


def _is_alone(key: str, keys: Sequence[str]) -> bool:
    last = key.rpartition(".")[2]
    return last not in ("low", "high") and sum(k.rpartition(".")[2] == last for k in keys) == 1


def _cards(rows: Sequence[Row]) -> list[dict[str, str]]:
    models = [row.found for row in rows if row.found]
    errors = sorted(found.worst for found in models)
    certified = sum(found.verdict == Verdict.CERTIFIED for found in models)
    paid, used = sum(row.new for row in rows), sum(row.runs for row in rows)
    good = sum(row.code == 0 for row in rows)
    share = f"{used - paid} of the {used} that the members rest on are shared" if used > paid else "none are shared"
    return [
        {"label": "members", "value": str(len(rows)), "note": f"{good} without a complaint"},
        {"label": "runs paid for", "value": str(paid), "note": share},
        {
            "label": "largest error",
            "value": f"{percent(errors[0])} to {percent(errors[-1])}" if errors else NONE,
            "note": "of the range on fresh runs, the best and the worst member",
        },
        {"label": "inverse", "value": f"{certified} certified", "note": f"on all of their ranges, of {len(models)}"},
    ]


def _row(row: Row) -> dict[str, Any]:
    found = row.found
    told = {
        "name": row.member.name,
        "href": f"{quote(row.member.name)}/report.html" if found else "",
        "settings": [shown(value) for _, value in row.member.settings],
        "runs": f"{row.new} of {row.runs}" if row.new < row.runs else str(row.runs),
        "outcome": row.outcome,
        "good": row.code == 0,
        "reason": row.reason,
    }
    if found is None:
        return told | dict.fromkeys(("kept", "worst", "verdict", "side"), NONE)
    worst = max(found.errors, key=lambda e: e.max_relative)
    symbol = next(r.symbol for r in found.responses if r.name == worst.response)
    kept = f"{len(found.kept)} of {len(found.factors)}"
    side = percent(found.side) if found.certificate else NONE
    return told | {"kept": kept, "worst": f"{percent(worst.max_relative)} ({symbol})", "verdict": found.verdict,
                   "side": side}  # fmt: skip


def _errors(row: Row, responses: Sequence[Response]) -> list[str]:
    """Largest and root mean square error of each response, over its range."""
    by_name = {e.response: e for e in row.found.errors} if row.found else {}
    cells = []
    for response in responses:
        error = by_name.get(response.name)
        rmse = None if error is None else error.relative_rmse
        cells += [NONE if error is None else percent(error.max_relative), NONE if rmse is None else percent(rmse)]
    return cells


def _boxes(row: Row, responses: Sequence[Response]) -> list[dict[str, str]]:
    """Ends of the certified box of targets in shown units, rounded inwards, and its share of the range."""
    box, shares = (row.found.box, row.found.shares) if row.found else ({}, {})
    cells = []
    for r in responses:
        low, high = box.get(r.name, (None, None))
        if low is None or high is None:
            cells.append({"ends": NONE, "share": ""})
            continue
        ends = (number(inwards(low * r.shown_scale, ROUND_CEILING), DIGITS),
                number(inwards(high * r.shown_scale, ROUND_FLOOR), DIGITS))  # fmt: skip
        cells.append({"ends": " … ".join(ends), "share": percent(shares[r.name]) if r.name in shares else ""})
    return cells


def _slopes(rows: Sequence[Row], first: Found | None) -> dict[str, Any] | None:
    """At the centre, each response by the factor that moves it most in the first member that has a model."""
    if first is None:
        return None
    chosen = dominant(first)
    heads = [
        {"top": r.symbol, "by": f.name, "unit": quotient_unit(r.shown_unit, f.unit)}
        for r, f in zip(first.responses, (first.factors.factors[j] for j in chosen), strict=True)
    ]
    names = [(r, first.factors.names[j]) for r, j in zip(first.responses, chosen, strict=True)]
    return {"heads": heads, "rows": [[_slope(row.found, r, name) for r, name in names] for row in rows]}


def _slope(found: Found | None, response: Response, factor: str) -> str:
    value = found.slope(response.name, factor) if found else None
    return NONE if value is None else number(value * response.shown_scale, 5)


def _stiffness(rows: Sequence[Row], first: Found | None) -> dict[str, Any] | None:
    """Diagonal of the inverse of the slopes, where the map is square."""
    if first is None or first.stiffness is None:
        return None
    pairs = list(zip(first.factors, first.responses, strict=True))
    heads = [{"top": f.name, "by": r.symbol, "unit": quotient_unit(f.unit, r.shown_unit)} for f, r in pairs]
    cells = []
    for row in rows:
        values = row.found.stiffness if row.found and row.found.responses == first.responses else None
        cells.append([NONE] * len(pairs) if values is None else
                     [number(v / r.shown_scale, 5) for v, (_, r) in zip(values, pairs, strict=True)])  # fmt: skip
    return {"heads": heads, "rows": cells}

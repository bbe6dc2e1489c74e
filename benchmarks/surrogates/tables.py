"""Markdown of the outcomes."""

from collections.abc import Sequence
from statistics import median

from .functions import Function
from .methods import Method
from .running import Outcome, Task

Outcomes = dict[Task, Outcome]

NOTE = (
    "RMSE on {n_test} fresh random points over the standard deviation of the truth: the median of {seeds} designs and, "
    "in parentheses, the worst. All methods get the same Latin hypercubes (seeds 0 to {last}). s: CPU seconds on one "
    "core of a fit, the least and the most of the functions' medians, shared machine. Bold: the best median of those "
    "that learn from values alone, and of those taught gradients (∇), run on all designs without failure. –: all fits "
    "failed, for the reasons below the table."
)


def sizes_table(
    outcomes: Outcomes, methods: Sequence[Method], functions: Sequence[Function], n: int, seeds: int
) -> str:
    """One table: a row a method, a column a function; below it, why fits failed."""
    head = ["", *(f"{f.title} ({f.n_inputs})" for f in functions), "s"]
    best = {
        (f.name, taught): _best(outcomes, methods, f, n, taught, seeds) for f in functions for taught in (False, True)
    }
    lines = [f"#### {n} runs\n", _row(head), _row(["---"] * len(head))]
    for method in methods:
        cells = [_cell(_of(outcomes, f, n, method), best[f.name, method.taught], seeds) for f in functions]
        seconds = [s for f in functions if (s := _seconds(_of(outcomes, f, n, method))) is not None]
        spent = f"{min(seconds):.2g} – {max(seconds):.2g}" if seconds else "–"
        lines.append(_row([method.label + " ∇" * method.taught, *cells, spent]))
    failures = _failures(outcomes, methods, functions, n)
    return "\n".join([*lines, "", *failures]) + "\n"


def sources(functions: Sequence[Function], methods: Sequence[Method]) -> str:
    """Where the functions are from, and how the methods were used."""
    of = [f"- {f.title}, {f.n_inputs} inputs: {f.source}." for f in functions]
    how = [f"- {m.label}: {m.stamp}." for m in methods]
    return "Functions:\n\n" + "\n".join(of) + "\n\nMethods:\n\n" + "\n".join(how) + "\n"


def _of(outcomes: Outcomes, function: Function, n: int, method: Method) -> list[Outcome]:
    return [
        one
        for task, one in outcomes.items()
        if (task.function, task.n, task.method) == (function.name, n, method.label)
    ]


def _errors(found: Sequence[Outcome]) -> list[float]:
    return [one["error"] for one in found if one["error"] is not None]


def _seconds(found: Sequence[Outcome]) -> float | None:
    seconds = [one["seconds"] for one in found if one["seconds"] is not None]
    return median(seconds) if seconds else None


def _best(
    outcomes: Outcomes, methods: Sequence[Method], function: Function, n: int, taught: bool, seeds: int
) -> float | None:
    """The least median of the methods that were run on all designs and never failed."""
    medians = [
        median(errors)
        for m in methods
        if m.taught == taught and len(errors := _errors(_of(outcomes, function, n, m))) == seeds
    ]
    return min(medians) if medians else None


def _cell(found: Sequence[Outcome], best: float | None, seeds: int) -> str:
    errors = _errors(found)
    if not errors:
        return "–" if found else "not run"
    text = _number(median(errors))
    if best is not None and len(errors) == seeds and text == _number(best):
        text = f"**{text}**"
    failed = len(found) - len(errors)
    few = f", {len(found)} of {seeds} designs" if len(found) < seeds else ""
    return f"{text} ({_number(max(errors))})" + few + (f", {failed} failed" if failed else "")


def _failures(outcomes: Outcomes, methods: Sequence[Method], functions: Sequence[Function], n: int) -> list[str]:
    lines = []
    for method in methods:
        for function in functions:
            found = [r for one in _of(outcomes, function, n, method) if (r := one["reason"]) is not None]
            if found:
                why = "; ".join(sorted(set(found)))
                lines.append(f"- {method.label}, {function.title}, {len(found)} failed: {why}")
    return lines


def _number(error: float) -> str:
    return f"{error:.4f}" if error >= 1e-4 else f"{error:.0e}"


def _row(cells: Sequence[str]) -> str:
    return f"| {' | '.join(cells)} |"

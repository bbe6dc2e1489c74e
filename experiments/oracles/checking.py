"""``check_oracle``: whether an oracle keeps its contract, in the manner of scikit-learn's check_estimator."""

import json
from collections.abc import Callable
from itertools import product

import numpy as np

from ..designs import Design, PlackettBurman
from ..runs import Runs, Status
from .base import Answers, Oracle
from .foreign import flaw_of

MOST_FULL = 3
"""Factors up to which all corners are asked; beyond, those of a Plackett-Burman design."""


def check_oracle(oracle: "str | Oracle | type[Oracle]") -> Runs:
    """Ask an oracle at the centre and in corners of its ranges, and see whether it answers as an oracle must.

    Parameters
    ----------
    oracle : Oracle, class of oracles, or str
        A name as :func:`.get` takes it: ``"spring"``, or ``"spring.py:spring"``, a file that is run.

    Returns
    -------
    Runs
        The centre, then the corners: 9 points or fewer up to three factors, some 13 for up to 7. They are asked twice.

    Raises
    ------
    AssertionError
        With one sentence on the first thing that is wrong.
    ValueError
        If there is no such oracle, or it cannot be made.
    """
    from . import get

    made = get(oracle) if isinstance(oracle, str) else oracle() if isinstance(oracle, type) else oracle
    who = f"oracle {getattr(made, 'name', type(made).__name__)!r}"
    if not isinstance(made, Oracle):
        raise AssertionError(f"{who} is no Oracle but an object of type {type(made).__name__}")
    _must(not (flaw := flaw_of(made)), f"{who}: {flaw}")
    space = made.factors
    _must(made.factors == space and made.responses == made.responses, f"{who} declares something else each time")
    made.prepare()
    design = Design(space, _corners(len(space)), "corners")
    answers = made.evaluate(design.physical)
    _shapes(who, made, answers, len(design))
    runs = made(design)
    for look in (_some_answer, _same_again, _same_alone, _nothing_for_nothing, _same_when_made_anew, _jacobian):
        look(who, made, runs)
    return runs


def _must(holds: bool, sentence: str) -> None:
    if not holds:
        raise AssertionError(sentence)


def _corners(k: int) -> np.ndarray:
    if k <= MOST_FULL:
        return np.array([(0.0,) * k, *product((-1.0, 1.0), repeat=k)])
    from ..factors import Factor, FactorSpace

    space = FactorSpace(tuple(Factor(f"x{i}", "1", -1.0, 1.0) for i in range(k)))
    return np.vstack([np.zeros((1, k)), PlackettBurman().generate(space).coded])


def _shapes(who: str, oracle: Oracle, answers: Answers, n: int) -> None:
    _must(
        isinstance(answers, tuple) and len(answers) == 3, f"{who}: evaluate must give Answers(values, status, reasons)"
    )
    values, status, reasons = answers
    expected = (n, len(oracle.responses))
    _must(np.shape(values) == expected, f"{who}: evaluate gave values of shape {np.shape(values)}, not {expected}")
    _must(len(status) == len(reasons) == n, f"{who}: evaluate must give a status and a reason for each of {n} points")
    wrong = [s for s in status if not isinstance(s, Status)]
    _must(not wrong, f"{who}: a status must be one of experiments.Status, got {wrong[:1]}")
    silent = [s for s, reason in zip(status, reasons, strict=True) if s is not Status.OK and not reason]
    _must(not silent, f"{who}: a point failed ({silent[:1]}) without a reason")


def _some_answer(who: str, oracle: Oracle, runs: Runs) -> None:
    _must(bool(runs.ok.any()), f"{who} answers neither the centre nor any corner of its ranges: {runs.failures()}")


def _same_again(who: str, oracle: Oracle, runs: Runs) -> None:
    order = np.arange(len(runs))[::-1]
    again = oracle(runs.design.take(order))
    same = np.array_equal(again.values[order], runs.values, equal_nan=True)
    _must(same, f"{who} answers otherwise when asked again, or in another order: points must not depend on each other")


def _same_alone(who: str, oracle: Oracle, runs: Runs) -> None:
    last = len(runs) - 1
    alone = oracle(runs.design.take([last]))
    same = np.array_equal(alone.values[0], runs.values[last], equal_nan=True)
    _must(same, f"{who} answers a point alone otherwise than in a batch")


def _nothing_for_nothing(who: str, oracle: Oracle, runs: Runs) -> None:
    shape = np.shape(oracle.evaluate(np.empty((0, len(oracle.factors))))[0])
    expected = (0, len(oracle.responses))
    _must(shape == expected, f"{who}: no points must give values of shape {expected}, got {shape}")


def _same_when_made_anew(who: str, oracle: Oracle, runs: Runs) -> None:
    from .recipes import recipe

    text = json.dumps(oracle.parameters, sort_keys=True)
    try:
        how = recipe(oracle)
    except ValueError:
        return  # known to this process alone, as in a notebook
    try:
        again = how.make()
    except ValueError as error:
        raise AssertionError(f"{who} cannot be made anew of its own parameters: {error}") from None
    _must(json.dumps(again.parameters, sort_keys=True) == text, f"{who} made anew has other parameters")


def _jacobian(who: str, oracle: Oracle, runs: Runs) -> None:
    ask: Callable | None = getattr(oracle, "jacobian", None)
    if ask is None:
        return
    at = runs.design.physical[:1]
    shape, expected = np.shape(ask(at)), (1, len(oracle.responses), len(oracle.factors))
    _must(shape == expected, f"{who}: jacobian gave shape {shape}, not {expected}")

"""A function as an oracle, ``check_oracle``, recipes, and what an oracle says of itself."""

import json
import pickle
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
import pytest

from experiments import Factor, FactorSpace, Response, Status, oracles
from experiments.oracles import Answers, Oracle, Recorded, check_oracle, described, point_oracle

A, B = Factor("a", "N", 1.0, 2.0), Factor("b", "m", -1.0, 1.0)
U, V = Response("u", "m"), Response("v", "rad", "mrad", 1e3, "ψ")


@point_oracle([A, B], [U, V], source="here", version="3", resolution=1e-9)
def pair(a, b, *, k=2.0, n: int | None = None):
    """Two numbers.

    And more about them.
    """
    if a > 1.9:
        raise ValueError("too much")
    return k * a, a - b


class TestPointOracle:
    def test_is_an_oracle(self):
        assert (pair.name, pair.summary, pair.source, pair.version, pair.resolution) == (
            "pair", "Two numbers.", "here", "3", 1e-9,
        )  # fmt: skip
        oracle = pair(k=3.0)
        assert oracle.parameters == {"k": 3.0, "n": None}
        assert oracle.evaluate(np.array([[1.5, 0.5]])).values.tolist() == [[4.5, 1.0]]
        assert pair.function(1.0, 0.0, k=1.0) == (1.0, 1.0)

    def test_an_exception_fails_its_point_only(self):
        answers = pair().evaluate(np.array([[2.0, 0.0], [1.0, 0.0]]))
        assert answers.status == [Status.CRASHED, Status.OK]
        assert answers.reasons == ["ValueError: too much", ""]

    def test_goes_through_pickle(self):
        assert pickle.loads(pickle.dumps(pair(k=5.0))) == pair(k=5.0)

    def test_gives_jacobians_in_jax(self):
        @point_oracle([A, B], [U], jax=True)
        def product(a, b, *, k=2.0):
            return k * a * b

        oracle = product(k=3.0)
        assert oracle.jacobian([[1.5, 0.5]]).tolist() == [[[1.5, 4.5]]]
        assert oracle.evaluate(np.array([[1.5, 0.5]])).values.tolist() == [[2.25]]

    @pytest.mark.parametrize(
        ("function", "match"),
        [
            (lambda a: a, r"the arguments of <lambda> are \(a\), its factors \(a, b\); they must agree"),
            (lambda b, a: a, r"are \(b, a\), its factors \(a, b\)"),
            (lambda a, b, *c: a, r"takes \*c; an oracle must know the names"),
            (lambda a, b, *, batch=1: a, r"no parameter can be called 'batch'"),
            (lambda a, b, *, k: a, r"say what k is, such as k: float"),
            (lambda a, b, *, k=None: a, r"say what k is, such as k: float"),
        ],
    )
    def test_refuses_arguments_that_are_not_the_factors(self, function, match):
        with pytest.raises(ValueError, match=match):
            point_oracle([A, B], [U], name="f")(function)

    def test_refuses_a_name_that_is_none(self):
        with pytest.raises(ValueError, match="oracle name '<lambda>' is not allowed"):
            point_oracle([A], [U])(lambda a: a)

    def test_a_parameter_may_be_required(self):
        @point_oracle([A], [U])
        def f(a, *, k=2.0, m: float):
            return a * k * m

        assert f(m=0.5).evaluate(np.array([[1.5]])).values == 1.5


@dataclass(frozen=True)
class Good(Oracle):
    name: ClassVar[str] = "good"
    k: float = 1.0

    @property
    def factors(self):
        return FactorSpace((A, B))

    @property
    def responses(self):
        return (U,)

    def evaluate(self, points):
        return Answers(points[:, :1] * self.k, [Status.OK] * len(points), [""] * len(points))


def broken(**methods):
    return type("Broken", (Good,), methods)


class TestCheckOracle:
    @pytest.mark.parametrize("oracle", [Good, Good(2.0), pair], ids=str)
    def test_a_good_one_gives_its_runs(self, oracle):
        runs = check_oracle(oracle)
        assert len(runs) >= 5
        assert runs.ok.any()

    @pytest.mark.parametrize(
        ("cls", "match"),
        [
            (broken(responses=property(lambda self: ())), "it has no responses"),
            (broken(evaluate=lambda self, points: points[:, :1]), r"must give Answers\(values, status, reasons\)"),
            (
                broken(evaluate=lambda self, p: Answers(p, ["ok"] * len(p), [""] * len(p))),
                r"shape \(5, 2\), not \(5, 1\)",
            ),
            (broken(evaluate=lambda self, p: Answers(p[:, :1], [], [])), "a status and a reason for each of 5 points"),
            (broken(evaluate=lambda self, p: Answers(p[:, :1], ["ok"] * len(p), [""] * len(p))), "must be one of"),
            (
                broken(evaluate=lambda self, p: Answers(p[:, :1], [Status.CRASHED] * len(p), [""] * len(p))),
                "failed .* without a reason",
            ),
            (
                broken(evaluate=lambda self, p: Answers(p[:, :1], [Status.REJECTED] * len(p), ["no"] * len(p))),
                r"answers neither the centre nor any corner of its ranges: 5 of 5 runs failed: run 1: rejected \(no\)",
            ),
            (
                broken(evaluate=lambda self, p: Answers(p[:, :1] + p[:1, :1], [Status.OK] * len(p), [""] * len(p))),
                "points must not depend on each other",
            ),
            (
                broken(evaluate=lambda self, p: Answers(p[:, :1] * (len(p) > 1), [Status.OK] * len(p), [""] * len(p))),
                "alone otherwise than in a batch",
            ),
            (
                broken(
                    evaluate=lambda self, p: Answers(p[:, :1] if len(p) else [], [Status.OK] * len(p), [""] * len(p))
                ),
                r"no points must give values of shape \(0, 1\), got \(0,\)",
            ),
            (broken(jacobian=lambda self, p: np.zeros((1, 2))), r"jacobian gave shape \(1, 2\), not \(1, 1, 2\)"),
        ],
        ids=lambda v: v if isinstance(v, str) else "",
    )
    def test_what_is_wrong_is_one_sentence(self, cls, match):
        with pytest.raises(AssertionError, match=match):
            check_oracle(cls)

    def test_takes_what_get_takes(self, monkeypatch):
        monkeypatch.setattr(oracles, "_REGISTERED", {"good": Good})
        assert check_oracle("good").responses == (U,)

    def test_no_oracle_at_all(self):
        with pytest.raises(AssertionError, match=r"is no Oracle but an object of type int"):
            check_oracle(3)  # type: ignore[arg-type]
        with pytest.raises(ValueError, match="unknown oracle 'godo'"):
            check_oracle("godo")

    def test_many_factors_take_few_points(self):
        factors = [replace(A, name=f"x{i}") for i in range(7)]
        many = broken(factors=property(lambda self: FactorSpace(tuple(factors))))
        assert len(check_oracle(many)) <= 13


class TestRecipes:
    @pytest.mark.parametrize(("name", "given"), [("cantilever", {"young": 60e9}), ("hexflex", {"thickness": 6e-4})])
    def test_of_a_built_in(self, name, given):
        oracle = oracles.get(name, **given)
        assert pickle.loads(pickle.dumps(oracles.recipe(oracle))).make() == oracle

    def test_of_a_program(self):
        program = oracles.get(
            "command",
            argv=["{{python}}", "-c", "print('u =', {{a}})"],
            factors={"a": {"unit": "N", "low": 1.0, "high": 2.0}},
            responses={"u": {"unit": "m", "regex": r"u = (\S+)"}},
        )
        again = pickle.loads(pickle.dumps(oracles.recipe(program))).make()
        assert again.parameters == program.parameters
        assert again.evaluate(np.array([[1.5]])).values == 1.5

    def test_of_what_this_process_alone_knows(self):
        with pytest.raises(ValueError, match=r"'good' is known to this process alone.*put it into a file"):
            oracles.recipe(Good())


class TestRecord:
    def test_says_what_the_oracle_says(self):
        text = json.dumps(described(pair(k=4.0)), allow_nan=False)
        record = Recorded(json.loads(text))
        for key in (
            "name",
            "summary",
            "source",
            "version",
            "resolution",
            "factors",
            "responses",
            "parameters",
            "limits",
        ):
            assert getattr(record, key) == getattr(pair(k=4.0), key), key
        assert not hasattr(record, "jacobian")
        assert hasattr(Recorded(described(oracles.get("cantilever"))), "jacobian")

    def test_cannot_be_asked(self):
        record = Recorded(described(pair()))
        with pytest.raises(oracles.OracleError, match=r"record of the oracle 'pair', without its code.*load=True"):
            record.evaluate(np.array([[1.5, 0.5]]))

    @pytest.mark.parametrize(
        "damage", [{}, [], {"name": "x"}, {**described(pair()), "factors": [{"name": "a"}]}], ids=str
    )
    def test_damage_is_refused(self, damage):
        with pytest.raises(ValueError, match="it is no description of an oracle"):
            Recorded(damage)

"""The oracle protocol: registry, failures, and the border to runs."""

import subprocess
import sys

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from experiments import Factor, FactorSpace, Response, Status, oracles
from experiments.designs import Design
from experiments.oracles import Answers, Oracle, PointOracle
from experiments.oracles.base import MOST_KEPT

SPACE = FactorSpace((Factor("a", "N", 0.0, 2.0), Factor("b", "m", 0.0, 2.0)))


class Moody(PointOracle):
    """Answers (a, b), but crashes, gives NaN or infinity at some points."""

    name = "moody"

    @property
    def factors(self) -> FactorSpace:
        return SPACE

    @property
    def responses(self) -> tuple[Response, ...]:
        return (Response("u", "m"), Response("v", "rad"))

    def respond(self, point):
        a, b = point
        if a == 0.0:
            raise ZeroDivisionError("no force")
        return (np.nan if b == 0.0 else a, np.inf if b == 2.0 else b)


def at(*physical) -> Design:
    return Design.from_physical(SPACE, np.array(physical, dtype=float).reshape(-1, 2))


@pytest.fixture
def registry(monkeypatch):
    monkeypatch.setattr(oracles, "_REGISTERED", {})


def test_a_crash_fails_its_point_only():
    runs = Moody()(at([1, 1], [0, 1], [1.5, 0.5]))
    assert runs.status == (Status.OK, Status.CRASHED, Status.OK)
    assert runs.reasons == ("", "ZeroDivisionError: no force", "")
    assert_array_equal(runs.values, [[1, 1], [np.nan, np.nan], [1.5, 0.5]])


def test_a_number_that_is_not_finite_fails_its_point_and_is_named():
    runs = Moody()(at([1, 0], [1, 2], [1, 1]))
    assert runs.status == (Status.NON_FINITE, Status.NON_FINITE, Status.OK)
    assert runs.reasons == ("u not finite", "v not finite", "")
    assert np.isnan(runs.values[:2]).all()


def test_failures_in_one_sentence():
    runs = Moody()(at([1, 1], [0, 1], [1, 0]))
    assert runs.failures() == (
        "2 of 3 runs failed: run 2: crashed (ZeroDivisionError: no force); run 3: non_finite (u not finite)"
    )


def test_the_user_can_still_interrupt():
    class Interrupted(Moody):
        def respond(self, point):
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        Interrupted()(at([1, 1]))


@pytest.mark.parametrize("answer", [3.0, [3.0], [1.0, 2.0, 3.0], [[1.0], [2.0]]], ids=str)
def test_a_wrong_number_of_responses_is_a_crash(answer):
    class Short(Moody):
        def respond(self, point):
            return answer

    runs = Short()(at([1, 1]))
    assert runs.status == (Status.CRASHED,)
    assert runs.reasons[0]


def test_own_status_and_reason_are_kept():
    class Diverging(Moody):
        def evaluate(self, points):
            values = np.full((len(points), 2), np.nan)
            return Answers(values, [Status.NOT_CONVERGED] * len(points), ["20 iterations"] * len(points))

    runs = Diverging()(at([1, 1], [1, 1]))
    assert runs.status == (Status.NOT_CONVERGED,) * 2
    assert runs.reasons == ("20 iterations",) * 2


def test_an_oracle_cannot_move_the_design():
    class Greedy(Moody):
        def respond(self, point):
            point[:] = 7.0
            return 1.0, 1.0

    design = at([1, 1], [1.5, 0.5])
    assert_array_equal(Greedy()(design).design.physical, [[1, 1], [1.5, 0.5]])


def test_an_oracle_without_fields_has_no_parameters():
    assert Moody().parameters == {}


def test_unknown_oracle_suggests_the_nearest():
    with pytest.raises(ValueError, match="unknown oracle 'cantilevr'; did you mean 'cantilever'"):
        oracles.get("cantilevr")


@pytest.mark.usefixtures("registry")
def test_a_registered_oracle_is_found():
    assert oracles.register(Moody) is Moody
    assert oracles.names()[-1] == "moody"
    assert isinstance(oracles.get("moody"), Moody)
    with pytest.raises(ValueError, match="did you mean 'moody'"):
        oracles.get("mody")


@pytest.mark.usefixtures("registry")
@pytest.mark.parametrize(
    ("taken", "message"),
    [("cantilever", "'cantilever' is taken by a built-in"), ("two words", "oracle name 'two words' is not allowed")],
)
def test_register_refuses_a_name_that_cannot_be_used(taken, message):
    with pytest.raises(ValueError, match=message):
        oracles.register(type("Wrong", (Moody,), {"name": taken}))
    assert "two words" not in oracles.names()


def test_an_oracle_must_answer():
    with pytest.raises(TypeError, match="abstract"):
        Oracle()


def test_listing_oracles_needs_no_jax():
    code = "import sys; from experiments import oracles; oracles.names(); sys.exit('jax' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_cantilever_refuses_a_modulus_that_is_not_positive():
    with pytest.raises(ValueError, match="young must be positive, got -1"):
        oracles.get("cantilever", young=-1.0)


def test_cantilever_verification():
    """Roark's Formulas for Stress and Strain, 7th ed., Table 8.1, case 1a: y = W l³/(3EI), θ = W l²/(2EI).

    W = 1 N, l = 50 mm, 10 mm × 1 mm, E = 60 GPa: EI = 0.05 N m², so y = 1/1200 m and θ = 1/40 rad.
    """
    oracle = oracles.get("cantilever", young=60e9)
    runs = oracle(Design.from_physical(oracle.factors, [[0.05, 0.01, 0.001, 1.0]]))
    assert_allclose(runs.values, [[1.0 / 1200.0, 1.0 / 40.0]], rtol=1e-12)


def test_cantilever_shape_ends_where_the_response_says():
    oracle = oracles.get("cantilever")
    runs = oracle(Design(oracle.factors, [[0.3, -0.2, 0.9, 0.4]], "one"))
    (leaf,) = oracle.shape(runs.design.physical[0]).lines
    deflection, slope = runs.values[0]
    assert_allclose(leaf.displacement[-1, 2], deflection, rtol=1e-12)
    rises, runs_out = np.diff(leaf.displacement[-3:, 2]), np.diff(leaf.points[-3:, 0])
    tangent = 1.5 * rises[1] / runs_out[1] - 0.5 * rises[0] / runs_out[0]
    assert_allclose(tangent, slope, rtol=1e-3)


class WrongError(Exception):
    def __str__(self):
        raise RuntimeError


@pytest.mark.parametrize("raised", [SystemExit(0), WrongError()])
def test_whatever_somebody_s_own_code_raises_is_told(raised):
    class Own(oracles.Oracle):
        name, origin = "own", "own.py"
        factors, responses = FactorSpace((Factor("a", "N", 0.0, 1.0),)), (Response("u", "m"),)

        def evaluate(self, points):
            raise raised

    with pytest.raises(oracles.OracleError, match=f"evaluate raised {type(raised).__name__}"):
        Own().answer(np.zeros((1, 1)))


@pytest.mark.parametrize(("raised", "reason"), [(SystemExit(0), "SystemExit: 0"), (ValueError("x" * 10**6), "ValueEr")])
def test_a_point_whose_code_exits_or_tells_a_novel_fails(raised, reason):
    class Own(oracles.PointOracle):
        name = "own"
        factors, responses = FactorSpace((Factor("a", "N", 0.0, 1.0),)), (Response("u", "m"),)

        def respond(self, point):
            raise raised

    answers = Own().answer(np.zeros((1, 1)))
    assert answers.status == [Status.CRASHED]
    assert answers.reasons[0].startswith(reason)
    assert len(answers.reasons[0]) <= MOST_KEPT

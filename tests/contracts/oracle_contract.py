"""The contract of every oracle: inherit :class:`OracleContract`."""

import json
import pickle
from dataclasses import replace
from functools import cache
from itertools import product

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from experiments import Factor, FactorSpace, Response, Runs, Status, oracles
from experiments.designs import Design, PlackettBurman, Random
from experiments.oracles.base import CHUNK, JaxOracle, Oracle, PublishedMap

MANY = CHUNK + 7


@cache
def default(name: str) -> Oracle:
    """One instance per oracle, so that each is compiled once."""
    return oracles.get(name)


@cache
def many_runs(name: str) -> Runs:
    """More random runs than fit in one chunk."""
    return default(name)(Random(MANY).generate(default(name).factors, rng=7))


class OracleContract:
    """Every test takes `name`, one of ``oracles.names()``."""

    @pytest.fixture
    def oracle(self, name: str) -> Oracle:
        return default(name)

    def test_is_what_its_name_says(self, name, oracle):
        assert isinstance(oracle, Oracle)
        assert type(oracle) is oracles.oracle_class(name)
        assert oracle.name == name
        assert oracle.summary
        assert oracle.source
        assert oracle.version
        assert 0.0 <= oracle.resolution < 1.0
        assert oracle.batch >= 1

    def test_passes_what_everybody_can_check(self, oracle):
        if hasattr(oracle, "jacobian") and not isinstance(oracle, JaxOracle):
            pytest.skip("its Jacobian would be compiled for this alone; it has tests of its own")
        runs = oracles.check_oracle(oracle)
        assert runs.ok.all()

    def test_can_be_made_in_another_process(self, name, oracle):
        again = pickle.loads(pickle.dumps(oracles.recipe(oracle))).make()
        assert type(again) is type(oracle)
        assert again.parameters == oracle.parameters

    def test_factors_have_units_and_a_source(self, oracle):
        assert isinstance(oracle.factors, FactorSpace)
        for factor in oracle.factors:
            assert isinstance(factor, Factor)
            assert factor.unit
            assert factor.source, f"say where the range of {factor.name} comes from"

    def test_responses_have_units_and_names_of_their_own(self, oracle):
        assert oracle.responses
        assert all(isinstance(r, Response) and r.unit and r.shown_unit for r in oracle.responses)
        names = [r.name for r in oracle.responses]
        assert len(set(names)) == len(names)
        assert not set(names) & set(oracle.factors.names)

    def test_answers_at_the_centre_and_the_corners(self, oracle):
        k = len(oracle.factors)
        corners = (
            np.array(list(product([-1.0, 1.0], repeat=k)))
            if k <= 7
            else PlackettBurman().generate(oracle.factors).coded
        )
        runs = oracle(Design(oracle.factors, np.vstack([np.zeros((1, k)), corners]), "corners"))
        assert runs.failures() == ""
        assert runs.values.shape == (1 + len(corners), len(oracle.responses))
        assert np.isfinite(runs.values).all()

    def test_answers_the_whole_range(self, name):
        assert many_runs(name).failures() == ""

    def test_every_response_varies(self, name):
        assert (np.ptp(many_runs(name).values, axis=0) > 0.0).all()

    def test_every_factor_matters(self, name, oracle):
        k = len(oracle.factors)
        coded = 0.5 * np.vstack([np.zeros((1, k)), np.eye(k)])
        values = oracle(Design(oracle.factors, coded, "one at a time")).values
        for factor, moved in zip(oracle.factors, values[1:], strict=True):
            assert (moved != values[0]).any(), f"{factor.name} changes nothing"

    def test_same_answer_twice(self, name, oracle):
        runs = many_runs(name)
        again = oracle(runs.design)
        assert_array_equal(again.values, runs.values)
        assert again.status == runs.status

    def test_a_new_instance_answers_the_same(self, name):
        runs = many_runs(name)
        assert_array_equal(oracles.get(name)(runs.design.take(np.arange(5))).values, runs.values[:5])

    @pytest.mark.parametrize("row", [0, CHUNK - 1, CHUNK, MANY - 1])
    def test_answer_alone_is_the_answer_in_a_batch(self, name, oracle, row):
        runs = many_runs(name)
        assert_array_equal(oracle(runs.design.take([row])).values, runs.values[[row]])

    def test_answer_does_not_depend_on_its_place(self, name, oracle):
        runs = many_runs(name)
        order = np.random.default_rng(0).permutation(MANY)
        assert_array_equal(oracle(runs.design.take(order)).values, runs.values[order])

    @pytest.mark.parametrize("size", [CHUNK - 1, CHUNK, CHUNK + 1])
    def test_answer_does_not_depend_on_the_batch_size(self, name, oracle, size):
        runs = many_runs(name)
        assert_array_equal(oracle(runs.design.take(np.arange(size))).values, runs.values[:size])

    def test_no_points_no_answers(self, oracle):
        runs = oracle(Design(oracle.factors, np.empty((0, len(oracle.factors))), "empty"))
        assert runs.values.shape == (0, len(oracle.responses))

    def test_runs_carry_the_design_and_the_responses(self, name, oracle):
        runs = many_runs(name)
        assert runs.design.space.labels == oracle.factors.labels
        assert runs.responses == oracle.responses
        assert set(runs.status) == {Status.OK}

    def test_refuses_other_factors(self, oracle):
        space = oracle.factors
        first, *rest = space.factors
        for wrong in (
            FactorSpace((replace(first, name="somethingElse"), *rest)),
            FactorSpace((replace(first, unit="furlong"), *rest)),
            FactorSpace((*space.factors, Factor("oneMore", "1", 0.0, 1.0))),
        ):
            with pytest.raises(ValueError, match=f"oracle '{oracle.name}' has the factors {first.name}"):
                oracle(Design(wrong, np.zeros((1, len(wrong))), "wrong"))

    def test_refuses_factors_in_another_order(self, oracle):
        turned = FactorSpace(oracle.factors.factors[::-1])
        if turned == oracle.factors:
            pytest.skip("one factor has one order")
        with pytest.raises(ValueError, match="the design has"):
            oracle(Design(turned, np.zeros((1, len(turned))), "turned"))

    def test_accepts_other_ranges(self, oracle):
        space = oracle.factors
        half = space.decode(0.5 * np.array([[-1.0], [1.0]]) * np.ones(len(space)))
        narrow = space.with_ranges(dict(zip(space.names, map(tuple, half.T.tolist()), strict=True)))
        assert_allclose(
            oracle(Design(narrow, np.ones((1, len(space))), "half")).values,
            oracle(Design(space, np.full((1, len(space)), 0.5), "half")).values,
            rtol=1e-9,
        )

    def test_parameters_survive_json(self, name, oracle):
        text = json.dumps(oracle.parameters, allow_nan=False)
        assert oracles.get(name, **json.loads(text)).parameters == oracle.parameters

    def test_unknown_parameter_suggests_the_nearest(self, name, oracle):
        if not oracle.parameters:
            pytest.skip("this oracle has no parameters")
        known = max(oracle.parameters, key=len)
        with pytest.raises(ValueError, match=rf"oracle '{name}' has no setting '{known}x'; did you mean '{known}'"):
            oracles.get(name, **{f"{known}x": 1.0})

    def test_refuses_parameters_of_the_wrong_type(self, name, oracle):
        numbers = [k for k, v in oracle.parameters.items() if type(v) is float]
        for key in numbers:
            with pytest.raises(ValueError, match=f"{key} must be a number, got 'much'"):
                oracles.get(name, **{key: "much"})
            with pytest.raises(ValueError, match=f"{key} must be finite, got inf"):
                oracles.get(name, **{key: float("inf")})

    def test_jacobian_is_that_of_central_differences(self, oracle):
        if not isinstance(oracle, JaxOracle):
            pytest.skip("no Jacobian")
        space, step = oracle.factors, 1e-3
        k = len(space)
        coded = np.random.default_rng(1).uniform(-0.9, 0.9, (3, k))
        moves = step * np.vstack([np.eye(k), -np.eye(k)])
        around = (coded[:, None, :] + moves).reshape(-1, k)
        values = oracle(Design(space, around, "differences")).values.reshape(3, 2, k, -1)
        differences = (values[:, 0] - values[:, 1]).transpose(0, 2, 1) / (2.0 * step)
        per_coded = oracle.jacobian(space.decode(coded)) * space.half_range
        assert per_coded.shape == (3, len(oracle.responses), k)
        for i in range(len(oracle.responses)):
            scale = np.abs(differences[:, i]).max()
            assert_allclose(per_coded[:, i], differences[:, i], rtol=0.0, atol=1e-5 * scale)

    def test_jacobian_does_not_depend_on_the_batch(self, name, oracle):
        if not isinstance(oracle, JaxOracle):
            pytest.skip("no Jacobian")
        points = many_runs(name).design.physical
        together = oracle.jacobian(points)
        assert_array_equal(oracle.jacobian(points[[CHUNK]]), together[[CHUNK]])

    def test_shape_can_be_drawn(self, oracle):
        space = oracle.factors
        for point in space.decode(np.vstack([np.zeros(len(space)), np.ones(len(space))])):
            shape = oracle.shape(point)
            if shape is None:
                pytest.skip("this oracle has no shape")
            assert shape.lines
            for line in shape.lines:
                assert line.points.ndim == 2
                assert line.points.shape[1] == 3
                assert len(line.points) >= 2
                assert line.displacement.shape == line.points.shape
                assert np.isfinite(line.points).all()
                assert np.isfinite(line.displacement).all()
            for arrow in shape.arrows:
                assert arrow.label
                for vector in (arrow.point, arrow.displacement, arrow.direction):
                    assert np.shape(vector) == (3,)
                    assert np.isfinite(vector).all()
                assert np.linalg.norm(arrow.direction) == pytest.approx(1.0, abs=1e-12)

    def test_published_map_fits_the_oracle(self, oracle):
        published = oracle.published
        if published is None:
            pytest.skip("nothing was published")
        assert isinstance(published, PublishedMap)
        assert published.source
        assert set(published.factors) <= set(oracle.factors.names)
        assert set(published.responses) <= {r.name for r in oracle.responses}
        assert published.values.shape == (len(published.responses), len(published.factors))
        assert np.isfinite(published.values).all()
        assert all(r in published.responses and f in published.factors for r, f in published.notes)

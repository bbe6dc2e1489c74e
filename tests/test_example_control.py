"""The proof in the loop, in small: a model of the nonlinear HexFlex, then all controllers on short trajectories.

The plant shares its finite elements with the runs that the model was fitted to, so that this is *validation* of the
surrogate and its exported inverse at fresh poses; that the finite elements are right is verified elsewhere.
"""

import csv
import shutil
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from examples.control import __main__ as command
from examples.control import campaign, compiled, controllers, loading, results, trajectories
from examples.control.campaign import AFFINE, AT_REST, LINEAR, LOOP, OURS, THESIS, Size, track
from examples.control.controllers import Controller, Lane, feed_forward, integral_loops
from examples.control.plant import Disturbance, Plant, disturbances
from experiments import Status, oracles
from experiments.designs import Halton, Random
from experiments.oracles.base import Answers
from surrogates import PolynomialRegressor, certify, dumps

AS_MODELLED, STIFFER, LOADED = "as modelled", "2 % stiffer", "10 mN on a tab"
SMALL = Size(samples=48, seeds=2, repeats=3)
needs_compiler = pytest.mark.skipif(
    not any(shutil.which(name) for name in compiled.COMPILERS),
    reason="NO C COMPILER: looked for cc, gcc and clang on PATH. The exported C controlled nothing.",
)


@pytest.fixture(scope="module")
def mechanism():
    return oracles.get("hexflex", kinematics="nonlinear")


@pytest.fixture(scope="module")
def model(mechanism):
    """As accurate as the study's, by other means: the full quintic from 512 runs, which needs no Jacobian compiled."""
    forces = Halton(n_runs=512).generate(mechanism.factors, 2012).physical
    poses = Plant(mechanism).poses(forces)
    regressor = PolynomialRegressor(degree=5, trim=False, space=mechanism.factors, responses=mechanism.responses)
    fit = regressor.fit(forces, poses).surrogate_
    origin = {"oracle": mechanism.name, "oracle_parameters": mechanism.parameters}
    return replace(fit, certificate=certify(fit), provenance=origin)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("control")


@pytest.fixture(scope="module")
def tracked(model, mechanism, folder):
    return track(model, mechanism, folder, SMALL)


# --- validation: the certified inverse on the nonlinear plant ------------------------------------------------------


@needs_compiler
@pytest.mark.parametrize("linear", LINEAR)
def test_feed_forward_errs_a_hundred_times_less_than_any_linear_inverse(tracked, linear):
    assert tracked.ratio(linear) >= 100.0


@needs_compiler
def test_ours_is_no_better_than_itself_and_the_ratio_sees_the_worst_coordinate(tracked):
    assert tracked.ratio(OURS) == 1.0
    found = [tracked.of(name, AS_MODELLED, c) for c in (AT_REST, OURS) for name in trajectories.SHAPES]
    ratios = [a.rms / b.rms for a, b in zip(found[:3], found[3:], strict=True)]
    assert tracked.ratio(AT_REST) <= np.min(ratios)


@needs_compiler
def test_the_exported_inverse_refused_no_pose(tracked):
    assert [e.refused for e in tracked.errors] == [0] * len(tracked.errors)
    assert len(tracked.errors) == 3 * 3 * 6


@needs_compiler
@pytest.mark.parametrize("name", trajectories.SHAPES)
def test_the_loop_takes_a_steady_load_away(tracked, name):
    """Before the load it lives on the sensor's noise; at the end of the trajectory the load is all but gone."""
    runs = [r for r in tracked.tracked if r.lane.trajectory.name == name and r.lane.disturbance.name == LOADED]
    last = {
        c: np.abs([r.poses[-4:] - r.lane.trajectory.poses[-4:] for r in runs if r.lane.controller.name == c]).max()
        for c in (OURS, OURS + LOOP)
    }
    assert last[OURS] > 3e-4  # rad: the tilt that 10 mN make
    assert last[OURS + LOOP] < 0.1 * last[OURS]
    assert tracked.of(name, LOADED, OURS + LOOP).position_rms < 0.6 * tracked.of(name, LOADED, OURS).position_rms


@needs_compiler
@pytest.mark.parametrize("name", trajectories.SHAPES)
def test_the_loop_reduces_what_a_stiffer_plant_makes(tracked, name):
    assert tracked.of(name, STIFFER, OURS + LOOP).position_rms < tracked.of(name, STIFFER, OURS).position_rms


@needs_compiler
def test_two_percent_of_stiffness_are_two_percent_of_the_pose_and_more_than_the_model_errs(tracked):
    for name in trajectories.SHAPES:
        stiffer, nominal = (tracked.of(name, plant, OURS) for plant in (STIFFER, AS_MODELLED))
        assert stiffer.position_rms > 100.0 * nominal.position_rms


@needs_compiler
def test_the_exported_c_is_what_controls(tracked, model):
    """Its forces are those of the model in Python, to the accuracy that the export promises."""
    run = next(r for r in tracked.tracked if r.lane.controller.name == OURS)
    assert isinstance(run.lane.controller.inverse, compiled.CompiledInverse)
    assert_allclose(run.forces, model.invert(run.lane.trajectory.poses).settings, rtol=0, atol=1e-9)


@needs_compiler
def test_another_model_in_the_same_folder_is_not_answered_for_by_the_first(tracked, model, folder):
    other = replace(model, coefficients=1.1 * model.coefficients)
    first = next(r for r in tracked.tracked if r.lane.controller.name == OURS)
    poses = first.lane.trajectory.poses[:1]
    forces, ok = compiled.compiled(other, folder)(poses)
    assert ok.all()
    assert_allclose(forces, other.invert(poses).settings, rtol=0, atol=1e-9)
    assert np.abs(forces - first.forces[:1]).max() > 1e-2


@needs_compiler
def test_times_are_those_of_every_pose_and_in_order(tracked):
    assert tracked.timing.calls.shape == (SMALL.repeats, 3 * SMALL.samples)
    told = tracked.timing.summary()
    assert 0.0 < told["median"] <= told["99.9 % of calls"] <= told["worst call"]
    assert told["clock alone, median"] < told["median"] < 1e3  # an inversion takes more than the clock, less than 1 ms


# --- verification: the pieces ---------------------------------------------------------------------------------------


def test_a_stiffer_mechanism_is_the_nominal_one_under_smaller_forces(mechanism):
    forces = Random(8).generate(mechanism.factors, rng=1).physical
    built = replace(mechanism, young=1.02 * mechanism.young).evaluate(forces).values
    disturbance = next(d for d in disturbances(mechanism.factors.names) if d.name == STIFFER)
    scaled = Plant(mechanism).poses(disturbance.forces(forces, np.zeros(8)))
    assert_allclose(scaled, built, rtol=0, atol=1e-12)


@pytest.mark.parametrize("name", trajectories.SHAPES)
def test_trajectories_use_four_fifths_of_the_box_in_every_coordinate(name):
    box = np.array([[-1.0, 3.0], [0.0, 2.0], [-5.0, -4.0], [-1.0, 1.0], [0.0, 1e-3], [2.0, 8.0]])
    poses = next(t for t in trajectories.trajectories(box, 96) if t.name == name).poses
    middle, half = box.mean(axis=1), np.ptp(box, axis=1) / 2.0
    assert_allclose((poses.min(axis=0) - middle) / half, -0.8, atol=1e-9)
    assert_allclose((poses.max(axis=0) - middle) / half, 0.8, atol=1e-9)


@pytest.mark.parametrize("n", [0, 12, 100])
def test_a_number_of_samples_that_gives_no_whole_lines_is_refused(n):
    with pytest.raises(ValueError, match=f"give a multiple of 24, at least 24; got {n}"):
        trajectories.trajectories(np.tile([-1.0, 1.0], (6, 1)), n)


@pytest.mark.parametrize("reach", [0.0, 1.2])
def test_a_reach_beyond_the_certified_box_is_refused(reach):
    with pytest.raises(ValueError, match="reach is a share of the certified box"):
        trajectories.placed(np.zeros((1, 6)), np.tile([-1.0, 1.0], (6, 1)), reach)


class Identity:
    """A mechanism whose pose is its forces."""

    status = Status.OK

    def evaluate(self, points):
        return Answers(points.copy(), [self.status] * len(points), ["too soft"] * len(points))


class Bounded:
    """The identity as an inverse that refuses what is larger than 1."""

    def __call__(self, poses):
        return np.array(poses), np.abs(poses).max(axis=1) <= 1.0


def lane(poses, gain=0.5, load=0.0, inverse=None, seed=None):
    wanted = trajectories.Trajectory("held", np.asarray(poses, dtype=float))
    return Lane(wanted, Disturbance("load", 1.0, np.full(6, load)), Controller("c", inverse or Bounded(), gain), seed)


def test_the_error_shrinks_by_one_less_the_gain_in_each_sample():
    """Closed form: about an exact inverse, a constant load d leaves d (1 - gain)^k."""
    (run,) = integral_loops(Plant(Identity()), [lane(np.zeros((6, 6)), gain=0.3, load=0.1)])
    assert_allclose(run.poses, 0.1 * 0.7 ** np.arange(6)[:, None] * np.ones(6), atol=1e-15)


def test_the_sensors_noise_comes_through_as_the_theory_says():
    """White noise σ through shift += gain * (−measured): variance gain/(2 − gain) σ² of the true pose."""
    (run,) = integral_loops(Plant(Identity()), [lane(np.zeros((4000, 6)), gain=0.5, seed=1)])
    expected = controllers.NOISE * np.sqrt(0.5 / 1.5)
    assert_allclose(run.poses[50:].std(axis=0), expected, rtol=0.06)


def test_a_refused_command_keeps_the_last_forces_and_does_not_wind_up():
    wanted = np.full((6, 6), 0.5)
    wanted[2:4] = 2.0
    (run,) = integral_loops(Plant(Identity()), [lane(wanted, gain=0.3)])
    assert run.refused == 2
    assert_allclose(run.poses, 0.5)


def test_a_loop_without_gain_is_feed_forward():
    one = lane(np.linspace(-1.0, 1.0, 10)[:, None] * np.ones(6), gain=0.0, load=0.1)
    plant = Plant(Identity())
    assert_allclose(integral_loops(plant, [one])[0].poses, feed_forward(plant, one).poses, atol=1e-15)


# --- misuse ---------------------------------------------------------------------------------------------------------


def test_feed_forward_says_what_was_refused():
    with pytest.raises(RuntimeError, match="c refused 1 of 2 poses of the held"):
        feed_forward(Plant(Identity()), lane([[0.0] * 6, [2.0] * 6]))


def test_a_plant_without_equilibrium_ends_the_run():
    soft = Identity()
    soft.status = Status.NOT_CONVERGED
    with pytest.raises(RuntimeError, match=r"the plant has no pose under the forces .* too soft; use a smaller reach"):
        Plant(soft).poses(np.zeros((1, 6)))


def test_lanes_of_different_lengths_are_refused():
    with pytest.raises(ValueError, match=r"same number of samples; got \[2, 3\]"):
        integral_loops(Plant(Identity()), [lane(np.zeros((2, 6))), lane(np.zeros((3, 6)))])


@pytest.mark.parametrize("gain", [-0.1, 2.0])
def test_an_unstable_gain_is_refused(gain):
    with pytest.raises(ValueError, match="at least 0 and below 2"):
        Controller("c", Bounded(), gain)


def test_a_model_without_a_certified_box_is_refused(model):
    with pytest.raises(ValueError, match="no certified box of responses to track in: it was not certified"):
        loading.plant_of(replace(model, certificate=None))
    boxless = replace(model.certificate, response_box=None, box_reason="the faces overlap")
    with pytest.raises(ValueError, match="no certified box of responses to track in: the faces overlap"):
        loading.plant_of(replace(model, certificate=boxless))


def test_a_model_of_something_else_is_refused(model):
    with pytest.raises(ValueError, match="the model is of oracle 'cantilever'"):
        loading.plant_of(replace(model, provenance={"oracle": "cantilever"}))
    linear = {**model.provenance, "oracle_parameters": {"kinematics": "linear"}}
    with pytest.raises(ValueError, match="with kinematics 'linear'"):
        loading.plant_of(replace(model, provenance=linear))


def test_without_a_compiler_it_says_what_to_install(model, tmp_path, monkeypatch):
    monkeypatch.setattr(compiled, "which", lambda name: None)
    with pytest.raises(RuntimeError, match=r"no C compiler: looked for cc, gcc, clang on PATH.*install one"):
        compiled.compiled(model, tmp_path)


def test_a_model_file_that_is_not_there_ends_the_command_with_one_line(tmp_path, capsys):
    assert command.main(["--model", str(tmp_path / "none.json"), "--out", str(tmp_path)]) == 2
    assert "error: there is no model at" in capsys.readouterr().err


# --- the command ----------------------------------------------------------------------------------------------------


@needs_compiler
def test_the_command_writes_tables_and_figures(tracked, model, tmp_path, monkeypatch, capsys):
    """With the campaign at hand: what is run was tested above."""
    path = tmp_path / "model.json"
    path.write_text(dumps(model), encoding="utf-8")
    monkeypatch.setattr(campaign, "track", lambda *arguments: tracked)
    assert command.main(["--model", str(path), "--out", str(tmp_path), "--small"]) == 0
    said = capsys.readouterr().out
    assert f"'{AT_REST}' errs at least" in said
    assert all(name in said for name in (THESIS, AFFINE, "worst pose"))
    with (tmp_path / "errors.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == len(tracked.errors)
    ours = next(r for r in rows if r["controller"] == OURS)
    assert float(ours[results.FOUR[0]]) == tracked.errors[3].position_rms
    for name in ("feed_forward", "loop", "timing"):
        assert (tmp_path / f"{name}.png").read_bytes()[:4] == b"\x89PNG"

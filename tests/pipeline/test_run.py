"""The run folder: what it holds, that it is reproducible, that it continues, and that it keeps what was found."""

import csv
import json
import re
import shutil
import socket
import subprocess
from datetime import datetime
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import pipeline
from experiments import Status, oracles
from experiments.designs import level_discrepancy_squared
from experiments.oracles import JaxOracle
from pipeline import InputError, TooManyFailures, load_config, read_run
from surrogates import Verdict, load
from tests.pipeline.cases import CONFIGS, SMALL, A, Counted, D, config_text, contents, reproducible
from tests.reference import hexflex_map

ROOT = CONFIGS.parent
SMOKE = CONFIGS / "smoke.toml"
STAGES = ("screening", "fit", "validation", "inversion")
CC = next((c for c in ("gcc", "cc", "clang") if shutil.which(c)), None)

FILES = {
    "config.toml", "provenance.json", "points.sqlite", "model.json", "report.html", "log.txt", "state.json",
    "screening/design.csv", "screening/runs.csv", "screening/effects.csv",
    "fit/design.csv", "fit/runs.csv",
    "validation/design.csv", "validation/runs.csv", "validation/errors.csv",
    "inversion/design.csv", "inversion/runs.csv", "inversion/targets.csv", "inversion/errors.csv",
}  # fmt: skip


def table(path: Path) -> tuple[list[str], list[list[str]]]:
    """Header and rows of a CSV, as text."""
    with path.open(newline="", encoding="utf-8") as file:
        header, *rows = csv.reader(file)
    return header, rows


def numbers(path: Path, columns: list[str]) -> np.ndarray:
    """Columns of a CSV as Python reads its floats; an empty cell is NaN."""
    header, rows = table(path)
    places = [header.index(c) for c in columns]
    return np.array([[float(row[i] or "nan") for i in places] for row in rows])


@pytest.fixture
def study(counted, tmp_path, no_report):
    """Run the counted oracle's study, small and without a report, in folder `name`."""

    def run(name: str = "out", oracle: str = "counted", more: str = "", overrides=(), **settings) -> pipeline.Outcome:
        config = tmp_path / f"{oracle}.toml"
        config.write_text(config_text(oracle, more), encoding="utf-8")
        return pipeline.run(config, tmp_path / name, [*SMALL, *overrides], **settings)

    return run


class TestFolder:
    def test_holds_what_the_architecture_says(self, smoke, hexflex):
        for outcome, name in ((smoke, "smoke"), (hexflex, "hexflex")):
            code = [f"{name}.h", f"{name}.c", f"{name}_selftest.c", "model.json", "export.json"]
            assert set(contents(outcome.path)) - {"exports/c99/verification.csv"} == FILES | {
                f"exports/c99/{file}" for file in code
            }

    def test_config_is_as_resolved(self, smoke):
        assert load_config(smoke.path / "config.toml") == load_config(SMOKE, SMALL) == smoke.study.config

    def test_headers_carry_name_and_unit(self, smoke):
        factors = ["length[m]", "width[m]", "thickness[m]", "load[N]"]
        coded = ["length[coded]", "width[coded]", "thickness[coded]", "load[coded]"]
        responses = ["deflection[m]", "slope[rad]"]
        dummies = [f"dummy{i}[coded]" for i in range(1, 8)]
        for stage in STAGES:
            assert table(smoke.path / stage / "design.csv")[0] == coded + (dummies if stage == "screening" else [])
            assert table(smoke.path / stage / "runs.csv")[0] == [*factors, *responses, "status", "reason"]
        assert table(smoke.path / "inversion" / "targets.csv")[0] == [
            *responses, *factors, "status", "preimages", "complete", "nearest_deflection[m]", "nearest_slope[rad]",
        ]  # fmt: skip

    def test_long_tables_carry_the_unit_in_a_column(self, smoke):
        for name in ("screening/effects.csv", "validation/errors.csv", "inversion/errors.csv"):
            header, rows = table(smoke.path / name)
            units = {(row[header.index("response")], row[header.index("unit")]) for row in rows}
            assert units == {("deflection", "m"), ("slope", "rad")}

    def test_designs_and_runs_round_trip_exactly(self, smoke):
        runs = {
            "screening": smoke.screening_runs,
            "fit": smoke.fit_runs,
            "validation": smoke.validation_runs,
            "inversion": smoke.round_trip.answers,
        }
        for stage, expected in runs.items():
            space, responses = expected.design.space, [r.label for r in expected.responses]
            coded = numbers(smoke.path / stage / "design.csv", [f"{n}[coded]" for n in space.names])
            assert_array_equal(coded, expected.design.coded)
            settings = numbers(smoke.path / stage / "runs.csv", list(space.labels))
            assert_array_equal(settings, expected.design.physical)
            assert_array_equal(numbers(smoke.path / stage / "runs.csv", responses), expected.values)

    def test_effects_round_trip_exactly(self, smoke):
        effects = smoke.screening.effects
        header, rows = table(smoke.path / "screening" / "effects.csv")
        told = {
            (r[header.index("response")], r[header.index("contrast")]): dict(zip(header, r, strict=True)) for r in rows
        }
        assert len(told) == effects.values.size == len(rows)
        for j, (response, result) in enumerate(zip(effects.responses, smoke.screening.lenth, strict=True)):
            for i, name in enumerate(effects.names):
                row = told[response.name, name]
                assert float(row["effect"]) == effects.values[i, j]
                assert (row["active"] == "True") == result.active[i]
                assert float(row["me"]) == result.me
                assert float(row["pse"]) == result.pse
                assert row["kind"] == ("dummy" if name.startswith("dummy") else "factor")

    def test_errors_round_trip_exactly(self, smoke):
        for name, errors in (("validation", smoke.model.validation), ("inversion", smoke.round_trip.errors)):
            columns = ["max_abs", "range", "max_relative_to_range", "rmse", "rmse_relative_to_range", "q2"]
            told = numbers(smoke.path / name / "errors.csv", columns)
            expected = [[e.max_abs, e.range, e.max_relative, e.rmse, e.relative_rmse, e.q2] for e in errors]
            assert_array_equal(told, expected)
        worst = numbers(smoke.path / "validation" / "errors.csv", [f"worst_{n}" for n in smoke.study.space.labels])
        assert_array_equal(worst, [e.worst_point for e in smoke.model.validation])
        told = numbers(smoke.path / "validation" / "errors.csv", ["half_width_0.9", "coverage_0.9"])
        assert_array_equal(told, [[e.intervals[0].half_width, e.intervals[0].coverage] for e in smoke.model.validation])

    def test_errors_are_those_of_the_files(self, smoke):
        """From the CSVs and model.json alone, by the definitions: MAXABS, over the range, and RMSE."""
        model = load(smoke.path / "model.json")
        runs = smoke.path / "validation" / "runs.csv"
        truth = numbers(runs, [r.label for r in model.responses])
        error = np.abs(model.predict(numbers(runs, list(model.factors.labels))) - truth)
        told = numbers(smoke.path / "validation" / "errors.csv", ["max_abs", "max_relative_to_range", "rmse", "q2"])
        largest = error.max(axis=0)
        assert_allclose(told[:, 0], largest, rtol=1e-12)
        assert_allclose(told[:, 1], largest / (truth.max(axis=0) - truth.min(axis=0)), rtol=1e-12)
        assert_allclose(told[:, 2], np.sqrt((error**2).mean(axis=0)), rtol=1e-12)
        assert_allclose(told[:, 3], 1.0 - (error**2).mean(axis=0) / truth.var(axis=0), rtol=1e-12)

    def test_model_json_is_the_outcomes_model(self, smoke):
        points = smoke.validation_runs.design.physical
        assert_array_equal(load(smoke.path / "model.json").predict(points), smoke.model.predict(points))

    def test_provenance_has_the_clock_the_host_and_the_versions(self, smoke):
        told = json.loads((smoke.path / "provenance.json").read_text(encoding="utf-8"))
        started, finished = (datetime.fromisoformat(told[k]) for k in ("started", "finished"))
        assert started.tzinfo is not None
        assert started <= finished
        assert told["host"] == socket.gethostname()
        assert told["packages"]["numpy"] == np.__version__
        assert set(told["seconds"]) >= {"screening", "fit", "validation", "inversion", "report"}
        assert all(s >= 0.0 for s in told["seconds"].values())

    def test_nothing_else_has_them(self, study, monkeypatch, tmp_path):
        monkeypatch.setattr(socket, "gethostname", lambda: "host-of-this-test")
        outcome = study("somewhere")
        assert "host-of-this-test" in (outcome.path / "provenance.json").read_text(encoding="utf-8")
        for name, data in reproducible(outcome.path).items():
            text = data.decode()
            assert "host-of-this-test" not in text, name
            assert str(tmp_path) not in text, name
            assert "somewhere" not in text, name
            assert not re.search(r"\d{4}-\d{2}-\d{2}|\d{2}:\d{2}:\d{2}", text), name
            assert not re.search(r'"/[a-z]', text), name


class TestReproducible:
    def test_two_folders_of_one_study_are_identical(self, smoke, tmp_path, no_report):
        again = pipeline.run(SMOKE, tmp_path / "again", SMALL)
        files = reproducible(again.path)
        assert "model.json" in files
        assert "exports/c99/smoke.c" in files
        assert len([name for name in files if name.endswith(".csv")]) == 12
        assert files == reproducible(smoke.path)

    def test_another_seed_differs(self, smoke, tmp_path, no_report):
        other = reproducible(pipeline.run(SMOKE, tmp_path / "other", [*SMALL, "seed=8"]).path)
        ours = reproducible(smoke.path)
        assert other["screening/design.csv"] == ours["screening/design.csv"], "nothing in it is random"
        for name in ("fit/design.csv", "fit/runs.csv", "validation/runs.csv", "inversion/runs.csv", "model.json"):
            assert other[name] != ours[name], name

    def test_stages_have_seeds_of_their_own(self, smoke, tmp_path, no_report):
        """Another validation leaves the fit alone."""
        other = pipeline.run(SMOKE, tmp_path / "other", [*SMALL, "validation.n_runs=30"])
        assert reproducible(other.path)["fit/runs.csv"] == reproducible(smoke.path)["fit/runs.csv"]
        assert_array_equal(other.model.coefficients, smoke.model.coefficients)


class TestContinue:
    def test_evaluates_nothing_again(self, smoke, smoke_copy, no_report, monkeypatch):
        def never(self, points):
            raise AssertionError(f"{len(points)} points were evaluated again")

        monkeypatch.setattr(JaxOracle, "evaluate", never)
        pipeline.run(SMOKE, smoke_copy, SMALL)
        assert reproducible(smoke_copy) == reproducible(smoke.path)

    def test_asks_the_oracle_nothing_again(self, study, counted):
        first = reproducible(study().path)
        n = len(counted.asked)
        assert n > 12 + 18
        assert reproducible(study().path) == first
        assert len(counted.asked) == n

    def test_pays_for_no_point_twice_within_a_run(self, study, counted):
        """Twelve runs in four two-level factors hold some settings twice."""
        study()
        assert len(counted.asked) == len(set(counted.asked))

    @pytest.mark.parametrize("n", [0, 5, 15, 35, 55])
    def test_after_an_interruption_ends_as_if_there_had_been_none(self, n, study, counted):
        whole = reproducible(study("whole").path)
        settings = set(counted.asked)
        counted.asked.clear()

        def trouble(point):
            if len(counted.asked) == n:
                raise KeyboardInterrupt

        Counted.trouble = staticmethod(trouble)
        with pytest.raises(KeyboardInterrupt):
            study("broken")
        assert len(counted.asked) == n
        Counted.trouble = staticmethod(lambda point: None)
        assert reproducible(study("broken").path) == whole
        assert set(counted.asked) == settings
        assert len(counted.asked) == len(settings), "a point was paid for twice"

    def test_fresh_asks_everything_again(self, study, counted):
        first = reproducible(study().path)
        n = len(counted.asked)
        assert reproducible(study(fresh=True).path) == first
        assert len(counted.asked) == 2 * n

    def test_a_finished_folder_can_be_moved(self, smoke, tmp_path):
        moved = Path(shutil.copytree(smoke.path, tmp_path / "elsewhere"))
        assert read_run(moved).path == moved

    def test_another_version_of_the_oracle_is_another_oracle(self, study, counted, monkeypatch):
        study()
        n = len(counted.asked)
        monkeypatch.setattr(counted, "version", "2")
        study()
        assert len(counted.asked) == 2 * n


class TestScreening:
    def test_an_inactive_factor_is_left_out_of_the_fit_but_not_of_the_model(self, study):
        outcome = study()
        assert outcome.kept == ("a", "b", "c")
        fit = outcome.fit_runs.design
        assert_array_equal(fit.physical[:, D], np.full(len(fit), 15.0))
        assert all(np.ptp(fit.physical[:, i]) > 0.0 for i in (0, 1, 2))
        assert outcome.model.factors.names == ("a", "b", "c", "d")
        assert not any("d" in label.replace("^", ":").split(":") for label in outcome.model.terms.labels)
        assert outcome.model.jacobian(outcome.model.factors.centre[None])[0, :, D].tolist() == [0.0, 0.0]
        # Drawn from its whole range, 10 to 20, in the validation: the price of leaving it out would show.
        drawn = outcome.validation_runs.design.physical[:, D]
        assert drawn.min() < 13.0
        assert drawn.max() > 17.0

    def test_the_polynomial_is_found_exactly(self, study):
        """u = 1 + 2a + 3b + 0.1ab and v = 20c − b, coded: b = 2 + b', c = −0.05 + 0.15c'."""
        model = study().model
        found = {
            (label, r.name): model.coefficients[i, j]
            for i, label in enumerate(model.terms.labels)
            for j, r in enumerate(model.responses)
            if model.coefficients[i, j] != 0.0
        }
        one = model.terms.labels[int(np.flatnonzero(model.terms.degrees == 0)[0])]
        expected = {
            (one, "u"): 7.0, ("a", "u"): 2.2, ("b", "u"): 3.0, ("a:b", "u"): 0.1,
            (one, "v"): -3.0, ("b", "v"): -1.0, ("c", "v"): 3.0,
        }  # fmt: skip
        assert set(found) == set(expected)
        for key, value in expected.items():
            assert found[key] == pytest.approx(value, rel=1e-10), key

    def test_keep(self, study):
        outcome = study(overrides=['screening.keep=["d"]'])
        assert outcome.kept == ("a", "b", "c", "d")
        assert np.ptp(outcome.fit_runs.design.physical[:, D]) == pytest.approx(10.0)
        assert json.loads((outcome.path / "model.json").read_text())["provenance"]["kept_factors"] == list("abcd")

    HIDING = ("screening.design.n_runs=12", "screening.design.n_centre=1", "screening.tolerance=0.01")

    def test_what_may_act_behind_main_effects_is_kept(self, study):
        """a:b leaves 3 % of u to the dummy columns: no factor can be ruled out then, d included."""
        outcome = study(overrides=self.HIDING)
        assert outcome.screening.active_factors == ("a", "b", "c")
        assert outcome.kept == ("a", "b", "c", "d")
        assert len(outcome.screening_runs) == 13

    def test_the_foldover_is_run_where_it_is_asked_for_and_allowed(self, study, counted):
        outcome = study(overrides=[*self.HIDING, "screening.follow=true"])
        assert len(outcome.screening_runs) == 25
        assert len(counted.asked) == len(set(counted.asked))
        folded = outcome.screening_runs.design.coded
        assert_array_equal(folded[12:24], -folded[:12])
        back = read_run(outcome.path)
        assert len(back.screening_runs) == 25
        assert back.kept == outcome.kept

    def test_the_foldover_is_not_run_where_main_effects_suffice(self, study):
        outcome = study(overrides=[*self.HIDING[:2], "screening.follow=true", "screening.tolerance=0.1"])
        assert len(outcome.screening_runs) == 13
        assert outcome.kept == ("a", "b", "c")

    def test_nobody_acts(self, study, counted):
        with pytest.raises(InputError, match=r"no response moves .* screening\.keep"):
            study(oracle="all_still")

    def test_the_fill_is_sized_from_the_factors_that_act(self, study):
        # 10 terms of degree 2 in 3 factors, half as many again, up to a multiple of 6 levels.
        assert len(study("three").fit_runs) == 18
        # 15 terms in 4 factors.
        assert len(study("four", overrides=['screening.keep=["d"]']).fit_runs) == 24
        # 4 terms without interactions and squares, up to a multiple of 5.
        few = study("few", overrides=["fit.degree=1", "fit.interactions=false", "fit.design.levels=5"])
        assert len(few.fit_runs) == 10

    def filled_by(self, folder: Path, *settings: str) -> pipeline.Outcome:
        """The counted study with another filling design than the uniform one."""
        config = folder / "study.toml"
        config.write_text(config_text(), encoding="utf-8")
        return pipeline.run(config, folder / "out", ["validation.n_runs=20", *settings])

    @pytest.mark.parametrize("method", ["definitive_screening", "d_optimal", "sobol", "halton", "latin_hypercube"])
    def test_any_design_of_three_levels_fills(self, counted, tmp_path, no_report, method):
        outcome = self.filled_by(tmp_path, f"fit.design.method={method}")
        assert outcome.kept == ("a", "b", "c")
        assert max(e.max_relative for e in outcome.model.validation) < 1e-9

    def test_a_full_factorial_fills(self, counted, tmp_path, no_report):
        outcome = self.filled_by(tmp_path, "fit.design.method=full_factorial", "fit.design.levels=3")
        assert len(outcome.fit_runs) == 27

    def test_a_full_factorial_for_another_number_of_factors_is_refused(self, counted, tmp_path, no_report):
        settings = ["fit.design.method=full_factorial", 'fit.design.levels="3, 3, 3, 3"']
        with pytest.raises(InputError, match=r"fit\.design: levels '3, 3, 3, 3' of a full factorial are for 4 factors"):
            self.filled_by(tmp_path, *settings)

    def test_a_given_n_runs_is_kept(self, study):
        assert len(study(overrides=["fit.design.n_runs=24"]).fit_runs) == 24


class TestFailures:
    def fails_in_the_fit(self, point) -> None:
        """Only the fit holds d at its centre; there a's highest level fails."""
        if point[D] == 15.0 and point[A] > 0.9:
            raise ArithmeticError("the solver gave up")

    def test_within_the_fraction_are_tolerated(self, study):
        Counted.trouble = staticmethod(self.fails_in_the_fit)
        outcome = study(overrides=["oracle.max_failed_fraction=0.2", "fit.design.n_runs=24"])
        failed = ~outcome.fit_runs.ok
        assert failed.sum() == 4
        assert_array_equal(outcome.fit_runs.design.physical[failed, A], 1.0)
        header, rows = table(outcome.path / "fit" / "runs.csv")
        for row, bad in zip(rows, failed, strict=True):
            told = dict(zip(header, row, strict=True))
            assert told["status"] == ("crashed" if bad else "ok")
            assert told["reason"] == ("ArithmeticError: the solver gave up" if bad else "")
            assert (told["u[m]"] == "") == bad
        assert all(e.max_relative < 1e-9 for e in outcome.model.validation), "a failed run poisoned the fit"

    def test_beyond_the_fraction_are_not(self, study, counted):
        Counted.trouble = staticmethod(self.fails_in_the_fit)
        with pytest.raises(
            TooManyFailures, match=r"fit: 4 of 24 runs failed: run \d+: crashed .*max_failed_fraction = 0.1"
        ):
            study(overrides=["oracle.max_failed_fraction=0.1", "fit.design.n_runs=24"])

    def test_fewer_runs_left_than_terms(self, study):
        def trouble(point):
            if point[D] == 15.0 and point[A] > 0.2:
                raise ArithmeticError("the solver gave up")

        Counted.trouble = staticmethod(trouble)
        with pytest.raises(TooManyFailures, match=r"8 runs are left of the 10 that the fit needs: 8 of 16 runs failed"):
            study(overrides=["oracle.max_failed_fraction=0.9", "fit.design.n_runs=16", "fit.design.levels=4"])

    def test_in_validation_and_inversion_are_left_out_of_the_errors(self, study):
        def trouble(point):
            if point[D] not in (10.0, 15.0, 20.0) and point[A] > 0.5:
                raise ArithmeticError("the solver gave up")

        Counted.trouble = staticmethod(trouble)
        outcome = study(overrides=["oracle.max_failed_fraction=0.9"])
        n_ok = int(outcome.validation_runs.ok.sum())
        assert 0 < n_ok < 20
        assert {e.n_runs for e in outcome.model.validation} == {n_ok}
        assert len(outcome.round_trip.targets) == n_ok
        again = read_run(outcome.path)
        assert again.validation_runs.status == outcome.validation_runs.status
        assert again.validation_runs.reasons == outcome.validation_runs.reasons
        assert Status.CRASHED in again.validation_runs.status

    def test_are_remembered_with_their_reason(self, study, counted):
        Counted.trouble = staticmethod(self.fails_in_the_fit)
        overrides = ["oracle.max_failed_fraction=0.2", "fit.design.n_runs=24"]
        first = reproducible(study(overrides=overrides).path)
        assert reproducible(study(overrides=overrides).path) == first

    def test_reasons_with_commas_quotes_and_newlines_survive(self, study):
        reason = 'said "no", then\nwent away; naïve µ'

        def trouble(point):
            if point[D] == 15.0 and point[A] > 0.9:
                raise ArithmeticError(reason)

        Counted.trouble = staticmethod(trouble)
        outcome = study(overrides=["oracle.max_failed_fraction=0.2", "fit.design.n_runs=24"])
        again = read_run(outcome.path)
        assert again.fit_runs.reasons == outcome.fit_runs.reasons
        assert f"ArithmeticError: {reason}" in again.fit_runs.reasons


class TestEdges:
    def test_a_response_that_never_moves(self, study):
        outcome = study(oracle="one_still")
        assert outcome.screening.active_on("v") == ()
        assert outcome.model.validation[1].max_abs < 1e-15
        assert_allclose(outcome.model.predict(outcome.model.factors.centre[None])[0, 1], 0.1, rtol=1e-15)
        assert read_run(outcome.path).model.validation == outcome.model.validation

    def test_no_response_that_moves(self, study):
        outcome = study(oracle="all_still", overrides=['screening.keep=["a"]'])
        assert_allclose(outcome.model.predict(outcome.model.factors.centre[None])[0], [0.3, 0.1], rtol=1e-15)
        assert outcome.model.certificate.verdict is not Verdict.CERTIFIED

    def test_every_target_out_of_reach(self, study):
        outcome = study(oracle="unreachable", overrides=["fit.degree=1"])
        assert outcome.round_trip.n_refused == 20
        assert len(outcome.round_trip.answers) == 0
        again = read_run(outcome.path)
        assert again.round_trip.n_refused == 20
        assert len(again.round_trip.answers) == 0

    def test_more_responses_than_factors_are_not_inverted(self, study, counted):
        """A stage that could only refuse is left out, and with it its folder and the inverse of the code."""
        outcome = study(oracle="crowded")
        assert outcome.round_trip is None
        assert outcome.obstacle.startswith("4 responses follow from 3 factors")
        paid = sum(len(runs) for runs in (outcome.screening_runs, outcome.fit_runs, outcome.validation_runs))
        assert len(counted.asked) <= paid
        assert not (outcome.path / "inversion").exists()
        assert "inversion" not in outcome.seconds
        assert all(e.max_relative < 1e-9 for e in outcome.model.validation)
        assert outcome.obstacle in outcome.model.certificate.reason
        assert "study_inverse" not in (outcome.path / "exports" / "c99" / "study.h").read_text(encoding="ascii")
        again = read_run(outcome.path)
        assert again.round_trip is None
        assert again.model.validation == outcome.model.validation

    def test_an_inversion_left_over_from_before_is_removed(self, study):
        outcome = study(oracle="crowded")
        (outcome.path / "inversion").mkdir()
        (outcome.path / "inversion" / "runs.csv").write_text("old")
        study(oracle="crowded")
        assert not (outcome.path / "inversion").exists()

    def test_what_is_not_inverted_is_not_certified(self, study):
        outcome = study(oracle="crowded", overrides=["require.certified_inverse=true"])
        assert outcome.shortfalls == (f"the inverse is not certified (verdict: refuted; {outcome.obstacle})",)

    def test_more_affine_responses_than_factors_are_inverted(self, study):
        """On a line through the oracle's own answers the closed form is exact."""
        outcome = study(oracle="one_still", overrides=["fit.degree=1"])
        assert outcome.round_trip is not None

    def test_shortfalls_are_told_after_everything_is_written(self, study):
        outcome = study(overrides=["require.max_relative_error=1e-300"])
        assert [s.split(":")[0] for s in outcome.shortfalls] == ["u", "v"]
        assert all("exceeds require.max_relative_error = 1e-300" in s for s in outcome.shortfalls)
        assert (outcome.path / "exports" / "c99" / "study.c").is_file()
        assert read_run(outcome.path).shortfalls == outcome.shortfalls

    def test_progress_tells_every_stage(self, study):
        told = []
        study(progress=lambda stage, done, total: told.append((stage, done, total)))
        for stage, total in (("screening", 12), ("fit", 18), ("validation", 20)):
            mine = [(d, t) for s, d, t in told if s == stage]
            assert mine[-1] == (total, total)
            assert [d for d, _ in mine] == sorted(d for d, _ in mine)


class TestReadRun:
    def test_gives_the_nouns_of_the_run(self, smoke):
        again = read_run(smoke.path)
        assert again.study.config == smoke.study.config
        assert again.kept == smoke.kept
        assert again.shortfalls == smoke.shortfalls
        for name in ("screening_runs", "fit_runs", "validation_runs"):
            ours, theirs = getattr(smoke, name), getattr(again, name)
            assert_array_equal(theirs.design.coded, ours.design.coded)
            assert_array_equal(theirs.design.dummies, ours.design.dummies)
            assert_array_equal(theirs.values, ours.values)
            assert theirs.status == ours.status
            assert theirs.reasons == ours.reasons
            assert theirs.responses == ours.responses
            assert theirs.design.method == ours.design.method
            assert theirs.design.space == ours.design.space
        assert_array_equal(again.screening.effects.values, smoke.screening.effects.values)
        assert_array_equal(again.screening.active, smoke.screening.active)
        assert_array_equal(again.model.coefficients, smoke.model.coefficients)
        assert again.model.validation == smoke.model.validation
        assert again.model.certificate == smoke.model.certificate
        assert again.model.provenance == smoke.model.provenance
        assert again.round_trip.errors == smoke.round_trip.errors
        assert again.round_trip.inversion.status == smoke.round_trip.inversion.status
        assert_array_equal(again.round_trip.inversion.settings, smoke.round_trip.inversion.settings)
        assert_array_equal(again.round_trip.answers.values, smoke.round_trip.answers.values)

    def test_no_run_folder(self, tmp_path):
        with pytest.raises(InputError, match="is not a run folder"):
            read_run(tmp_path)


class TestExports:
    def test_are_generated_from_model_json(self, smoke):
        from surrogates import exports

        texts = exports.get("c99").render(load(smoke.path / "model.json"), "smoke")
        written = contents(smoke.path / "exports" / "c99")
        assert {n: t.encode() for n, t in texts.items()}.items() <= written.items()
        assert written["model.json"] == (smoke.path / "model.json").read_bytes()

    @pytest.mark.skipif(
        CC is None, reason="NO C COMPILER: gcc, cc and clang were not found; the exports were not compiled"
    )
    @pytest.mark.parametrize("which", ["smoke", "hexflex"])
    def test_compile_without_a_warning(self, which, request, tmp_path):
        folder = request.getfixturevalue(which).path / "exports" / "c99"
        flags = ["-std=c99", "-Wall", "-Wextra", "-Wconversion", "-pedantic", "-Werror"]
        argv = [str(CC), *flags, "-c", str(folder / f"{which}.c"), "-o", str(tmp_path / "o.o")]
        done = subprocess.run(argv, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        assert done.stderr == ""


IN_PLANE, OUT_OF_PLANE = {"T1D1", "T2D1", "T3D1"}, {"T1D2", "T2D2", "T3D2"}
ACTIVE = {
    "x": IN_PLANE,
    "y": {"T2D1", "T3D1"},
    "z": OUT_OF_PLANE,
    "theta_x": OUT_OF_PLANE,
    "theta_y": {"T2D2", "T3D2"},
    "theta_z": IN_PLANE,
}
"""Who acts on what, as physics says (issue 2, "Screening")."""


class TestHexFlex:
    """The main job, end to end."""

    def test_screening_finds_who_acts(self, hexflex):
        assert {r: set(hexflex.screening.active_on(r)) for r in ACTIVE} == ACTIVE
        assert hexflex.screening.flagged_dummies == {}
        assert len(hexflex.screening_runs) == 12
        assert len(hexflex.screening.effects.names) == 11

    def test_the_effects_file_says_the_same(self, hexflex):
        header, rows = table(hexflex.path / "screening" / "effects.csv")
        told = [dict(zip(header, row, strict=True)) for row in rows]
        assert len(told) == 6 * 11
        found = {r: {t["contrast"] for t in told if t["response"] == r and t["active"] == "True"} for r in ACTIVE}
        assert found == ACTIVE

    def test_terms_are_exactly_linear(self, hexflex):
        model = hexflex.model
        assert {r.name: set(model.terms_of(j)) for j, r in enumerate(model.responses)} == ACTIVE
        assert model.is_affine
        assert len(hexflex.study.candidates(6)) == 28, "the linear terms were chosen among all quadratic ones"

    @pytest.mark.parametrize("which", ["fitted model", "oracle"])
    def test_reproduces_the_published_map(self, which, hexflex):
        rows, columns, published = hexflex_map()
        if which == "oracle":
            oracle = oracles.get("hexflex")
            space, responses = oracle.factors, oracle.responses
            ours = oracle.jacobian(space.centre[None])[0]
        else:
            space, responses = hexflex.model.factors, hexflex.model.responses
            ours = hexflex.model.jacobian(space.centre[None])[0]
        names = {
            "x_um": "x",
            "y_um": "y",
            "z_um": "z",
            "thx_urad": "theta_x",
            "thy_urad": "theta_y",
            "thz_urad": "theta_z",
        }
        assert [names[r] for r in rows] == [r.name for r in responses]
        assert tuple(columns) == space.names
        assert [(r.unit, r.shown_scale) for r in responses] == [("m", 1e6)] * 3 + [("rad", 1e6)] * 3
        ours = 1e6 * ours
        zero = published == 0.0
        assert (~zero).sum() == 16
        assert np.abs(ours[~zero] / published[~zero] - 1.0).max() <= 0.002
        largest = np.abs(published).max(axis=1, keepdims=True)
        assert (np.abs(ours) / largest)[zero].max() < 1e-6

    def test_the_fill_is_a_balanced_uniform_design(self, hexflex):
        coded = numbers(hexflex.path / "fit" / "design.csv", [f"{n}[coded]" for n in hexflex.model.factors.names])
        assert coded.shape == (30, 6)
        for column in coded.T:
            levels, counts = np.unique(np.round(column, 9), return_counts=True)
            assert_allclose(levels, [-1.0, -0.6, -0.2, 0.2, 0.6, 1.0], atol=1e-9)
            assert counts.tolist() == [5] * 6
        assert level_discrepancy_squared(coded) <= 0.0295

    def test_errors_on_a_thousand_fresh_runs(self, hexflex):
        model = load(hexflex.path / "model.json")
        runs = hexflex.path / "validation" / "runs.csv"
        settings, truth = numbers(runs, list(model.factors.labels)), numbers(runs, [r.label for r in model.responses])
        assert len(settings) == 1000
        fitted = hexflex.fit_runs.design.physical
        assert not (settings[:, None] == fitted[None]).all(axis=2).any(), "a validation run was used in the fit"
        error = np.abs(model.predict(settings) - truth).max(axis=0) / np.ptp(truth, axis=0)
        assert error.max() <= 1e-9
        assert all(e.n_runs == 1000 and e.max_relative <= 1e-9 for e in model.validation)

    def test_a_thousand_poses_come_back(self, hexflex):
        labels = [r.label for r in hexflex.model.responses]
        targets = numbers(hexflex.path / "inversion" / "targets.csv", labels)
        answers = numbers(hexflex.path / "inversion" / "runs.csv", labels)
        assert targets.shape == answers.shape == (1000, 6)
        assert hexflex.round_trip.n_refused == 0
        assert (np.abs(answers - targets).max(axis=0) / np.ptp(targets, axis=0)).max() <= 1e-9
        assert all(e.n_runs == 1000 and e.max_relative <= 1e-9 for e in hexflex.round_trip.errors)

    def test_the_inverse_is_certified(self, hexflex):
        certificate = load(hexflex.path / "model.json").certificate
        assert certificate.verdict is Verdict.CERTIFIED
        assert 1.0 <= certificate.condition < 10.0

    def test_meets_what_its_config_requires(self, hexflex):
        assert hexflex.study.config.require.max_relative_error == 0.001
        assert hexflex.study.config.require.certified_inverse
        assert hexflex.shortfalls == ()

    @pytest.mark.parametrize("package", ["pipeline", "surrogates"])
    def test_nothing_is_wired_to_it(self, package):
        words = re.compile(r"hexflex|\bT[123]D[12]\b|theta_[xyz]|nano-?manipulator", re.IGNORECASE)
        files = [p for p in (ROOT / package).rglob("*") if p.suffix in {".py", ".html", ".js", ".css", ".json"}]
        assert len(files) > 10
        found = [
            f"{path.relative_to(ROOT)}:{i}: {line.strip()}"
            for path in files
            for i, line in enumerate(path.read_text(encoding="utf-8").splitlines(), start=1)
            if words.search(line)
        ]
        assert found == []

"""A study that adds terms and runs until its required error holds (``require.max_runs``)."""

import json
import sqlite3
from dataclasses import dataclass, replace
from math import log
from typing import ClassVar

import numpy as np
import pytest
from numpy.testing import assert_array_equal

import pipeline
from experiments import oracles
from pipeline import InputError, TooManyFailures, load_config, read_run, resolve, stages
from pipeline.cli import main
from pipeline.report import report_html
from pipeline.rounds import BUDGET, MET, RUNS, STALLED, TERMS, UNTRUE, Round, read_rounds, rounds_csv, runs_needed
from pipeline.store import PointStore
from surrogates import certify, dumps, load
from tests.pipeline.cases import SMALL, Counted, D, config_text, reproducible

BEGIN = ("fit.design.n_runs=18", "validation.n_runs=40", "screening.tolerance=0.5")


@dataclass(frozen=True)
class Curved(Counted):
    """Smooth, and no polynomial."""

    name: ClassVar[str] = "curved"

    def respond(self, point: np.ndarray) -> tuple[float, ...]:
        super().respond(point)
        a, b, c, _ = point
        return float(np.exp(0.8 * a + 0.3 * b)), float(np.sin(4.0 * c + 0.5 * a) - 0.3 * b)


@dataclass(frozen=True)
class Kinked(Counted):
    """Two kinks, which no polynomial follows."""

    name: ClassVar[str] = "kinked"

    def respond(self, point: np.ndarray) -> tuple[float, ...]:
        u, v = super().respond(point)
        return u + 3.0 * abs(point[0] - 0.13), v


@dataclass(frozen=True)
class Hidden(Counted):
    """The fourth factor acts as an even function, which two levels cannot show: it is not kept."""

    name: ClassVar[str] = "hidden"

    def respond(self, point: np.ndarray) -> tuple[float, ...]:
        u, v = super().respond(point)
        return u + 0.02 * (point[D] - 15.0) ** 2, v


@pytest.fixture
def study(counted, tmp_path, no_report, monkeypatch):
    """Run an oracle's study in folder `name`: 18 runs and a quadratic, unless told otherwise."""

    def hasty(store):
        # No waiting for the disk: these tests stop studies, not machines.
        db = sqlite3.connect(store.path)
        db.execute("PRAGMA synchronous = OFF")
        return db

    monkeypatch.setattr(PointStore, "_connect", hasty)
    for cls in (Curved, Kinked, Hidden):
        oracles.register(cls)

    def run(oracle="curved", error=0.01, most: int | None = 60, *overrides, name="out", **settings) -> pipeline.Outcome:
        config = tmp_path / f"{oracle}.toml"
        config.write_text(config_text(oracle), encoding="utf-8")
        asked = [f"require.max_relative_error={error}", *([] if most is None else [f"require.max_runs={most}"])]
        return pipeline.run(config, tmp_path / name, [*SMALL, *BEGIN, *asked, *overrides], **settings)

    yield run
    for cls in (Curved, Kinked, Hidden):
        oracles._REGISTERED.pop(cls.name, None)


def resolved(tmp_path, *overrides, oracle="counted"):
    config = tmp_path / "study.toml"
    config.write_text(config_text(oracle), encoding="utf-8")
    return resolve(load_config(config, [*SMALL, *overrides]))


def worst(outcome) -> float:
    """Largest relative error on the validation runs in the folder, by model.json and the definition alone."""
    done = outcome.validation_runs.completed()
    wrong = np.abs(load(outcome.path / "model.json").predict(done.design.physical) - done.values)
    return float((wrong.max(axis=0) / np.ptp(done.values, axis=0)).max())


class TestNothingToDo:
    """Regression: what holds, or has no budget, is left as it is."""

    def test_met_as_configured(self, study, counted):
        plain, grown = study("counted", most=None, name="plain"), study("counted", name="grown")
        n = len(plain.screening_runs)
        assert [(r.runs, r.then) for r in grown.rounds] == [(18, MET)]
        assert grown.shortfalls == plain.shortfalls == ()
        assert_array_equal(grown.fit_runs.design.coded, plain.fit_runs.design.coded)
        assert_array_equal(grown.validation_runs.values, plain.validation_runs.values)
        assert_array_equal(grown.model.coefficients, plain.model.coefficients)
        assert n == 12

    def test_without_a_budget_nothing_grows(self, study):
        outcome = study(error=1e-9, most=None)
        assert len(outcome.fit_runs) == 18
        assert "more runs in fit.design.n_runs" in outcome.shortfalls[0]
        assert not (outcome.path / "fit" / "rounds.csv").exists()
        assert "max_runs" not in (outcome.path / "config.toml").read_text()

    def test_without_a_budget_the_model_is_the_stages_one_after_the_other(self, study):
        """model.json, byte for byte: fitted, judged, certified, and nothing else said of where it comes from."""
        outcome = study(most=None)
        fitted = stages.fitted(outcome.study, outcome.kept, outcome.fit_runs).model
        judged = stages.validated(outcome.study, fitted, outcome.validation_runs)
        origin = stages.provenance(outcome.study, outcome.kept)
        whole = replace(judged, certificate=certify(fitted), provenance=origin)
        assert dumps(whole) == (outcome.path / "model.json").read_text(encoding="utf-8")
        assert not {"fit_degree", "fit_selection"} & set(outcome.model.provenance)


class TestRounds:
    """Validation: what is added, in which order, and what is claimed at the end."""

    def test_terms_come_before_runs(self, study):
        """With no runs to add, a wider choice of terms alone brings the error down."""
        before = study(error=0.9, most=18, name="before")
        outcome = study(error=0.5 * worst(before), most=18)
        assert [r.step for r in outcome.rounds] == ["as configured", TERMS]
        assert outcome.rounds[0].then == TERMS
        assert_array_equal(outcome.fit_runs.design.coded, before.fit_runs.design.coded)
        assert outcome.rounds[1].selection == "evidence"
        assert outcome.rounds[1].loo < outcome.rounds[0].loo
        assert outcome.rounds[1].then == MET
        assert worst(outcome) < 0.5 * worst(before)
        assert outcome.model.provenance["fit_degree"] == "auto"
        assert outcome.fit.selection == "evidence"

    def test_met_after_runs_were_added(self, study, counted):
        outcome = study(error=1e-4, most=80)
        assert outcome.shortfalls == ()
        assert outcome.rounds[-1].then == MET
        assert 18 < len(outcome.fit_runs) == outcome.rounds[-1].runs <= 80
        assert worst(outcome) <= 1e-4
        assert outcome.rounds[-1].error == pytest.approx(worst(outcome))
        assert [r.runs for r in outcome.rounds] == sorted(r.runs for r in outcome.rounds)
        assert {r.then for r in outcome.rounds[:-1]} == {TERMS, RUNS}
        first = stages.fill_design(outcome.study, outcome.kept)
        assert_array_equal(outcome.fit_runs.design.coded[:18], first.coded)
        assert len(counted.asked) == len(set(counted.asked)), "a run was paid for twice"

    def test_the_last_judge_was_never_asked_before(self, study):
        outcome = study(error=1e-4, most=80)
        seen = stages.validation_design(outcome.study, 0).physical
        last = outcome.validation_runs.design.physical
        assert len(last) == 40
        assert not (last[:, None] == seen[None]).all(axis=2).any()
        assert not (last[:, None] == outcome.fit_runs.design.physical[None]).all(axis=2).any()

    def test_rounds_are_not_steered_by_the_judge(self, study):
        """Looked at before the end only where the leave-one-out error says that the requirement may hold."""
        outcome = study(error=1e-4, most=80)
        for one in outcome.rounds[1:-1]:
            assert one.expected is not None
            assert (one.error is None) == (one.expected > 1e-4)

    def test_the_budget_ends(self, study):
        outcome = study(error=1e-12, most=40)
        assert len(outcome.fit_runs) == 40
        assert outcome.rounds[-1].then == BUDGET
        assert outcome.rounds[-1].error == pytest.approx(worst(outcome))
        assert all("all 40 runs of require.max_runs are used" in s for s in outcome.shortfalls)

    def test_more_runs_that_do_not_help_are_not_added(self, study):
        outcome = study("kinked", 1e-3, 2000)
        assert outcome.rounds[-1].then == STALLED
        assert len(outcome.fit_runs) < 2000
        assert "more no longer helped" in outcome.shortfalls[0]

    def test_what_leaving_out_cannot_see(self, study):
        """The factor that was dropped is at its centre in all runs of the fit: no number of them shows it."""
        outcome = study("hidden", 0.01, 2000)
        assert outcome.kept == ("a", "b", "c")
        assert outcome.rounds[-1].then == UNTRUE
        assert len(outcome.fit_runs) == 30
        assert "see screening.keep" in outcome.shortfalls[0]
        mended = study("hidden", 0.01, 2000, 'screening.keep=["d"]', name="mended")
        assert mended.shortfalls == ()

    def test_failed_runs_among_those_added(self, study):
        def trouble(point):
            if point[D] == 15.0 and point[0] > 0.9:
                raise ArithmeticError("the solver gave up")

        Counted.trouble = staticmethod(trouble)
        outcome = study("curved", 1e-12, 30, "oracle.max_failed_fraction=0.4")
        assert len(outcome.fit_runs) == 30
        assert 0 < (~outcome.fit_runs.ok[18:]).sum() < 12
        assert outcome.rounds[-1].then == BUDGET
        with pytest.raises(TooManyFailures, match=r"fit: \d+ of 18 runs failed"):
            study("curved", 1e-12, 30, "oracle.max_failed_fraction=0.01", name="strict")

    @pytest.mark.parametrize("method", ["sobol", "halton", "random"])
    def test_sequences_grow_too(self, study, counted, method):
        outcome = study("curved", 1e-12, 30, f"fit.design={{method='{method}', n_runs=18}}")
        assert len(outcome.fit_runs) == 30
        assert len(counted.asked) == len(set(counted.asked))


class TestResuming:
    @pytest.mark.parametrize("n", [12, 31, 75, 92, 120])
    def test_after_an_interruption_ends_as_if_there_had_been_none(self, n, study, counted):
        whole = reproducible(study(error=1e-3, name="whole").path)
        settings = set(counted.asked)
        assert len(settings) > 120
        counted.asked.clear()

        def trouble(point):
            if len(counted.asked) == n:
                raise KeyboardInterrupt

        Counted.trouble = staticmethod(trouble)
        with pytest.raises(KeyboardInterrupt):
            study(error=1e-3, name="broken")
        Counted.trouble = staticmethod(lambda point: None)
        assert reproducible(study(error=1e-3, name="broken").path) == whole
        assert set(counted.asked) == settings
        assert len(counted.asked) == len(settings), "a point was paid for twice"

    def test_a_finished_folder_stays_whole_while_it_is_run_again(self, study, monkeypatch):
        outcome = study(error=1e-3)
        files = reproducible(outcome.path)

        def stop(*_):
            raise KeyboardInterrupt

        monkeypatch.setattr(stages, "grown_design", stop)
        with pytest.raises(KeyboardInterrupt):
            study(error=1e-3)
        assert reproducible(outcome.path) == files

    def test_is_read_back(self, study):
        outcome = study(error=1e-12, most=40)
        again = read_run(outcome.path)
        assert again.rounds == outcome.rounds
        assert again.shortfalls == outcome.shortfalls
        assert again.fit == outcome.fit
        assert_array_equal(again.fit_runs.values, outcome.fit_runs.values)
        assert_array_equal(again.validation_runs.design.coded, outcome.validation_runs.design.coded)
        assert again.model.validation == outcome.model.validation

    def test_a_damaged_record_is_refused(self, study):
        record = study(error=1e-3).path / "fit" / "rounds.csv"
        text = record.read_text()
        record.write_text(text.replace("evidence", "evidence,"))
        with pytest.raises(InputError, match=r"rounds\.csv: row 2 has 10 cells"):
            read_run(record.parents[1])
        record.unlink()
        with pytest.raises(InputError, match=r"rounds\.csv is missing .* run the study again"):
            read_run(record.parents[1])


class TestTelling:
    def test_exit_code_4_and_the_table(self, study, tmp_path, capsys):
        study(error=0.9, most=None)  # writes the config file
        settings = [*SMALL, *BEGIN, "require.max_relative_error=1e-12", "require.max_runs=40"]
        argv = ["run", str(tmp_path / "curved.toml"), "--out", str(tmp_path / "four")]
        assert main([*argv, *(word for one in settings for word in ("--set", one))]) == 4
        out, err = capsys.readouterr()
        assert "How the fit grew" in out
        assert "12 runs added" in out
        assert "10 runs added" in out
        assert "all of require.max_runs used" in out
        assert "required but not met: u: maximum relative error" in err
        assert "all 40 runs of require.max_runs are used" in err

    def test_the_report_shows_the_rounds(self, study):
        outcome = study(error=1e-3)
        provenance = json.loads((outcome.path / "provenance.json").read_text())
        page = report_html(outcome, provenance)
        assert "How the fit grew" in page
        assert all(one.step in page for one in outcome.rounds)
        assert "a degree chosen for each response, at most 5, with interactions" in page
        plain = study(error=0.9, most=None, name="plain")
        assert "How the fit grew" not in report_html(plain, provenance)

    def test_plan_says_how_many_runs_there_may_be(self, study, tmp_path, capsys):
        study(error=0.9, most=None)
        settings = [*SMALL, *BEGIN, "require.max_relative_error=1e-3", "require.max_runs=60"]
        assert main(["plan", str(tmp_path / "curved.toml"), *(w for one in settings for w in ("--set", one))]) == 0
        out = " ".join(capsys.readouterr().out.split())
        assert "The fit may grow to 60 runs" in out
        # 12 to screen, 60 to fit; 18, wider, 30, 48, 60: five looks of 40, and 40 for the inverse.
        assert f"At most {12 + 60 + 6 * 40} runs in all" in out


class TestSizes:
    def test_grow_by_half_in_balance_up_to_the_budget(self, counted, tmp_path):
        grown = resolved(tmp_path, "require.max_relative_error=0.1", "require.max_runs=160", "fit.design.n_runs=18")
        assert grown.sizes(18) == (30, 48, 72, 108, 160)
        assert grown.sizes(160) == ()
        assert grown.sizes(150) == (160,)

    def test_none_without_a_budget(self, counted, tmp_path):
        assert resolved(tmp_path).sizes(18) == ()
        assert resolved(tmp_path).most_looks == 1

    def test_levels_come_between_where_there_are_too_few(self, counted, tmp_path):
        """Two factors on six levels have 36 settings; 60 runs there would repeat themselves."""
        asked = ("require.max_relative_error=0.1", "require.max_runs=60", "fit.design.n_runs=18")
        grown = resolved(tmp_path, *asked, "fit.design.budget=20000")
        first = stages.fill_design(grown, ("a", "b"))
        more = stages.grown_design(grown, ("a", "b"), first, 60, 1)
        assert_array_equal(more.coded[:18], first.coded)
        assert len(np.unique(np.round(more.coded, 9), axis=0)) == 60
        assert set(np.unique(np.round(more.coded[:, 0], 9))) == set(np.round(np.linspace(-1.0, 1.0, 11), 9))

    @pytest.mark.parametrize("method", ["uniform", "sobol", "halton", "random"])
    def test_an_addition_keeps_every_bit_of_what_was_run(self, counted, tmp_path, method):
        asked = (
            "require.max_relative_error=0.1",
            "require.max_runs=60",
            f"fit.design={{method='{method}', n_runs=18}}",
        )
        grown = resolved(tmp_path, *asked, *(("fit.design.budget=200",) if method == "uniform" else ()))
        kept = ("a", "c")
        first = stages.fill_design(grown, kept)
        more, again, other = (stages.grown_design(grown, kept, first, 30, number) for number in (1, 1, 2))
        assert (more.physical[:18] == first.physical).all()
        assert_array_equal(more.coded, again.coded)
        assert (more.coded == other.coded).all() == (method != "uniform")
        assert_array_equal(more.coded[:, D], np.zeros(30))


class TestRecord:
    def rounds(self, errors: dict[int, float], last: float) -> list[Round]:
        return [Round(i, "s", n, 3, "evidence", e, None, last, BUDGET) for i, (n, e) in enumerate(errors.items())]

    def test_survives_its_file(self):
        rounds = [
            Round(0, "as configured", 18, 2, "backward", 1 / 3, None, 0.1, TERMS),
            Round(1, TERMS, 18, 5, "evidence", np.inf, 2 / 3, None, BUDGET),
        ]
        assert list(read_rounds(rounds_csv(rounds), "here")) == rounds

    def test_a_cell_that_is_no_number(self):
        text = rounds_csv(self.rounds({10: 0.1}, 0.2)).replace("0.1", "much")
        with pytest.raises(InputError, match=r"here is damaged: 'much' is not a number"):
            read_rounds(text, "here")

    def test_no_round(self):
        with pytest.raises(InputError, match="here has no rounds"):
            read_rounds(rounds_csv([]), "here")

    def test_runs_needed_by_a_power(self):
        """Errors that fall as n⁻²: a hundredth of the error takes ten times the runs; a quarter takes twice."""
        rounds = self.rounds({n: 7.0 * n**-2.0 for n in (20, 30, 45, 70)}, 0.04)
        assert runs_needed(rounds, 0.01) == 140
        assert runs_needed(rounds, 0.04 / 99.0) in {690, 700}
        assert runs_needed(rounds, 0.04 / 101.0) is None, "more than ten times the runs is too far"

    def test_runs_needed_go_by_the_last_step_where_that_is_slower(self):
        rounds = self.rounds({20: 1.0, 40: 2.0**-4, 80: 2.0**-5}, 0.04)
        assert runs_needed(rounds, 0.02) == 160

    @pytest.mark.parametrize(
        "errors",
        [{20: 1.0, 40: 0.1}, {20: 1.0, 40: 0.9, 80: 0.8}, {20: 1.0, 40: 0.1, 80: 0.1}, {20: 1.0, 40: 0.0, 80: 0.0}],
        ids=["two sizes", "slow", "levelled off", "exact"],
    )
    def test_runs_needed_are_not_guessed(self, errors):
        assert runs_needed(self.rounds(errors, 0.04), 0.01) is None

    def test_runs_needed_are_those_of_the_cantilever(self):
        """Against a straight line through the logarithms, by hand."""
        errors = {30: 1e-3, 48: 2e-4, 72: 5e-5}
        slope = max(
            log(5e-5 / 2e-4) / log(72 / 48), np.polyfit(np.log([30, 48, 72]), np.log(list(errors.values())), 1)[0]
        )
        expected = 72 * (3e-4 / 1e-4) ** (-1.0 / slope)
        assert expected <= (runs_needed(self.rounds(errors, 3e-4), 1e-4) or 0) <= 1.1 * expected


class TestConfig:
    @pytest.mark.parametrize(
        ("settings", "sentence"),
        [
            (["require.max_runs=60"], r"require\.max_runs needs require\.max_relative_error"),
            (
                ["require.max_runs=17", "require.max_relative_error=0.1", "fit.design.n_runs=24"],
                r"max_runs = 17 is fewer than the 24 runs that the fit begins with; use 24 or more",
            ),
            (
                ["require.max_runs=20", "require.max_relative_error=0.1"],
                r"max_runs = 20 is fewer than the 24 runs that the fit begins with, if all 4 factors act",
            ),
            (
                ["require.max_runs=2001", "require.max_relative_error=0.1"],
                r"max_runs = 2001 is more than a uniform design can have; use 2000",
            ),
            (["require.max_runs=1", "require.max_relative_error=0.1"], r"require\.max_runs should be greater than"),
            (
                ["require.max_runs=2.5", "require.max_relative_error=0.1"],
                r"require\.max_runs should be a whole number, got 2\.5",
            ),
        ],
    )
    def test_refused(self, counted, tmp_path, settings, sentence):
        with pytest.raises(InputError, match=sentence):
            resolved(tmp_path, *settings)

    @pytest.mark.parametrize("method", ["latin_hypercube", "d_optimal", "definitive_screening"])
    def test_designs_that_nothing_can_be_added_to(self, counted, tmp_path, method):
        config = tmp_path / "study.toml"
        config.write_text(config_text(), encoding="utf-8")
        asked = [f"fit.design.method={method}", "require.max_relative_error=0.1", "require.max_runs=90"]
        with pytest.raises(InputError, match=rf"no runs can be added to fit\.design\.method = '{method}'; use one of"):
            resolve(load_config(config, asked))

"""A study whose screening lost runs: analysed and said so everywhere, or refused with the runs to make again."""

import csv
import io
import re

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from rich.console import Console

import pipeline
import pipeline.console
import pipeline.report.figures
from experiments import Status
from pipeline import read_run
from pipeline.cli import main
from pipeline.errors import TooManyFailures
from tests.pipeline.cases import SMALL, Counted, D, config_text, reproducible

TOLERANT = "oracle.max_failed_fraction=0.2"


def at_corners(*numbers: int):
    """Trouble at these runs of the screening, from 1, and nowhere else."""

    def trouble(point: np.ndarray) -> None:
        corners = [Counted.corners[i - 1] for i in numbers]
        if any(np.array_equal(point, corner) for corner in corners):
            raise ArithmeticError("the solver gave up")

    return staticmethod(trouble)


def twins(numbers) -> set[int]:
    """These runs, and others at the same settings: four factors can have one twice among 12 runs."""
    given = Counted.corners[[i - 1 for i in numbers]]
    return {i for i, corner in enumerate(Counted.corners, start=1) if (given == corner).all(axis=1).any()}


@pytest.fixture
def study(counted, tmp_path, monkeypatch):
    """Run the counted oracle's study in folder `name`; its report has words and no pictures, which take the time."""
    monkeypatch.setattr(pipeline.report.figures, "uri", lambda draw, size: "data:image/svg+xml;base64,")
    config = tmp_path / "study.toml"
    config.write_text(config_text(), encoding="utf-8")
    design = pipeline.resolve(pipeline.load_config(config)).screening_design
    monkeypatch.setattr(Counted, "corners", design.physical, raising=False)

    def run(*overrides: str, name: str = "out", **settings) -> pipeline.Outcome:
        return pipeline.run(config, tmp_path / name, [*SMALL, *overrides], **settings)

    return run


def effects_of(outcome: pipeline.Outcome) -> list[dict[str, str]]:
    with (outcome.path / "screening" / "effects.csv").open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def summary_of(outcome: pipeline.Outcome, monkeypatch) -> str:
    text = io.StringIO()
    monkeypatch.setattr(pipeline.console, "console", Console(file=text, width=300, highlight=False))
    pipeline.console.summary(outcome)
    return text.getvalue()


class TestAnalysed:
    def test_said_in_log_report_summary_and_table(self, study, monkeypatch):
        Counted.trouble = at_corners(5)
        outcome = study(TOLERANT)
        holes = outcome.screening.holes
        assert holes.lost == (5,)
        # One lost run of n = 12 with k = 4 factors: 1 + 1/(n - k - 1) of the variance, see test_screening_holes.py.
        assert_allclose(holes.inflation, 1.0 + 1.0 / 7.0)
        said = "run 5 of 12 two-level runs failed: the effects are least squares on the 11 left"
        assert f"screening: {said}" in (outcome.path / "log.txt").read_text(encoding="utf-8")
        report = (outcome.path / "report.html").read_text(encoding="utf-8")
        assert "Runs that are missing" in report
        assert "Run" + said[3:] in report
        assert "1 of 12 runs failed: run 5: crashed (ArithmeticError: the solver gave up)" in report
        assert f"Screening: {said}" in summary_of(outcome, monkeypatch)
        rows = effects_of(outcome)
        factors = [row for row in rows if row["kind"] == "factor"]
        assert_allclose([float(row["inflation"]) for row in factors], 8.0 / 7.0)
        for row in rows:
            widened = float(row["me"]) * np.sqrt(float(row["inflation"]))
            assert_allclose(float(row["margin"]), widened)
            assert (abs(float(row["effect"])) > widened) == (row["active"] == "True")
            assert row["contrast"].startswith("~dummy") == (row["kind"] == "dummy") == (row["vif"] == "")

    def test_finds_what_the_whole_design_finds(self, study):
        whole = study(name="whole")
        assert {"inflation", "vif", "margin"}.isdisjoint(effects_of(whole)[0])
        assert whole.screening.holes is None
        assert whole.gaps == {}
        for number in (1, 12):
            Counted.trouble = at_corners(number)
            outcome = study(TOLERANT, name=f"without {number}")
            assert set(outcome.kept) >= set(whole.kept)
            assert max(e.max_relative for e in outcome.model.validation) < 1e-6

    def test_is_read_back_and_goes_on_with_the_same_bytes(self, study):
        Counted.trouble = at_corners(2, 9)
        outcome = study(TOLERANT)
        back = read_run(outcome.path)
        assert back.kept == outcome.kept
        assert_array_equal(back.screening.effects.values, outcome.screening.effects.values)
        assert back.screening.holes.sentences() == outcome.screening.holes.sentences()
        before = reproducible(outcome.path)
        assert reproducible(study(TOLERANT).path) == before

    def test_a_foldover_that_follows_a_hole(self, study):
        """The product of two factors is loud without run 3 too, so the foldover is run; the hole stays one."""
        Counted.trouble = at_corners(3)
        hiding = ("screening.design.n_runs=12", "screening.design.n_centre=1", "screening.tolerance=0.01")
        outcome = study(TOLERANT, *hiding, "screening.follow=true")
        assert len(outcome.screening_runs) == 25
        same = (outcome.screening_runs.design.physical == Counted.corners[2]).all(axis=1)
        assert_array_equal(outcome.screening.holes.lost, np.flatnonzero(same) + 1)
        assert outcome.screening.holes.lost[0] == 3
        assert outcome.screening.holes.n_corners == 24
        assert set(read_run(outcome.path).kept) == set(outcome.kept) == {"a", "b", "c", "d"}

    def test_later_stages_say_on_how_many_runs_they_stand(self, study, monkeypatch):
        def trouble(point):
            """Only the fit holds d at its centre."""
            if (point[D] == 15.0 and point[0] > 0.9) or (point[D] not in (10.0, 15.0, 20.0) and point[0] > 0.3):
                raise ArithmeticError("the solver gave up")

        Counted.trouble = staticmethod(trouble)
        outcome = study("oracle.max_failed_fraction=0.5", "fit.design.n_runs=24")
        n_fresh = int(outcome.validation_runs.ok.sum())
        assert 0 < n_fresh < 20
        said = {
            "fit": "the model is fitted to 20 of 24 runs, the others failed",
            "validation": f"errors are those at {n_fresh} of 20 runs, the others failed",
        }
        assert outcome.gaps.items() >= said.items()
        log = (outcome.path / "log.txt").read_text(encoding="utf-8")
        report = (outcome.path / "report.html").read_text(encoding="utf-8")
        shown = summary_of(outcome, monkeypatch)
        for stage, sentence in said.items():
            assert f"{stage}: {sentence}" in log
            assert sentence[1:] in report
            assert f"{stage.capitalize()}: {sentence}." in shown


class TestRefused:
    def test_above_the_declared_fraction(self, study):
        Counted.trouble = at_corners(5)
        with pytest.raises(
            TooManyFailures, match=r"screening: 1 of 12 .*; 8\.3% is more than .*max_failed_fraction = 0"
        ):
            study()

    def test_names_the_runs_to_make_again_and_how(self, study, tmp_path, capsys):
        lost = twins(range(1, 9))
        Counted.trouble = at_corners(*lost)
        with pytest.raises(TooManyFailures, match=r"--retry-failed, or --retry crashed") as told:
            study("oracle.max_failed_fraction=0.9")
        said = str(told.value)
        assert said.startswith(
            f"screening: {len(lost)} of 12 runs failed: run 1: crashed (ArithmeticError: the solver gave up)"
        )
        assert "without runs 1, 2, 3, 4, 5, 6, 7, 8" in said
        assert "the main effects cannot be estimated" in said
        again = {int(n) for n in re.findall(r"\d+", said.split("; with run")[1])}
        assert 0 < len(again) < 8
        argv = ["run", str(tmp_path / "study.toml"), "--out", str(tmp_path / "out"), "--set", SMALL[0]]
        argv += [part for one in (*SMALL[1:], "oracle.max_failed_fraction=0.9") for part in ("--set", one)]
        assert main(argv) == 3
        assert "cannot be estimated" in capsys.readouterr().err
        # The advice is true: with those runs mended and asked for, the study goes through.
        Counted.trouble = at_corners(*lost - twins(again))
        outcome = study("oracle.max_failed_fraction=0.9", retry=[Status.CRASHED])
        assert set(outcome.screening.holes.lost) == lost - twins(again)

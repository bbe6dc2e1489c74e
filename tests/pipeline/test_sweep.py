"""Sweeps: a grid of studies that share what they pay for, of which no one stops another, and one comparison."""

import csv
import re
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar
from urllib.parse import unquote

import numpy as np
import pytest

import pipeline
import pipeline.report.sweeps
import pipeline.runner
import pipeline.sweeping
from experiments import Factor, FactorSpace, Response, oracles
from experiments.oracles import PointOracle
from experiments.settings import parameter
from pipeline import InputError
from pipeline.cli import main
from pipeline.lock import FolderLock
from pipeline.sweep_rows import quotient_unit
from surrogates import load
from tests.pipeline.cases import CONFIGS, contents, reproducible

BAD = -1.0


@dataclass(frozen=True)
class Spring(PointOracle):
    """Two springs in the plane, a little curved, that break at a negative stiffness. Notes every answer."""

    name: ClassVar[str] = "spring"
    resolution: ClassVar[float] = 1e-12
    asked: ClassVar[list[tuple[float, ...]]] = []

    stiffness: float = parameter(1.0, "N/m", "of both")

    @property
    def factors(self) -> FactorSpace:
        return FactorSpace((Factor("a", "N", -1.0, 1.0), Factor("b", "N", -1.0, 1.0)))

    @property
    def responses(self) -> tuple[Response, ...]:
        return Response("u", "m", "mm", 1e3), Response("v", "rad")

    def respond(self, point: np.ndarray) -> tuple[float, ...]:
        a, b = (float(x) for x in point)
        self.asked.append((self.stiffness, a, b))
        if self.stiffness < 0.0:
            raise ValueError("it broke")
        return (a + 0.1 * a * b + 0.02 * a**3) / self.stiffness, (2.0 * b + 0.1 * a * a) / self.stiffness


CONFIG = """\
name = "springs"
[oracle]
name = "spring"
[fit.design]
method = "uniform"
n_runs = 12
levels = 6
budget = 200
[validation]
n_runs = 15
[export]
targets = []
[sweep]
oracle.parameters.stiffness = [1.0, 4.0, -1.0]
"""
OVER = {"require.max_relative_error": [0.5, 1e-9]}


@pytest.fixture(scope="module")
def spring():
    """The oracle, registered, and no reports, which take most of the time."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(pipeline.runner, "write_report", lambda folder, outcome: folder.path / "report.html")
        oracles.register(Spring)
        yield Spring
        oracles._REGISTERED.pop("spring", None)


@pytest.fixture(autouse=True)
def forgetful():
    Spring.asked.clear()


@pytest.fixture
def config(tmp_path, spring, swept, monkeypatch) -> Path:
    """The config by itself; the page, which takes most of a sweep's time, is that of `swept`."""
    monkeypatch.setattr(pipeline.sweeping, "write_page", lambda folder, found: folder.path / "sweep.html")
    path = tmp_path / "springs.toml"
    path.write_text(CONFIG, encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def swept(spring, tmp_path_factory):
    """Six members: two springs that hold and one that breaks, each with a lax and a strict limit."""
    folder = tmp_path_factory.mktemp("sweep")
    (folder / "springs.toml").write_text(CONFIG, encoding="utf-8")
    Spring.asked.clear()
    found = pipeline.sweep(folder / "springs.toml", OVER, folder / "out")
    return found, list(Spring.asked)


def names(found) -> list[str]:
    return [row.member.name for row in found.rows]


class TestMembers:
    def test_are_run_folders_with_readable_names(self, swept):
        found, _ = swept
        assert names(found)[:2] == ["stiffness=1,max_relative_error=0.5", "stiffness=1,max_relative_error=1e-09"]
        for row in found.rows[:4]:
            place = found.path / row.member.name
            assert {"config.toml", "points.sqlite", "model.json"} <= {p.name for p in place.iterdir()}
            kept = pipeline.load_config(place / "config.toml")
            assert kept.sweep is None
            assert kept.oracle.parameters["stiffness"] == dict(row.member.settings)["oracle.parameters.stiffness"]
            assert pipeline.read_run(place).model.responses == row.found.responses

    def test_that_fail_stop_no_other(self, swept):
        found, _ = swept
        assert [row.code for row in found.rows] == [0, 4, 0, 4, 3, 3]
        assert "1e-09" in found.rows[1].reason
        assert "it broke" not in found.rows[0].reason
        assert "screening: 8 of 8 runs failed" in found.rows[4].reason
        assert found.code == 3
        assert found.trouble.startswith("4 of 6 members: stiffness=1,max_relative_error=1e-09 (falls short), ")

    def test_pay_for_no_point_twice(self, swept):
        found, asked = swept
        assert len(set(asked)) == len(asked) > 60
        assert sum(row.new for row in found.rows) == len(asked)
        assert [row.new for row in found.rows[1::2]] == [0, 0, 0]
        assert [row.asked for row in found.rows[1::2]] == [0, 0, 0]
        assert found.rows[0].runs == found.rows[0].new == found.rows[1].runs

    def test_a_member_is_what_a_run_of_its_own_is(self, swept, tmp_path, config):
        found, _ = swept
        pipeline.run(config, tmp_path / "alone", ["oracle.parameters.stiffness=4.0", "require.max_relative_error=0.5"])
        assert reproducible(tmp_path / "alone") == reproducible(found.path / names(found)[2])


class TestTable:
    def test_says_what_the_models_say(self, swept):
        found, _ = swept
        with (found.path / "sweep.csv").open(encoding="utf-8", newline="") as file:
            rows = list(csv.DictReader(file))
        assert len(rows) == 6
        for row, told in zip(rows, found.rows[:4], strict=False):
            model = load(found.path / row["member"] / "model.json")
            assert model.certificate is not None
            assert model.certificate.response_box is not None
            slopes = model.jacobian([[0.0, 0.0]])[0]
            for error in model.validation:
                assert float(row[f"{error.response}_max_relative_to_range"]) == error.max_relative
                assert float(row[f"{error.response}_rmse_relative_to_range"]) == error.relative_rmse
            assert row["verdict"] == model.certificate.verdict == "certified"
            assert float(row["certified_side"]) == told.found.side == 1.0
            ends = [float(row[f"u_box_{end}[m]"]) for end in ("low", "high")]
            assert ends == list(model.certificate.response_box[0])
            share = (ends[1] - ends[0]) / model.validation[0].range
            assert float(row["u_box_relative_to_range"]) == pytest.approx(share, rel=1e-14)
            assert 0.5 < share < 1.5  # the fresh runs do not reach the ends of what the model does
            assert float(row["d_u_d_a[m/N]"]) == slopes[0, 0]
            assert float(row["d_v_d_b[rad/N]"]) == slopes[1, 1]
            assert float(row["d_a_d_u[N/m]"]) == pytest.approx(np.linalg.inv(slopes)[0, 0], rel=1e-12)
            assert row["kept"] == "a b"

    def test_stiffness_follows_the_parameter(self, swept):
        one, four = (row.found.stiffness for row in swept[0].rows[:4:2])
        np.testing.assert_allclose(four, 4.0 * one, rtol=1e-6)
        np.testing.assert_allclose(one, [1.0, 0.5], rtol=0.03)

    def test_has_units_of_swept_keys_and_reasons(self, swept):
        table = swept[0].table
        assert list(table["oracle.parameters.stiffness[N/m]"]) == [1.0, 1.0, 4.0, 4.0, -1.0, -1.0]
        assert list(table["outcome"]) == ["ok", "falls short"] * 2 + ["too many failures"] * 2
        assert list(table["exit_code"]) == [0, 4, 0, 4, 3, 3]
        assert table["verdict"].isna().tolist() == [False] * 4 + [True] * 2

    @pytest.mark.parametrize(
        ("above", "below", "told"), [("m", "N", "m/N"), ("1", "N", "1/N"), ("m", "1", "m"), ("m", "N*m", "m/(N*m)")]
    )
    def test_unit_of_a_quotient(self, above, below, told):
        assert quotient_unit(above, below) == told


class TestPage:
    def test_needs_no_other_file_and_leads_to_the_reports(self, swept):
        found, _ = swept
        text = (found.path / "sweep.html").read_text(encoding="utf-8")
        assert not re.findall(r'(?:src|href)="(?:https?:|//)', text)
        links = {unquote(link) for link in re.findall(r'href="([^"#]*)/report\.html"', text)}
        assert links == set(names(found)[:4])
        assert text.count("data:image/svg+xml;base64,") == 2
        assert "2 of the members came to no model" in text
        assert "screening: 8 of 8 runs failed" in text

    def test_hostile_texts_are_quoted(self, config, tmp_path, monkeypatch):
        monkeypatch.undo()
        monkeypatch.setattr(pipeline.report.sweeps, "axis_figure", lambda found, which: "data:,")
        hostile = ['<script>alert("1")</script>', "../../x"]
        found = pipeline.sweep(config, {"title": hostile, "oracle.parameters.stiffness": [1.0]}, tmp_path / "out")
        text = (found.path / "sweep.html").read_text(encoding="utf-8")
        assert "<script>" not in text
        assert found.code == 0
        assert {p.parent for p in tmp_path.rglob("model.json")} == {found.path / name for name in names(found)}
        assert {p.name for p in tmp_path.iterdir()} == {"springs.toml", "out"}


class TestAgain:
    @pytest.fixture
    def done(self, config, tmp_path):
        found = pipeline.sweep(config, {"oracle.parameters.stiffness": [1.0, 2.0]}, tmp_path / "out")
        Spring.asked.clear()
        return found

    def test_the_same_asks_nothing_and_changes_nothing(self, done, config):
        before = {n: b for n, b in contents(done.path).items() if n.endswith((".csv", ".toml", "model.json"))}
        again = pipeline.sweep(config, {"oracle.parameters.stiffness": [1.0, 2.0]}, done.path)
        assert Spring.asked == []
        assert {n: b for n, b in contents(done.path).items() if n in before} == before
        assert [row.asked for row in again.rows] == [0, 0]
        assert "sweep.csv" in before

    def test_another_value_adds_a_member(self, done, config):
        again = pipeline.sweep(config, {"oracle.parameters.stiffness": [1.0, 3.0, 2.0]}, done.path)
        assert names(again) == ["stiffness=1", "stiffness=3", "stiffness=2"]
        assert {a[0] for a in Spring.asked} == {3.0}

    def test_another_base_is_refused_and_touches_nothing(self, done, config):
        before = contents(done.path)
        with pytest.raises(InputError, match=r"out belongs to another config \(different: seed\)"):
            pipeline.sweep(config, {"oracle.parameters.stiffness": [1.0]}, done.path, ["seed=9"])
        assert contents(done.path) == before

    def test_fresh_takes_the_folder_and_keeps_the_answers(self, done, config):
        over = {"oracle.parameters.stiffness": [1.0]}
        found = pipeline.sweep(config, over, done.path, ["fit.degree=1"], fresh=True)
        assert found.code == 0
        assert 0 < len(Spring.asked) < found.rows[0].runs  # other settings to confirm the inverse with, no others

    def test_stopped_by_hand_goes_on(self, config, tmp_path, monkeypatch):
        over, out = {"oracle.parameters.stiffness": [1.0, 2.0, 3.0]}, tmp_path / "out"
        real = pipeline.sweeping.run

        def stopped(file, place, *rest):
            if place.name == "stiffness=2":
                raise KeyboardInterrupt
            return real(file, place, *rest)

        monkeypatch.setattr(pipeline.sweeping, "run", stopped)
        with pytest.raises(KeyboardInterrupt):
            pipeline.sweep(config, over, out)
        assert (out / "sweep.csv").read_text(encoding="utf-8").count("\n") == 2
        assert not (out / "run.lock").exists()
        monkeypatch.setattr(pipeline.sweeping, "run", real)
        Spring.asked.clear()
        assert [row.code for row in pipeline.sweep(config, over, out).rows] == [0, 0, 0]
        assert {a[0] for a in Spring.asked} == {2.0, 3.0}

    def test_a_bug_of_ours_stops_no_other_and_is_raised_at_the_end(self, config, tmp_path, monkeypatch):
        real = pipeline.sweeping.run

        def buggy(file, place, *rest):
            if place.name == "stiffness=1":
                raise ZeroDivisionError("ours")
            return real(file, place, *rest)

        monkeypatch.setattr(pipeline.sweeping, "run", buggy)
        with pytest.raises(ZeroDivisionError, match="ours"):
            pipeline.sweep(config, {"oracle.parameters.stiffness": [1.0, 2.0]}, tmp_path / "out")
        text = (tmp_path / "out" / "sweep.csv").read_text(encoding="utf-8")
        assert "bug,1,ZeroDivisionError: ours" in text
        assert "stiffness=2,2.0,ok,0" in text


class TestRefused:
    @pytest.mark.parametrize(
        ("over", "match"),
        [
            ({"fit.degree": [1, 2, 13]}, r"member degree=13,stiffness=1: .*fit\.degree should be less than or equal"),
            ({"fit.degre": [1]}, r"unknown key 'fit\.degre'; did you mean 'degree'"),
            ({"oracle.parameters.stifness": [1]}, r"no setting 'stifness'; did you mean 'stiffness'"),
            ({"factors.c": [{"low": 0, "high": 1}]}, r"unknown factor 'c'"),
            ({"ranges.c": [1, 2]}, r"ranges\.c: no factor is called so; they are a, b"),
            ({"fit.design": [{"method": "full_factorial", "levels": 1}]}, r"member design=\S+: fit\.design"),
            ({"name.x": [1]}, r"'name' is a value, not a table"),
            ({"name": ["../x"]}, r"name should be letters, digits"),
        ],
    )
    def test_before_anything_runs(self, over, match, config, tmp_path):
        with pytest.raises(InputError, match=match):
            pipeline.sweep(config, over, tmp_path / "out")
        assert Spring.asked == []
        assert [p.name for p in tmp_path.iterdir()] == ["springs.toml"]

    def test_folders_that_are_not_to_be_had(self, config, tmp_path):
        (tmp_path / "full").mkdir()
        (tmp_path / "full" / "letter.txt").write_text("dear", encoding="utf-8")
        with pytest.raises(InputError, match="full is not empty and is no sweep's folder"):
            pipeline.sweep(config, None, tmp_path / "full")
        with pytest.raises(InputError, match=r"springs\.toml is a file"):
            pipeline.sweep(config, None, config)
        (tmp_path / "out" / "stiffness=4").mkdir(parents=True)
        (tmp_path / "out" / "sweep.toml").write_text(CONFIG, encoding="utf-8")
        (tmp_path / "out" / "stiffness=4" / "letter.txt").write_text("dear", encoding="utf-8")
        with pytest.raises(InputError, match="stiffness=4 is not empty and is no run folder"):
            pipeline.sweep(config, None, tmp_path / "out")
        assert Spring.asked == []

    def test_a_second_sweep_in_the_folder(self, config, tmp_path):
        (tmp_path / "out").mkdir()
        lock = FolderLock(tmp_path / "out")
        try:
            with pytest.raises(InputError, match="another run is at work in"):
                pipeline.sweep(config, None, tmp_path / "out")
        finally:
            lock.release()
        assert Spring.asked == []


class TestCommand:
    def test_runs_tells_and_exits(self, config, tmp_path, capsys):
        out = tmp_path / "out"
        argv = ["sweep", str(config), "--over", "oracle.parameters.stiffness=1,-1", "--out", str(out)]
        assert main([*argv, "--cache", str(tmp_path / "answers")]) == 3
        told, warned = capsys.readouterr()
        assert "1 of 2  stiffness=1\n" in told
        assert "too many failures: screening: 8 of 8 runs failed" in told
        assert "certified" in told
        assert warned.splitlines()[-1].startswith("flexdoce: 1 of 2 members: stiffness=-1 (too many failures)")
        assert (tmp_path / "answers" / "points.sqlite").is_file()
        assert not (out / "cache").exists()
        assert main(["status", str(out)]) == 0
        lines = capsys.readouterr().out.splitlines()
        assert lines[0].endswith(": not running, 2 members")
        assert lines[1].startswith("stiffness=1: finished")
        assert lines[2].startswith("stiffness=-1: failed")

    def test_dry_run_prints_the_grid_and_touches_nothing(self, config, tmp_path, capsys):
        argv = ["sweep", str(config), "--over", "ranges=0.5,1", "--over", "fit.degree,fit.design.n_runs=[1,12],[2,18]"]
        assert main([*argv, "--dry-run", "--out", str(tmp_path / "out")]) == 0
        told = capsys.readouterr().out
        assert "12 members" in told
        # 8 runs screen, 12 or 18 fit, 15 validate, 15 confirm the inverse; three springs, two ranges.
        assert f"At most {6 * (8 + 12 + 30) + 6 * (8 + 18 + 30)} runs in all" in told
        assert [p.name for p in tmp_path.iterdir()] == ["springs.toml"]
        assert Spring.asked == []

    def test_run_is_of_the_base_and_says_so(self, config, tmp_path, capsys):
        assert main(["run", str(config), "--out", str(tmp_path / "run")]) == 0
        assert f"flexdoce sweep {config}" in capsys.readouterr().out.replace("\n", " ")
        assert {a[0] for a in Spring.asked} == {1.0}
        assert "sweep" not in (tmp_path / "run" / "config.toml").read_text(encoding="utf-8")

    def test_check_looks_at_every_member(self, config, tmp_path, capsys):
        assert main(["check", str(config)]) == 0
        assert "[sweep]" in capsys.readouterr().out
        config.write_text(CONFIG + "fit.degree = [1, 13]\n", encoding="utf-8")
        assert main(["check", str(config)]) == 2
        assert "member degree=13,stiffness=1:" in capsys.readouterr().err

    def test_bad_over_is_one_sentence(self, config, tmp_path, capsys):
        assert main(["sweep", str(config), "--over", "fit.degree", "--out", str(tmp_path / "out")]) == 2
        err = capsys.readouterr().err
        assert err.count("\n") == 1
        assert "is not of the form dotted.key=a,b,c" in err

    def test_what_it_kept_goes_on_by_itself(self, config, tmp_path):
        """``sweep.toml`` has the grid of the command line."""
        over = ["--over", "oracle.parameters.stiffness=1,2"]
        assert main(["sweep", str(config), *over, "--out", str(tmp_path / "out")]) == 0
        Spring.asked.clear()
        assert main(["sweep", str(tmp_path / "out" / "sweep.toml"), "--out", str(tmp_path / "out")]) == 0
        assert Spring.asked == []


def test_every_example_with_a_grid_can_be_swept():
    found = [path for path in sorted(CONFIGS.glob("*.toml")) if pipeline.load_config(path).sweep]
    assert "hexflex_sweep" in {path.stem for path in found}
    for path in found:
        base, grid, chosen = pipeline.sweeping.planned(path)
        assert len(chosen) == np.prod([len(axis.values) for axis in grid])
        assert base.sweep

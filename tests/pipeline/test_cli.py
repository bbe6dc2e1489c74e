"""The command line: exit codes, one sentence per error, and nothing touched when something is refused."""

import csv
import io
import json
import re
import shutil
import sqlite3
import subprocess
import sys
import warnings
from pathlib import Path

import numpy as np
import pytest

from pipeline import load_config
from pipeline.cli import main
from pipeline.config import parse_config
from surrogates import dumps, exports
from tests.pipeline.bad_inputs import BAD, MINIMAL, Bad
from tests.pipeline.cases import CONFIGS, SMALL, A, C, Counted, D, config_text, contents, reproducible
from tests.surrogates.cases import folded, surrogate, underdetermined, unit_box

SMOKE = str(CONFIGS / "smoke.toml")
SET_SMALL = [word for override in SMALL for word in ("--set", override)]
HEADER = "length[m],width[m],thickness[m],load[N]\n"
ROW = "0.05,0.01,0.001,1.0\n"


@pytest.fixture
def refused(capsys):
    """Call ``main`` and check that it refuses with one sentence and exit code 2; gives the sentence."""

    def call(*argv: str | Path) -> str:
        code = main([str(a) for a in argv])
        out, err = capsys.readouterr()
        assert code == 2, err
        assert "Traceback" not in err
        assert err.count("\n") == 1, err
        assert err.startswith("flexdoce: ")
        assert out == ""
        return err

    return call


@pytest.fixture
def answered(capsys):
    """Call ``main`` and check that it succeeds; gives what it printed on standard output and standard error."""

    def call(*argv: str | Path) -> tuple[str, str]:
        code = main([str(a) for a in argv])
        out, err = capsys.readouterr()
        assert code == 0, err
        return out, err

    return call


@pytest.fixture
def model(smoke) -> Path:
    return smoke.path / "model.json"


@pytest.fixture
def linear(hexflex) -> Path:
    return hexflex.path / "model.json"


@pytest.fixture
def table(tmp_path):
    """Write a table and give its path."""

    def write(text: str | bytes) -> Path:
        path = tmp_path / "table.csv"
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        return path

    return write


def rows_of(text: str) -> list[dict[str, str]]:
    return list(csv.DictReader(io.StringIO(text)))


class TestBadConfig:
    @pytest.mark.parametrize("bad", BAD, ids=lambda b: b.what)
    @pytest.mark.parametrize("command", ["run", "check", "plan"])
    def test_is_refused_and_touches_nothing(self, bad: Bad, command, tmp_path, monkeypatch, refused):
        path = tmp_path / "bad.toml"
        path.write_bytes(bad.text if isinstance(bad.text, bytes) else bad.text.encode())
        monkeypatch.chdir(tmp_path)
        before = contents(tmp_path)
        out = ["--out", tmp_path / "out"] if command == "run" else []
        refused(command, path, *out, *(word for o in bad.overrides for word in ("--set", o)))
        assert contents(tmp_path) == before
        assert [p.name for p in tmp_path.iterdir()] == ["bad.toml"]

    @pytest.mark.parametrize("bad", BAD[:3], ids=lambda b: b.what)
    def test_leaves_a_run_folder_as_it_was(self, bad: Bad, tmp_path, smoke_copy, refused):
        path = tmp_path / "bad.toml"
        path.write_text(str(bad.text), encoding="utf-8")
        before = contents(smoke_copy)
        refused("run", path, "--out", smoke_copy, "--fresh")
        assert contents(smoke_copy) == before

    @pytest.mark.parametrize("command", ["run", "check", "plan"])
    def test_missing_file_and_directory(self, command, tmp_path, refused):
        assert "No such file" in refused(command, tmp_path / "nowhere.toml")
        assert "Is a directory" in refused(command, tmp_path)
        assert list(tmp_path.iterdir()) == []


class TestOutputFolder:
    def test_of_another_config_is_refused(self, smoke_copy, refused):
        before = contents(smoke_copy)
        sentence = refused("run", SMOKE, "--out", smoke_copy, *SET_SMALL, "--set", "seed=8")
        assert "belongs to another config (different: seed)" in sentence
        assert "--fresh" in sentence
        assert contents(smoke_copy) == before

    def test_that_is_not_empty_and_no_run_folder_is_refused(self, tmp_path, refused):
        (tmp_path / "thesis.txt").write_text("mine")
        for more in ([], ["--fresh"]):
            assert "is not empty and is no run folder" in refused("run", SMOKE, "--out", tmp_path, *more)
        assert contents(tmp_path) == {"thesis.txt": b"mine"}

    def test_with_somebody_elses_config_toml_is_refused(self, tmp_path, refused):
        theirs = {"config.toml": b'[database]\nhost = "x"\n', "fit/mine.txt": b"mine", "model.json": b"{}"}
        for name, data in theirs.items():
            (tmp_path / name).parent.mkdir(exist_ok=True)
            (tmp_path / name).write_bytes(data)
        for more in ([], ["--fresh"]):
            refused("run", SMOKE, "--out", tmp_path, *more)
            assert contents(tmp_path) == theirs

    def test_the_config_that_is_run_is_never_overwritten(self, tmp_path, no_report, capsys):
        config = tmp_path / "config.toml"
        text = "# a comment worth keeping\n" + Path(SMOKE).read_text(encoding="utf-8")
        text = text.replace("levels = 6", "levels = 6\nbudget = 200").replace("n_runs = 500", "n_runs = 20")
        for more in ([], ["--fresh"]):
            config.write_text(text, encoding="utf-8")
            assert main(["run", str(config), "--out", str(tmp_path), *more]) in (0, 2)
            assert config.read_text(encoding="utf-8") == text

    def test_that_is_a_file_is_refused(self, tmp_path, refused):
        file = tmp_path / "file"
        file.write_text("mine")
        assert "is a file" in refused("run", SMOKE, "--out", file)
        refused("run", SMOKE, "--out", file / "below")
        assert contents(tmp_path) == {"file": b"mine"}

    def test_with_a_name_no_disk_takes_is_refused(self, tmp_path, refused):
        assert "too long" in refused("run", SMOKE, "--out", tmp_path / ("x" * 300))

    @pytest.mark.parametrize("damage", [b"\xff", b"", b"version = "], ids=["not UTF-8", "empty", "broken"])
    def test_with_a_damaged_config_is_refused(self, damage, smoke_copy, refused):
        (smoke_copy / "config.toml").write_bytes(damage)
        before = contents(smoke_copy)
        assert "config.toml" in refused("run", SMOKE, "--out", smoke_copy, *SET_SMALL)
        assert contents(smoke_copy) == before

    def test_fresh_removes_only_our_files(self, smoke_copy, no_report, answered):
        mine = smoke_copy / "notes.txt"
        mine.write_text("mine")
        (smoke_copy / "pictures").mkdir()
        (smoke_copy / "pictures" / "one.png").write_bytes(b"picture")
        (smoke_copy / "fit" / "stale.csv").write_text("stale")
        answered("run", SMOKE, "--out", smoke_copy, "--fresh", *SET_SMALL, "--set", "export.targets=[]")
        assert mine.read_text() == "mine"
        assert (smoke_copy / "pictures" / "one.png").read_bytes() == b"picture"
        assert not (smoke_copy / "report.html").exists(), "a report of the old study is left"
        assert not (smoke_copy / "exports").exists()

    def test_default_is_runs_and_the_studys_name(self, tmp_path, monkeypatch, no_report, answered):
        monkeypatch.chdir(tmp_path)
        answered("run", SMOKE, *SET_SMALL)
        assert (tmp_path / "runs" / "smoke" / "model.json").is_file()

    @pytest.mark.parametrize("name", ["[draft] study", "a[/b]c", "[bold]"])
    def test_with_brackets_in_its_name_is_printed_as_it_is(self, name, smoke, tmp_path, no_report, answered):
        folder = tmp_path / name
        folder.parent.mkdir(exist_ok=True)
        shutil.copytree(smoke.path, folder)
        out, _ = answered("run", SMOKE, "--out", folder, *SET_SMALL)
        assert str(folder / "model.json") in out.replace("\n", "")


class TestPointStore:
    def damaged(self, folder: Path, statement: str) -> None:
        db = sqlite3.connect(folder / "points.sqlite")
        db.execute(statement)
        db.commit()
        db.close()

    @pytest.mark.parametrize("damage", [b"garbage" * 100, None], ids=["garbage", "half"])
    def test_damaged_file_is_refused(self, damage, smoke_copy, refused):
        store = smoke_copy / "points.sqlite"
        store.write_bytes(damage or store.read_bytes()[: store.stat().st_size // 2])
        assert "points.sqlite" in refused("run", SMOKE, "--out", smoke_copy, *SET_SMALL)

    @pytest.mark.parametrize(
        "statement",
        [
            "ALTER TABLE points RENAME COLUMN key TO name",
            "UPDATE points SET status = 'weird'",
            "UPDATE points SET responses = '[1.0]'",
            "UPDATE points SET responses = 'x'",
        ],
    )
    def test_damaged_content_is_refused(self, statement, smoke_copy, capsys):
        self.damaged(smoke_copy, statement)
        assert main(["run", SMOKE, "--out", str(smoke_copy), *SET_SMALL]) == 2
        assert "points.sqlite" in capsys.readouterr().err


class TestExitCodes:
    def test_0_and_a_summary(self, smoke_copy, answered):
        out, _ = answered("run", SMOKE, "--out", smoke_copy, *SET_SMALL)
        for word in ("deflection", "slope", "20 of 20", "report.html", "model.json"):
            assert word in out.replace("\n", "")

    def test_4_when_a_requirement_is_not_met_and_everything_is_written(self, smoke, tmp_path, capsys):
        out = tmp_path / "out"
        code = main(["run", SMOKE, "--out", str(out), *SET_SMALL, "--set", "require.max_relative_error=1e-9"])
        last = capsys.readouterr().err.splitlines()[-1]
        assert code == 4
        assert last.startswith("flexdoce: required but not met: deflection: maximum relative error")
        assert "slope" in last
        assert set(contents(out)) == set(contents(smoke.path))
        assert "Not everything that was required holds" in (out / "report.html").read_text(encoding="utf-8")

    def test_4_when_the_inverse_is_not_certified(self, smoke_copy, tmp_path, no_report, capsys):
        argv = ["run", SMOKE, "--out", str(tmp_path / "out"), *SET_SMALL, "--set", "require.certified_inverse=true"]
        assert main(argv) == 4
        assert "the inverse is not certified (verdict: refuted)" in capsys.readouterr().err

    def test_3_when_a_screening_run_fails(self, counted, tmp_path, capsys):
        def trouble(point):
            if point[A] > 0.5 and point[C] > 0.0:
                raise ArithmeticError("the solver gave up")

        Counted.trouble = staticmethod(trouble)
        config, out = tmp_path / "study.toml", tmp_path / "out"
        config.write_text(config_text(), encoding="utf-8")
        assert main(["run", str(config), "--out", str(out)]) == 3
        err = capsys.readouterr().err
        last = err.splitlines()[-1]
        assert last.startswith("flexdoce: ")
        assert "screening" in last
        assert "of 12 runs failed" in last
        assert "ArithmeticError: the solver gave up" in last
        assert "Traceback" not in err
        assert stored(out) == sorted(set(counted.asked))
        assert 0 < len(counted.asked) < 12
        assert not (out / "model.json").exists()

    def test_3_when_too_many_fit_runs_fail(self, counted, tmp_path, capsys):
        Counted.trouble = staticmethod(fails_in_the_fit)
        config, out = tmp_path / "study.toml", tmp_path / "out"
        config.write_text(config_text(), encoding="utf-8")
        argv = ["run", str(config), "--out", str(out), *SET_SMALL]
        assert main([*argv, "--set", "oracle.max_failed_fraction=0.01"]) == 3
        last = capsys.readouterr().err.splitlines()[-1]
        assert last.startswith("flexdoce: fit: ")
        assert "is more than oracle.max_failed_fraction = 0.01" in last
        assert stored(out) == sorted(set(counted.asked))
        assert len(counted.asked) > 12

    def test_130_when_stopped(self, counted, tmp_path, capsys):
        def trouble(point):
            if len(counted.asked) == 5:
                raise KeyboardInterrupt

        Counted.trouble = staticmethod(trouble)
        config, out = tmp_path / "study.toml", tmp_path / "out"
        config.write_text(config_text(), encoding="utf-8")
        assert main(["run", str(config), "--out", str(out)]) == 130
        err = capsys.readouterr().err
        assert err.splitlines()[-1].startswith("flexdoce: stopped; run the same command to continue")
        assert stored(out) == sorted(set(counted.asked))

    def test_1_only_for_a_bug_of_ours(self):
        code = (
            "import sys, pipeline.commands as commands\n"
            "def bug(arguments): raise RuntimeError('a bug')\n"
            "commands.check = bug\n"
            "from pipeline.cli import main\n"
            "sys.exit(main(['check', 'x']))"
        )
        done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
        assert done.returncode == 1
        assert "RuntimeError: a bug" in done.stderr

    @pytest.mark.parametrize(
        "argv",
        [
            [], ["rnu"], ["run"], ["run", SMOKE, "--ouT", "x"], ["check", SMOKE, "--out", "x"], ["predict", "m"],
            ["export", "m", "--too", "c99"], ["verify"], ["list", "more"],
        ],
    )  # fmt: skip
    def test_2_for_bad_arguments(self, argv, capsys):
        with pytest.raises(SystemExit) as stopped:
            main(argv)
        assert stopped.value.code == 2
        err = capsys.readouterr().err
        assert err.startswith("usage: flexdoce")
        assert "Traceback" not in err

    def test_help_names_every_command_and_exit_code(self, capsys):
        with pytest.raises(SystemExit) as stopped:
            main(["--help"])
        assert stopped.value.code == 0
        text = " ".join(capsys.readouterr().out.split())
        for word in ("run", "check", "plan", "report", "predict", "invert", "export", "verify", "status", "list"):
            assert f" {word} " in text
        assert "2 bad config" in text

    def test_python_m_pipeline(self, tmp_path):
        done = subprocess.run(
            [sys.executable, "-m", "pipeline", "check", SMOKE],
            capture_output=True,
            text=True,
            check=False,
            cwd=tmp_path,
        )
        assert done.returncode == 0, done.stderr
        assert parse_config(done.stdout) == load_config(SMOKE)
        done = subprocess.run(
            [sys.executable, "-m", "pipeline", "check", "nowhere.toml"], capture_output=True, text=True, check=False
        )
        assert done.returncode == 2
        assert done.stderr.startswith("flexdoce: ")


def fails_in_the_fit(point) -> None:
    """Only the fit holds d at the centre of its range."""
    if point[D] == 15.0 and point[A] > 0.9:
        raise ArithmeticError("the solver gave up")


def stored(folder: Path) -> list[tuple[float, ...]]:
    """Settings of the points in the store that have an answer, sorted."""
    db = sqlite3.connect(folder / "points.sqlite")
    found = db.execute("SELECT settings FROM points WHERE status = 'ok'").fetchall()
    db.close()
    return sorted(tuple(json.loads(text)) for (text,) in found)


class TestCheckPlanList:
    @pytest.mark.parametrize("path", sorted(CONFIGS.glob("*.toml")), ids=lambda p: p.stem)
    def test_check_prints_a_config_that_parses_to_the_same(self, path, answered):
        out, err = answered("check", path)
        assert parse_config(out) == load_config(path)
        assert err == ""

    def test_check_applies_overrides(self, answered):
        out, _ = answered("check", SMOKE, "--set", "fit.degree=1")
        assert parse_config(out).fit.degree == 1

    def test_plan_prints_the_designs_and_runs_and_writes_nothing(self, counted, tmp_path, monkeypatch, answered):
        monkeypatch.chdir(tmp_path)
        Path("study.toml").write_text(config_text(), encoding="utf-8")
        out, _ = answered("plan", "study.toml", *SET_SMALL)
        for words in ("12 runs, plackett_burman", "24 runs, uniform", "15 candidate terms", "20 random runs"):
            assert words in " ".join(out.split())
        for label in ("a[N]", "b[mm]", "c[rad]", "d[1]"):
            assert label in out
        assert counted.asked == []
        assert list(contents(tmp_path)) == ["study.toml"]

    def test_list_names_everything_with_its_settings(self, answered):
        out, _ = answered("list")
        for word in ("hexflex", "cantilever", "plackett_burman", "uniform", "latin_hypercube", "random", "c99"):
            assert word in out
        for word in ("young = 71700000000.0 Pa", "levels = 6", "n_runs = 30"):
            assert word in out


class TestPredict:
    def test_answers_in_csv(self, smoke, model, table, answered):
        points = smoke.validation_runs.design.physical[:5]
        out, err = answered(
            "predict", model, table(HEADER + "\n".join(",".join(map(repr, p)) for p in points.tolist()))
        )
        rows = rows_of(out)
        assert list(rows[0]) == [*HEADER.strip().split(","), "deflection[m]", "slope[rad]", "status"]
        told = np.array([[float(r["deflection[m]"]), float(r["slope[rad]"])] for r in rows])
        np.testing.assert_array_equal(told, smoke.model.predict(points))
        assert {r["status"] for r in rows} == {"inside"}
        assert err == ""

    @pytest.mark.parametrize(
        "text",
        [
            "load[N],thickness[m],width[m],length[m]\n1.0,0.001,0.01,0.05\n",
            "length,width,thickness,load\n" + ROW,
            "note,load,thickness[m],width,length,more\nfirst,1,0.001,0.01,0.05,9\n",
            " length [m] , width[m],thickness[m], load\n0.05, 0.01, 0.001, 1.0\n",
            "\ufefflength,width,thickness,load\n" + ROW,
            HEADER.replace("\n", "\r\n") + ROW.replace("\n", "\r\n"),
        ],
        ids=["any order", "without units", "more columns", "spaces", "byte order mark", "CRLF"],
    )
    def test_reads_columns_by_name(self, text, model, table, answered):
        expected, _ = answered("predict", model, table(HEADER + ROW))
        out, _ = answered("predict", model, table(text))
        assert out == expected

    def test_writes_to_a_file(self, model, table, tmp_path, answered):
        expected, _ = answered("predict", model, table(HEADER + ROW))
        out, _ = answered("predict", model, table(HEADER + ROW), "--out", tmp_path / "answers.csv")
        assert out == ""
        assert (tmp_path / "answers.csv").read_text(encoding="utf-8") == expected

    def test_reads_standard_input(self, model, table, monkeypatch, answered):
        expected, _ = answered("predict", model, table(HEADER + ROW))
        monkeypatch.setattr("sys.stdin", io.StringIO(HEADER + ROW))
        assert answered("predict", model, "-")[0] == expected

    def test_flags_rows_outside_the_domain(self, model, table, answered):
        out, err = answered("predict", model, table(HEADER + ROW + "0.06,0.01,0.001,1.0\n"))
        assert [r["status"] for r in rows_of(out)] == ["inside", "outside"]
        assert err == "flexdoce: 1 of 2 rows lie outside the model's domain; their status is 'outside'\n"

    def test_far_outside_is_flagged_and_no_warning_of_numpy(self, model, table, answered):
        with warnings.catch_warnings():
            warnings.simplefilter("error", RuntimeWarning)
            out, _ = answered("predict", model, table(HEADER + "1e300,0.01,0.001,1.0\n"))
        assert rows_of(out)[0]["status"] == "outside"

    def test_says_what_lies_on_the_edge(self, smoke, model, table, answered):
        low, high = ([getattr(f, end) for f in smoke.model.factors] for end in ("low", "high"))
        centre = smoke.model.factors.centre.tolist()
        rows = [low, high, [low[0], *centre[1:]], centre]
        out, err = answered("predict", model, table(HEADER + "\n".join(",".join(map(repr, r)) for r in rows)))
        assert [r["status"] for r in rows_of(out)] == ["edge", "edge", "edge", "inside"]
        assert err == ""

    def test_refuses_settings_outside_where_asked_to(self, model, table, tmp_path, refused, answered):
        bad = table(HEADER + ROW + "0.06,0.01,0.001,1.0\n")
        sentence = refused("predict", model, bad, "--outside", "refuse", "--out", tmp_path / "o")
        assert "table.csv: 1 of 2 settings lie outside the domain: row 2: length = 0.06 m (allowed: 0." in sentence
        assert not (tmp_path / "o").exists()
        told, _ = answered("predict", model, bad, "--outside", "flag")
        assert told == answered("predict", model, bad)[0]
        good = table(HEADER + ROW)
        assert answered("predict", model, good, "--outside", "refuse") == answered("predict", model, good)

    def test_gives_intervals(self, smoke, model, table, answered):
        """The study has 20 validation runs: enough for 0.9 alone."""
        out, _ = answered("predict", model, table(HEADER + ROW + "0.06,0.01,0.001,1.0\n"), "--interval", "0.9")
        inside, outside = rows_of(out)
        responses = ["deflection[m]", "slope[rad]"]
        ends = [f"{end}_{label}" for end in ("low", "high") for label in responses]
        assert list(inside) == [*HEADER.strip().split(","), *responses, *ends, "status"]
        low, high = smoke.model.interval([[0.05, 0.01, 0.001, 1.0]], 0.9)
        assert [float(inside[e]) for e in ends] == [*low[0], *high[0]]
        assert low[0, 0] < float(inside["deflection[m]"]) < high[0, 0]
        assert [outside[e] for e in ends] == [""] * 4

    def test_refuses_a_level_without_an_interval(self, model, table, refused):
        for level, match in (("0.99", "that takes 197 validation runs or more, this model had 20"), ("90", "level 90")):
            sentence = refused("predict", model, table(HEADER + ROW), "--interval", level)
            assert match in sentence
            assert "levels there are: 0.9" in sentence
            assert str(model) in sentence


BAD_TABLES = [
    ("wrong columns", "a,b,c,d\n1,2,3,4\n", r"has the wrong columns: length\[m\], .* missing; found a, b, c, d"),
    ("one column missing", "length,width,thickness\n1,2,3\n", r"wrong columns: load\[N\] missing"),
    ("wrong unit", HEADER.replace("length[m]", "length[mm]") + ROW, r"'length\[mm\]' must be in 'm', not 'mm'"),
    ("text in a cell", HEADER + ROW + "0.05,0.01,thin,1.0\n", r"row 2, column thickness\[m\] is not a number: 'thin'"),
    ("true in a cell", HEADER + "0.05,0.01,0.001,True\n", r"row 1, column load\[N\]"),
    ("nan in a cell", HEADER + "0.05,0.01,0.001,nan\n", r"row 1, column load\[N\] is not a finite number"),
    ("inf in a cell", HEADER + "0.05,0.01,0.001,-inf\n", r"row 1, column load\[N\] is not a finite number"),
    ("nothing in a cell", HEADER + "0.05,,0.001,1.0\n", r"row 1, column width\[m\] is not a finite number"),
    ("a number that overflows", HEADER + "0.05,0.01,0.001,1e999\n", r"row 1, column load\[N\]"),
    ("a whole number that overflows", HEADER + f"0.05,0.01,0.001,1{'0' * 400}\n", r"row 1, column load\[N\]"),
    ("decimal commas", HEADER + '"0,05","0,01","0,001","1,0"\n', r"row 1, column length\[m\] is not a number: '0,05'"),
    ("empty file", "", r"is not a CSV table"),
    ("blank lines", "\n\n", r"is not a CSV table"),
    ("header only", HEADER, r"has no rows"),
    ("column twice", "length,width,thickness,load,load\n0.05,0.01,0.001,1.0,2.0\n", r"the column 'load' appears twice"),
    ("column twice, with unit", HEADER.strip() + ",load[N]\n0.05,0.01,0.001,1.0,2.0\n", r"'load' appears twice"),
    ("with and without unit", HEADER.strip() + ",load\n0.05,0.01,0.001,1.0,2.0\n", r"'load' appears twice"),
    ("a cell too few", HEADER + "0.05,0.01,0.001\n", r"row 1"),
    ("a cell too many", HEADER + "0.05,0.01,0.001,1.0,9.0\n", r"row 1|line 2|columns"),
    ("a cell too many below", HEADER + ROW + "0.05,0.01,0.001,1.0,9.0\n", r"line 3|row 2"),
    ("an open quote", HEADER + '"0.05,0.01', r"is not a CSV table"),
    ("a newline in a header", '"len\ngth",width,thickness,load\n' + ROW, r"wrong columns"),
    ("not UTF-8", b"\xff\xfel\x00", r"cannot read the table .*: it is not UTF-8 text"),
]


class TestBadTable:
    @pytest.mark.parametrize(("what", "text", "match"), BAD_TABLES, ids=[w for w, _, _ in BAD_TABLES])
    def test_is_refused(self, what, text, match, model, table, tmp_path, refused):
        assert re.search(match, refused("predict", model, table(text), "--out", tmp_path / "o"))
        assert not (tmp_path / "o").exists()

    def test_missing_file_and_directory(self, model, tmp_path, refused):
        for command in ("predict", "invert"):
            assert "cannot read the table" in refused(command, model, tmp_path / "nowhere.csv")
            assert "cannot read the table" in refused(command, model, tmp_path)

    def test_invert_needs_responses(self, model, table, refused):
        sentence = refused("invert", model, table(HEADER + ROW))
        assert "wrong columns: deflection[m], slope[rad] missing" in sentence

    def test_an_output_that_cannot_be_written(self, model, table, tmp_path, refused):
        assert "cannot write" in refused("predict", model, table(HEADER + ROW), "--out", tmp_path / "no" / "o.csv")


class TestInvert:
    def test_answers_that_predict_gives_back(self, hexflex, linear, table, answered):
        targets = hexflex.validation_runs.values[:5]
        labels = [r.label for r in hexflex.model.responses]
        text = ",".join(labels) + "\n" + "\n".join(",".join(map(repr, t)) for t in targets.tolist())
        out, err = answered("invert", linear, table(text))
        assert err == ""
        rows = rows_of(out)
        names = list(hexflex.model.factors.labels)
        counted = ["preimages", "complete"]
        assert list(rows[0]) == [*labels, *names, "status", *counted, *(f"nearest_{label}" for label in labels)]
        settings = np.array([[float(r[n]) for n in names] for r in rows])
        np.testing.assert_allclose(settings, hexflex.validation_runs.design.physical[:5], rtol=0, atol=1e-9)
        assert {r["status"] for r in rows} == {"ok"}
        assert {(r["preimages"], r["complete"]) for r in rows} == {("1", "True")}

    def test_tells_of_several_preimages_and_lists_them_all(self, table, tmp_path, answered):
        path = tmp_path / "model.json"
        path.write_text(dumps(folded()), encoding="utf-8")
        targets = table("r0\n0.005\n5\n-0.3\n")
        out, err = answered("invert", path, targets)
        assert [(r["status"], r["preimages"], r["complete"]) for r in rows_of(out)] == [
            ("ok", "2", "False"), ("outside", "0", "False"), ("ok", "2", "False")
        ]  # fmt: skip
        several, refused = err.splitlines()
        assert several == (
            "flexdoce: 2 of 3 targets have several preimages; the settings given are one of them, --all lists them"
        )
        assert refused.startswith("flexdoce: 1 of 3 targets are out of reach and were refused")

        out, err = answered("invert", path, targets, "--all")
        rows = rows_of(out)
        assert [(r["r0[m]"], r["status"], r["preimages"], r["complete"]) for r in rows] == [
            *[("0.005", "ok", "2", "True")] * 2, ("5.0", "outside", "0", "True"), *[("-0.3", "ok", "2", "True")] * 2
        ]  # fmt: skip
        model = folded()
        for row in rows:
            if row["status"] == "ok":
                assert float(row["nearest_r0[m]"]) == pytest.approx(float(row["r0[m]"]), abs=1e-12)
                assert model.predict([[float(row["f[N]"])]])[0, 0] == pytest.approx(float(row["r0[m]"]), abs=1e-12)
            else:
                assert row["f[N]"] == ""
        assert rows[0]["f[N]"] != rows[1]["f[N]"]
        assert [line.split(";")[0] for line in err.splitlines()] == [
            "flexdoce: 2 of 3 targets have several preimages, one row each",
            "flexdoce: 1 of 3 targets are out of reach",
        ]

    def test_says_where_a_list_of_preimages_may_lack_some(self, table, tmp_path, answered):
        path = tmp_path / "model.json"
        fold = surrogate(unit_box(1), ["f0^2"], [[1.0]])
        path.write_text(dumps(fold), encoding="utf-8")
        out, err = answered("invert", path, table("r0\n0\n"), "--all")
        (row,) = rows_of(out)
        assert (row["status"], row["preimages"], row["complete"]) == ("ok", "1", "False")
        assert err.startswith("flexdoce: 1 of 1 lists of preimages are not proven to be complete; the first: ")
        assert "stay undecided: settings meet there, or nearly; there may be others" in err

    @pytest.mark.parametrize("more", [[], ["--all"]])
    def test_tells_of_a_continuum(self, more, table, tmp_path, answered):
        path, model = tmp_path / "model.json", underdetermined()
        path.write_text(dumps(model), encoding="utf-8")
        middle = model.predict(model.factors.centre[None])[0]
        out, err = answered("invert", path, table("r0,r1\n" + ",".join(map(repr, middle.tolist())) + "\n"), *more)
        (row,) = rows_of(out)
        assert (row["status"], row["preimages"], row["complete"]) == ("ok", "inf", "False")
        assert err == (
            "flexdoce: 1 of 1 targets have a continuum of preimages: there are more factors than responses that follow "
            "independently, or one acts on none; one is given\n"
        )

    def test_refuses_a_pose_out_of_reach_with_the_nearest(self, hexflex, linear, table, answered):
        names = [r.name for r in hexflex.model.responses]
        text = ",".join(names) + "\n0,0,0,0,0,0\n1,0,0,0,0,0\n"
        out, err = answered("invert", linear, table(text))
        reached, refusal = rows_of(out)
        assert (reached["status"], refusal["status"]) == ("ok", "outside")
        assert [refusal[label] for label in hexflex.model.factors.labels] == [""] * 6
        # Largest x of Eq. 2.6: all three D1 at their ends, 57.5 + 28.8 + 28.8 µm.
        assert float(refusal["nearest_x[m]"]) == pytest.approx(115.1e-6, rel=2e-3)
        assert err.startswith("flexdoce: 1 of 2 targets are out of reach and were refused")

    def test_a_model_without_an_inverse_is_refused_with_the_reason(self, counted, table, tmp_path, answered, refused):
        config = tmp_path / "crowded.toml"
        config.write_text(config_text("crowded"), encoding="utf-8")
        out, _ = answered("run", config, "--out", tmp_path / "out", *SET_SMALL)
        text = " ".join(out.split())
        assert "Inverse: none; 4 responses follow from 3 factors, so that they cannot be chosen independently" in text
        assert "Round trip" not in text
        report = " ".join((tmp_path / "out" / "report.html").read_text(encoding="utf-8").split())
        assert "it has no inverse: 4 responses follow from 3 factors" in report
        assert "No responses were inverted and confirmed on the oracle" in report
        assert "model.invert(Y) " not in report
        assert "inversion/" not in report
        assert "The proof that matters" not in report
        said = refused("invert", tmp_path / "out" / "model.json", table("u,v,w,t\n1,1,1,1\n"))
        assert "model.json has no inverse: 4 responses follow from 3 factors" in said
        answered("report", tmp_path / "out")

    def test_a_target_at_the_end_of_float64_is_refused_with_a_nearest_that_is_as_near(self, linear, table, answered):
        text = "x,y,z,theta_x,theta_y,theta_z\n1,0,0,0,0,0\n1e300,0,0,0,0,0\n"
        with warnings.catch_warnings():
            warnings.simplefilter("error", RuntimeWarning)
            out, err = answered("invert", linear, table(text))
        near, far = rows_of(out)
        assert far["status"] == "outside"
        assert float(far["nearest_x[m]"]) == pytest.approx(float(near["nearest_x[m]"]), rel=1e-6)
        assert err.count("\n") == 1


BAD_MODELS = [
    ("not JSON", lambda d: "{", "not valid JSON"),
    ("brackets without end", lambda d: "[" * 100_000, "not valid JSON"),
    ("a list", lambda d: [], "expected schema"),
    ("another schema", lambda d: d | {"schema": "flexdoce-model/99"}, "found 'flexdoce-model/99'"),
    ("no terms", lambda d: {k: v for k, v in d.items() if k != "terms"}, "terms"),
    ("unknown term", lambda d: d | {"terms": ["q"] * len(d["terms"])}, "term 'q' names an unknown factor"),
    ("text coefficients", lambda d: d | {"coefficients": dict.fromkeys(d["coefficients"], "x")}, "model.json"),
    ("huge coefficients", lambda d: d | {"coefficients": {k: [10**400] * len(v) for k, v in d["coefficients"].items()}},
     "model.json"),
    ("huge range", lambda d: d | {"factors": [d["factors"][0] | {"high": 10**400}, *d["factors"][1:]]}, "model.json"),
    ("low above high", lambda d: d | {"factors": [d["factors"][0] | {"low": 9}, *d["factors"][1:]]}, "must be below"),
    ("missing factor", lambda d: d | {"factors": d["factors"][1:]}, "unknown factor 'length'"),
    ("not a number", lambda d: json.dumps(d).replace('"low": ', '"low": NaN, "l": ', 1), "not valid JSON"),
    ("no validation", lambda d: d | {"validation": 3}, "model.json"),
]  # fmt: skip


class TestBadModel:
    @pytest.mark.parametrize(("what", "change", "match"), BAD_MODELS, ids=[w for w, _, _ in BAD_MODELS])
    def test_is_refused(self, what, change, match, model, table, tmp_path, refused):
        changed = change(json.loads(model.read_text(encoding="utf-8")))
        bad = tmp_path / "model.json"
        bad.write_text(changed if isinstance(changed, str) else json.dumps(changed), encoding="utf-8")
        for argv in (["predict", bad, table(HEADER + ROW)], ["export", bad, "--to", "c99", "--out", tmp_path / "o"]):
            assert match in refused(*argv)
        assert not (tmp_path / "o").exists()

    def test_missing_file_and_directory(self, table, tmp_path, refused):
        for path in (tmp_path / "nowhere.json", tmp_path):
            assert "cannot read the model" in refused("predict", path, table(HEADER + ROW))
            assert "cannot read the model" in refused("invert", path, table(HEADER + ROW))
            assert "cannot read the model" in refused("export", path, "--to", "c99", "--out", tmp_path / "o")


class TestExport:
    FILES = ("export.json", "model.json", "smoke.c", "smoke.h", "smoke_selftest.c")

    def test_gives_what_the_run_gave(self, smoke, model, tmp_path, answered):
        out, _ = answered("export", model, "--to", "c99", "--out", tmp_path / "code", "--no-verify")
        assert contents(tmp_path / "code") == contents(smoke.path / "exports" / "c99")
        assert sorted(out.split()) == [str(tmp_path / "code" / name) for name in self.FILES]

    def test_refuses_to_overwrite_without_force(self, model, tmp_path, refused, answered):
        (tmp_path / "smoke.c").write_text("mine")
        sentence = refused("export", model, "--to", "c99", "--out", tmp_path)
        assert "already holds smoke.c" in sentence
        assert "--force" in sentence
        assert contents(tmp_path) == {"smoke.c": b"mine"}
        answered("export", model, "--to", "c99", "--out", tmp_path, "--force", "--no-verify")
        assert (tmp_path / "smoke.c").read_bytes() != b"mine"

    def test_prefix(self, model, tmp_path, answered, refused):
        answered("export", model, "--to", "c99", "--out", tmp_path / "o", "--prefix", "leaf", "--no-verify")
        assert {"leaf.c", "leaf.h"} <= set(contents(tmp_path / "o"))
        for prefix in ("while", "a b", "../x"):
            refused("export", model, "--to", "c99", "--out", tmp_path / "p", "--prefix", prefix)
        assert not (tmp_path / "p").exists()
        assert not (tmp_path / "x.c").exists()

    def test_another_prefix_leaves_nothing_of_the_first(self, model, tmp_path, answered):
        for prefix in ("leaf", "stem"):
            answered("export", model, "--to", "c99", "--out", tmp_path, "--prefix", prefix, "--force", "--no-verify")
        assert set(contents(tmp_path)) == {"export.json", "model.json", "stem.c", "stem.h", "stem_selftest.c"}

    def test_several_targets_have_a_folder_each(self, model, tmp_path, answered):
        answered("export", model, "--to", "c99,c99_float", "--out", tmp_path, "--no-verify")
        assert sorted(p.name for p in tmp_path.iterdir()) == ["c99", "c99_float"]

    def test_a_setting_of_the_target(self, model, tmp_path, answered, refused):
        answered("export", model, "--to", "c99", "--out", tmp_path, "--set", "max_iterations=7", "--no-verify")
        assert "at most 7 Gauss-Newton steps" in (tmp_path / "smoke.h").read_text(encoding="ascii")
        wrong = refused("export", model, "--to", "c99", "--out", tmp_path / "o", "--set", "max_iteration=7")
        assert "export 'c99' has no setting 'max_iteration'; did you mean 'max_iterations'?" in wrong
        both = refused("export", model, "--to", "c99,c99_float", "--out", tmp_path / "o", "--set", "max_iterations=9")
        assert "--set needs a single target" in both

    def test_unknown_target(self, model, tmp_path, refused):
        assert "unknown export 'c9'; did you mean 'c99'?" in refused("export", model, "--to", "c9", "--out", tmp_path)

    def test_out_is_a_file(self, model, tmp_path, refused):
        (tmp_path / "file").write_text("mine")
        assert "cannot write to" in refused("export", model, "--to", "c99", "--out", tmp_path / "file")

    def test_without_a_model_the_targets_are_listed(self, answered, refused, model):
        out, _ = answered("export")
        for name in exports.TARGETS:
            assert f"  {name}  " in out
        assert "an export needs --to NAME" in refused("export", model)


class TestReport:
    def test_writes_the_report_again(self, smoke_copy, answered):
        report = smoke_copy / "report.html"
        written = report.read_text(encoding="utf-8")
        report.unlink()
        before = contents(smoke_copy)
        out, _ = answered("report", smoke_copy)
        assert out.strip() == str(report)
        again = report.read_text(encoding="utf-8")
        report.unlink()
        assert contents(smoke_copy) == before
        # The first report could not yet say when it was done itself; nothing else may differ.
        changed = [a for a, b in zip(written.splitlines(), again.splitlines(), strict=True) if a != b]
        assert all("<th>seconds</th>" in line or "<th>ran</th>" in line for line in changed)

    def test_refuses_what_is_no_run_folder(self, tmp_path, refused):
        assert "is not a run folder" in refused("report", tmp_path)
        assert "is not a run folder" in refused("report", tmp_path / "nowhere")
        assert "is not a run folder" in refused("report", SMOKE)


class TestSameAsPython:
    def test_the_command_writes_what_the_function_writes(self, smoke, tmp_path, no_report, answered):
        answered("run", SMOKE, "--out", tmp_path / "out", *SET_SMALL)
        assert reproducible(tmp_path / "out") == reproducible(smoke.path)


def test_the_shortest_config_is_good():
    """The bad configs above differ from it by one thing each."""
    assert parse_config(MINIMAL).name == "bad"

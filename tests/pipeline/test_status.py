"""What a person sees while a study runs and after: ``flexdoce status``, the progress line, ``log.txt``."""

import io
import json
import re
import time

import pytest
from rich.console import Console

import pipeline.console
from pipeline import monitor
from pipeline.cli import main
from pipeline.lock import LOCK, FolderLock
from pipeline.monitor import Monitor, State, state_json
from pipeline.status import read_status
from pipeline.store import RunFolder
from pipeline.tally import Tally, Watcher, duration, failures, speed
from tests.pipeline.cases import A, Counted, D, config_text, contents

FAST = ["--set", "fit.design={method='sobol', n_runs=16}", "--set", "validation.n_runs=20",
        "--set", "export.verify=false", "--set", "oracle.max_failed_fraction=0.4"]  # fmt: skip


@pytest.fixture
def argv(counted, tmp_path, no_report):
    config = tmp_path / "study.toml"
    config.write_text(config_text(), encoding="utf-8")
    return ["run", str(config), "--out", str(tmp_path / "out"), *FAST]


def fails_in_the_fit(point) -> None:
    if point[D] == 15.0 and point[A] > 0.7:
        raise ArithmeticError("the solver gave up")


def number(pattern: str, text: str) -> int:
    found = re.search(pattern, text)
    assert found, text
    return int(found[1])


class TestStatus:
    def test_from_within_a_run(self, argv, counted, tmp_path, capsys, monkeypatch):
        """Asked by the oracle itself, at a moment that is known."""
        said = []
        monkeypatch.setattr(monitor, "STATE_EVERY", 0.0)

        def trouble(point):
            if len(counted.asked) == 21:
                said.append(read_status(RunFolder(tmp_path / "out")).lines())
            fails_in_the_fit(point)

        Counted.trouble = staticmethod(trouble)
        assert main(argv) == 0
        text = "\n".join(said[0])
        done, failed = (number(p, text) for p in (r"fit, (\d+) of 16 runs", r"(\d+) failed \("))
        assert re.search(r"^out: running \(process \d+ on \S+, since ", text)
        assert failed == number(r"Failed: (\d+) crashed; the last: ArithmeticError: the solver gave up", text)
        assert failed > 0
        # All points of the screening differ here but one, and 21 have been answered.
        assert f"Stored: {21 + failed} points, 21 of them answered" in text
        assert done == 21 + failed - len({p for p in counted.asked[:21] if p[D] != 15.0})
        assert re.search(r"\d runs/(s|min), about \d+ \w+ left", text)
        assert "log.txt" in text

    def test_of_a_finished_run(self, argv, tmp_path, capsys):
        assert main(argv) == 0
        capsys.readouterr()
        before = contents(tmp_path / "out")
        assert main(["status", str(tmp_path / "out")]) == 0
        out = capsys.readouterr().out
        assert re.match(r"out: finished \d+ s ago\n", out)
        assert "Go on" not in out
        assert contents(tmp_path / "out") == before

    def test_of_one_that_was_stopped_says_how_to_go_on(self, argv, counted, tmp_path, capsys):
        def trouble(point):
            if len(counted.asked) == 5:
                raise KeyboardInterrupt

        Counted.trouble = staticmethod(trouble)
        assert main(argv) == 130
        assert main(["status", str(tmp_path / "out")]) == 0
        out = capsys.readouterr().out
        assert "stopped by hand" in out
        assert "Stage: screening, " in out
        command = next(line for line in out.splitlines() if line.startswith("Go on: "))
        Counted.trouble = staticmethod(lambda point: None)
        assert main(command.removeprefix("Go on: flexdoce ").split()) == 0
        assert (tmp_path / "out" / "model.json").is_file()

    def test_of_one_that_was_killed(self, argv, tmp_path, capsys):
        assert main(argv) == 0
        state = json.loads((tmp_path / "out" / "state.json").read_text())
        (tmp_path / "out" / "state.json").write_text(json.dumps(state | {"ended": ""}))
        (tmp_path / "out" / LOCK).write_text('{"pid": 1, "host": "x", "since": "then"}')
        main(["status", str(tmp_path / "out")])
        assert "not running; it ended without a word, last heard of" in capsys.readouterr().out

    def test_of_one_that_failed_says_why(self, argv, tmp_path, capsys):
        Counted.trouble = staticmethod(fails_in_the_fit)
        assert main([*argv, "--set", "oracle.max_failed_fraction=0.01"]) == 3
        main(["status", str(tmp_path / "out")])
        out = capsys.readouterr().out
        assert re.search(r"out: failed \d+ s ago: fit: \d of 16 runs failed", out)
        assert "Go on: flexdoce run " in out

    @pytest.mark.parametrize("text", ["", "{", "[]", '{"study": 1}', '{"study": "x", "pid": "?"}', "[" * 100_000])
    def test_a_damaged_state_is_no_obstacle(self, text, argv, tmp_path, capsys):
        assert main(argv) == 0
        (tmp_path / "out" / "state.json").write_text(text)
        capsys.readouterr()
        assert main(["status", str(tmp_path / "out")]) == 0
        assert capsys.readouterr().out.startswith("out: not running\nStored: ")

    def test_a_damaged_store_is_told(self, argv, tmp_path, capsys):
        assert main(argv) == 0
        (tmp_path / "out" / "points.sqlite").write_bytes(b"garbage" * 200)
        capsys.readouterr()
        assert main(["status", str(tmp_path / "out")]) == 0
        assert "cannot read the point store" in capsys.readouterr().out

    def test_of_no_run_folder(self, tmp_path, capsys):
        assert main(["status", str(tmp_path)]) == 2
        assert "is not a run folder" in capsys.readouterr().err

    def test_watch_ends_with_the_run(self, argv, tmp_path, capsys, monkeypatch):
        assert main(argv) == 0
        lock, looks = FolderLock(tmp_path / "out"), []

        def sleep(seconds):
            looks.append(seconds)
            if len(looks) == 3:
                lock.release()

        capsys.readouterr()
        monkeypatch.setattr("pipeline.commands.time.sleep", sleep)
        assert main(["status", str(tmp_path / "out"), "--watch"]) == 0
        assert looks == [2.0] * 3
        assert capsys.readouterr().out.count("out: running") == 3

    def test_one_without_an_answer_for_long_says_so(self, argv, tmp_path):
        assert main(argv) == 0
        folder = RunFolder(tmp_path / "out")
        state = State("study", 1, "h", 0.0, 1000.0, "fit", 10, 30, 0, {}, 0.5, 40.0)
        folder.write("state.json", state_json(state))
        lock = FolderLock(folder.path)
        try:
            assert "about 30 s left" in read_status(folder, lambda: 1010.0).lines()[1]
            late = read_status(folder, lambda: 1500.0).lines()[1]
            assert late == "Stage: fit, 10 of 30 runs, 30 runs/min, about 0 s left, no answer for 8 min"
        finally:
            lock.release()


class TestLog:
    def test_reads_well_and_is_added_to(self, argv, tmp_path):
        Counted.trouble = staticmethod(fails_in_the_fit)
        assert main(argv) == 0
        log = tmp_path / "out" / "log.txt"
        first = log.read_text(encoding="utf-8")
        assert all(re.match(r"\d{4}-\d\d-\d\d \d\d:\d\d:\d\d  \S", line) for line in first.splitlines())
        said = [line[21:] for line in first.splitlines()]
        assert re.match(r"flexdoce \S+, study study, process \d+ on \S+: begins", said[0])
        assert re.match(r"finished after \d+ s", said[-1])
        assert sum(s.endswith("failed: crashed (ArithmeticError: the solver gave up)") for s in said) > 0
        assert any(
            re.match(r"fit: 16 runs done, \d failed \(\d crashed\); \d+ new in \d+ s, \d+ known", s) for s in said
        )
        assert main(argv) == 0
        again = log.read_text(encoding="utf-8")
        assert again.startswith(first)
        assert "continues" in again[len(first) :]

    def test_fresh_begins_a_new_one(self, argv, tmp_path):
        assert main(argv) == 0
        assert main([*argv, "--fresh"]) == 0
        assert (tmp_path / "out" / "log.txt").read_text().count("flexdoce") == 1

    def test_many_failures_are_cut_short(self, tmp_path):
        with Monitor(RunFolder(tmp_path), "x", lambda *told: None) as one:
            news = tuple(f"run {i} failed: crashed (no)" for i in range(50))
            one.tally(Tally("fit", 50, 100, failed={"crashed": 50}, news=news))
        text = (tmp_path / "log.txt").read_text()
        assert text.count("crashed (no)") == monitor.MOST_REASONS
        assert "further failures are in fit/runs.csv" in text

    def test_a_line_a_minute(self, tmp_path):
        now = [1000.0]
        with Monitor(RunFolder(tmp_path), "x", lambda *told: None, lambda: now[0]) as one:
            for done in range(101):
                one.tally(Tally("fit", done, 101, seconds=2.0 * done))
                now[0] += 2.0
        assert (tmp_path / "log.txt").read_text().count("of 101 runs, 30 runs/min, about ") == 3

    def test_reasons_of_several_lines_stay_one(self, tmp_path):
        with Monitor(RunFolder(tmp_path), "x", lambda *told: None) as one:
            one.note("said\nno\r\n and \udcff went")
        assert len((tmp_path / "log.txt").read_text().splitlines()) == 3

    def test_a_disk_that_refuses_it_stops_nothing(self, argv, tmp_path, monkeypatch):
        def full(self):
            raise OSError(28, "No space left on device")

        monkeypatch.setattr("logging.FileHandler.flush", full)
        assert main(argv) == 0


class TestProgress:
    def lines(self, monkeypatch, *tallies, every=1.0):
        now, text = [0.0], io.StringIO()
        monkeypatch.setattr(pipeline.console, "_errors", Console(file=text, width=200, force_terminal=False))
        told = pipeline.console._Lines(lambda: now[0])
        for one in tallies:
            told.tally(one)
            now[0] += every
        return text.getvalue().splitlines()

    def test_lines_where_there_is_no_terminal(self, monkeypatch):
        tallies = [Tally("fit", n, 100, 10, {"crashed": 3} if n > 20 else {}, n - 10.0) for n in range(10, 101)]
        assert self.lines(monkeypatch, *tallies) == [
            "fit: 40 of 100 runs, 3 failed (3 crashed), 1 runs/s, about 60 s left",
            "fit: 70 of 100 runs, 3 failed (3 crashed), 1 runs/s, about 30 s left",
            "fit: 100 runs done (10 known from before), 3 failed (3 crashed)",
        ]

    def test_a_quick_stage_is_one_line(self, monkeypatch):
        assert self.lines(monkeypatch, Tally("fit", 0, 9), Tally("fit", 9, 9)) == ["fit: 9 runs done"]
        assert self.lines(monkeypatch, Tally("export", 0, 0), Tally("export", 1, 1)) == ["export: done"]

    def test_the_bar_of_a_terminal_has_failures_rate_and_time_left(self, monkeypatch):
        text = io.StringIO()
        terminal = Console(file=text, width=140, force_terminal=True, color_system=None)
        monkeypatch.setattr(pipeline.console, "_errors", terminal)
        with pipeline.console.progress_bars() as told:
            told("screening", 3, 12)
            assert isinstance(told, Watcher)
            told.tally(Tally("fit", 12, 32, 2, {"timed_out": 1}, 20.0))
            time.sleep(0.2)
        assert "12/32" in text.getvalue()
        assert "1 failed (1 timed_out), 30 runs/min, about 40 s left" in text.getvalue()
        assert "3/12" in text.getvalue()


class TestWords:
    @pytest.mark.parametrize(
        ("seconds", "text"),
        [
            (0.2, "0 s"),
            (99.0, "99 s"),
            (100.0, "2 min"),
            (3600.0, "60 min"),
            (12000.0, "3 h 20 min"),
            (3e5, "3 days 11 h"),
        ],
    )
    def test_duration(self, seconds, text):
        assert duration(seconds) == text

    @pytest.mark.parametrize(
        ("rate", "text"), [(12.3456, "12.3 runs/s"), (0.5, "30 runs/min"), (0.01, "36 runs/h"), (1e-4, "0.36 runs/h")]
    )
    def test_speed(self, rate, text):
        assert speed(rate) == text

    def test_failures(self):
        assert failures({"timed_out": 1, "crashed": 2}) == "3 failed (2 crashed, 1 timed_out)"

    def test_what_was_known_is_no_measure_of_speed(self):
        assert Tally("fit", 50, 100, known=50, seconds=3.0).left is None
        assert Tally("fit", 60, 100, known=50, seconds=5.0).left == 20.0

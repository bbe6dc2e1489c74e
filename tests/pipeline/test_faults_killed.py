"""A run that is killed, politely or not, goes on as if it had not been; and what is left of a beginning."""

import os
import random
import signal
import time
from contextlib import suppress

import pytest

import pipeline
import pipeline.lock
import pipeline.store
from pipeline import InputError
from pipeline.lock import LOCK, holder
from pipeline.store import RunFolder
from tests.pipeline.cases import Counted, config_text, contents, reproducible
from tests.pipeline.faults import asked, needs_fork


@needs_fork
class TestKilled:
    @pytest.mark.parametrize("seed", range(8))
    def test_at_any_instant_it_ends_as_if_it_had_not_been(self, seed, server, whole, tmp_path):
        """Killed three times at random, then continued: the same bytes, and no stored answer paid for again."""
        folder, seconds, expected = whole
        instants, kills = random.Random(seed), 0
        for _ in range(3):
            child = server.begin(tmp_path / "run", tmp_path / "notes.txt")
            time.sleep(instants.uniform(0.0, 0.8) * seconds)
            with suppress(ProcessLookupError):  # it was done
                os.kill(child, signal.SIGKILL)
            kills += server.end() == -signal.SIGKILL
        assert kills, "no process was killed while it ran"
        assert server.run(tmp_path / "run", tmp_path / "notes.txt") == 0, (tmp_path / "notes.err").read_text()
        assert reproducible(tmp_path / "run") == reproducible(folder)
        found = asked(tmp_path / "notes.txt")
        assert found.keys() == expected.keys()
        assert found.total() - len(found) <= kills, "more was paid for twice than what was in flight"
        assert set(contents(tmp_path / "run")) == set(contents(folder)), "something was left lying about"

    def test_the_log_says_so(self, server, whole, tmp_path):
        child = server.begin(tmp_path / "run", tmp_path / "notes.txt")
        until = time.monotonic() + 20.0
        while len(asked(tmp_path / "notes.txt")) < 14 and time.monotonic() < until:
            time.sleep(0.005)
        os.kill(child, signal.SIGKILL)
        assert server.end() == -signal.SIGKILL
        assert (tmp_path / "run" / LOCK).exists()
        assert holder(tmp_path / "run") is None
        assert server.run(tmp_path / "run", tmp_path / "notes.txt") == 0
        log = (tmp_path / "run" / "log.txt").read_text()
        assert f"the run before (process {child} on " in log
        assert "ended without a word" in log
        assert f"the lock of process {child} on " in log
        assert "known from before" in log

    @pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP, signal.SIGINT])
    def test_politely_ends_like_ctrl_c(self, number, server, whole, tmp_path):
        child = server.begin(tmp_path / "run", tmp_path / "notes.txt")
        until = time.monotonic() + 20.0
        while len(asked(tmp_path / "notes.txt")) < 5 and time.monotonic() < until:
            time.sleep(0.005)
        os.kill(child, number)
        assert server.end() == 128 + number
        said = (tmp_path / "notes.err").read_text()
        assert "stopped; run the same command to continue" in said
        assert "Traceback" not in said
        assert "stopped by hand in " in (tmp_path / "run" / "log.txt").read_text()
        assert not {LOCK, "points.sqlite-wal", "points.sqlite-shm"} & set(contents(tmp_path / "run"))
        assert server.run(tmp_path / "run", tmp_path / "notes.txt") == 0
        assert reproducible(tmp_path / "run") == reproducible(whole[0])


class TestBeginnings:
    @pytest.mark.parametrize("left", [[], ["config.toml.partial"], [LOCK], ["log.txt", "state.json.partial", LOCK]])
    def test_what_is_left_of_one_killed_before_it_had_a_config(self, left, run, finished, tmp_path):
        folder = tmp_path / "broken"
        folder.mkdir()
        for name in left:
            (folder / name).write_text("half of")
        assert run(folder)[0] == 0
        assert reproducible(folder) == reproducible(finished)

    def test_a_refused_claim_leaves_no_lock(self, counted, tmp_path):
        config = tmp_path / "study.toml"
        config.write_text(config_text(), encoding="utf-8")
        (tmp_path / "out").mkdir()
        (tmp_path / "out" / "mine.txt").write_text("mine")
        with pytest.raises(InputError, match="is no run folder"):
            RunFolder.claim(tmp_path / "out", pipeline.load_config(config))
        assert list(contents(tmp_path / "out")) == ["mine.txt"]

    def test_an_unforeseen_error_lets_go_of_the_folder(self, run, counted, tmp_path, monkeypatch):
        def bug(*arguments):
            raise RuntimeError("a bug")

        monkeypatch.setattr("pipeline.stages.screened", bug)
        with pytest.raises(RuntimeError, match="a bug"):
            run(tmp_path / "out")
        assert holder(tmp_path / "out") is None
        assert "failed in screening, 12 of 12 runs: RuntimeError: a bug" in (tmp_path / "out" / "log.txt").read_text()
        monkeypatch.undo()
        n = len(Counted.asked)
        assert n > 5

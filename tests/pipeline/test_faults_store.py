"""A store that is damaged, or holds the answers of another oracle."""

import os

import pytest

from tests.pipeline.cases import reproducible
from tests.pipeline.faults import changed, last


class TestDamagedStore:
    @pytest.mark.parametrize(
        ("damage", "words"),
        [
            (lambda p: p.write_bytes(b"garbage" * 100), "file is not a database"),
            (lambda p: p.write_bytes(p.read_bytes()[: p.stat().st_size // 2]), "malformed"),
            (lambda p: p.write_bytes(p.read_bytes()[:-4096] + b"\xa5" * 4096), "cannot use the point store"),
            (lambda p: changed(p, "DROP TABLE points; CREATE TABLE points (a, b)"), "no column 'key'"),
            (lambda p: changed(p, "PRAGMA user_version = 99"), "that of a newer flexdoce"),
            (
                lambda p: changed(p, "UPDATE points SET responses = replace(responses, '1', '2')"),
                "not as it was written",
            ),
        ],
        ids=["garbage", "truncated", "a page overwritten", "another schema", "newer", "a digit changed"],
    )
    def test_is_refused_and_fresh_or_moving_away_helps(self, damage, words, run, finished, tmp_path):
        expected = reproducible(finished)
        damage(finished / "points.sqlite")
        code, err = run(finished)
        assert code == 2
        assert "points.sqlite" in last(err)
        assert words in last(err)
        assert "move it away or use --fresh" in last(err)
        assert reproducible(finished) == expected, "the files of the finished study were touched"
        (finished / "points.sqlite").rename(tmp_path / "away.sqlite")
        assert run(finished)[0] == 0
        assert reproducible(finished) == expected

    def test_fresh_starts_anew(self, run, finished):
        expected = reproducible(finished)
        (finished / "points.sqlite").write_bytes(b"garbage" * 100)
        assert run(finished, "--fresh")[0] == 0
        assert reproducible(finished) == expected

    def test_a_log_of_another_database_is_not_mixed_in(self, run, finished):
        """A stray log beside the file: SQLite's salts tell that it is not its own."""
        (finished / "points.sqlite-wal").write_bytes(os.urandom(8192))
        assert run(finished)[0] == 0


class TestChangedOracle:
    def test_is_run_anew_and_said(self, run, finished, counted, monkeypatch):
        monkeypatch.setattr(counted, "version", "2")
        assert run(finished)[0] == 0
        n = len(counted.asked)
        assert n == len(set(counted.asked)) > 30
        log = (finished / "log.txt").read_text()
        assert f"the {n} points in points.sqlite are answers of another oracle, version or parameters" in log
        monkeypatch.undo()
        counted.asked.clear()

"""Disks that are full, read-only, or far away."""

import errno
import os
import shutil
import sqlite3
import subprocess
from pathlib import Path

import numpy as np
import pytest

import pipeline
import pipeline.lock
import pipeline.store
from experiments import Status, oracles
from experiments.oracles import Answers
from pipeline import database
from pipeline.cli import main
from pipeline.points import PointStore
from tests.pipeline.cases import contents, reproducible
from tests.pipeline.faults import changed, last


class TestDiskFull:
    def test_at_every_single_write_of_a_file(self, run, finished, counted, tmp_path, monkeypatch):
        """The first write fails, then the second …: each time one sentence, and in the end the same bytes."""
        written, flush = [], pipeline.lock.flushed

        def full(path):
            written.append(path.name)
            if len(written) == limit:
                raise OSError(errno.ENOSPC, "No space left on device", str(path))
            flush(path)

        monkeypatch.setattr(pipeline.store, "flushed", full)
        folder, codes = tmp_path / "full", []
        for limit in range(1, 40):  # noqa: B007 - used in `full`
            written.clear()
            code, err = run(folder)
            codes.append(code)
            if code == 0:
                break
            assert "No space left on device" in last(err)
            assert "Traceback" not in err
        assert len(codes) > 10
        assert codes[-1] == 0
        assert set(codes[:-1]) <= {1, 2}
        assert len(counted.asked) == len(set(counted.asked)), "a point was paid for twice"
        assert reproducible(folder) == reproducible(finished)

    def test_for_the_store(self, run, finished, counted, tmp_path, monkeypatch):
        """SQLite's own limit of pages: what it says is what a full disk makes it say."""
        connect = database.connect

        def small(path):
            db = connect(path)
            db.execute("PRAGMA max_page_count = 8")
            return db

        monkeypatch.setattr(database, "connect", small)
        code, err = run(tmp_path / "full")
        assert code == 1
        assert "points.sqlite: no space left on the device; run the same command to continue" in last(err)
        assert "no space left" in (tmp_path / "full" / "log.txt").read_text()
        n = len(counted.asked)
        assert n > 5
        monkeypatch.setattr(database, "connect", connect)
        assert run(tmp_path / "full")[0] == 0
        assert reproducible(tmp_path / "full") == reproducible(finished)
        assert len(counted.asked) - len(set(counted.asked)) <= 1, "more than the point without room was lost"

    def test_of_a_real_file_system(self, run, finished, counted, tmp_path):
        place = tmp_path / "small"
        place.mkdir()
        mount = shutil.which("mount")
        done = subprocess.run([str(mount), "-t", "tmpfs", "-o", "size=96k", "tmpfs", str(place)],
                              capture_output=True, check=False) if mount and os.geteuid() == 0 else None  # fmt: skip
        if done is None or done.returncode:
            pytest.skip("NO TMPFS: only root may mount one; a disk that is really full was not tried")
        try:
            code, err = run(place / "run")
            assert code == 1
            assert "o space left" in last(err) or "the disk refuses" in last(err)
            subprocess.run([str(mount), "-o", "remount,size=16m", str(place)], check=True)
            assert run(place / "run")[0] == 0
            assert reproducible(place / "run") == reproducible(finished)
            assert len(counted.asked) - len(set(counted.asked)) <= 1
        finally:
            subprocess.run(["umount", str(place)], check=True)


class TestReadOnly:
    def test_folder_is_refused_with_one_sentence(self, run, finished, counted):
        """A mount, for root may write whatever the mode says."""
        mount = shutil.which("mount")
        is_root = mount is not None and os.geteuid() == 0
        before = contents(finished)
        if is_root:
            bind = [str(mount), "--bind", str(finished), str(finished)]
            if subprocess.run(bind, capture_output=True, check=False).returncode:
                pytest.skip("NO MOUNT: a folder that is really read-only was not tried")
            subprocess.run([str(mount), "-o", "remount,ro,bind", str(finished)], check=True)
        else:
            finished.chmod(0o555)
        try:
            code, err = run(finished)
            assert code == 2
            words = "Read-only file system" if is_root else "Permission denied"
            assert last(err) == f"flexdoce: cannot use the output folder {finished}: {words}"
            assert main(["status", str(finished)]) == 0
            assert contents(finished) == before
            assert counted.asked == []
        finally:
            if is_root:
                subprocess.run(["umount", str(finished)], check=True)
            else:
                finished.chmod(0o755)

    def test_while_it_runs(self, run, finished, tmp_path, monkeypatch):
        """The mount goes read-only under the store, as Linux does with a failing disk."""
        write = database.write
        calls = []

        def read_only(db, rows):
            calls.append(1)
            if len(calls) == 7:
                db.execute("PRAGMA query_only = ON")
            write(db, rows)

        monkeypatch.setattr(database, "write", read_only)
        code, err = run(tmp_path / "out")
        assert code == 1
        assert "points.sqlite: it cannot be written; run the same command to continue" in last(err)
        monkeypatch.setattr(database, "write", write)
        assert run(tmp_path / "out")[0] == 0
        assert reproducible(tmp_path / "out") == reproducible(finished)


class TestNetworkFolder:
    def test_where_a_write_ahead_log_fails_the_rollback_journal_does(self, counted, tmp_path, monkeypatch):
        connect, modes = database.connect, []

        class Refusing(sqlite3.Connection):
            def execute(self, sql, *more):
                if sql == "PRAGMA journal_mode = WAL":
                    raise sqlite3.OperationalError("locking protocol")
                modes.append(sql)
                return super().execute(sql, *more)

        def refusing(path):
            db = sqlite3.connect(path, factory=Refusing)
            db.execute("PRAGMA synchronous = FULL")
            return db

        monkeypatch.setattr(database, "connect", refusing)
        with PointStore(tmp_path / "p.sqlite", oracles.get("counted")) as store:
            assert store._db.execute("PRAGMA journal_mode").fetchone() == ("delete",)
            assert store._db.execute("PRAGMA synchronous").fetchone() == (2,)
        monkeypatch.setattr(database, "connect", connect)

    def test_where_there_is_no_shared_memory(self, counted, tmp_path, monkeypatch):
        """SQLite's own way of doing without: its dot-file locks, with which a file in WAL mode cannot be opened."""
        changed(tmp_path / "p.sqlite", "PRAGMA journal_mode = WAL; CREATE TABLE other (a)")

        def without(path):
            return sqlite3.connect(f"{path.as_uri()}?vfs=unix-dotfile", uri=True)

        with pytest.raises(sqlite3.OperationalError, match="unable to open"):
            without(tmp_path / "p.sqlite").execute("SELECT * FROM other")
        monkeypatch.setattr(database, "connect", without)
        point = np.zeros((1, 4))
        with PointStore(tmp_path / "p.sqlite", oracles.get("counted")) as store:
            assert store._db.execute("PRAGMA journal_mode").fetchone() == ("delete",)
            assert store.known(store.keys(point)) == {}
            store.add(store.keys(point), point, Answers(np.ones((1, 2)), [Status.OK], [""]))
            assert len(store.known(store.keys(point))) == 1

    def test_a_file_left_in_wal_mode_is_brought_over(self, counted, tmp_path, monkeypatch):
        changed(tmp_path / "p.sqlite", "PRAGMA journal_mode = WAL; CREATE TABLE other (a)")
        monkeypatch.setattr(database, "on_network", lambda path: True)
        with PointStore(tmp_path / "p.sqlite", oracles.get("counted")) as store:
            assert store._db.execute("PRAGMA journal_mode").fetchone() == ("delete",)

    @pytest.mark.parametrize(
        ("place", "expected"),
        [("/net/data/run", True), ("/net", True), ("/network", False), ("/home/a b/c", True), ("/home", False)],
    )
    def test_is_told_by_its_mount(self, place, expected, tmp_path):
        mounts = tmp_path / "mounts"
        mounts.write_text("/dev/a / ext4 rw 0 0\nserver:/x /net nfs4 rw 0 0\nserver:/y /home/a\\040b cifs rw 0 0\n")
        assert database.on_network(Path(place), mounts) is expected

    def test_no_list_of_mounts(self, tmp_path):
        assert database.on_network(tmp_path, tmp_path / "nothing") is False

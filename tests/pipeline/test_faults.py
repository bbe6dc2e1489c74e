"""What can go wrong while a study runs: every row of the table in docs/reliability.md that is the store's."""

import errno
import json
import os
import random
import shutil
import signal
import sqlite3
import subprocess
import sys
import threading
import time
from collections import Counter
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest

import pipeline
import pipeline.lock
import pipeline.store
from experiments import Status, oracles
from experiments.oracles import Answers
from pipeline import InputError, database
from pipeline.cli import main
from pipeline.lock import LOCK, FolderLock, Owner, holder
from pipeline.points import PointStore
from pipeline.store import RunFolder
from tests.pipeline.cases import Counted, config_text, contents, reproducible
from tests.pipeline.slow_study import HOLD

ROOT = Path(__file__).parents[2]

SET_SMALL = [
    "--set",
    'fit.design={method="sobol", n_runs=16}',
    "--set",
    "validation.n_runs=20",
    "--set",
    "export.verify=false",
]

needs_fork = pytest.mark.skipif(not hasattr(os, "fork"), reason="NO FORK: processes were not killed on this system")


class Server:
    """The processes of tests.pipeline.slow_study."""

    def __init__(self) -> None:
        self.process = subprocess.Popen(
            [sys.executable, "-m", "tests.pipeline.slow_study"], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
            text=True, cwd=ROOT, env={**os.environ, "OMP_NUM_THREADS": "1"},
        )  # fmt: skip

    def _line(self) -> int:
        assert self.process.stdout is not None
        return int(self.process.stdout.readline())

    def begin(self, folder: Path, notes: Path, *arguments: str) -> int:
        assert self.process.stdin is not None
        order = {"folder": str(folder), "notes": str(notes), "arguments": list(arguments)}
        self.process.stdin.write(json.dumps(order) + "\n")
        self.process.stdin.flush()
        return self._line()

    def end(self) -> int:
        return self._line()

    def close(self) -> None:
        assert self.process.stdin is not None
        self.process.stdin.close()
        self.process.wait(timeout=20)

    def run(self, folder: Path, notes: Path, *arguments: str) -> int:
        self.begin(folder, notes, *arguments)
        return self.end()


@pytest.fixture(scope="module")
def server():
    one = Server()
    yield one
    one.close()


@pytest.fixture(scope="module")
def whole(server, tmp_path_factory):
    """The uninterrupted study: its folder, its seconds, and what its oracle was asked."""
    place = tmp_path_factory.mktemp("whole")
    server.run(place / "first", place / "first.txt")  # the first one warms caches up
    began = time.monotonic()
    code = server.run(place / "run", place / "notes.txt")
    seconds = time.monotonic() - began
    assert code == 0, (place / "notes.err").read_text()
    assert reproducible(place / "run") == reproducible(place / "first")
    return place / "run", seconds, asked(place / "notes.txt")


def asked(notes: Path) -> Counter[str]:
    return Counter(notes.read_text().splitlines()) if notes.exists() else Counter()


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


@pytest.fixture
def run(counted, tmp_path, no_report, capsys):
    """Run the counted study by the command line; gives the exit code and what it said on standard error."""
    config = tmp_path / "study.toml"
    config.write_text(config_text(), encoding="utf-8")

    def call(folder: Path, *more: str) -> tuple[int, str]:
        code = main(["run", str(config), "--out", str(folder), *SET_SMALL, *more])
        return code, capsys.readouterr().err

    return call


@pytest.fixture
def finished(run, counted, tmp_path):
    """A finished study; its oracle has forgotten what it was asked."""
    assert run(tmp_path / "finished")[0] == 0
    counted.asked.clear()
    return tmp_path / "finished"


def last(err: str) -> str:
    """The one sentence that an error is."""
    assert "Traceback" not in err
    return err.splitlines()[-1]


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


class TestTwoRuns:
    def test_the_second_is_refused_with_who_has_it(self, run, finished):
        before = contents(finished)
        lock = FolderLock(finished)
        try:
            code, err = run(finished)
            me = Owner.me()
            assert code == 2
            assert f"another run is at work in {finished} (process {me.pid} on {me.host}, since " in last(err)
            assert {k: v for k, v in contents(finished).items() if k != LOCK} == before
            assert holder(finished) is not None
        finally:
            lock.release()
        assert contents(finished) == before
        assert run(finished)[0] == 0

    @needs_fork
    def test_in_two_processes(self, server, whole, tmp_path, run):
        hold = tmp_path / f"notes{HOLD}"
        hold.touch()
        child = server.begin(tmp_path / "run", tmp_path / "notes.txt")
        until = time.monotonic() + 60.0
        while not asked(tmp_path / "notes.txt") and time.monotonic() < until:
            time.sleep(0.005)
        try:
            with pytest.raises(InputError, match=f"another run is at work .*process {child} on "):
                FolderLock(tmp_path / "run")
        finally:
            hold.unlink()
        assert server.end() == 0
        assert reproducible(tmp_path / "run") == reproducible(whole[0])

    def test_of_many_at_once_one_gets_in(self, tmp_path):
        got, refused, gate = [], [], threading.Barrier(8)

        def enter():
            gate.wait()
            try:
                got.append(FolderLock(tmp_path))
            except InputError as error:
                refused.append(str(error))

        threads = [threading.Thread(target=enter) for _ in range(8)]
        [t.start() for t in threads]
        [t.join() for t in threads]
        assert len(got) == 1
        assert len(refused) == 7
        got[0].release()
        assert list(tmp_path.iterdir()) == []

    @pytest.mark.parametrize(
        ("owner", "is_free"),
        [
            (Owner(2**22 + 1, Owner.me().host, "then"), True),  # beyond the highest process id of Linux
            (Owner(os.getpid(), Owner.me().host, "then"), False),
            (Owner(1, "another-host", "then"), False),
        ],
        ids=["dead", "alive", "elsewhere"],
    )
    def test_where_locks_do_not_work_the_file_is_believed(self, owner, is_free, tmp_path, monkeypatch):
        """As on NFS without its lock daemon: flock says ENOLCK."""

        def flock(descriptor, how):
            raise OSError(errno.ENOLCK, "No locks available")

        monkeypatch.setattr("fcntl.flock", flock)
        (tmp_path / LOCK).write_text(json.dumps({"pid": owner.pid, "host": owner.host, "since": owner.since}))
        assert holder(tmp_path) == (None if is_free else owner)
        if is_free:
            lock = FolderLock(tmp_path)
            assert lock.before == owner
            lock.release()
            assert not (tmp_path / LOCK).exists()
        else:
            with pytest.raises(InputError, match=f"another run is at work .*process {owner.pid} on {owner.host}"):
                FolderLock(tmp_path)
            assert (tmp_path / LOCK).exists()

    def test_a_lock_file_that_says_nothing_locks_nobody_out(self, tmp_path):
        """As after a power cut."""
        (tmp_path / LOCK).write_bytes(b"")
        FolderLock(tmp_path).release()


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


def changed(path: Path, script: str) -> None:
    db = sqlite3.connect(path)
    db.executescript(script)
    db.close()


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

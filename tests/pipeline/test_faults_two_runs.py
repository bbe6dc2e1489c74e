"""One run per folder: its lock, taken, left behind, and where locks do not work."""

import errno
import json
import os
import threading
import time

import pytest

from pipeline import InputError
from pipeline.lock import LOCK, FolderLock, Owner, holder
from tests.pipeline.cases import contents, reproducible
from tests.pipeline.faults import asked, last, needs_fork
from tests.pipeline.slow_study import HOLD


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

"""One run per folder: a lock that the system lets go when its process ends, however it ends; and the disk flushed."""

import json
import os
import socket
import sys
import time
from dataclasses import asdict, dataclass
from datetime import datetime
from pathlib import Path

from .errors import InputError

LOCK = "run.lock"
PLAIN = getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0)
"""How a lock is opened: what a link of that name points to is not emptied, and a pipe is not waited for."""

PATIENCE = 0.5
"""Seconds that a run waits for a lock; ``flexdoce status`` looks at it for an instant."""


@dataclass(frozen=True)
class Owner:
    """Who runs in a folder: process id, machine, and since when (ISO 8601)."""

    pid: int
    host: str
    since: str

    @classmethod
    def me(cls) -> "Owner":
        """This process."""
        return cls(os.getpid(), socket.gethostname(), datetime.now().astimezone().isoformat(timespec="seconds"))

    @property
    def is_alive(self) -> bool:
        """Whether the process may still run: of another machine's that is not known, so it may."""
        if self.host != socket.gethostname() or sys.platform == "win32":
            return True
        try:
            os.kill(self.pid, 0)
        except (ProcessLookupError, OverflowError):
            return False
        except OSError:
            return True
        return True

    def __str__(self) -> str:
        return f"process {self.pid} on {self.host}, since {self.since}"


class FolderLock:
    """The lock of a run folder, a file that is there while a run is.

    The system's lock on it decides. Only where locks do not work (some network folders) is what the file
    says believed: then a process that is known to be dead is taken over from, and any other is respected.

    Parameters
    ----------
    folder : Path

    Raises
    ------
    InputError
        If another run is at work there.
    OSError
        If the folder cannot be written.
    """

    def __init__(self, folder: Path) -> None:
        self.path = folder / LOCK
        self.before: Owner | None = None
        self._descriptor = self._acquired()

    def _acquired(self) -> int:
        until = time.monotonic() + PATIENCE
        while True:
            descriptor = os.open(self.path, os.O_RDWR | os.O_CREAT | PLAIN, 0o644)
            try:
                if self._is_mine(descriptor):
                    return descriptor
            except BaseException:
                os.close(descriptor)
                raise
            os.close(descriptor)
            if time.monotonic() > until:
                raise InputError(self._refusal())
            time.sleep(0.02)

    def _is_mine(self, descriptor: int) -> bool:
        is_locked, before = _locked(descriptor), _owner(descriptor)
        if is_locked is False or (is_locked is None and before is not None and before.is_alive):
            return False
        # Whoever held it before may have removed the file between our opening and our locking it.
        if not _is_at(descriptor, self.path):
            return False
        self.before = before
        os.ftruncate(descriptor, 0)
        os.lseek(descriptor, 0, os.SEEK_SET)
        os.write(descriptor, json.dumps(asdict(Owner.me())).encode())
        return True

    def _refusal(self) -> str:
        owner = _read(self.path)
        told = f" ({owner})" if owner else ""
        gone = ""
        if owner and owner.host != socket.gethostname():
            gone = f"; if that machine is gone, remove {self.path}"
        return (
            f"another run is at work in {self.path.parent}{told}: wait for it, watch it with flexdoce status, or name "
            f"another folder with --out{gone}"
        )

    def release(self) -> None:
        """Remove the file and let go of it; a second call does nothing."""
        if self._descriptor < 0:
            return
        descriptor, self._descriptor = self._descriptor, -1
        try:
            self.path.unlink(missing_ok=True)
        except OSError:
            pass  # the next run takes it over
        finally:
            os.close(descriptor)


def holder(folder: Path) -> Owner | None:
    """Who runs in a folder at this moment; None if nobody does. Changes nothing."""
    path = folder / LOCK
    try:
        descriptor = os.open(path, os.O_RDONLY | PLAIN)
    except OSError:
        return None
    try:
        owner, is_free = _owner(descriptor), _locked(descriptor, shared=True)
    except OSError:
        return None  # a folder or a pipe of that name
    finally:
        os.close(descriptor)
    if owner is None or is_free or (is_free is None and not owner.is_alive):
        return None
    return owner


def flushed(path: Path) -> None:
    """Wait until what was written to a file is on the disk."""
    descriptor = os.open(path, os.O_RDWR)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def _is_at(descriptor: int, path: Path) -> bool:
    """Whether the open file is the one that lies at `path` now."""
    try:
        return os.path.samestat(os.fstat(descriptor), path.stat())
    except FileNotFoundError:
        return False


def _read(path: Path) -> Owner | None:
    try:
        return _parsed(path.read_bytes())
    except OSError:
        return None


def _owner(descriptor: int) -> Owner | None:
    os.lseek(descriptor, 0, os.SEEK_SET)
    return _parsed(os.read(descriptor, 4096))


def _parsed(data: bytes) -> Owner | None:
    """The owner that a lock file names; None if it names none, as after a crash of the machine."""
    try:
        found = json.loads(data)
        return Owner(int(found["pid"]), str(found["host"]), str(found["since"]))
    except (ValueError, KeyError, TypeError, OverflowError, RecursionError):
        return None


if sys.platform == "win32":
    import msvcrt

    FAR = 1 << 30
    """The byte that is locked: Windows lets nobody read a locked one, and what lies before says who."""

    def _locked(descriptor: int, shared: bool = False) -> bool | None:
        os.lseek(descriptor, FAR, os.SEEK_SET)
        try:
            msvcrt.locking(descriptor, msvcrt.LK_NBLCK, 1)
        except OSError:
            return False
        return True
else:
    import fcntl

    def _locked(descriptor: int, shared: bool = False) -> bool | None:
        """Lock without waiting: True if we have it, False if somebody else has, None if locks do not work there."""
        try:
            fcntl.flock(descriptor, (fcntl.LOCK_SH if shared else fcntl.LOCK_EX) | fcntl.LOCK_NB)
        except BlockingIOError:
            return False
        except OSError:
            return None
        return True

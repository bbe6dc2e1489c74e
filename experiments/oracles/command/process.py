"""One process with all its children: started without a shell, watched, and ended for good."""

import os
import shutil
import signal
import subprocess
import time
import uuid
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from enum import Enum
from pathlib import Path
from typing import NamedTuple

from .checks import STDERR, STDOUT
from .folder import WorkFolder

INHERITED = ("PATH", "HOME", "USER", "LOGNAME", "LANG", "LC_ALL", "LC_CTYPE", "TZ", "TMPDIR")
"""Environment variables that every program gets, where they are set."""

MARK = "FLEXDOCE_POINT"
"""Variable by which descendants are known that left the process group."""

MOST_PRINTED = 256 * 2**20
"""Bytes that a program may print; one that runs wild would fill the disk."""

_RUNNING: dict[str, subprocess.Popen] = {}
"""By mark, what runs at this moment, in whatever thread."""

_LONGEST_PAUSE = 0.05
_LONGEST_DEATH = 10.0
"""Seconds for what was killed to be gone: a large memory takes long to free, a hung disk for ever."""


class End(Enum):
    """How a process ended."""

    BY_ITSELF = "by itself"
    TIME = "time limit"
    PRINTED = "printed too much"


class Ended(NamedTuple):
    """How a process ended; exit code, negative for a signal; wall time in s."""

    how: End
    code: int
    seconds: float


def program(argv: Sequence[str]) -> str | None:
    """Absolute path of the program that ``argv[0]`` names, as found on PATH; None if there is none."""
    found = shutil.which(argv[0])
    return found if found is not None and Path(found).is_absolute() else None


def environment(added: Mapping[str, str], inherit: Sequence[str]) -> dict[str, str]:
    """A small environment: what every program needs, what is passed on by name, and what is added."""
    passed = {name: os.environ[name] for name in (*INHERITED, *inherit) if name in os.environ}
    return {**passed, **added}


def run(argv: Sequence[str], folder: WorkFolder, variables: Mapping[str, str], limit: float, grace: float) -> Ended:
    """Run a program in `folder` until it ends, or is ended with all its children.

    Parameters
    ----------
    argv : sequence of str
        The first is the absolute path of the program.
    folder : WorkFolder
        Takes what it prints, too.
    variables : mapping
        The whole environment.
    limit, grace : float
        Seconds until SIGTERM, and from there to SIGKILL.

    Raises
    ------
    OSError
        If the program cannot be started.
    """
    mark = uuid.uuid4().hex
    sinks: list[int] = []
    started = time.monotonic()
    try:
        for name in (STDOUT, STDERR):
            sinks.append(folder.sink(name))
        process = subprocess.Popen(
            list(argv), cwd=folder.path, env={**variables, MARK: mark}, stdin=subprocess.DEVNULL,
            stdout=sinks[0], stderr=sinks[1], start_new_session=True, close_fds=True,
        )  # fmt: skip
    finally:
        for sink in sinks:
            os.close(sink)
    grace_left = 0.0  # when interrupted, at once
    _RUNNING[mark] = process
    try:
        how = _watch(process, started + limit, lambda: folder.size(STDOUT) + folder.size(STDERR) > MOST_PRINTED)
        grace_left = 0.0 if how is End.BY_ITSELF else grace
    finally:
        del _RUNNING[mark]
        _end(process, mark, grace_left)
    return Ended(how, process.returncode, time.monotonic() - started)


def end_all() -> None:
    """End what runs for other threads of this process, which is about to end itself or has no use for it."""
    for mark, running in list(_RUNNING.items()):
        _signal(running.pid, _living(running.pid, mark), signal.SIGKILL)


def _watch(process: subprocess.Popen, until: float, prints_too_much: Callable[[], bool]) -> End:
    pause = 1e-3
    while not _has_ended(process):
        if time.monotonic() >= until:
            return End.TIME
        if prints_too_much():
            return End.PRINTED
        time.sleep(max(0.0, min(pause, until - time.monotonic())))
        pause = min(2.0 * pause, _LONGEST_PAUSE)
    return End.PRINTED if prints_too_much() else End.BY_ITSELF


def _has_ended(process: subprocess.Popen) -> bool:
    """Whether it ended. Where possible it is not reaped: its number stays taken while its group lives."""
    if process.returncode is None and hasattr(os, "waitid"):
        return os.waitid(os.P_PID, process.pid, os.WEXITED | os.WNOHANG | os.WNOWAIT) is not None
    return process.poll() is not None


def _end(process: subprocess.Popen, mark: str, grace: float) -> None:
    """End the process, its session, and whatever carries its mark: politely for `grace` seconds, then not."""
    if grace > 0.0:
        _signal(process.pid, _living(process.pid, mark), signal.SIGTERM)
        until = time.monotonic() + grace
        while time.monotonic() < until and (not _has_ended(process) or _living(process.pid, mark)):
            time.sleep(_LONGEST_PAUSE)
    seen: set[int] = set()
    until = time.monotonic() + _LONGEST_DEATH
    while time.monotonic() < until:  # one that forks while it is being killed needs more than one round
        _signal(process.pid, living := _living(process.pid, mark), signal.SIGKILL)
        seen = {number for number in seen.union(living) if _is_living(number)}
        if not seen and _has_ended(process):
            break
        time.sleep(1e-3)
    process.wait()


def _signal(leader: int, others: Sequence[int], what: signal.Signals) -> None:
    """Signal a process group, and processes outside of it."""
    with suppress(ProcessLookupError, PermissionError):  # gone; macOS says so of a group of the dead
        os.killpg(leader, what)
    for number in others:
        with suppress(ProcessLookupError, PermissionError):
            os.kill(number, what)


def _is_living(number: int) -> bool:
    """Whether a process still runs; one that is dying has lost its environment, and so its mark, before that."""
    try:
        return (Path("/proc") / str(number) / "stat").read_text().rpartition(")")[2].split()[0] not in "ZX"
    except (OSError, UnicodeDecodeError, IndexError):
        return False


def _living(leader: int, mark: str) -> list[int]:
    """Numbers of living processes of the leader's session, or with the mark; only where there is ``/proc``."""
    found, wanted = [], f"{MARK}={mark}".encode()
    proc = Path("/proc")
    if not (proc / "self" / "stat").exists():
        return found
    for place in proc.iterdir():
        if not place.name.isdigit() or int(place.name) == os.getpid():
            continue
        try:
            # After the name in parentheses: state, parent, group, session.
            state, _, group, session = (place / "stat").read_text().rpartition(")")[2].split()[:4]
            ours = (
                int(group) == leader
                or int(session) == leader
                or wanted in (place / "environ").read_bytes().split(b"\0")
            )
        except (OSError, ValueError, UnicodeDecodeError):
            continue  # gone, or somebody else's
        if ours and state not in "ZX":
            found.append(int(place.name))
    return found

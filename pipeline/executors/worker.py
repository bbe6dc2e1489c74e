"""What runs in a worker process, wherever it is: it makes the oracle once, and answers."""

import multiprocessing
import os
import signal
import socket
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from types import FrameType

import numpy as np
from numpy.typing import NDArray

from experiments.oracles import Answers, Leave, Oracle

from ..errors import InputError
from ..points import identity

GRACE = 5.0
"""Seconds that a worker has to end its programs after it was told to."""

_ORACLES: dict[str, Oracle] = {}


@dataclass(frozen=True)
class SharedOracle:
    """A study's oracle as its workers get it: how each makes it, and what it must then be; goes through pickle.

    Parameters
    ----------
    token : str
        Names the oracle among those of a worker, which may serve several studies.
    make : callable
        Gives the oracle, such as the ``make`` of a :class:`experiments.oracles.Recipe`.
    identity : str
        What the oracle must be, as the store writes it.
    n_responses : int
    """

    token: str
    make: Callable[[], Oracle]
    identity: str
    n_responses: int


def here() -> str:
    """``host:pid`` of this process."""
    return f"{socket.gethostname()}:{os.getpid()}"


def prepare(shared: SharedOracle) -> str:
    """Make the oracle, if that was not done yet; gives who did.

    Raises
    ------
    InputError
        If it cannot be made here, or is not the one that the study has.
    """
    if shared.token in _ORACLES:
        return here()
    try:
        oracle = shared.make()
        oracle.prepare()
    except Leave:
        raise
    except (Exception, SystemExit) as error:
        raise InputError(f"worker {here()} cannot make the oracle: {error}") from None
    if lacking := getattr(oracle, "missing", ""):
        raise InputError(f"worker {here()} cannot run the oracle: {lacking}")
    if identity(oracle) != shared.identity:
        raise InputError(
            f"worker {here()} has another version of the oracle {oracle.name!r} than this process; "
            "install the same there as here"
        )
    _ORACLES[shared.token] = oracle
    return here()


def answer(token: str, points: NDArray[np.float64]) -> tuple[Answers, float, str]:
    """Answers at `points`, shape (n, n_factors); wall time per point [s]; who.

    Raises
    ------
    InputError
        If the oracle could not be made here.
    """
    if token not in _ORACLES:
        raise InputError(f"worker {here()} has not got the oracle: look at its log, and install the same there as here")
    began = time.monotonic()
    try:
        answers = _ORACLES[token].answer(points)
    except Leave:
        os._exit(1)  # told to end, and what ran for the point has ended; the pool would go on with the next one
    return answers, (time.monotonic() - began) / len(points), here()


def forget(token: str) -> None:
    """The study is done, or given up: end what other threads still run for it."""
    oracle = _ORACLES.pop(token, None)
    if oracle is not None:
        oracle.interrupt()


def begin() -> None:
    """In a new worker process of our own: Ctrl-C is the parent's to see to, and without a parent there is no work."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if hasattr(signal, "SIGHUP"):  # a closed terminal tells all; who dies of it leaves its programs behind
        signal.signal(signal.SIGHUP, signal.SIG_IGN)
    if hasattr(signal, "pthread_sigmask"):  # blocked while it was started, see `uninterrupted`
        signal.pthread_sigmask(signal.SIG_UNBLOCK, [signal.SIGINT])
    # Raised where the work is, so that a program that runs for it is ended with it.
    signal.signal(signal.SIGTERM, _leave)
    threading.Thread(target=_follow_parent, daemon=True).start()


def _leave(number: int, frame: FrameType | None) -> None:
    raise Leave(128 + number)


@contextmanager
def uninterrupted() -> Iterator[None]:
    """Processes that are started within do not get Ctrl-C; here it comes afterwards."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGINT])
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _follow_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os.kill(os.getpid(), signal.SIGTERM)
        time.sleep(GRACE)
        os._exit(1)

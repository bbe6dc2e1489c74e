"""A run that is ended politely ends as with Ctrl-C: the scheduler's SIGTERM, the closed terminal's SIGHUP."""

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

ENDING = tuple(getattr(signal, name) for name in ("SIGTERM", "SIGHUP") if hasattr(signal, name))


@contextmanager
def ended_like_ctrl_c() -> Iterator[None]:
    """Within, these signals raise ``KeyboardInterrupt`` with the signal's number; a signal ignored before stays so."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = {number: signal.getsignal(number) for number in ENDING}
    # With nohup a run survives its terminal: SIGHUP is ignored then, and has to stay so.
    mine = [number for number, handler in before.items() if handler is not signal.SIG_IGN]
    try:
        for number in mine:
            signal.signal(number, _raise)
        yield
    finally:
        for number in mine:
            signal.signal(number, before[number])


def _raise(number: int, frame: FrameType | None) -> None:
    raise KeyboardInterrupt(number)


@contextmanager
def unheard() -> Iterator[None]:
    """Within, Ctrl-C and these signals do nothing: who is told again while it cleans up is to finish that."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = {number: signal.signal(number, signal.SIG_IGN) for number in (signal.SIGINT, *ENDING)}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)

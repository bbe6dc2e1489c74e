"""What fuzz tests share: strings that hurt, guards that tell when something is run or written, and a time limit."""

import os
import signal
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager

import pytest
from hypothesis import HealthCheck, settings
from hypothesis import strategies as st

EXAMPLES = int(os.environ.get("FLEXDOCE_FUZZ", "0"))
"""``FLEXDOCE_FUZZ=5000`` searches anew, with so many examples a test; else each test has a few, always the same."""

PIECES = (
    "\x00", "\x1b[2J", "\x1b]0;x\x07", "\x9b31m", "\r", "\n", "\t", "\u2028", "\u202e", "\u2066", "\ufeff", "\xa0",
    "\x7f", "é", "µm", "𝒳", "[bold]", "[/]", "[red", "<script>", "</script>", "{{", "}}", "{{ 7 * 7 }}", "$x_", "$",
    "\\",
    '"', "'",
    '"""', "..", "../", "/", "/etc/passwd", "C:\\", "=1+1", "__import__('os')", "`id`", "$(id)", ";", "%s", "a", "1",
    " ",
)  # fmt: skip
TEXTS = st.lists(st.sampled_from(PIECES) | st.text(max_size=5), max_size=6).map("".join)
NUMBERS = st.sampled_from(
    [0, 1, -1, 2, 3, 6, 12, 30, 10**6, 10**7, 10**9, 2**31, 2**63 - 1, 2**63, 2**70, -(2**70), 10**400, 0.0, -0.0, 0.5,
     1.0, 1e-300, 5e-324, 1e300, 1e308, -1e308, float("nan"), float("inf"), float("-inf")]
)  # fmt: skip
SCALARS = st.booleans() | NUMBERS | TEXTS
VALUES = st.recursive(
    SCALARS,
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(TEXTS, inner, max_size=3),
    max_leaves=6,
)


def fuzzed(few: int) -> settings:
    """Settings of a test with `few` examples, or as many as the environment asks for."""
    return settings(
        max_examples=EXAMPLES or few, deadline=None, derandomize=not EXAMPLES, database=None,
        suppress_health_check=[HealthCheck.too_slow, HealthCheck.filter_too_much, HealthCheck.data_too_large,
                               HealthCheck.function_scoped_fixture],
    )  # fmt: skip


class TooLong(BaseException):
    """The time limit of :func:`within`."""


@contextmanager
def within(seconds: float) -> Iterator[None]:
    """Fail if the block takes more of the processor's time, or six times as long on the wall: others may be at work."""

    def stop(number: int, frame: object) -> None:
        raise TooLong(f"it took longer than {seconds:g} s")

    clocks = {signal.SIGPROF: (signal.ITIMER_PROF, seconds), signal.SIGALRM: (signal.ITIMER_REAL, 6.0 * seconds)}
    before = {number: signal.signal(number, stop) for number in clocks}
    for clock, limit in clocks.values():
        signal.setitimer(clock, limit)
    try:
        yield
    finally:
        for number, (clock, _) in clocks.items():
            signal.setitimer(clock, 0.0)
            signal.signal(number, before[number])


class Acted(BaseException):
    """Something was run, opened on the network, or evaluated."""


@pytest.fixture(scope="module")
def inert() -> Iterator[None]:
    """Nothing may start a program, talk to the network or evaluate a text while this fixture lives."""

    def refused(*arguments: object, **named: object) -> None:
        raise Acted(f"{arguments!r:.200}")

    with pytest.MonkeyPatch.context() as patch:
        # Of the class, a method: libraries test it for being one.
        patch.setattr(subprocess.Popen, "__init__", refused)
        for name in ("system", "popen", "fork", "posix_spawn", "execv", "execve"):
            patch.setattr(os, name, refused, raising=False)
        for name in ("connect", "bind", "sendto"):
            patch.setattr(f"socket.socket.{name}", refused)
        yield


def is_one_line(sentence: str) -> bool:
    """Whether a terminal can be sent the sentence, and a person can read it."""
    return sentence.isprintable() and 0 < len(sentence) < 5000

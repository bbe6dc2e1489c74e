"""Time limits: whatever a program does to live on, it and its children are gone afterwards."""

import os
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

from experiments.oracles.command import process
from tests.experiments.command_cases import SUM, made, once

ROOT = Path(__file__).parents[2]
LINUX = pytest.mark.skipif(
    not Path("/proc/self/environ").exists(), reason="NO /proc HERE: children that leave are lost"
)

SLEEP = "time.sleep(60)\n"
STUBBORN = "signal.signal(signal.SIGTERM, signal.SIG_IGN)\n"
NOTE = "open(f'pid-{os.getpid()}', 'w')\n"
FORK = "os.fork()\n"
BARE = "import os, signal, time\n" + STUBBORN + NOTE + SLEEP
NEW_SESSION = "if os.fork() == 0:\n    os.setsid()\n    os.fork()\n"


def noted(folder: Path) -> list[int]:
    return [int(p.name.partition("-")[2]) for p in folder.rglob("pid-*")]


def is_alive(number: int) -> bool:
    try:
        return "Z" not in Path(f"/proc/{number}/stat").read_text().rpartition(")")[2].split()[:1]
    except OSError:
        return False


@LINUX
@pytest.mark.parametrize(
    ("script", "processes"),
    [
        (NOTE + SLEEP, 1),
        (STUBBORN + NOTE + SLEEP, 1),
        (STUBBORN + FORK + NOTE + SLEEP, 2),
        (STUBBORN + NEW_SESSION + NOTE + SLEEP, 3),
        (f"if os.fork() == 0: os.execve(sys.executable, ['x', '-I', '-S', '-c', {BARE!r}], {{}})\n" + NOTE + SLEEP, 2),
    ],
    ids=[
        "plain",
        "ignores SIGTERM",
        "forks and ignores SIGTERM",
        "leaves the session, ignores SIGTERM",
        "without environment",
    ],
)
def test_the_time_limit_ends_all(script, processes, tmp_path):
    began = time.monotonic()
    status, reason, _ = once(made(tmp_path, "print('step 7', flush=True)\n" + script, time_limit=1.0, grace=0.3))
    assert time.monotonic() - began < 10.0
    assert status == "timed_out"
    assert reason.startswith("ended at the time limit of 1 s; last lines: step 7")
    pids = noted(tmp_path)
    assert len(pids) == processes
    assert not any(map(is_alive, pids))


def test_one_that_is_asked_to_end_may_tidy_up(tmp_path):
    script = "signal.signal(signal.SIGTERM, lambda *_: (print('tidied', flush=True), sys.exit(0)))\n" + SLEEP
    status, reason, _ = once(made(tmp_path, script, time_limit=0.5, grace=20.0))
    assert status == "timed_out"
    assert "tidied" in reason


@LINUX
def test_children_that_outlive_their_program_are_ended_too(tmp_path):
    status, _, value = once(
        made(
            tmp_path,
            SUM.replace(")\n", ", flush=True)\n")
            + "if os.fork() == 0:\n    "
            + NOTE
            + "    "
            + SLEEP
            + "else:\n    time.sleep(0.3)\n",
        )
    )
    assert (status, value) == ("ok", 2.0)
    (pid,) = noted(tmp_path)
    assert not is_alive(pid)


def test_within_the_time_limit_nothing_is_ended(tmp_path):
    assert once(made(tmp_path, "time.sleep(0.3)\n" + SUM, time_limit=20.0))[::2] == ("ok", 2.0)


@LINUX
def test_an_interrupt_ends_the_program_and_goes_on_up(tmp_path):
    code = (
        "import sys\nfrom tests.experiments.command_cases import made, once\nfrom pathlib import Path\n"
        f"once(made(Path({str(tmp_path)!r}), {STUBBORN + NOTE + SLEEP!r}, keep='none'))\n"
    )
    child = subprocess.Popen([sys.executable, "-c", code], cwd=ROOT, stderr=subprocess.PIPE, text=True)
    try:
        until = time.monotonic() + 60.0
        while not noted(tmp_path) and time.monotonic() < until:
            time.sleep(0.05)
        (pid,) = noted(tmp_path)
        child.send_signal(2)
        _, err = child.communicate(timeout=20)
    finally:
        child.kill()
    assert "KeyboardInterrupt" in err
    assert not is_alive(pid)
    assert list((tmp_path / "work").iterdir()) == []


@LINUX
def test_programs_of_others_are_left_alone(tmp_path):
    other = subprocess.Popen([sys.executable, "-c", "import time; time.sleep(60)"])
    try:
        neighbour = threading.Thread(target=once, args=(made(tmp_path / "n", "time.sleep(2)\n" + SUM), 0.1, 0.2))
        neighbour.start()
        assert once(made(tmp_path / "o", SLEEP, time_limit=0.5, grace=0.1))[0] == "timed_out"
        assert neighbour.is_alive()
        neighbour.join()
        assert other.poll() is None
        assert "y = 0.5" in next((tmp_path / "n" / "work").glob("*/stdout.txt")).read_text()
    finally:
        other.kill()
        other.wait()


def test_a_program_is_found_on_an_absolute_path_only(tmp_path, monkeypatch):
    solver = tmp_path / "solver"
    solver.write_text("#!/bin/false\n")
    solver.chmod(0o700)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("PATH", ".")
    assert process.program(["solver"]) is None
    monkeypatch.setenv("PATH", str(tmp_path))
    assert process.program(["solver"]) == str(solver)
    assert os.sep in str(solver)

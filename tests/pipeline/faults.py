"""What the tests of faults share: processes to be killed, a small study by the command line, and its store."""

import json
import os
import sqlite3
import subprocess
import sys
import time
from collections import Counter
from pathlib import Path

import pytest

from pipeline.cli import main
from tests.pipeline.cases import config_text, reproducible

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


@pytest.fixture(scope="session")
def server():
    one = Server()
    yield one
    one.close()


@pytest.fixture(scope="session")
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


def changed(path: Path, script: str) -> None:
    db = sqlite3.connect(path)
    db.executescript(script)
    db.close()

"""Studies that are run once and looked at by many tests."""

import shutil
from pathlib import Path

import pytest

import pipeline
import pipeline.runner
from experiments import oracles
from tests.pipeline import cases
from tests.pipeline.cases import CONFIGS, SMALL
from tests.pipeline.faults import finished, run, server, whole

__all__ = ["finished", "run", "server", "whole"]


@pytest.fixture(scope="session")
def smoke(tmp_path_factory):
    """A small smoke study in a folder of its own; nobody may write to it."""
    return pipeline.run(CONFIGS / "smoke.toml", tmp_path_factory.mktemp("smoke") / "run", SMALL)


@pytest.fixture(scope="session")
def hexflex(tmp_path_factory):
    """The main job, in full; nobody may write to its folder."""
    return pipeline.run(CONFIGS / "hexflex.toml", tmp_path_factory.mktemp("hexflex") / "run")


@pytest.fixture
def smoke_copy(smoke, tmp_path) -> Path:
    """A copy of the smoke study's folder that a test may damage."""
    return Path(shutil.copytree(smoke.path, tmp_path / "copy"))


@pytest.fixture
def counted():
    """The test oracles, registered for one test; gives the class that notes its answers."""
    cases.forget()
    for cls in cases.OURS:
        oracles.register(cls)
    yield cases.Counted
    cases.forget()


@pytest.fixture
def no_report(monkeypatch):
    """Leave out the report, which takes most of a small study's time."""
    monkeypatch.setattr(pipeline.runner, "write_report", lambda folder, outcome: folder.path / "report.html")

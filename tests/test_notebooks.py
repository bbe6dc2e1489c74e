"""The notebooks run from top to bottom on a real run folder."""

from pathlib import Path

import nbformat
import pytest
from nbclient import NotebookClient

import pipeline

ROOT = Path(__file__).parents[1]


@pytest.fixture(scope="module")
def hexflex_run(tmp_path_factory):
    folder = tmp_path_factory.mktemp("runs") / "hexflex"
    pipeline.run(ROOT / "configs" / "hexflex.toml", folder, ["fit.design.budget=500", "validation.n_runs=50"])
    return folder


@pytest.mark.parametrize("path", sorted((ROOT / "notebooks").glob("*.ipynb")), ids=lambda p: p.stem)
def test_notebook_runs(path, hexflex_run, monkeypatch):
    monkeypatch.setenv("FLEXDOCE_RUN", str(hexflex_run))
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    notebook = nbformat.read(path, as_version=4)
    NotebookClient(notebook, timeout=120, resources={"metadata": {"path": str(path.parent)}}).execute()
    assert any(cell.get("outputs") for cell in notebook.cells)

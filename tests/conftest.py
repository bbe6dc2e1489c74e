"""Equal programs are compiled once in a session: most of the time of the nonlinear oracles' tests is compilation."""

import os
import shutil
import tempfile

import pytest

from pipeline.compilation import FOLDER, SHORTEST


def pytest_configure(config: pytest.Config) -> None:
    """Before JAX is imported. A folder that the user named is taken, and kept; ours is removed at the end."""
    if FOLDER not in os.environ:
        ours = tempfile.mkdtemp(prefix="flexdoce-compiled-")
        os.environ[FOLDER] = ours
        os.environ.setdefault(SHORTEST, "0.5")
        config.add_cleanup(lambda: shutil.rmtree(ours, ignore_errors=True))

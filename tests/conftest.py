"""Equal programs are compiled once in a session: most of the time of the nonlinear oracles' tests is compilation."""

import os
import shutil
import signal
import tempfile

import pytest

from pipeline.compilation import FOLDER, SHORTEST

if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    # Started in the background of a script: a test that sends Ctrl-C, to itself or to a child, would wait for ever.
    signal.signal(signal.SIGINT, signal.default_int_handler)

LONGEST = (
    "experiments/test_oracle_hexflex_nonlinear.py",
    "validation/test_fea_nonlinear_cantilevers.py",
    "validation/test_fea_nonlinear_mechanisms.py",
    "experiments/test_oracle_flexure_3rrr.py",
    "experiments/test_fea_geometry.py",
    "validation/test_fea_nonlinear_frames.py",
    "validation/test_fea_nonlinear_stability.py",
    "test_configs.py",
    "test_docs.py",
    "surrogates/exports/test_c99_tools.py",
    "surrogates/exports/test_fmi.py",
    "test_example_control.py",
    "test_notebooks.py",
)
"""Files that take most of a minute, in the order in which they begin: what compiles goes before what then finds it."""


def pytest_configure(config: pytest.Config) -> None:
    """Before JAX is imported. A folder that the user named is taken, and kept; ours is removed at the end."""
    if FOLDER not in os.environ:
        ours = tempfile.mkdtemp(prefix="flexdoce-compiled-")
        os.environ[FOLDER] = ours
        os.environ.setdefault(SHORTEST, "0.5")
        config.add_cleanup(lambda: shutil.rmtree(ours, ignore_errors=True))
    if hasattr(config.option, "loadscopereorder"):
        config.option.loadscopereorder = False  # xdist would begin the files with the fewest tests, our longest, last


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """The longest files first, so that none is alone at the end; stable otherwise."""
    items.sort(key=_turn)


def _turn(item: pytest.Item) -> int:
    return next((i for i, name in enumerate(LONGEST) if item.path.as_posix().endswith(f"tests/{name}")), len(LONGEST))

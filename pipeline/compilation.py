"""Compiled oracles outlive the process: JAX's own cache on disk, switched on by the command line alone."""

import os
from collections.abc import MutableMapping
from pathlib import Path

FOLDER, SHORTEST = "JAX_COMPILATION_CACHE_DIR", "JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS"


def keep_compiled(environment: MutableMapping[str, str] = os.environ) -> None:
    """Let JAX, which is imported later, keep what took over half a second to compile; the user's settings go first.

    The folder is ``flexdoce/jax`` in ``$XDG_CACHE_HOME`` or ``~/.cache``. An empty
    ``JAX_COMPILATION_CACHE_DIR`` switches it off. Where the folder cannot be written JAX warns and goes on.
    """
    if FOLDER in environment:
        return
    base = environment.get("XDG_CACHE_HOME") or str(Path.home() / ".cache")
    environment[FOLDER] = str(Path(base) / "flexdoce" / "jax")
    environment.setdefault(SHORTEST, "0.5")

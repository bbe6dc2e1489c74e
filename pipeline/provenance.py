"""``provenance.json``: the clock, the machine and the versions, kept out of every other file."""

import json
import os
import platform
import socket
import subprocess
from collections.abc import Mapping
from datetime import datetime
from importlib.metadata import PackageNotFoundError, version
from typing import Any

from .errors import InputError

PACKAGES = ("flexdoce", "numpy", "scipy", "scikit-learn", "pyDOE3", "pandas", "jax", "jaxlib", "matplotlib")
KEYS = {"started", "finished", "seconds", "host", "platform", "processors", "python", "packages", "commit"}


def provenance_json(started: datetime, finished: datetime, seconds: Mapping[str, float]) -> str:
    """When, where and with what a study ran; `seconds` by stage."""
    document: dict[str, Any] = {
        "started": started.isoformat(timespec="seconds"),
        "finished": finished.isoformat(timespec="seconds"),
        "seconds": {stage: round(s, 3) for stage, s in seconds.items()},
        "host": socket.gethostname(),
        "platform": platform.platform(),
        "processors": os.cpu_count(),
        "python": platform.python_version(),
        "packages": {name: _version(name) for name in PACKAGES},
        "commit": _commit(),
    }
    return json.dumps(document, indent=2) + "\n"


def read_provenance(text: str) -> dict[str, Any]:
    """What :func:`provenance_json` wrote; ``InputError`` if it is damaged."""
    document: Any = None
    try:
        document = json.loads(text)
        complete = isinstance(document, dict) and set(document) >= KEYS
        complete = complete and all(isinstance(document[key], dict) for key in ("seconds", "packages"))
    except (ValueError, RecursionError):
        complete = False
    if not complete:
        raise InputError("provenance.json is damaged: run the study again")
    return document


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return "not installed"


def _commit() -> str:
    """Commit of the checkout that this code runs from; empty if it is none."""
    here = os.path.dirname(__file__)  # noqa: PTH120 - a text for git, not a path to work with
    try:
        done = subprocess.run(
            ["git", "-C", here, "rev-parse", "HEAD"], capture_output=True, text=True, timeout=5, check=True
        )
    except (OSError, subprocess.SubprocessError):
        return ""
    return done.stdout.strip()

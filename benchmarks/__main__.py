"""``python -m benchmarks``: all tables, as Markdown, with machine, versions and date."""

import os
import platform
from datetime import UTC, datetime
from importlib.metadata import version

from . import designs, executors, fea_load_cases, nonlinear, selection, study, surrogates

PACKAGES = ("numpy", "scipy", "jax", "pyDOE3")

if __name__ == "__main__":
    versions = ", ".join(f"{p} {version(p)}" for p in PACKAGES)
    print(f"{datetime.now(UTC):%Y-%m-%d}, {platform.processor() or platform.machine()}, {os.cpu_count()} cores, ")
    print(f"Python {platform.python_version()}, {versions}.\n")
    for module in (designs, selection, surrogates, fea_load_cases, nonlinear, study, executors):
        print(module.table(), flush=True)

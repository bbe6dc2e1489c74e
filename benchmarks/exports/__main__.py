"""``python -m benchmarks.exports``: the tables; see ``--help``."""

import argparse
import platform
import shutil
import subprocess
from collections.abc import Sequence
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from surrogates import load

from .report import FLAGS, table


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.exports", description=__doc__)
    parser.add_argument("--flags", action="append", help="flags of the compiler, several times for several tables")
    parser.add_argument("--compiler", default=shutil.which("gcc") or "cc")
    parser.add_argument(
        "--model", type=Path, action="append", default=[], help="a model.json beside the built-in cases"
    )
    given = parser.parse_args(arguments)
    told = subprocess.run(
        [given.compiler, "--version"], capture_output=True, text=True, check=True
    ).stdout.splitlines()[0]
    print(f"{datetime.now(UTC):%Y-%m-%d}, {_processor()}, {told}, {', '.join(map(_version, PACKAGES))}.\n")
    more = {f"{path.parent.name}": load(path) for path in given.model}
    for flags in given.flags or FLAGS:
        print(table(given.compiler, flags, more), flush=True)


PACKAGES = ("casadi", "onnxruntime", "scikit-learn", "numpy")


def _version(package: str) -> str:
    try:
        return f"{package} {version(package)}"
    except PackageNotFoundError:
        return f"{package} not installed"


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
        return next(line.partition(":")[2].strip() for line in lines if line.startswith("model name"))
    except (OSError, StopIteration):
        return platform.processor() or platform.machine()


if __name__ == "__main__":
    main()

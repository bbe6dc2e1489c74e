"""Wall time of the whole HexFlex study, by stage, in a process of its own."""

import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path

CONFIG = Path(__file__).parents[1] / "configs" / "hexflex.toml"


def table() -> str:
    with tempfile.TemporaryDirectory() as folder:
        begin = time.perf_counter()
        command = [sys.executable, "-m", "pipeline", "run", str(CONFIG), "--out", folder]
        subprocess.run(command, check=True, capture_output=True)
        wall = time.perf_counter() - begin
        seconds = json.loads((Path(folder) / "provenance.json").read_text(encoding="utf-8"))["seconds"]
    rows = "".join(f"| {stage} | {s:.2f} |\n" for stage, s in seconds.items())
    return (
        "### The HexFlex study\n\n`flexdoce run configs/hexflex.toml`, 2042 runs, wall time.\n\n"
        f"| stage | seconds |\n|---|---|\n{rows}| whole command, start of Python and imports included | {wall:.2f} |\n"
    )

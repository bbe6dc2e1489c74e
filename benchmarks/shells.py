"""Two fidelities on the HexFlex: beams corrected with a few CalculiX shell runs, beside shell runs alone.

``python -m benchmarks.shells [FOLDER]``: every shell run is kept in FOLDER (runs/shells_benchmark if not given), so
that the first time takes a quarter of an hour and every other one a minute. It needs ``ccx``.
"""

import hashlib
import json
import platform
import subprocess
import sys
import time
from collections.abc import Callable
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from experiments import oracles
from experiments.designs import Design, Random, Uniform
from experiments.oracles import Oracle
from experiments.runs import Runs
from experiments.shells import Sheet
from pipeline import load_config, resolve
from pipeline.stages import fill_design
from pipeline.study import Study
from surrogates import PolynomialRegressor, Surrogate
from surrogates.discrepancy import correct

Array = NDArray[np.float64]

ROOT = Path(__file__).parents[1]
SHELLS = ROOT / "configs" / "hexflex_calculix.toml"
CACHE = ROOT / "runs" / "shells_benchmark"

SIZES = {7: 3, 12: 3, 20: 3, 30: 3, 60: 1}
"""Shell runs to spend, and how many designs of that size; that of 60 is the study's own."""

N_FRESH, N_BEAMS, CHEAP_DEGREE = 60, 400, 4

METHODS: dict[str, tuple[str, int]] = {
    "shells only, linear": ("", 1),
    "shells only, quadratic": ("", 2),
    "shells only, cubic": ("", 3),
    "additive, linear": ("additive", 1),
    "additive, quadratic": ("additive", 2),
    "scaled, linear": ("scaled", 1),
    "scaled, quadratic": ("scaled", 2),
    "multiplicative, constant": ("multiplicative", 0),
    "multiplicative, linear": ("multiplicative", 1),
    "multiplicative, quadratic": ("multiplicative", 2),
}


def beams(**others: Any) -> Oracle:
    """Nonlinear beams of the shells' dimensions, or with `others` replaced."""
    sheet = Sheet()
    given = {name: getattr(sheet, name) for name in ("length_1", "length_2", "width", "thickness")}
    return oracles.get("hexflex", **{"kinematics": "nonlinear", **given, **others})


def answered(oracle: Oracle, design: Design, cache: Path) -> Runs:
    """The design's answers: from the cache where they are there, else run and kept, point by point."""
    found, started = [], time.monotonic()
    for i, row in enumerate(design.physical):
        one = Design.from_physical(design.space, row[None], design.method)
        file = cache / f"{_key(oracle, row)}.json"
        if not file.is_file():
            runs = oracle(one)
            if not runs.ok.all():
                raise SystemExit(f"a shell run failed: {runs.failures()}")
            partial = file.with_suffix(".partial")
            partial.write_text(json.dumps({"settings": row.tolist(), "responses": runs.values[0].tolist()}))
            partial.replace(file)
            print(f"{design.method} {i + 1} of {len(design)}, {time.monotonic() - started:.0f} s", file=sys.stderr)
        found.append(json.loads(file.read_text())["responses"])
    ok, none = ("ok",) * len(design), ("",) * len(design)
    return Runs(design, oracle.responses, np.array(found), ok, none)  # type: ignore[arg-type]


def _key(oracle: Oracle, row: Array) -> str:
    """Of the program, its files and the exact settings."""
    said = json.dumps([oracle.name, oracle.version, oracle.parameters, [float(v).hex() for v in row]], sort_keys=True)
    return hashlib.sha256(said.encode()).hexdigest()[:32]


def cheap_model(oracle: Oracle) -> tuple[Surrogate, float]:
    """A quartic from many beam runs, and the seconds that they took, compiling left out."""
    oracle(Random(2).generate(oracle.factors, 1))
    design = Random(N_BEAMS).generate(oracle.factors, 5)
    begin = time.perf_counter()
    runs = oracle(design)
    seconds = time.perf_counter() - begin
    return _fitted(runs, CHEAP_DEGREE), seconds


def _fitted(runs: Runs, degree: int) -> Surrogate:
    regressor = PolynomialRegressor(
        degree=degree, selection="evidence", space=runs.design.space, responses=runs.responses
    )
    return regressor.fit(runs.design.physical, runs.values).surrogate_


def predicted(method: str, cheap: Surrogate, few: Runs, points: Array) -> Array | None:
    """What a method says at `points`, shape (n, n_responses); None where there are too few runs for it."""
    kind, degree = METHODS[method]
    if not kind:
        return _fitted(few, degree).predict(points)
    try:
        return correct(cheap, few.design.physical, few.values, kind, degree).surrogate.predict(points)
    except ValueError as error:
        if "runs or more" not in str(error):
            raise
        return None


def worst(said: Array, fresh: Runs) -> float:
    """Largest error over the response's range in the fresh runs, worst response, in %."""
    return float((100.0 * np.abs(said - fresh.values) / np.ptp(fresh.values, axis=0)).max())


def table(cache: Path = CACHE) -> str:
    """The whole comparison as Markdown."""
    cache.mkdir(parents=True, exist_ok=True)
    study = resolve(load_config(SHELLS))
    shells = study.oracle
    if why := getattr(shells, "missing", ""):
        raise SystemExit(why)
    space = shells.factors
    fresh = answered(shells, Random(N_FRESH).generate(space, 99), cache)
    designs = {
        n: [answered(shells, _design(study, n, seed), cache) for seed in range(many)] for n, many in SIZES.items()
    }
    lines = []
    for label, others in (("the shells' dimensions", {}), ("their own dimensions, identified from Eq. 2.6", _own())):
        oracle = beams(**others)
        cheap, seconds = cheap_model(oracle)
        itself = _row("beams alone", lambda n, s, cheap=cheap: cheap.predict(fresh.design.physical), fresh)
        rows = [
            _row(m, lambda n, s, m=m, cheap=cheap: predicted(m, cheap, designs[n][s], fresh.design.physical), fresh)
            for m in METHODS
            if not (others and m.startswith("shells only"))
        ]
        own = worst(cheap.predict(fresh.design.physical), oracle(fresh.design))
        lines.append(_titled(label, rows, itself, seconds, own))
    return "\n".join([_head(), *lines])


def _own() -> dict[str, Any]:
    default: Any = oracles.get("hexflex")
    return {name: getattr(default, name) for name in ("length_1", "length_2", "width", "thickness")}


def _design(study: Study, n_runs: int, seed: int) -> Design:
    """The study's own design where it is of that size, else one with as many levels as runs."""
    own = study.config.fit.design.settings["n_runs"]
    if n_runs == own:
        return fill_design(study, study.space.names)
    return Uniform(n_runs, levels=n_runs).generate(study.space, seed)


def _row(name: str, say: Callable[[int, int], Array | None], fresh: Runs) -> str:
    cells = []
    for n, many in SIZES.items():
        said = [say(n, s) for s in range(many)]
        found = [worst(one, fresh) for one in said if one is not None]
        spread = f" ({_short(min(found))} – {_short(max(found))})" if len(set(found)) > 1 else ""
        cells.append(f"{_short(float(np.median(found)))}{spread}" if found else "")
    return f"| {name} | {' | '.join(cells)} |"


def _short(value: float) -> str:
    return f"{value:.0f}" if value >= 10.0 else f"{value:.2g}"


def _head() -> str:
    said = subprocess.run(["ccx", "-v"], capture_output=True, text=True, check=False).stdout.split()
    packages = ", ".join(f"{p} {version(p)}" for p in ("numpy", "scipy", "jax"))
    return (
        "### Two fidelities: beams corrected with a few shell runs\n\n"
        f"`python -m benchmarks.shells`, {datetime.now(UTC):%Y-%m-%d}, {platform.processor() or platform.machine()}, "
        f"Python {platform.python_version()}, {packages}, ccx {said[-1] if said else '?'} "
        "by `configs/hexflex_calculix.toml`.\n"
        f"Large displacements, ±1 N. Largest error over {N_FRESH} fresh shell runs in % of a response's range, worst "
        "response: median of the designs (least – most). Uniform designs, as many levels as runs but for the "
        f"study's own: {', '.join(f'{many} of {n}' for n, many in SIZES.items())}. The cheap model is a polynomial of "
        f"degree {CHEAP_DEGREE} from {N_BEAMS} beam runs.\n"
    )


def _titled(label: str, rows: list[str], itself: str, seconds: float, own: float) -> str:
    head = "".join(f" {n} shell runs |" for n in SIZES)
    alone = [r for r in rows if r.startswith("| shells only")]
    corrected = [r for r in rows if r not in alone]
    return "\n".join(
        [
            f"Beams of {label} ({N_BEAMS} runs in {seconds:.1f} s, compiled; "
            f"their polynomial within {own:.2g} % of them):\n",
            f"| |{head}",
            "|---|" + "---|" * len(SIZES),
            *alone,
            itself,
            *corrected,
            "",
        ]
    )


if __name__ == "__main__":
    print(table(Path(sys.argv[1]) if len(sys.argv) > 1 else CACHE))

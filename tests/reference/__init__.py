"""Read the reference tables; ``README.md`` beside this file names their sources."""

import csv
import json
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

FOLDER = Path(__file__).parent


def hexflex_table(name: str) -> dict[str, NDArray[np.float64]]:
    """Columns of ``hexflex/<name>.csv`` by header; the units are in the headers."""
    with (FOLDER / "hexflex" / f"{name}.csv").open(newline="") as file:
        header, *rows = csv.reader(file)
    return {column: np.array([float(row[i]) for row in rows]) for i, column in enumerate(header)}


def hexflex_map() -> tuple[list[str], list[str], NDArray[np.float64]]:
    """Eq. 2.6: responses, factors and the entries, µm/N and µrad/N."""
    with (FOLDER / "hexflex" / "s_t.csv").open(newline="") as file:
        header, *rows = csv.reader(file)
    return [row[0] for row in rows], header[1:], np.array([[float(x) for x in row[1:]] for row in rows])


def published_discrepancies() -> list[dict[str, float]]:
    """Rows of ``designs/published_cd2.csv``."""
    with (FOLDER / "designs" / "published_cd2.csv").open(newline="") as file:
        return [{k: float(v) for k, v in row.items()} for row in csv.DictReader(file)]


def lenth_cases() -> list[str]:
    """Names of the files in ``lenth/``."""
    return sorted(path.stem for path in (FOLDER / "lenth").glob("*.json"))


def lenth_case(name: str) -> dict[str, Any]:
    """One file of ``lenth/``."""
    return json.loads((FOLDER / "lenth" / f"{name}.json").read_text(encoding="utf-8"))


def recorded(name: str) -> dict[str, Any]:
    """One JSON file of this folder, by its path without the ending."""
    return json.loads((FOLDER / f"{name}.json").read_text(encoding="utf-8"))


def lenth_columns(case: dict[str, Any]) -> tuple[list[str], NDArray[np.float64]]:
    """Factor names (their first word) and ±1 columns; a text stands for the full factorial, first factor fastest."""
    names = [column.split()[0] for column in case["design_columns"]]
    if isinstance(case["design"], str):
        return names, np.array(list(product([-1.0, 1.0], repeat=len(names))))[:, ::-1]
    return names, np.array(case["design"], dtype=np.float64)

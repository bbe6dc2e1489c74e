"""The run folder: the only place, with the runner, that touches the disk."""

import hashlib
import json
import shutil
import sqlite3
from collections.abc import Sequence
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from experiments.oracles import Answers, Oracle
from experiments.runs import Status

from .config import Config, differences, dump_config, load_config
from .errors import InputError

CONFIG, POINTS = "config.toml", "points.sqlite"
ASKED_AT_ONCE = 500  # SQLite allows at least 999 placeholders in a query
OURS = (
    "provenance.json", POINTS, f"{POINTS}-journal", "model.json", "report.html",
    "screening", "fit", "validation", "inversion", "exports",
)  # fmt: skip


class RunFolder:
    """A run folder that belongs to one config.

    Parameters
    ----------
    path : Path
        Use :meth:`claim` or :meth:`existing` to get one.
    """

    def __init__(self, path: Path) -> None:
        self.path = path

    @classmethod
    def claim(cls, path: Path, config: Config, fresh: bool = False) -> "RunFolder":
        """The folder for `config`: new, or continued if it holds the same config; emptied of our files if `fresh`.

        Raises
        ------
        InputError
            If the folder holds something else or belongs to another config; nothing is touched then.
        """
        try:
            return cls._claim(path, config, fresh)
        except OSError as error:
            raise InputError(f"cannot use the output folder {path}: {error.strerror}") from None

    @classmethod
    def _claim(cls, path: Path, config: Config, fresh: bool) -> "RunFolder":
        folder = cls(path)
        if path.exists() and not path.is_dir():
            raise InputError(f"the output folder {path} is a file; name a folder with --out")
        owner = None
        if path.is_dir() and any(path.iterdir()):
            if not (path / CONFIG).is_file():
                raise InputError(f"the folder {path} is not empty and is no run folder; name another with --out")
            _, owner = cls.existing(path)
            keys = differences(owner, config)
            if keys and not fresh:
                raise InputError(
                    f"the folder {path} belongs to another config (different: {', '.join(keys)}); "
                    "name another with --out, or start it anew with --fresh"
                )
            if fresh:
                folder._empty()
        path.mkdir(parents=True, exist_ok=True)
        if owner is None or differences(owner, config):
            # A config.toml that says the same stays as it is: somebody may have written it by hand.
            folder.write(CONFIG, dump_config(config))
        return folder

    @classmethod
    def existing(cls, path: Path) -> tuple["RunFolder", Config]:
        """A run folder that is there already, with its config; ``InputError`` if it is none."""
        if not (path / CONFIG).is_file():
            raise InputError(f"{path} is not a run folder: it has no {CONFIG}")
        return cls(path), load_config(path / CONFIG)

    def write(self, name: str, text: str) -> Path:
        """Write a file of the folder whole: a reader never sees half of it."""
        target = self.path / name
        target.parent.mkdir(parents=True, exist_ok=True)
        partial = target.with_name(target.name + ".partial")
        partial.write_text(text, encoding="utf-8", newline="\n")
        partial.replace(target)
        return target

    def read(self, name: str) -> str:
        """Read a file of the folder; ``InputError`` that says what to do if it is missing."""
        try:
            return (self.path / name).read_text(encoding="utf-8")
        except (OSError, UnicodeDecodeError):
            raise InputError(f"{self.path / name} is missing or unreadable: run the study again") from None

    def discard(self, name: str) -> None:
        """Remove a file or folder of ours, if it is there."""
        target = self.path / name
        if target.is_dir() and not target.is_symlink():
            shutil.rmtree(target)
        else:
            target.unlink(missing_ok=True)

    def points(self, oracle: Oracle) -> "PointStore":
        """The store of evaluated points for `oracle`."""
        return PointStore(self.path / POINTS, oracle)

    def _empty(self) -> None:
        """Remove our files and our folders; the config is written over, if it differs."""
        for name in OURS:
            self.discard(name)


class PointStore:
    """Every evaluated point, durable as soon as its batch is answered.

    Points are keyed by a hash of the oracle, its version and parameters, and the exact settings, so
    that a continued study pays for nothing twice.
    """

    def __init__(self, path: Path, oracle: Oracle) -> None:
        self.path = path
        self._identity = json.dumps(
            [
                oracle.name,
                oracle.version,
                oracle.parameters,
                oracle.factors.labels,
                [r.label for r in oracle.responses],
            ],
            sort_keys=True,
        )
        self._n_responses = len(oracle.responses)
        try:
            with closing(self._connect()) as db, db:
                db.execute(
                    "CREATE TABLE IF NOT EXISTS points (key TEXT PRIMARY KEY, oracle TEXT NOT NULL, "
                    "settings TEXT NOT NULL, responses TEXT NOT NULL, status TEXT NOT NULL, reason TEXT NOT NULL)"
                )
        except sqlite3.DatabaseError as error:
            raise InputError(f"cannot use the point store {path}: {error}; move it away or use --fresh") from None

    def keys(self, points: NDArray[np.float64]) -> list[str]:
        """One key per point, shape (n, n_factors) in physical units."""
        # -0.0 and 0.0 are the same setting and must have the same key.
        return [
            hashlib.sha256((self._identity + json.dumps([v.hex() for v in row])).encode()).hexdigest()
            for row in (points + 0.0).tolist()
        ]

    def known(self, keys: Sequence[str]) -> dict[str, tuple[list[float], Status, str]]:
        """Good answers by key, for those keys that have one: a failed point is tried again.

        Raises
        ------
        InputError
            If the store is damaged.
        """
        try:
            return self._known(list(keys))
        except (sqlite3.DatabaseError, ValueError, TypeError) as error:
            raise InputError(f"the point store {self.path} is damaged ({error}); move it away or use --fresh") from None

    def _known(self, wanted: list[str]) -> dict[str, tuple[list[float], Status, str]]:
        found = {}
        with closing(self._connect()) as db:
            for start in range(0, len(wanted), ASKED_AT_ONCE):
                some = wanted[start : start + ASKED_AT_ONCE]
                marks = ", ".join("?" * len(some))
                query = f"SELECT key, responses, status, reason FROM points WHERE key IN ({marks})"
                for key, values, status, reason in db.execute(query, some):
                    if Status(status) is not Status.OK:
                        continue
                    numbers = [float(v) for v in json.loads(values)]
                    if len(numbers) != self._n_responses or not np.isfinite(numbers).all():
                        raise ValueError(f"point {key[:8]} has {len(numbers)} answers, not {self._n_responses} numbers")
                    found[key] = (numbers, Status.OK, reason)
        return found

    def add(self, keys: Sequence[str], points: NDArray[np.float64], answers: Answers) -> None:
        """Store one batch in one transaction."""
        rows = []
        for key, point, values, status, reason in zip(keys, points.tolist(), *answers, strict=True):
            numbers = [float(v) if np.isfinite(v) else None for v in values]
            rows.append((key, self._identity, json.dumps(point), json.dumps(numbers), str(status), reason))
        with closing(self._connect()) as db, db:
            db.executemany("INSERT OR REPLACE INTO points VALUES (?, ?, ?, ?, ?, ?)", rows)

    def _connect(self) -> Any:
        return sqlite3.connect(self.path, timeout=30.0)

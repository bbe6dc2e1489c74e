"""The store of evaluated points: durable the moment they are known, and never paid for twice."""

import hashlib
import json
import os
import socket
import sqlite3
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from types import TracebackType
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from experiments.oracles import Answers, Oracle
from experiments.runs import Status

from . import database
from .database import Row
from .errors import InputError

FAILURES = tuple(s for s in Status if s is not Status.OK)


class Answer(NamedTuple):
    """One point's answer: a value per response, NaN where the status is not ``OK``."""

    values: list[float]
    status: Status
    reason: str


class Evaluated(NamedTuple):
    """A batch that was answered: its keys, settings (n, n_factors) and answers; wall time per point [s]; by whom."""

    keys: Sequence[str]
    points: NDArray[np.float64]
    answers: Answers
    seconds: float
    worker: str


def identity(oracle: Oracle) -> str:
    """All that an answer depends on but the settings: the oracle's name, version, parameters, labels, and its code."""
    labels, code = [r.label for r in oracle.responses], [oracle.code] if oracle.code else []
    return json.dumps(
        [oracle.name, oracle.version, oracle.parameters, oracle.factors.labels, labels, *code], sort_keys=True
    )


class PointStore:
    """Every evaluated point of a folder, keyed by what it depends on.

    The key is a hash of the oracle, its version and parameters, and the exact settings. A failure is an
    answer, too: it is read back with its reason, unless its status is one to be tried again.

    Parameters
    ----------
    path : Path
        The file.
    oracle : Oracle
        Whose points are asked for; others may lie in the same file.
    cache : PointStore, optional
        Shared with other studies: asked for what this file does not have, and told everything new.
    retry : collection of Status
        Failures that are tried again, once in the life of this object.
    shared : bool
        Whether other processes write to the file, too.

    Raises
    ------
    InputError
        If the file is damaged, is none of ours, or cannot be used.
    """

    def __init__(
        self,
        path: Path,
        oracle: Oracle,
        cache: "PointStore | None" = None,
        retry: Sequence[Status] = (),
        shared: bool = False,
    ) -> None:
        self.path, self.cache, self.retry, self.shared = path, cache, frozenset(retry), shared
        self.warn: Callable[[str], None] = lambda sentence: None
        self._identity = identity(oracle)
        self._n_responses = len(oracle.responses)
        self._tried: set[str] = set()
        self._worker = f"{socket.gethostname()}:{os.getpid()}"
        try:
            self._db = database.prepared(path, self._connect)
            self._file = path.stat()
        except (sqlite3.DatabaseError, OSError) as error:
            raise InputError(f"cannot use the point store {path}: {error}; move it away or use --fresh") from None

    def __enter__(self) -> "PointStore":
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self.close()

    def close(self) -> None:
        """Leave single files that anybody can read."""
        database.close(self._db, alone=not self.shared)
        if self.cache is not None:
            self.cache.close()

    def strangers(self) -> str:
        """What the file holds if it holds points, but none of this oracle as it is now; else empty."""
        try:
            there = database.oracles(self._db)
        except sqlite3.DatabaseError as error:
            raise database.translated(error, self.path) from None
        if not there or self._identity in there:
            return ""
        return (
            f"the {sum(there.values())} points in {self.path.name} are answers of another oracle, version or "
            "parameters: they stay there, and everything is run anew"
        )

    def keys(self, points: NDArray[np.float64]) -> list[str]:
        """One key per point, shape (n, n_factors) in physical units."""
        # -0.0 and 0.0 are the same setting and must have the same key.
        return [
            hashlib.sha256((self._identity + json.dumps([v.hex() for v in row])).encode()).hexdigest()
            for row in (points + 0.0).tolist()
        ]

    def known(self, keys: Sequence[str]) -> dict[str, Answer]:
        """Answers by key, for those keys that have one that need not be tried again; the cache is asked, too.

        Raises
        ------
        InputError
            If the store is damaged.
        OSError
            If the disk refuses.
        """
        wanted = list(dict.fromkeys(keys))
        found = self._read(wanted)
        missing = [key for key in wanted if key not in found]
        if self.cache is not None and missing:
            cached = self._cached(lambda cache: cache._read(missing, self.retry, self._tried)) or {}
            self._write([row for row, _ in cached.values()])
            found |= cached
        return {key: answer for key, (_, answer) in found.items()}

    def add(
        self, keys: Sequence[str], points: NDArray[np.float64], answers: Answers, seconds: float = 0.0
    ) -> dict[str, Answer]:
        """As :meth:`add_all`, of one batch that was answered in this process."""
        return self.add_all([Evaluated(keys, points, answers, seconds, self._worker)])

    def add_all(self, batches: Sequence[Evaluated]) -> dict[str, Answer]:
        """Store batches in one transaction, here and in the cache; gives the answers as they will be read back.

        Raises
        ------
        OSError
            If the disk refuses: these batches are lost, and none before them.
        """
        rows = [row for batch in batches for row in self._rows(batch)]
        try:
            self._write(rows)
        except KeyboardInterrupt:
            self._write(rows)  # it was paid for; to write it twice does no harm
            raise
        finally:
            self._tried.update(row.key for row in rows)
        self._cached(lambda cache: cache._write(rows))
        return {row.key: self._answer(row) for row in rows}

    def _rows(self, batch: Evaluated) -> Iterator[Row]:
        for key, point, values, status, reason in zip(batch.keys, batch.points.tolist(), *batch.answers, strict=True):
            numbers = [float(v) if np.isfinite(v) else None for v in values]
            # What no UTF-8 can hold would not come back as it went in.
            told = reason.encode("utf-8", "replace").decode()
            settings, responses = json.dumps(point), json.dumps(numbers)
            yield Row(key, self._identity, settings, responses, str(status), told, batch.seconds, batch.worker)

    def _cached(self, act: Callable[["PointStore"], Any]) -> Any:
        """Do something with the cache; a cache that fails on the way is done without, for the folder is complete."""
        if self.cache is None:
            return None
        try:
            return act(self.cache)
        except (OSError, InputError) as error:
            self.warn(f"the cache is left out from here on: {error}")
            self.cache.close()
            self.cache = None
            return None

    def _read(
        self, keys: list[str], retry: frozenset[Status] | None = None, tried: set[str] | None = None
    ) -> dict[str, tuple[Row, Answer]]:
        retry, tried = self.retry if retry is None else retry, self._tried if tried is None else tried
        found = {}
        try:
            for row in database.rows(self._db, keys):
                answer = self._answer(row)
                if answer.status not in retry or row.key in tried:
                    found[row.key] = (row, answer)
        except sqlite3.DatabaseError as error:
            raise database.translated(error, self.path) from None
        except (ValueError, TypeError, RecursionError) as error:
            raise InputError(f"the point store {self.path} is damaged ({error}); move it away or use --fresh") from None
        return found

    def _answer(self, row: Row) -> Answer:
        """What a row says; ``ValueError`` or ``TypeError`` if it makes no sense."""
        status, values = Status(row.status), json.loads(row.responses)
        numbers = [float("nan") if v is None else float(v) for v in values]
        is_whole = len(numbers) == self._n_responses
        if not is_whole or (status is Status.OK and not np.isfinite(numbers).all()):
            raise ValueError(f"point {row.key[:8]} has {len(numbers)} answers, not {self._n_responses} numbers")
        return Answer(numbers, status, row.reason)

    def _write(self, batch: Sequence[Row]) -> None:
        if not self._is_there():
            raise InputError(
                f"the point store {self.path} was removed or replaced while the run was at work: what was stored since "
                "is lost with it; run the same command again"
            )
        try:
            if batch:
                database.write(self._db, batch)
        except sqlite3.DatabaseError as error:
            raise database.translated(error, self.path) from None

    def _is_there(self) -> bool:
        """Whether the file that is open is the one at its place: a removed one takes answers, and keeps none."""
        try:
            return os.path.samestat(self._file, self.path.stat())
        except OSError:
            return False

    def _connect(self) -> Any:
        return database.connect(self.path)

"""The workers of a Dask cluster: one that is there, by its address, or one that is started on this machine."""

import errno
import json
import logging
import queue
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from ..errors import FlexdoceError, InputError
from . import worker
from .base import Answered, Batch, Elsewhere
from .worker import SharedOracle

LEAST_AHEAD, MOST_AHEAD, HORIZON = 2, 50, 0.2
"""Batches for every thread of a worker: the one it answers and the next; of quick ones, as many as last 0.2 s."""

PATIENCE = 20.0
"""Seconds that a scheduler may take to answer."""

LOOK_EVERY, LONELY = 2.0, 60.0
"""Seconds between two looks at the workers, and without any until the log says so."""

LOCAL: dict[str, Any] = {
    "threads_per_worker": 1, "processes": True, "memory_limit": 0, "silence_logs": logging.CRITICAL,
    "dashboard_address": ":0", "scheduler_kwargs": {"dashboard": False},
}  # fmt: skip
"""Of a cluster that is started here: an oracle need not bear threads, and no worker is ended for its memory."""


class DaskCluster(Elsewhere):
    """A Dask cluster, joined or begun when the first point asks for it.

    Parameters
    ----------
    shared, batch, note
        As :class:`.Elsewhere` has them.
    address : str or None
        Of the scheduler, such as ``tcp://head:8786``, or the path of its file, which ends in ``.json``. With None a
        cluster is started here.
    workers : int
        Of a cluster that is started here.
    """

    def __init__(
        self, shared: SharedOracle, batch: int | None, note: Callable[[str], None], address: str | None, workers: int
    ) -> None:
        super().__init__(shared, batch, note)
        self.address, self.workers = address, workers
        self._client: Any = None
        self._cluster: Any = None
        self._given: dict[Any, Batch] = {}
        self._told: queue.SimpleQueue[Any] = queue.SimpleQueue()
        self._done: list[Any] = []
        self._found: list[Answered] = []
        self._failure: BaseException | None = None
        self._threads, self._looked, self._seen = 0, 0.0, 0.0
        self._ahead = LEAST_AHEAD

    def run(self, batches: Iterable[Batch]) -> Iterator[Sequence[Answered]]:
        """Keep the workers busy, those that join, too."""
        self._backlog = self._waiting(batches)
        while True:
            self._fill()
            self._collect()
            self._fill()  # before the answers are stored: workers are not to wait for the disk
            if found := self.arrived():
                yield found
            if self._failure is not None:  # now that what the others answered is stored
                raise self._failure
            if not found and not self._given:
                return
            if not found:
                self._wait()

    def arrived(self) -> Sequence[Answered]:
        """Fetch what is done."""
        self._collect()
        found, self._found = self._found, []
        return found

    def _collect(self) -> None:
        """Note what is done, and what failed for good; nothing is forgotten if that is interrupted."""
        from distributed.scheduler import KilledWorker

        with suppress(queue.Empty):
            while True:
                self._done.append(self._told.get_nowait())
        for future in [future for future in self._done if future.status != "finished"]:
            error = future.exception() if future.status == "error" else None
            if isinstance(error, KilledWorker):
                self._backlog.lost(self._given.pop(future), str(error.last_worker.address))
            elif future.status in ("lost", "pending") and self._client.status == "running":
                # The worker that kept the answer is gone; the scheduler has another one find it.
                future.add_done_callback(self._told.put)
            else:  # cancelled: so the client tells that its scheduler is gone
                self._failure = self._failure or error or self._gone()
            self._done.remove(future)
        self._fetch()
        self._found += self._backlog.given_up()

    def close(self, in_haste: bool) -> None:
        """Leave the cluster as it was found, or end the one that was started."""
        client, self._client = self._client, None
        given, self._given = list(self._given), {}
        cluster, self._cluster = self._cluster, None
        with suppress(Exception):  # a scheduler that is gone cannot be told
            if client is not None and client.status == "running":
                client.cancel(given)
                client.unregister_worker_plugin(self.shared.token)
        for one in (client, cluster):
            with suppress(Exception):
                if one is not None:
                    one.close(timeout=worker.GRACE)

    def _fetch(self) -> None:
        if not self._done:
            return
        try:
            results = self._client.gather(self._done)
        except FlexdoceError:
            raise
        except Exception as error:
            raise self._gone() from error
        found = [Answered(self._given.pop(f), *result) for f, result in zip(self._done, results, strict=True)]
        self._found, self._done = self._found + found, []
        slowest = max(len(a.batch.rows) * a.seconds for a in found)
        self._ahead = min(max(LEAST_AHEAD, round(HORIZON / max(slowest, 1e-6))), MOST_AHEAD)

    def _wait(self) -> None:
        """Until something is done, or there is reason to look at the workers again."""
        try:
            first = self._told.get(timeout=LOOK_EVERY)
        except queue.Empty:
            if self._client.status != "running":
                raise self._gone() from None
        else:
            self._told.put(first)

    def _fill(self) -> None:
        if self._failure is not None or not self._backlog:
            return
        client = self._client or self._open()
        self._look()
        while len(self._given) < self._ahead * max(self._threads, 1) and (batch := self._backlog.next()) is not None:
            # pure: the cluster keeps no answers, the store does.
            future = client.submit(worker.answer, self.shared.token, batch.points, pure=False)
            self._given[future] = batch
            future.add_done_callback(self._told.put)

    def _look(self) -> None:
        """How many threads there are now."""
        now = time.monotonic()
        if now - self._looked < LOOK_EVERY:
            return
        self._looked = now
        try:
            self._threads = sum(self._client.nthreads().values())
        except Exception as error:
            raise self._gone() from error
        if self._threads:
            self._seen = now
        elif now - self._seen > LONELY:
            self._seen = now
            self.note(f"the Dask scheduler {self._where} has no workers; waiting for some")

    def _open(self) -> Any:
        from distributed import Client, LocalCluster

        _silence()
        from .dask_worker import OraclePlugin

        try:
            if self.address is None:
                self._cluster = LocalCluster(n_workers=self.workers, **LOCAL)
            where = self._cluster or _scheduler(self.address)
            self._client = Client(where, timeout=PATIENCE, set_as_default=False)
        except (OSError, ValueError) as error:
            self.close(in_haste=True)
            raise InputError(
                f"executor.address: no Dask scheduler answers at {self._where} ({error}); start one with dask "
                "scheduler, or leave the address out to have one started here"
            ) from None
        self._seen = time.monotonic()
        plugin = OraclePlugin(self.shared, is_ours=self.address is None)
        self._client.register_plugin(plugin, name=self.shared.token)
        return self._client

    @property
    def _where(self) -> str:
        return self.address or "on this machine"

    def _gone(self) -> OSError:
        return ConnectionError(
            errno.ECONNRESET, "the Dask scheduler went away; what was answered is stored", f"executor {self._where}"
        )


def _scheduler(address: str | None) -> str:
    """An address, as it is or from the scheduler's file; looked at first, for a client that is told nonsense hangs.

    Raises
    ------
    ValueError
        If it is none.
    OSError
        If the file cannot be read, nor comes for some time.
    """
    from distributed.comm.addressing import get_address_host_port

    found, file = str(address), Path(str(address))
    if file.suffix == ".json":
        until = time.monotonic() + PATIENCE
        while not file.exists() and time.monotonic() < until:
            time.sleep(0.1)
        try:
            found = str(json.loads(file.read_text(encoding="utf-8"))["address"])
        except (ValueError, KeyError, TypeError, RecursionError):
            raise ValueError("it is not the file of a Dask scheduler") from None
    get_address_host_port(found)
    return found


def _silence() -> None:
    """What matters is told by us, in one place; a traceback of a network would bury it."""
    for name in logging.root.manager.loggerDict:
        if name.split(".")[0] in {"distributed", "tornado"}:
            logging.getLogger(name).setLevel(logging.CRITICAL)

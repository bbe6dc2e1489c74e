"""What a Dask worker is given: the study's oracle, which every one makes for itself, also one that comes later."""

import signal
import threading
from typing import Any

from distributed import WorkerPlugin

from .worker import SharedOracle, forget, prepare


class OraclePlugin(WorkerPlugin):
    """Makes the oracle when a worker starts, and ends what runs for it when the study is done.

    Parameters
    ----------
    shared : SharedOracle
    is_ours : bool
        Whether the worker was started for this study: Ctrl-C in its terminal is then not its own affair.
    """

    def __init__(self, shared: SharedOracle, is_ours: bool) -> None:
        self.shared, self.is_ours = shared, is_ours

    def setup(self, worker: Any) -> None:
        """On every worker, before it has any task."""
        if self.is_ours and threading.current_thread() is threading.main_thread():
            signal.signal(signal.SIGINT, signal.SIG_IGN)
        prepare(self.shared)

    def teardown(self, worker: Any) -> None:
        """When the study is done, or the worker ends."""
        forget(self.shared.token)

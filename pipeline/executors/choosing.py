"""Which executor a config asks for."""

from collections.abc import Callable
from uuid import uuid4

from experiments import oracles
from experiments.oracles import Oracle

from ..config import Config
from ..points import identity
from .base import Executor, cores
from .dask_cluster import DaskCluster
from .in_process import InProcess
from .processes import Processes
from .worker import SharedOracle


def make(config: Config, oracle: Oracle, note: Callable[[str], None]) -> Executor:
    """The executor of a study; nothing is started before the first point.

    Parameters
    ----------
    config : Config
    oracle : Oracle
        That of the study, in this process.
    note : callable
        Told in a sentence what is worth a line in the log.

    Raises
    ------
    ValueError
        If no other process could make the oracle.
    """
    table = config.executor
    if table.name == "in_process":
        return InProcess(oracle)
    shared = SharedOracle(
        f"flexdoce-{uuid4().hex}", oracles.recipe(oracle).make, identity(oracle), len(oracle.responses)
    )
    workers = table.workers or cores()
    if table.name == "processes":
        return Processes(shared, table.batch, note, workers)
    return DaskCluster(shared, table.batch, note, table.address, workers)

"""Executors: where the points of a study are answered. One protocol, :class:`.Executor`.

===================  ==================================================================================
:mod:`.in_process`   in this process, a batch after the other: vectorised JAX, and whatever is quick
:mod:`.processes`    in worker processes on this machine: external programs and slow Python
:mod:`.dask_cluster` on the workers of a Dask cluster, or of one that is started here
===================  ==================================================================================

:func:`execute` runs a design on one of them and stores every answer as it comes; :mod:`.worker` is what runs there.
"""

from .base import Answered, Batch, Executor
from .choosing import make
from .execution import Progress, execute, silent

__all__ = ["Answered", "Batch", "Executor", "Progress", "execute", "make", "silent"]

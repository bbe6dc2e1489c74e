"""In this process: a batch after the other. What is vectorised, or quick, needs no more."""

import time
from collections.abc import Iterable, Iterator, Sequence

from experiments.oracles import Oracle

from .base import Answered, Batch, Executor
from .worker import here


class InProcess(Executor):
    """Answers in the calling thread.

    Parameters
    ----------
    oracle : Oracle
    """

    def __init__(self, oracle: Oracle) -> None:
        self.oracle = oracle

    def size(self, batch: int) -> int:
        """As many as the oracle answers together."""
        return batch

    def run(self, batches: Iterable[Batch]) -> Iterator[Sequence[Answered]]:
        """One batch at a time."""
        for batch in batches:
            began = time.monotonic()
            answers = self.oracle.answer(batch.points)
            yield [Answered(batch, answers, (time.monotonic() - began) / len(batch.rows), here())]

"""What a Dask worker is given: the study's oracle, which every one makes for itself, also one that comes later."""

from typing import Any

from distributed import WorkerPlugin

from .worker import Recipe, forget, prepare


class OraclePlugin(WorkerPlugin):
    """Makes the oracle when a worker starts, and ends what runs for it when the study is done.

    Parameters
    ----------
    recipe : Recipe
    """

    def __init__(self, recipe: Recipe) -> None:
        self.recipe = recipe

    def setup(self, worker: Any) -> None:
        """On every worker, before it has any task."""
        prepare(self.recipe)

    def teardown(self, worker: Any) -> None:
        """When the study is done, or the worker ends."""
        forget(self.recipe.token)

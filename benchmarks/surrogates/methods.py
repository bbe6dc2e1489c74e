"""What a method is: settings in words, and a fit that gives a predictor."""

import importlib
import importlib.util
from collections.abc import Callable
from dataclasses import dataclass
from importlib.metadata import version

import numpy as np

from .functions import Floats

Predict = Callable[[Floats], Floats]
Fit = Callable[[Floats, Floats, Floats], Predict]


@dataclass(frozen=True)
class Method:
    """A row of the tables.

    Parameters
    ----------
    label : str
        In tables, in the cache, and for ``--only``.
    settings : str
        How it is used, in words; a cached result made with other settings or versions does not count.
    modules : tuple of str
        What is imported before the clock starts; the first one's distribution gives the version.
    taught : bool
        Whether it learns from the Jacobian.
    fit : callable
        From X (n, n_inputs), Y (n, n_responses) and J (n, n_responses, n_inputs), coded, to a predictor that
        takes (n_points, n_inputs) and gives (n_points, n_responses). A method that is not taught ignores J.
    """

    label: str
    settings: str
    modules: tuple[str, ...]
    taught: bool
    fit: Fit

    @property
    def missing(self) -> str | None:
        """The first module that is not installed."""
        for module in self.modules:
            if importlib.util.find_spec(module.split(".")[0]) is None:
                return module.split(".")[0]
        return None

    @property
    def stamp(self) -> str:
        """Settings and version, as kept with a cached result."""
        package = {"sklearn": "scikit-learn", "surrogates": "flexdoce"}.get(self.modules[0], self.modules[0])
        return f"{package} {version(package)}: {self.settings}"

    def load(self) -> None:
        """Import what the fit imports, so that this is not timed."""
        for module in self.modules:
            importlib.import_module(module)


def each_response(fit_one: Callable[[Floats, Floats, Floats], Predict]) -> Fit:
    """A fit of many responses from a fit of one, which gets y (n,) and j (n, n_inputs) and predicts (n_points,)."""

    def fit(X: Floats, Y: Floats, J: Floats) -> Predict:
        parts = [fit_one(X, Y[:, j], J[:, j]) for j in range(Y.shape[1])]
        return lambda Z: np.stack([np.asarray(part(Z)).ravel() for part in parts], axis=1)

    return fit

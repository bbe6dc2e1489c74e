"""The pipeline: from a config to a run folder. Orchestration only; the mathematics lives below.

>>> import pipeline
>>> outcome = pipeline.run("configs/smoke.toml", out="runs/smoke")  # doctest: +SKIP
>>> outcome.model.predict([[0.05, 0.01, 0.001, 1.0]])  # doctest: +SKIP
"""

from .config import Config, load_config
from .errors import FlexdoceError, InputError, RequirementNotMet, TooManyFailures
from .resolving import resolve
from .runner import Outcome, read_run, run
from .study import Study
from .sweeping import Sweep, sweep
from .version import __version__

__all__ = [
    "Config",
    "FlexdoceError",
    "InputError",
    "Outcome",
    "RequirementNotMet",
    "Study",
    "Sweep",
    "TooManyFailures",
    "__version__",
    "load_config",
    "read_run",
    "resolve",
    "run",
    "sweep",
]

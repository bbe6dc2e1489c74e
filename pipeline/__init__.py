"""The pipeline: from a config to a run folder. Orchestration only; the mathematics lives below.

===============  ======================================================================================================
what a person    :mod:`.config`, of the tables in :mod:`.sections`, :mod:`.programs` (``[oracle.command]``) and
wrote            :mod:`.other_models` (``[[compare]]``), all of them a :mod:`.strict` ``Table``; :mod:`.nesting`
what it means    :mod:`.resolving` makes a :mod:`.study` of it; :mod:`.oracle_file`
what is done     :mod:`.runner` takes it through :mod:`.stages` and :mod:`.growth`, by one of the :mod:`.executors`
what stays       :mod:`.store`, :mod:`.points` in a :mod:`.database`, :mod:`.tables`, :mod:`.report`, :mod:`.exporting`
many of them     :mod:`.grid`, :mod:`.sweeping`, :mod:`.sweep_rows`, :mod:`.sweep_console`
who is told      :mod:`.cli`, :mod:`.commands`, :mod:`.console`, :mod:`.listing`, :mod:`.monitor`, :mod:`.status`
===============  ======================================================================================================

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

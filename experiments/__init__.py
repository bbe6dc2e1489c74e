"""The experiment: what is varied, where it is tried, what answers, and what the runs say.

``experiments`` means *the experiment*, not its outputs; outputs go to ``runs/``, which git ignores.

==================  ===============================================================================
:mod:`.factors`     factors and the one border between physical and coded units
:mod:`.terms`       the algebra of polynomial terms (``"A"``, ``"A:B"``, ``"A^2"``) and model matrices
:mod:`.runs`        responses, statuses, and the table of runs
:mod:`.designs`     designs of experiments: where to try
:mod:`.oracles`     what answers a run
:mod:`.fea`         the beam finite elements below the oracles; knows nothing of factors
:mod:`.screening`   effects and Lenth's method: which factors act
==================  ===============================================================================

This package imports nothing from ``surrogates`` or ``pipeline``.
"""

from .factors import Factor, FactorSpace
from .runs import Response, Runs, Status
from .terms import Terms, model_matrix

__all__ = ["Factor", "FactorSpace", "Response", "Runs", "Status", "Terms", "model_matrix"]

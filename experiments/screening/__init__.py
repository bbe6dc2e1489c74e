"""Screening: which factors act on which responses.

>>> from experiments.screening import lenth
>>> result = lenth([21.6, 3.1, 9.9, 14.6, 0.1, -18.1, 16.6, 2.4, -0.4, -1.1, 1.9, 4.1, -1.6, -2.6, 1.4])
>>> round(result.me, 2), int(result.active.sum())
(6.74, 5)

==========================  ==========================================================================
:mod:`.contrasts`           effects of all columns, centre points apart; :mod:`.aliasing` names them
:mod:`.holes`               what failed runs cost, and which to run again; :mod:`.regression` does without them
:mod:`.lenth`               Lenth's margins; :mod:`.dong`, :mod:`.zahn`, :mod:`.daniel` are alternatives
:mod:`.critical`            simulated critical values of all of them
:mod:`.box_meyer`           probability that a contrast acts; :mod:`.factor_posterior`, that a factor does
:mod:`.crowding`            half or more of the contrasts act: the dummies judge, or the result advises
:mod:`.noise`               how noisy a simulator is
:mod:`.adequacy`            whether main effects suffice, from :mod:`.evidence`; :mod:`.next_design` if not
:mod:`.plots`               half-normal, Pareto, Lenth, main effects, interactions, aliases
==========================  ==========================================================================
"""

from .adequacy import Adequacy, judge_adequacy
from .aliasing import alias_matrix
from .box_meyer import ContrastPosterior, box_meyer
from .contrasts import Effects, completed_values, contrast_columns, count_contrasts, effects
from .critical import ReferenceDistribution, reference_distribution
from .curvature import CentrePoints
from .daniel import HalfNormalFit, half_normal_fit
from .dong import dong
from .evidence import AdequacyStatus, ResponseAdequacy
from .factor_posterior import FactorPosterior, factor_posterior
from .holes import Holes, TooManyHoles
from .judgement import Judgement
from .lenth import LenthResult, lenth
from .next_design import NextDesign
from .noise import effect_error, line_noise, replicate_error
from .screen import Screening, screen
from .zahn import zahn

__all__ = [
    "Adequacy",
    "AdequacyStatus",
    "CentrePoints",
    "ContrastPosterior",
    "Effects",
    "FactorPosterior",
    "HalfNormalFit",
    "Holes",
    "Judgement",
    "LenthResult",
    "NextDesign",
    "ReferenceDistribution",
    "ResponseAdequacy",
    "Screening",
    "TooManyHoles",
    "alias_matrix",
    "box_meyer",
    "completed_values",
    "contrast_columns",
    "count_contrasts",
    "dong",
    "effect_error",
    "effects",
    "factor_posterior",
    "half_normal_fit",
    "judge_adequacy",
    "lenth",
    "line_noise",
    "reference_distribution",
    "replicate_error",
    "screen",
    "zahn",
]

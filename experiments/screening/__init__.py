"""Screening: which factors act on which responses.

>>> from experiments.screening import lenth
>>> result = lenth([21.6, 3.1, 9.9, 14.6, 0.1, -18.1, 16.6, 2.4, -0.4, -1.1, 1.9, 4.1, -1.6, -2.6, 1.4])
>>> round(result.me, 2), int(result.active.sum())
(6.74, 5)
"""

from .contrasts import Effects, contrast_columns, effects
from .lenth import LenthResult, lenth
from .screen import Screening, screen

__all__ = ["Effects", "LenthResult", "Screening", "contrast_columns", "effects", "lenth", "screen"]

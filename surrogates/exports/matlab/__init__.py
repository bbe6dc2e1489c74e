"""Functions for MATLAB and GNU Octave."""

from .target import Matlab

__all__ = ["Matlab"]

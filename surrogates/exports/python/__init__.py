"""Python files: one that needs NumPy alone, one for optimisation with CasADi."""

from .casadi_sx import CasADi
from .numpy_file import NumPyFile

__all__ = ["CasADi", "NumPyFile"]

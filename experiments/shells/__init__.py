"""Shell models for CalculiX: a structured mesh, the text of the input, and what is read off the answer.

Nothing here runs the solver or writes a file: a deck is a text, results are read from a folder somebody else made.
"""

from .deck import Load, Material, model_text, steps_text
from .hexflex import Divisions, Sheet, hexflex_deck, hexflex_files, placeholders, sheet_mesh
from .mesh import Mesh, areas, least_jacobian
from .results import SolverFailed, pose, poses

__all__ = [
    "Divisions",
    "Load",
    "Material",
    "Mesh",
    "Sheet",
    "SolverFailed",
    "areas",
    "hexflex_deck",
    "hexflex_files",
    "least_jacobian",
    "model_text",
    "placeholders",
    "pose",
    "poses",
    "sheet_mesh",
    "steps_text",
]

"""Finite elements for frames of beams in space; knows nothing of factors, designs or devices.

A :class:`Frame` says what is built: nodes, straight members, rigid bodies, clamps. A solver takes it
from there, so that several solvers can share one description.

===================  =============================================================================
:mod:`.model`        materials, members, rigid bodies, frames, loads
:mod:`.checks`       the refusals of a bad frame, one sentence each
:mod:`.sections`     cross-sections: the rectangle, the circle
:mod:`.elements`     the Timoshenko beam: pure functions of coordinates and section properties
:mod:`.arrays`       a frame as arrays
:mod:`.assembly`     the stiffness of the frame and the kinematics of its rigid bodies: pure functions
:mod:`.mechanisms`   frames that nothing holds, or hardly anything
:mod:`.linear`       factorise once, solve many load cases
:mod:`.results`      the deformed centrelines
:mod:`.precision`    float64 for this package alone
===================  =============================================================================

Conventions: SI units and radians. A node has six unknowns, (ux, uy, uz, θx, θy, θz), in global axes.
A member's local x runs from start to end, local z is the part of `up` normal to x, and y = z × x.
All is computed in float64; the global setting ``jax_enable_x64`` is neither needed nor touched.

>>> section, steel = rectangle(width=0.01, thickness=0.001), Material(young=210e9, poisson=0.3)
>>> frame = Frame(
...     nodes={"root": (0, 0, 0), "tip": (0.1, 0, 0)},
...     members=[Member("leaf", "root", "tip", section, steel)],
...     clamps=["root"],
... )
>>> solution = factorise(frame).solve(load_array(frame, [[Load("tip", force=(0, 0, -1.0))]]))
>>> float(solution.at("tip")[0, 2].round(6))
-0.001905
"""

from .equilibria import Equilibria, Path
from .linear import LinearSolver, Solution, factorise
from .loads import load_array, motion_array
from .model import Frame, Load, Material, Member, Motion, RigidBody, Support
from .nonlinear import NonlinearSolver, condense
from .results import Centreline, centrelines
from .sections import Section, circle, rectangle
from .stress import PeakStress

__all__ = [
    "Centreline",
    "Equilibria",
    "Frame",
    "LinearSolver",
    "Load",
    "Material",
    "Member",
    "Motion",
    "NonlinearSolver",
    "Path",
    "PeakStress",
    "RigidBody",
    "Section",
    "Solution",
    "Support",
    "centrelines",
    "circle",
    "condense",
    "factorise",
    "load_array",
    "motion_array",
    "rectangle",
]

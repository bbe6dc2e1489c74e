"""Finite elements for frames of beams, linear and geometrically exact; knows nothing of factors, designs or devices.

A :class:`Frame` says what is built: nodes, straight and circular members, rigid bodies, clamps, supports.
Two solvers take it from there: :func:`factorise` for small displacements, :func:`condense` for large.

=====================  ===========================================================================
:mod:`.model`          materials, members, rigid bodies, supports, frames, loads, motions
:mod:`.checks`         the refusals of a bad frame, one sentence each
:mod:`.sections`       cross-sections: the rectangle, the circle
:mod:`.shapes`         members at rest: length, axes, bend
:mod:`.arrays`         a frame as arrays
:mod:`.loads`          load cases and prescribed motions as arrays
:mod:`.mechanisms`     frames that nothing holds, or hardly anything
:mod:`.stress`         stresses from internal forces
:mod:`.results`        the deformed centrelines
:mod:`.precision`      float64 for this package alone
**small**
:mod:`.elements`       the Timoshenko beam and the arc: pure functions of shape and properties
:mod:`.assembly`       the stiffness of the frame and the kinematics of its rigid bodies
:mod:`.linear`         factorise once, solve many load cases
:mod:`.between`        the stiffness of members between rigid bodies, in many geometries
:mod:`.varying`        one frame in many geometries
**large**
:mod:`.rods`           a member as an initial value problem
:mod:`.planar`         motions, poses and wrenches in the plane
:mod:`.spatial`        the same in space
:mod:`.planes`         which frames move in a plane
:mod:`.blocks`         small dense blocks, many at once
:mod:`.elimination`    block elimination with a plan
:mod:`.condensed`      a frame as whole numbers and arrays of order one
:mod:`.scaling`        from SI units to these
:mod:`.blockloads`     loads and motions of nodes as those of blocks
:mod:`.tangent`        residual, tangent, Newton's step
:mod:`.newton`         Newton's method at one go or in load steps
:mod:`.conclusion`     what a converged state is worth, and its stability
:mod:`.kernel`         the compiled whole
:mod:`.flexibility`    of members, as the derivative of their law
:mod:`.sensitivity`    what is read off, and its derivatives
:mod:`.directions`     along which these are taken
:mod:`.parameters`     geometry as a function of what a frame is built from
:mod:`.path`           paths past limit points
:mod:`.equilibria`     answers in SI units
:mod:`.nonlinear`      condense once, solve many cases
=====================  ===========================================================================

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
>>> large = condense(frame, n_steps=4).solve(load_array(frame, [[Load("tip", force=(0, 0, -20.0))]]))
>>> large.at("tip")[0, [0, 2]].round(4).tolist()
[-0.0071, -0.0336]
"""

from .equilibria import Equilibria, Path
from .linear import LinearSolver, Solution, factorise
from .loads import load_array, motion_array
from .model import Frame, Load, Material, Member, Motion, RigidBody, Support
from .nonlinear import NonlinearSolver, condense
from .parameters import geometry_rates
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
    "geometry_rates",
    "load_array",
    "motion_array",
    "rectangle",
]

"""The Assur-group method: force and displacement of planar flexure mechanisms, for many points at once.

A :class:`Mechanism` is told by its generation principle: driving links, then groups of two links (dyads) or
of a platform on three legs (triads), each hung on what is there already, each joint a leaf flexure.
:func:`solve` repeats the thesis's three steps until nothing changes: positions of the rigid equivalent,
forces in reverse order, large deflection of each flexure. What it finds is an exact equilibrium of rigid
links on elastic leaves, with no mesh.

======================  ==========================================================================
:mod:`.model`           leaves, flexures, loads
:mod:`.groups`          driving links, dyads, triads, and the mechanism they build
:mod:`.checks`          the refusals of bad input, one sentence each
:mod:`.layout`          a mechanism as arrays
:mod:`.kinematics`      step 1: the position of each module
:mod:`.statics`         step 2: joint forces and driving torques
:mod:`.elastica`        step 3: the boundary value problem of a leaf
:mod:`.iteration`       Algorithm 1
:mod:`.acceleration`    Anderson's acceleration of it
:mod:`.batch`           many points at once
:mod:`.solver`          :func:`solve`
:mod:`.results`         :class:`Solution`
:mod:`.examples`        the thesis's 3-RRR, a four-bar
======================  ==========================================================================

Conventions: SI units and radians, anticlockwise; float64. Links are described where they are at rest, in
global axes. Source: S. Durango's thesis, section 1.1 ("the thesis").

>>> mechanism = flexure_3rrr()
>>> solution = solve(mechanism, [mechanism.rest + 0.1, mechanism.rest - 0.1])
>>> [bool(ok) for ok in solution.ok]
[True, True]
>>> solution.rotation("platform").round(4).tolist()
[-0.1149, 0.1266]
>>> (solution.torque("crank1") * 1e3).round(3).tolist()  # N mm
[1.635, -2.699]
"""

from .elastica import Deflection, deflect
from .examples import flexure_3rrr, flexure_four_bar
from .groups import GROUND, DrivingLink, Dyad, Mechanism, Triad
from .iteration import Settings
from .model import Flexure, Leaf, Load
from .results import Solution
from .solver import solve

__all__ = [
    "GROUND",
    "Deflection",
    "DrivingLink",
    "Dyad",
    "Flexure",
    "Leaf",
    "Load",
    "Mechanism",
    "Settings",
    "Solution",
    "Triad",
    "deflect",
    "flexure_3rrr",
    "flexure_four_bar",
    "solve",
]

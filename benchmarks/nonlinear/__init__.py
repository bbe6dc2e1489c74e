"""The nonlinear solver: beside OpenSees, over a whole workspace, as the frame and the number of points grow.

Modules
-------
processes
    Work in a fresh process, on one core or on all.
peer, cases
    The same mechanisms in OpenSees, CPU time and error side by side.
workspace
    All cores, all points of two workspaces, and whether each converges.
growth
    Time against members, steps and points; memory.
first_call
    What compilation costs.
"""

from . import first_call, growth, peer, workspace


def table() -> str:
    parts = (peer, workspace, growth, first_call)
    return "### Nonlinear beams\n\n" + "\n".join(part.table() for part in parts)

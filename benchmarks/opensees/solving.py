"""What all OpenSees models here share: the static Newton analysis and its steps."""

from collections.abc import Iterable
from itertools import count

import numpy as np
import openseespy.opensees as ops
from numpy.typing import NDArray


def static_analysis(
    n_steps: int, tolerance: float = 1e-9, iterations: int = 50, system: str = "BandGeneral", algorithm: str = "Newton"
) -> None:
    """Newton's method, `n_steps` equal increments of the load factor to 1; `tolerance` bounds the last correction.

    The tolerance is on the Euclidean norm of all displacement corrections, m and rad mixed. The tangent of the
    spatial corotational transformation is not exact: convergence is linear, so the error left is a few tolerances,
    and large rotations need ``NewtonLineSearch``.
    """
    ops.wipeAnalysis()
    ops.constraints("Transformation")
    ops.numberer("RCM")
    ops.system(system)
    ops.test("NormDispIncr", tolerance, iterations, 0, 2)
    ops.algorithm(algorithm)
    ops.integrator("LoadControl", 1.0 / n_steps)
    ops.analysis("Static", "-noWarnings")


def advance(n_steps: int) -> None:
    """Take the increments.

    Raises
    ------
    RuntimeError
        If Newton's method does not converge.
    """
    if ops.analyze(n_steps) != 0:
        raise RuntimeError(f"OpenSees: no convergence in {n_steps} steps; take more")


class Builder:
    """A model under construction: hands out tags of nodes and elements.

    Parameters
    ----------
    dimensions, freedoms : int
        Of the model, and per node.
    """

    def __init__(self, dimensions: int, freedoms: int) -> None:
        ops.wipe()
        ops.model("basic", "-ndm", dimensions, "-ndf", freedoms)
        ops.timeSeries("Linear", 1)
        self._nodes, self._elements = count(1), count(1)

    def node(self, point: Iterable[float]) -> int:
        """Add a node at `point`, m; returns its tag."""
        tag = next(self._nodes)
        ops.node(tag, *map(float, point))
        return tag

    def element(self, kind: str, start: int, end: int, *arguments: float) -> int:
        """Add an element of OpenSees's type `kind`; returns its tag."""
        tag = next(self._elements)
        ops.element(kind, tag, start, end, *arguments)
        return tag

    def chain(self, start: int, points: NDArray[np.float64], kind: str, *arguments: float) -> tuple[int, list[int]]:
        """Elements from node `start` through new nodes at `points`; returns the last node and the elements."""
        elements = []
        for point in points:
            end = self.node(point)
            elements.append(self.element(kind, start, end, *arguments))
            start = end
        return start, elements


def divided(start: NDArray[np.float64], end: NDArray[np.float64], n: int) -> NDArray[np.float64]:
    """The `n` points that divide the line from `start` to `end` equally, `end` included."""
    return start + np.outer(np.arange(1, n + 1) / n, end - start)

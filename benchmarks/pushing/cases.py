"""The mechanisms: what is widened, what is fitted, and the largest stress."""

from collections.abc import Callable
from dataclasses import dataclass

import jax.numpy as jnp
import numpy as np
from jax import Array
from numpy.typing import NDArray

from experiments import Factor, FactorSpace
from experiments.fea import condense
from experiments.fea.sensitivity import Answer
from experiments.fea.stress import bending_stress, fibres
from experiments.oracles.flexure_3rrr import Flexure3RRR
from experiments.oracles.hexflex import HexFlex

from ..nonlinear.cases import tab_loads

Floats = NDArray[np.float64]

STRESS_LIMITS = {"the thesis's 250 MPa": 250e6, "yield, 503 MPa": 503e6}
"""Pa. Both mechanisms are of aluminium 7075. 250 MPa: Durango et al. 1.1.5.4, for the 3-RRR; for the HexFlex the thesis
states none. 503 MPa: typical tensile yield of temper T6, by the Aluminum Association; the thesis names no temper.
"""


@dataclass(frozen=True)
class Case:
    """A mechanism whose ranges grow.

    Parameters
    ----------
    title, unit : str
        What a range is, and its unit.
    oracle : HexFlex or Flexure3RRR
    space : callable
        From a range to the factors that vary, the first n_varied of the oracle's.
    n_outputs : int
        So many responses of the oracle are fitted, from the first.
    stress : callable
        From points of the oracle, shape (n, n_factors), to the largest bending stress, shape (n,), Pa; NaN without
        equilibrium.
    sizes : tuple of int
        Runs of the designs.
    ranges : tuple of float
        From small to large; the first is the published one.
    precision : tuple of float
        To which a range is bisected: by the stress, and by what needs models.
    """

    title: str
    unit: str
    oracle: HexFlex | Flexure3RRR
    space: Callable[[float], FactorSpace]
    n_outputs: int
    stress: Callable[[Floats], Floats]
    sizes: tuple[int, ...]
    ranges: tuple[float, ...]
    precision: tuple[float, float]

    def points(self, reach: float, coded: Floats) -> Floats:
        """Settings of all of the oracle's factors, shape (n, n_factors); those that do not vary are zero."""
        varied = self.space(reach).decode(coded)
        return np.hstack([varied, np.zeros((len(varied), len(self.oracle.factors) - varied.shape[1]))])


def hexflex() -> Case:
    """All six forces of the HexFlex at once."""
    oracle = HexFlex(kinematics="nonlinear")
    solver = condense(oracle.frame, n_steps=oracle.n_steps)
    sections = fibres(oracle.frame.members)

    def largest(answer: Answer) -> Array:
        return bending_stress(jnp, answer.internal, sections).max(axis=(0, 1))[None]

    def space(reach: float) -> FactorSpace:
        return FactorSpace(tuple(Factor(f.name, f.unit, -reach, reach) for f in oracle.factors))

    def stress(points: Floats) -> Floats:
        return solver.read(largest, tab_loads(points)).values[:, 0]

    ranges = (1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0)
    return Case("HexFlex, all six forces, ±", "N", oracle, space, 6, stress, (60, 120), ranges, (0.01, 0.1))


def flexure_3rrr() -> Case:
    """The three cranks of the 3-RRR about the middle of their range, without a wrench (Durango et al. 1.1.5.4)."""
    oracle = Flexure3RRR()
    cranks = oracle.factors.factors[:3]
    column = [response.name for response in oracle.responses].index("stress")

    def space(reach: float) -> FactorSpace:
        middles = [0.5 * (f.low + f.high) for f in cranks]
        return FactorSpace(
            tuple(Factor(f.name, f.unit, m - reach / 2, m + reach / 2) for f, m in zip(cranks, middles, strict=True))
        )

    def stress(points: Floats) -> Floats:
        return oracle.evaluate(points).values[:, column]

    ranges = (0.44, 0.55, 0.66, 0.88, 1.1)
    return Case("3-RRR, three cranks, width", "rad", oracle, space, 3, stress, (30, 60), ranges, (0.001, 0.02))


CASES = {"hexflex": hexflex, "flexure_3rrr": flexure_3rrr}

"""A tip-loaded cantilever in closed form: the smallest mechanism, and nothing of the HexFlex in it."""

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from ..factors import Factor, FactorSpace
from ..runs import Response
from ..settings import parameter
from .base import Arrow, JaxOracle, Line, Shape


@dataclass(frozen=True)
class Cantilever(JaxOracle):
    """Straight leaf spring, clamped at one end, loaded across its tip.

    Parameters
    ----------
    young : float
        Young's modulus [Pa]; by default aluminium 7075.

    Raises
    ------
    ValueError
        If `young` is not positive.

    Notes
    -----
    Young and Budynas (2002), *Roark's Formulas for Stress and Strain*, 7th ed., Table 8.1, case 1a:
    tip deflection F·L³/(3EI), tip slope F·L²/(2EI), with I = b·h³/12. Small displacements, no shear.
    """

    name: ClassVar[str] = "cantilever"
    summary: ClassVar[str] = "tip-loaded leaf spring, small displacements, closed form"
    source: ClassVar[str] = "Roark's Formulas for Stress and Strain, 7th ed., Table 8.1, case 1a"
    resolution: ClassVar[float] = 1e-12

    young: float = parameter(71.7e9, "Pa", "Young's modulus")

    def __post_init__(self) -> None:
        if not self.young > 0.0:
            raise ValueError(f"oracle 'cantilever': young must be positive, got {self.young}")

    @property
    def limits(self) -> str:
        """What the closed form leaves out."""
        return "Small displacements, no shear"

    @property
    def factors(self) -> FactorSpace:
        """Length, width, thickness and load of a flexure a hand could hold."""
        ours = "our choice: a spring-steel-ruler-sized flexure within ±5 % (load ±20 %)"
        return FactorSpace(
            (
                Factor("length", "m", 47.5e-3, 52.5e-3, ours),
                Factor("width", "m", 9.5e-3, 10.5e-3, ours),
                Factor("thickness", "m", 0.95e-3, 1.05e-3, ours),
                Factor("load", "N", 0.8, 1.2, ours),
            )
        )

    @property
    def responses(self) -> tuple[Response, ...]:
        """Tip deflection and slope."""
        return (
            Response("deflection", "m", "mm", 1e3),
            Response("slope", "rad", "mrad", 1e3),
        )

    def respond(self, point: Any) -> Any:
        """Tip deflection [m] and slope [rad] at (length, width, thickness, load)."""
        import jax.numpy as jnp

        length, width, thickness, load = point
        bending = self.young * width * thickness**3 / 12.0
        return jnp.array([load * length**3 / (3.0 * bending), load * length**2 / (2.0 * bending)])

    def shape(self, point: ArrayLike) -> Shape:
        """The deflection line F·x²(3L − x)/(6EI), along x, deflecting along z."""
        length, width, thickness, load = np.asarray(point, dtype=np.float64)
        x = np.linspace(0.0, length, 41)
        bending = self.young * width * thickness**3 / 12.0
        zero = np.zeros_like(x)
        line = load * x**2 * (3.0 * length - x) / (6.0 * bending)
        at_rest, moved = np.column_stack([x, zero, zero]), np.column_stack([zero, zero, line])
        tip = Arrow("load", at_rest[-1], moved[-1], np.array([0.0, 0.0, np.sign(load)]))
        return Shape((Line("leaf", at_rest, moved),), (tip,), at_rest[:1])

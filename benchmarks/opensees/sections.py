"""Section properties of solid rectangles, written anew so that the peer shares no code with ``experiments.fea``."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Rectangle:
    """`width` along local y, `thickness` along local z, m; `shear_coefficient` is shear area over area."""

    width: float
    thickness: float
    shear_coefficient: float = 5 / 6

    @property
    def area(self) -> float:
        """m²."""
        return self.width * self.thickness

    @property
    def second_moment_y(self) -> float:
        """∫ z² dA, m⁴."""
        return self.width * self.thickness**3 / 12

    @property
    def second_moment_z(self) -> float:
        """∫ y² dA, m⁴."""
        return self.thickness * self.width**3 / 12

    @property
    def torsion_constant(self) -> float:
        """Saint-Venant's series, m⁴."""
        a, b = max(self.width, self.thickness), min(self.width, self.thickness)
        k = np.arange(1, 400, 2)
        series = np.sum(np.tanh(k * np.pi * a / (2 * b)) / k**5)
        return float(a * b**3 / 3 * (1 - 192 * b / (np.pi**5 * a) * series))

"""Test functions with exact Jacobians; inputs in coded units, [−1, 1]."""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import combinations_with_replacement
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Complexes = NDArray[Any]  # real, or complex for a complex step

STEP = 1e-30
"""Complex step: f'(x) = Im f(x + ih) / h to rounding, however small h is (Squire and Trapp, 1998, SIAM Review 40)."""


@dataclass(frozen=True)
class Function:
    """A map from coded inputs to responses, and where it is from.

    Parameters
    ----------
    name : str
        On the command line.
    title, source : str
        In tables.
    low, high : tuple of float
        Ranges of the inputs, in the units of the source; coded −1 and +1.
    formula : callable
        From inputs in the units of the source, shape (n_inputs, n_points), to responses, shape (n_points,) or
        (n_responses, n_points); takes complex numbers, too.
    """

    name: str
    title: str
    source: str
    low: tuple[float, ...]
    high: tuple[float, ...]
    formula: Callable[[Complexes], Complexes]

    @property
    def n_inputs(self) -> int:
        """Number of inputs."""
        return len(self.low)

    def values(self, X: Floats) -> Floats:
        """Responses at coded points, shapes (n_points, n_inputs) and (n_points, n_responses)."""
        return np.real(self._at(X))

    def jacobian(self, X: Floats) -> Floats:
        """d response / d coded input, shape (n_points, n_responses, n_inputs), exact but for rounding."""
        columns = [np.imag(self._at(X + STEP * 1j * unit)) / STEP for unit in np.eye(self.n_inputs)]
        return np.stack(columns, axis=-1)

    def _at(self, X: Complexes) -> Complexes:
        low, high = np.array(self.low), np.array(self.high)
        settings = low + (high - low) * (X + 1.0) / 2.0
        return np.atleast_2d(self.formula(settings.T)).T


def _ishigami(x: Complexes) -> Complexes:
    return np.sin(x[0]) + 7.0 * np.sin(x[1]) ** 2 + 0.1 * x[2] ** 4 * np.sin(x[0])


def _otl(x: Complexes) -> Complexes:
    r_b1, r_b2, r_f, r_c1, r_c2, beta = x
    v_b1 = 12.0 * r_b2 / (r_b1 + r_b2)
    gain = beta * (r_c2 + 9.0)
    return (v_b1 + 0.74) * gain / (gain + r_f) + 11.35 * r_f / (gain + r_f) + 0.74 * r_f * gain / ((gain + r_f) * r_c1)


def _piston(x: Complexes) -> Complexes:
    mass, area, v0, k, p0, ta, t0 = x
    push = p0 * area + 19.62 * mass - k * v0 / area
    gas = p0 * v0 / t0 * ta
    volume = area / (2.0 * k) * (np.sqrt(push**2 + 4.0 * k * gas) - push)
    return 2.0 * np.pi * np.sqrt(mass / (k + area**2 * gas / volume**2))


def _borehole(x: Complexes) -> Complexes:
    r_w, r, t_u, h_u, t_l, h_l, length, k_w = x
    log = np.log(r / r_w)
    return 2.0 * np.pi * t_u * (h_u - h_l) / (log * (1.0 + t_u / t_l) + 2.0 * length * t_u / (r_w**2 * k_w))


def _wing(x: Complexes) -> Complexes:
    s_w, w_fw, a, sweep, q, taper, t_c, n_z, w_dg, w_p = x
    cos = np.cos(sweep * np.pi / 180.0)
    wing = 0.036 * s_w**0.758 * w_fw**0.0035 * (a / cos**2) ** 0.6 * q**0.006 * taper**0.04
    return wing * (100.0 * t_c / cos) ** -0.3 * (n_z * w_dg) ** 0.49 + s_w * w_p


def _cubic_map(seed: int = 2012, n: int = 6) -> Callable[[Complexes], Complexes]:
    """Six cubics of six inputs; all 84 terms act, the coefficients of degree 2 and 3 are small (rms).

    The linear part has singular values from 1 to 2.
    """
    rng = np.random.default_rng(seed)
    exponents = [
        np.bincount(np.array(term, dtype=int), minlength=n)
        for degree in range(4)
        for term in combinations_with_replacement(range(n), degree)
    ]
    table = np.array(exponents)
    degrees = table.sum(axis=1)
    left, right = (np.linalg.qr(rng.normal(size=(n, n)))[0] for _ in range(2))
    linear = (left * np.linspace(1.0, 2.0, n)) @ right
    size = np.sqrt(np.mean(linear**2)) * np.array([1.0, 1.0, 0.1, 0.03])[degrees]
    coefficients = size * rng.normal(size=(n, len(table)))
    coefficients[:, degrees == 1] = linear

    def formula(x: Complexes) -> Complexes:
        return coefficients @ np.prod(x[None, :, :] ** table[:, :, None], axis=1)

    return formula


FUNCTIONS = (
    Function(
        "ishigami",
        "Ishigami",
        "Ishigami and Homma (1990), ISUMA '90, 398–403, a = 7, b = 0.1",
        (-np.pi,) * 3,
        (np.pi,) * 3,
        _ishigami,
    ),
    Function(
        "otl",
        "OTL circuit",
        "Ben-Ari and Steinberg (2007), Quality Engineering 19, 327–338",
        (50.0, 25.0, 0.5, 1.2, 0.25, 50.0),
        (150.0, 70.0, 3.0, 2.5, 1.2, 300.0),
        _otl,
    ),
    Function(
        "cubic",
        "6 → 6 cubic",
        "random, our own: degree 2 is 0.1 and degree 3 is 0.03 of the linear coefficients, all 84 terms act",
        (-1.0,) * 6,
        (1.0,) * 6,
        _cubic_map(),
    ),
    Function(
        "piston",
        "piston",
        "Kenett and Zacks (1998), Modern Industrial Statistics",
        (30.0, 0.005, 0.002, 1000.0, 90e3, 290.0, 340.0),
        (60.0, 0.020, 0.010, 5000.0, 110e3, 296.0, 360.0),
        _piston,
    ),
    Function(
        "borehole",
        "borehole",
        "Morris, Mitchell and Ylvisaker (1993), Technometrics 35, 243–255",
        (0.05, 100.0, 63070.0, 990.0, 63.1, 700.0, 1120.0, 9855.0),
        (0.15, 50000.0, 115600.0, 1110.0, 116.0, 820.0, 1680.0, 12045.0),
        _borehole,
    ),
    Function(
        "wing",
        "wing weight",
        "Forrester, Sóbester and Keane (2008), Engineering Design via Surrogate Modelling, example 1.3",
        (150.0, 220.0, 6.0, -10.0, 16.0, 0.5, 0.08, 2.5, 1700.0, 0.025),
        (200.0, 300.0, 10.0, 10.0, 45.0, 1.0, 0.18, 6.0, 2500.0, 0.08),
        _wing,
    ),
)

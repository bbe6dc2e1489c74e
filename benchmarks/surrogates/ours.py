"""Ours: settings of the estimator that are tried beside the peers. Change the list, the peers' results stay known."""

from typing import Any

from .functions import Floats
from .methods import Method, Predict

OURS: list[tuple[str, dict[str, Any], bool]] = [
    ("ours", {"degree": "auto", "highest_degree": 12, "selection": "evidence"}, False),
    ("ours with gradients", {"degree": "auto", "highest_degree": 12, "selection": "evidence"}, True),
]
"""Label, settings of :class:`surrogates.PolynomialRegressor`, and whether it is taught gradients."""


def _method(label: str, settings: dict[str, Any], taught: bool) -> Method:
    def fit(X: Floats, Y: Floats, J: Floats) -> Predict:
        from experiments import Factor, FactorSpace
        from surrogates import PolynomialRegressor

        cube = FactorSpace(tuple(Factor(f"x{k + 1}", "1", -1.0, 1.0) for k in range(X.shape[1])))
        model = PolynomialRegressor(**settings, space=cube)
        return (model.fit(X, Y, J) if taught else model.fit(X, Y)).predict

    text = ", ".join(f"{name}={value!r}" for name, value in settings.items())
    return Method(label, f"PolynomialRegressor({text})", ("surrogates", "experiments"), taught, fit)


METHODS = tuple(_method(*one) for one in OURS)

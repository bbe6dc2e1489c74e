"""Peers of smt: a quadratic, Kriging, and Kriging taught by gradients (GEKPLS)."""

from typing import Any

import numpy as np

from .functions import Floats
from .methods import Method, Predict, each_response

MODULES = ("smt", "smt.surrogate_models")


def _trained(model: Any, X: Floats, y: Floats, slopes: Floats | None = None) -> Predict:
    model.set_training_values(X, y[:, None])
    if slopes is not None:
        for k in range(X.shape[1]):
            model.set_training_derivatives(X, slopes[:, [k]], k)
    model.train()
    return model.predict_values


def _quadratic(X: Floats, y: Floats, slopes: Floats) -> Predict:
    from smt.surrogate_models import QP

    return _trained(QP(print_global=False), X, y)


def _kriging(X: Floats, y: Floats, slopes: Floats) -> Predict:
    from smt.surrogate_models import KRG

    return _trained(KRG(print_global=False), X, y)


def _gekpls(n_comp: int | None) -> Any:
    def fit_one(X: Floats, y: Floats, slopes: Floats) -> Predict:
        from smt.surrogate_models import GEKPLS

        k = X.shape[1]
        n = k if n_comp is None else n_comp
        model = GEKPLS(
            n_comp=n, theta0=[1e-2] * n, extra_points=k, xlimits=np.array([[-1.0, 1.0]] * k), print_global=False
        )
        return _trained(model, X, y, slopes)

    return fit_one


# GEKPLS puts further points beside each run, delta_x of the range away, by first-order Taylor. As many as inputs use
# the whole gradient and did best in trials on other designs; so did the default step, 1e-4 (1e-2, and larger nuggets,
# were mostly worse). One component per input is better still on maps near to linear, but slow.
METHODS = (
    Method("smt QP", "the full quadratic", MODULES, False, each_response(_quadratic)),
    Method(
        "smt KRG",
        "defaults: constant trend, squared exponential, theta0 = 1e-2, TNC from 10 starts",
        MODULES,
        False,
        each_response(_kriging),
    ),
    Method(
        "smt GEKPLS",
        "2 components (default), as many extra points as inputs, delta_x = 1e-4 (default)",
        MODULES,
        True,
        each_response(_gekpls(2)),
    ),
    Method(
        "smt GEKPLS (all components)",
        "as many components and extra points as inputs, delta_x = 1e-4 (default)",
        MODULES,
        True,
        each_response(_gekpls(None)),
    ),
)

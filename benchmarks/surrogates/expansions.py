"""Peers with sparse expansions in Legendre polynomials: OpenTURNS and chaospy."""

from functools import cache, partial
from typing import Any

import numpy as np

from .functions import Floats
from .methods import Method, Predict, each_response
from .regression import candidate_degrees, folds

MOST = 500
"""Candidates: the highest degree has no more terms."""

TOTAL, HYPERBOLIC = (1.0,), (0.5, 0.75, 1.0)
"""Quasi-norms of the bases that OpenTURNS tries: in trials, the first was the better at 30 runs, the second at 100."""


def _openturns(quasi_norms: tuple[float, ...], X: Floats, y: Floats, slopes: Floats) -> Predict:
    """LARS on each basis (Blatman and Sudret, 2011, J. Comput. Phys. 230), then the least corrected LOO error."""
    import openturns as ot

    ot.TBB.Disable()
    k = X.shape[1]
    inputs, outputs = ot.Sample(X), ot.Sample(y[:, None])
    measure = ot.JointDistribution([ot.Uniform(-1.0, 1.0)] * k)
    search = ot.LeastSquaresStrategy(ot.LeastSquaresMetaModelSelectionFactory(ot.LARS(), ot.CorrectedLeaveOneOut()))
    found: list[tuple[float, Any]] = []
    for q in quasi_norms:
        order = ot.HyperbolicAnisotropicEnumerateFunction(k, q)
        basis = ot.OrthogonalProductPolynomialFactory([ot.LegendreFactory()] * k, order)
        for degree in range(1, 9):
            size = order.getBasisSizeFromTotalDegree(degree)
            if size > MOST:
                break
            fit = ot.FunctionalChaosAlgorithm(inputs, outputs, measure, ot.FixedStrategy(basis, size), search)
            fit.run()
            # The history holds the corrected leave-one-out errors of the path; the model returned is its least.
            found.append((min(fit.getResult().getErrorHistory()), fit.getResult().getMetaModel()))
    best = min(found, key=lambda one: one[0])[1]
    return lambda Z: np.array(best(ot.Sample(Z)))


@cache
def _legendre(k: int, degree: int) -> Any:
    import chaospy

    return chaospy.generate_expansion(degree, chaospy.Iid(chaospy.Uniform(-1.0, 1.0), k), normed=True)


def _chaospy(X: Floats, y: Floats, slopes: Floats) -> Predict:
    """Lasso by LARS, the degree with the least cross-validated error. The mean goes first: no intercept is fitted."""
    import chaospy
    from sklearn.linear_model import LassoLarsCV

    mean = y.mean()
    found: list[tuple[float, Any]] = []
    for degree in candidate_degrees(X.shape[1], MOST):
        model = LassoLarsCV(fit_intercept=False, cv=folds(), max_iter=2000)
        expansion = chaospy.fit_regression(_legendre(X.shape[1], degree), X.T, y - mean, model=model)
        found.append((float(model.mse_path_.mean(axis=-1).min()), expansion))
    best = min(found, key=lambda one: one[0])[1]
    return lambda Z: mean + best(*Z.T)


_LARS = "FunctionalChaosAlgorithm, LARS with CorrectedLeaveOneOut on Legendre polynomials; "
_CHOICE = f"degrees 1 to 8 with at most {MOST} candidates, the basis with the least corrected leave-one-out error"

METHODS = (
    Method(
        "OpenTURNS LARS",
        f"{_LARS}total {_CHOICE}",
        ("openturns",),
        False,
        each_response(partial(_openturns, TOTAL)),
    ),
    Method(
        "OpenTURNS LARS (hyperbolic)",
        f"{_LARS}hyperbolic bases of q = 0.5, 0.75 and 1, {_CHOICE}",
        ("openturns",),
        False,
        each_response(partial(_openturns, HYPERBOLIC)),
    ),
    Method(
        "chaospy LassoLarsCV",
        "fit_regression on orthonormal Legendre polynomials with scikit-learn's LassoLarsCV, 10 folds; "
        f"degrees 1 to 8 with at most {MOST} candidates, chosen by cross-validation",
        ("chaospy", "sklearn.linear_model"),
        False,
        each_response(_chaospy),
    ),
)

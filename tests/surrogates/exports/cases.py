"""Models that the exports to Python, CasADi and ONNX are tried on, beside those of ``cases``."""

from dataclasses import replace

from surrogates import Surrogate, certify
from tests.surrogates.cases import ALL, square_quadratic, surrogate, unit_box


def logarithms() -> Surrogate:
    """Three factors to three curved responses, the second and third by their logarithm."""
    model = square_quadratic()
    return replace(model, coefficients=model.coefficients * [1.0, 100.0, 1.0], links=("identity", "log", "log"))


def affine_logarithm() -> Surrogate:
    """Affine, the first of two responses by its logarithm."""
    model = surrogate(unit_box(2), ["1", "f0", "f1"], [[0.5, 1.0, -0.5], [-14.0, 0.2, 1.0]])
    return replace(model, links=("log", "identity"))


def one_logarithm() -> Surrogate:
    """One factor, one response, which is given by its logarithm."""
    return replace(surrogate(unit_box(1), ["1", "f0"], [[-3.0, 0.5]]), links=("log",))


def certified() -> Surrogate:
    """Curved, with a certificate that counts Newton's steps."""
    model = square_quadratic()
    return replace(model, certificate=certify(model))


def sparse() -> Surrogate:
    """A term of degree nine, few of whose divisors are terms, and a response that is always zero."""
    return surrogate(unit_box(3), ["f0", "f0^3:f1^2:f2^4"], [[2.0, 0.5], [0.0, 0.0]])


MODELS = {
    **ALL,
    "logarithms": logarithms,
    "affine_logarithm": affine_logarithm,
    "one_logarithm": one_logarithm,
    "certified": certified,
    "sparse": sparse,
}

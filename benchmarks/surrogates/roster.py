"""All methods, ours first."""

from . import expansions, kriging, ours, regression
from .methods import Method

METHODS: tuple[Method, ...] = (*ours.METHODS, *regression.METHODS, *expansions.METHODS, *kriging.METHODS)


def by_label(label: str) -> Method:
    return next(method for method in METHODS if method.label == label)


def is_ours(label: str) -> bool:
    """Ours change from day to day, so nothing of ours is kept."""
    return any(method.label == label for method in ours.METHODS)

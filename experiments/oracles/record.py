"""What an oracle says of itself, as plain data: enough to report on its answers without its code."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..factors import Factor, FactorSpace
from ..runs import Response
from .base import Answers, Oracle, OracleError

_PLAIN = ("name", "summary", "source", "version", "origin", "code", "batch", "resolution", "limits", "parameters")


def described(oracle: Oracle) -> dict[str, Any]:
    """What `oracle` says of itself, JSON-able; :class:`Recorded` reads it."""
    return {
        **{key: getattr(oracle, key) for key in _PLAIN},
        "factors": [asdict(f) for f in oracle.factors],
        "responses": [asdict(r) for r in oracle.responses],
        "has_jacobian": hasattr(oracle, "jacobian"),
    }


@dataclass(frozen=True, eq=False)
class Recorded(Oracle):
    """An oracle that can be read of, but not asked.

    Parameters
    ----------
    description : mapping
        From :func:`described`.

    Raises
    ------
    ValueError
        If the description is damaged.
    """

    description: Mapping[str, Any]
    _said: tuple[FactorSpace, tuple[Response, ...], str, dict[str, Any]] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        try:
            for key in ("name", "summary", "source", "version", "origin", "code", "batch", "resolution"):
                object.__setattr__(self, key, self.description[key])
            space = FactorSpace(tuple(Factor(**f) for f in self.description["factors"]))
            responses = tuple(Response(**r) for r in self.description["responses"])
            said = str(self.description["limits"]), dict(self.description["parameters"])
            if self.description["has_jacobian"]:
                object.__setattr__(self, "jacobian", self.evaluate)
        except (KeyError, TypeError, AttributeError) as error:
            raise ValueError(f"it is no description of an oracle ({type(error).__name__}: {error})") from None
        object.__setattr__(self, "_said", (space, responses, *said))

    @property
    def factors(self) -> FactorSpace:
        """As they were."""
        return self._said[0]

    @property
    def responses(self) -> tuple[Response, ...]:
        """As they were."""
        return self._said[1]

    @property
    def limits(self) -> str:
        """As it said."""
        return self._said[2]

    @property
    def parameters(self) -> dict[str, Any]:
        """As they were."""
        return self._said[3]

    def evaluate(self, points: NDArray[np.float64]) -> Answers:
        """Refuse: :class:`OracleError`."""
        raise OracleError(
            f"this is the record of the oracle {self.name!r}, without its code ({self.origin}); to ask it, read the "
            "run with pipeline.read_run(folder, load=True), which runs that code"
        )

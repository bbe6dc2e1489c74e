"""The generation principle: a mechanism as a sequence of driving links and Assur groups.

Which flexures join a module to the earlier ones follows from the links that they name.
Source: thesis, 1.1.4.1 and eq. 1.10.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from .checks import check_mechanism
from .model import Flexure

GROUND = "ground"


@dataclass(frozen=True)
class DrivingLink:
    """A link on one flexure whose orientation is prescribed, class I_R.

    Parameters
    ----------
    link : str
    rest : float
        Its angle at rest, rad: with 0, angles are rotations from rest. On a moving link the angle is
        counted from that link, and the driving torque reacts on it.
    """

    link: str
    rest: float = 0.0

    @property
    def links(self) -> tuple[str, ...]:
        """The one link."""
        return (self.link,)


@dataclass(frozen=True)
class Dyad:
    """Two links, joined by a flexure; each hangs by another flexure on an earlier link. Second class, RRR.

    Parameters
    ----------
    first, second : str
    """

    first: str
    second: str

    @property
    def links(self) -> tuple[str, ...]:
        """Both links."""
        return (self.first, self.second)


@dataclass(frozen=True)
class Triad:
    """A platform on three legs, each of which hangs on an earlier link. Third class, RR-RR-RR.

    Parameters
    ----------
    platform : str
    legs : tuple of 3 str
    """

    platform: str
    legs: tuple[str, str, str]

    def __post_init__(self) -> None:
        if isinstance(self.legs, str) or len(tuple(self.legs)) != 3:
            raise ValueError(f"legs of triad {self.platform!r} must be three link names, got {self.legs!r}")
        object.__setattr__(self, "legs", tuple(self.legs))

    @property
    def links(self) -> tuple[str, ...]:
        """The platform, then the legs."""
        return (self.platform, *self.legs)


Module = DrivingLink | Dyad | Triad


@dataclass(frozen=True)
class Mechanism:
    """A planar flexure mechanism at rest, with its generation principle.

    Parameters
    ----------
    flexures : iterable of Flexure
        All joints; the link called "ground" does not move.
    modules : iterable of DrivingLink, Dyad or Triad
        In the order in which they build the mechanism: each hangs on the ground or on earlier links.

    Raises
    ------
    ValueError
        If the parts do not fit together; the sentence names the module, link or flexure.
    """

    flexures: tuple[Flexure, ...]
    modules: tuple[Module, ...]

    def __post_init__(self) -> None:
        object.__setattr__(self, "flexures", tuple(self.flexures))
        object.__setattr__(self, "modules", tuple(self.modules))
        check_mechanism(self)

    @property
    def links(self) -> tuple[str, ...]:
        """Ground first, then the moving links in the order of the modules."""
        return (GROUND, *(link for module in self.modules for link in module.links))

    @property
    def drivers(self) -> tuple[str, ...]:
        """Names of the driving links; angles and torques keep this order."""
        return tuple(m.link for m in self.modules if isinstance(m, DrivingLink))

    @property
    def rest(self) -> np.ndarray:
        """Angles of the driving links at rest, shape (n_drivers,), rad."""
        return np.array([m.rest for m in self.modules if isinstance(m, DrivingLink)], float)

    def flexures_between(self, links: Iterable[str], others: Iterable[str]) -> tuple[Flexure, ...]:
        """Flexures that join one of `links` to one of `others`, in the order of `links`."""
        others = set(others)
        return tuple(
            flexure
            for link in links
            for flexure in self.flexures
            if any(pair[0] == link and pair[1] in others for pair in (flexure.links, flexure.links[::-1]))
        )

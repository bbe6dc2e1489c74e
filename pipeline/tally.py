"""How far a stage is: counts, rate and time left, and how people read them."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Protocol, runtime_checkable


@dataclass(frozen=True)
class Tally:
    """A stage at one moment.

    Parameters
    ----------
    stage : str
    done, total : int
        Runs that are answered, and all; a total of 0 belongs to a stage that runs no oracle.
    known : int
        Of those done, how many were known from before.
    failed : mapping of str to int
        Of those done, how many failed, by status.
    seconds : float
        Wall time since the stage began to run what was not known [s].
    news : tuple of str
        One sentence for each failure since the tally before.
    """

    stage: str
    done: int
    total: int
    known: int = 0
    failed: Mapping[str, int] = field(default_factory=dict)
    seconds: float = 0.0
    news: tuple[str, ...] = ()

    @property
    def n_failed(self) -> int:
        """Failed runs of all kinds."""
        return sum(self.failed.values())

    @property
    def rate(self) -> float | None:
        """Runs per second, of those that were not known; None before the first."""
        fresh = self.done - self.known
        return fresh / self.seconds if fresh > 0 and self.seconds > 0.0 else None

    @property
    def left(self) -> float | None:
        """Seconds until the stage is done, at this rate; None where that is not known."""
        return (self.total - self.done) / self.rate if self.rate else None

    @property
    def pace(self) -> str:
        """Failures, rate and time left, as far as there is anything to say."""
        parts = [failures(self.failed)] if self.n_failed else []
        if self.rate and self.done < self.total:
            parts += [speed(self.rate), f"about {duration(self.left or 0.0)} left"]
        return ", ".join(parts)


@runtime_checkable
class Watcher(Protocol):
    """What wants to know more than how many runs are done."""

    def tally(self, tally: Tally) -> None:
        """Called when a stage begins, after every batch and when it is done."""
        ...


def failures(failed: Mapping[str, int]) -> str:
    """Such as ``3 failed (2 crashed, 1 timed_out)``."""
    kinds = ", ".join(f"{n} {status}" for status, n in sorted(failed.items()) if n)
    return f"{sum(failed.values())} failed" + (f" ({kinds})" if kinds else "")


def speed(rate: float) -> str:
    """Runs per second, minute or hour, whichever has digits before the point."""
    for unit, seconds in (("s", 1.0), ("min", 60.0)):
        if rate * seconds >= 1.0:
            return f"{rate * seconds:.3g} runs/{unit}"
    return f"{rate * 3600.0:.3g} runs/h"


def duration(seconds: float) -> str:
    """Such as ``40 s``, ``12 min`` or ``3 h 20 min``."""
    if seconds < 99.5:
        return f"{seconds:.0f} s"
    minutes = round(seconds / 60.0)
    if minutes < 100:
        return f"{minutes} min"
    hours, minutes = divmod(minutes, 60)
    return f"{hours} h {minutes} min" if hours < 48 else f"{hours // 24} days {hours % 24} h"

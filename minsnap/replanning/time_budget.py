"""The time that an answer may take, on a monotonic clock."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from minsnap.errors import TimingError

Clock = Callable[[], float]
"""Reads a monotonic clock [s]."""


@dataclass(frozen=True, eq=False)
class TimeBudget:
    """When an answer is due.

    Parameters
    ----------
    clock : callable
        Reads the clock [s].
    called, due : float
        Readings when the answer was asked for, and at which it is due [s].
    """

    clock: Clock
    called: float
    due: float

    @property
    def left(self) -> float:
        """Seconds until the answer is due; negative once it is late."""
        return self.due - self.clock()

    @property
    def took(self) -> float:
        """Seconds since it was asked for."""
        return self.clock() - self.called


def budget_of(clock: Clock, now: float, seconds: float, began: float | None) -> TimeBudget:
    """Return when an answer is due: ``seconds`` after this call, or at the splice where the flight's clock is known.

    Parameters
    ----------
    clock : callable
    now, seconds : float
        Instant on the flown plan's clock, and the budget [s].
    began : float or None
        Reading of ``clock`` at time 0 of the flown plan [s].

    Raises
    ------
    TimingError
        If the splice has passed already.
    """
    called = clock()
    if began is None:
        return TimeBudget(clock, called, called + seconds)
    late = called - (began + now + seconds)
    if late >= 0.0:
        raise TimingError(
            f"the splice at {now + seconds:.6g} s of the flown plan passed {late:.4g} s ago: replan earlier"
        )
    return TimeBudget(clock, called, began + now + seconds)

"""The instant by which work is due, on a monotonic clock."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import inf
from time import monotonic, thread_time

from minsnap.errors import SolverError

Clock = Callable[[], float]
"""Reads a monotonic clock [s]."""

LATE = "time_limit has passed without a certified plan: give more time, or loosen a limit"


class Stopwatch:
    """Time on a clock since a start [s], without what other programs took of the processor meanwhile.

    Parameters
    ----------
    clock : callable
        Reads a monotonic clock [s].

    Attributes
    ----------
    began : float
        Its reading at the start [s].
    """

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self.restart()

    def restart(self) -> None:
        """Start again."""
        self.began, self._processor = self._clock(), thread_time()

    def lap(self) -> float:
        """Return the seconds since the start, and start again."""
        began, processor = self.began, self._processor
        self.restart()
        return min(self.began - began, self._processor - processor)

    @property
    def seconds(self) -> float:
        """Seconds since the start."""
        return min(self.on_clock, thread_time() - self._processor)

    @property
    def on_clock(self) -> float:
        """The same with what other programs took."""
        return self._clock() - self.began


class LateError(SolverError):
    """The time allowed was over before there was a plan that can be certified."""


@dataclass(eq=False)
class Deadline:
    """When work is due.

    Parameters
    ----------
    due : float
        Reading of the clock by which it must have ended [s].
    clock : callable
        Reads a monotonic clock [s].
    expected : float
        How long the work between two checks may take, as far as is known [s].
    """

    due: float = inf
    clock: Clock = monotonic
    expected: float = 0.0

    def __post_init__(self) -> None:
        self.longest, self._watch = 0.0, Stopwatch(self.clock)

    @property
    def passed(self) -> bool:
        """Whether it is over."""
        return self.due < inf and self.clock() > self.due

    @property
    def left(self) -> float:
        """Seconds until then."""
        return self.due - self.clock()

    @property
    def since(self) -> float:
        """Seconds since the last check, or since this deadline was made."""
        return self._watch.seconds

    def resume(self) -> None:
        """Leave out the time since the last check, in which something ran that has its own end."""
        self._watch.restart()

    def require(self) -> None:
        """Raise LateError if it is over."""
        if self.passed:
            raise LateError(LATE)

    def check(self) -> None:
        """Raise LateError if the work until the next check would be late, judged by the longest between two so far."""
        if self.due == inf:
            return
        self.longest = max(self.longest, self._watch.lap())
        if self._watch.began + max(self.longest, self.expected) > self.due:
            raise LateError(LATE)


NEVER = Deadline()
"""No deadline."""

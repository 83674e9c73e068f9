"""Slots of a monotonic clock, one setpoint in each without bursts, and the common start of several vehicles."""

from __future__ import annotations

import math
import select
import threading
import time
from array import array
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from minsnap.basics.messages import shown
from minsnap.errors import TimingError


def check_setpoint_rate(rate: float) -> float:
    """Return a rate [Hz], or raise TimingError where it is no positive number."""
    if not (math.isfinite(rate) and rate > 0):
        raise TimingError(f"the rate is {shown(rate)}: it must be a positive number of setpoints per second")
    return rate


class Clock:
    """Monotonic time and waiting; tests may pass a clock with simulated time."""

    def now(self) -> float:
        """Return the time [s] from an arbitrary origin."""
        return time.monotonic()

    def wait(self, until: float, readers: Sequence[int]) -> None:
        """Wait until the instant, or until one of the file descriptors is readable.

        Parameters
        ----------
        until : float
            An instant of :meth:`now` [s].
        readers : sequence of int
            File descriptors to wake up for.
        """
        select.select(readers, [], [], max(0.0, until - self.now()))


@dataclass(frozen=True)
class Lateness:
    """Lateness of the sent setpoints, and the number of skipped ones.

    Parameters
    ----------
    sent, skipped : int
        Slots that were served, and slots that had passed when their turn came.
    rate : float
        Mean rate of the slots served and skipped, over the time they took [Hz].
    median, p99, p999, worst : float
        Time from the instant a slot was due to the instant it was served [s].
    """

    sent: int
    skipped: int
    rate: float
    median: float
    p99: float
    p999: float
    worst: float


class Schedule:
    """Slots at start + k/rate.

    Each slot is computed from the start time, so errors do not accumulate: after an hour slot k is still at k/rate.
    After a delay the slot due now is served; missed slots are skipped.

    Parameters
    ----------
    rate : float
        Slots a second [Hz].
    start : float
        Instant of slot 0 [s].

    Raises
    ------
    TimingError
        If the rate is not a positive number.
    """

    def __init__(self, rate: float, start: float) -> None:
        self.rate = check_setpoint_rate(rate)
        self.start = start
        self.skipped = 0
        self._last = -1
        self._lateness = array("d")
        self._served = array("d")

    @property
    def due(self) -> float:
        """The instant of the next slot [s]."""
        return self.start + (self._last + 1) / self.rate

    @property
    def last_lateness(self) -> float:
        """Lateness of the slot served last [s]."""
        return self._lateness[-1]

    def take(self, now: float) -> int:
        """Serve the slot due at ``now`` and return its number; missed slots are skipped and counted."""
        self._lateness.append(max(0.0, now - self.due))
        self._served.append(now)
        index = max(self._last + 1, math.floor((now - self.start) * self.rate + 1e-6))
        self.skipped += index - self._last - 1
        self._last = index
        return index

    def lateness(self) -> Lateness:
        """Summarise the slots served so far."""
        if not self._lateness:
            return Lateness(0, 0, 0.0, 0.0, 0.0, 0.0, 0.0)
        late = np.array(self._lateness)
        took = self._served[-1] - self._served[0]
        rate = self._last / took if took > 0 else 0.0
        median, p99, p999 = np.percentile(late, [50, 99, 99.9]).tolist()
        return Lateness(len(late), self.skipped, rate, median, p99, p999, float(late.max()))


AHEAD = 0.5
"""Time from the last vehicle's being ready to the first setpoint of all [s]."""


class CommonFlight:
    """What the flights of a fleet tell each other: who is ready, when all begin, and why all stop.

    Parameters
    ----------
    names : sequence of str
        Of the vehicles.
    clock : Clock
        The same for all.
    rate : float
        Setpoints a second, the same for all [Hz].
    trigger : callable
        Called once all are ready; True lets all go.

    Attributes
    ----------
    begin : float or None
        When the first setpoint of all is due [s].
    reason : str or None
        Why all stop.
    """

    def __init__(self, names: Sequence[str], clock: Clock, rate: float, trigger: Callable[[], bool]) -> None:
        self._names, self._clock, self._rate, self._trigger = tuple(names), clock, rate, trigger
        self._epoch, self._lock = clock.now(), threading.Lock()
        self._ready = [False] * len(names)
        self.begin: float | None = None
        self.reason: str | None = None

    def aligned(self, start: float) -> float:
        """Return the first instant of the common grid of setpoints from another on [s]."""
        return self._epoch + math.ceil((start - self._epoch) * self._rate) / self._rate

    def tell(self, member: int, ready: bool, stopped: str | None) -> None:
        """Take note of a vehicle: whether it is ready, and why it has stopped."""
        with self._lock:
            if stopped is not None and self.reason is None:
                self.reason = f"{self._names[member]} has stopped: {stopped}"
            self._ready[member] = ready
            if self.begin is None and self.reason is None and all(self._ready) and self._trigger():
                self.begin = self.aligned(self._clock.now() + AHEAD)

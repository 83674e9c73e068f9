"""What flights on one clock tell each other: they begin at the same instant, and what stops one of them stops all."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable, Sequence

from minsnap.flight.mavlink.schedule import Clock

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

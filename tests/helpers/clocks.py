"""Clocks whose time runs faster than the wall's, for the streamer and for the stand-in alike."""

import select
import threading
import time

from minsnap.flight.mavlink.schedule import Clock

MOST = 0.02
"""Real time that passes at most between two looks at a fast clock [s]."""


class FastClock(Clock):
    """Real time, multiplied: everything in a test has the same one, and lateness counts as it would.

    While nobody looks at it for long, a busy machine has taken the processor away: that time does not pass.
    """

    def __init__(self, factor):
        self.factor = factor
        self._now, self._seen, self._lock = 0.0, time.monotonic(), threading.Lock()

    def now(self):
        with self._lock:
            real = time.monotonic()
            self._now += self.factor * min(real - self._seen, MOST)
            self._seen = real
            return self._now

    def skip(self, seconds):
        """Let time pass in which nothing happens."""
        with self._lock:
            self._now += seconds

    def wait(self, until, readers):
        while (left := until - self.now()) > 0.0:
            if select.select(readers, [], [], min(left / self.factor, MOST))[0]:
                return


class PatientClock(Clock):
    """Time that passes in waiting alone, so that a slow machine is never late: for tests that count every setpoint.

    Waiting still takes a real share of its time, during which sockets are looked at as ever.
    """

    def __init__(self, factor):
        self.factor = factor
        self._now = 0.0

    def now(self):
        return self._now

    def wait(self, until, readers):
        began = time.monotonic()
        readable, _, _ = select.select(readers, [], [], max(0.0, until - self._now) / self.factor)
        passed = (time.monotonic() - began) * self.factor
        self._now = min(self._now + passed, until) if readable else max(self._now, until)

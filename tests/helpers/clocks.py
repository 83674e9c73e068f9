"""Clocks whose time runs faster than the wall's, for the streamer and for the stand-in alike."""

import select
import time

from minsnap.mavlink.schedule import Clock


class FastClock(Clock):
    """Real time, multiplied: everything in a test has the same one, and lateness counts as it would."""

    def __init__(self, factor):
        self.factor = factor
        self._origin = time.monotonic()

    def now(self):
        return (time.monotonic() - self._origin) * self.factor

    def wait(self, until, readers):
        select.select(readers, [], [], max(0.0, until - self.now()) / self.factor)


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

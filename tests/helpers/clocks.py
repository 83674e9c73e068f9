"""Clocks with a time of their own, for the streamer and for the stand-in alike."""

import select
import threading
import time

from minsnap.flight.mavlink.link import Clock

STUCK = 120.0
"""Real time after which whoever still waits is told that nobody moves [s]."""


class SharedClock(Clock):
    """Time that passes only while all who share it wait, to the next instant that one of them waits for.

    How fast or how busy the machine is does not matter, and nothing is waited for in real time.  Who makes the clock
    shares it; another thread does between :meth:`enter`, called before it is started, and :meth:`leave`, called by it.
    """

    def __init__(self):
        self._now, self._sharing, self._waiting, self._moved = 0.0, 1, {}, threading.Condition()

    def now(self):
        return self._now

    def enter(self):
        with self._moved:
            self._sharing += 1

    def leave(self):
        with self._moved:
            self._sharing -= 1
            self._moved.notify_all()

    def skip(self, seconds):
        """Let time pass in which the rest does nothing."""
        with self._moved:
            self._now += seconds

    def wait(self, until, readers=()):
        with self._moved:
            self._waiting[threading.get_ident()] = until, readers
            while self._now < until and not _readable(readers):
                self._pass()
            del self._waiting[threading.get_ident()]

    def _pass(self):
        everyone = list(self._waiting.values())
        if len(everyone) == self._sharing:
            self._moved.notify_all()
            soonest = min(until for until, _ in everyone)
            if soonest > self._now and not any(_readable(readers) for _, readers in everyone):
                self._now = soonest
                return
        if not self._moved.wait(STUCK):
            raise TimeoutError(f"{self._sharing} share the clock, and {len(everyone)} wait")


def _readable(readers):
    return bool(readers and select.select(readers, [], [], 0.0)[0])


def enter(clock):
    """Let a thread that will be started share a clock, if it can be shared."""
    if isinstance(clock, SharedClock):
        clock.enter()


def leave(clock):
    """Let a thread that ends share a clock no more."""
    if isinstance(clock, SharedClock):
        clock.leave()


class PatientClock(Clock):
    """Time that passes in waiting alone, so that a slow machine is never late: for tests with another process.

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

"""Setpoints that leave on time: from a thread of their own or the one that decides, and nothing that disturbs them.

Undisturbed is a flight with real-time priority, memory that stays in place and no garbage collection.
"""

from __future__ import annotations

import ctypes
import gc
import math
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from minsnap.flight.mavlink.link import Clock, Link, Schedule
from minsnap.flight.mavlink.native_sender import MOST_AHEAD, NativeSender
from minsnap.flight.mavlink.sequence import SetpointStep
from minsnap.flight.mavlink.vehicle_messages import Message, load_dialect


@dataclass(frozen=True)
class SenderSettings:
    """How setpoints leave on time.

    Parameters
    ----------
    priority : int
        SCHED_FIFO priority of the thread that decides: one less than that of the thread that sends.
    ahead : float
        Setpoints are prepared this long ahead: they leave on time while the rest of the program is late [s].
    setting_up : float
        Time for the thread to start before its first setpoint is decided [s].
    """

    priority: int = 9
    ahead: float = 0.25
    setting_up: float = 0.05


SENDING = SenderSettings()


_LOCK_ALL = 3  # MCL_CURRENT | MCL_FUTURE of Linux


@contextmanager
def undisturbed(real_time: bool, within: bool = False) -> Iterator[str]:
    """Let this thread go first, lock the memory and stop garbage collection; undo all of it at the end.

    Objects made before are never collected meanwhile, and those made meanwhile are freed by their reference counts.

    Parameters
    ----------
    real_time : bool
        False: only garbage collection is stopped, as for a clock that is not real.
    within : bool
        True: another thread does this for the process, and its memory and collector are left alone.

    Yields
    ------
    str
        What the system granted, in words; empty without a request.
    """
    collecting = gc.isenabled()
    if not within:
        gc.collect()
        gc.freeze()
        gc.disable()
    first, locked = (_go_first(), not within and _locked()) if real_time else (None, False)
    try:
        yield _in_words(first is not None, locked) if real_time else ""
    finally:
        if first is not None:
            os.sched_setscheduler(0, *first)
        if locked:
            ctypes.CDLL(None).munlockall()
        if not within:
            gc.unfreeze()
            if collecting:
                gc.enable()


def _go_first() -> tuple[int, os.sched_param] | None:
    """Give this thread real-time priority; return what it had before, None if that is not granted."""
    try:
        before = os.sched_getscheduler(0), os.sched_getparam(0)
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(SENDING.priority))
    except (OSError, AttributeError):
        return None
    return before


def _locked() -> bool:
    """Keep all memory of the process, that to come too, from being swapped out."""
    try:
        return int(ctypes.CDLL(None).mlockall(_LOCK_ALL)) == 0
    except (OSError, AttributeError):
        return False


def _in_words(first: bool, locked: bool) -> str:
    if first:
        return f"the flight's logic has real-time priority{' and locked memory' if locked else ''}"
    grant = "sudo prlimit --pid $$ --rtprio=20 --memlock=unlimited"
    return (
        f"the flight's logic has no real-time priority: a busy computer may delay it; '{grant}' in this shell grants it"
    )


GRANTED = {
    2: "setpoints leave from a thread of their own, with real-time priority",
    1: "setpoints leave from a thread of their own, with raised priority: real-time priority was not granted",
    0: "setpoints leave from a thread of their own; no priority was granted (a limit such as 'ulimit -r 20' allows it)",
}

Encoder = Callable[[SetpointStep, int], Message]
"""Makes the message of a step from the time at which it is due, after the start of the stream [ms]."""

Foreseer = Callable[[int], SetpointStep]
"""Tells what is sent in a later slot if nothing happens until then."""


@dataclass(frozen=True)
class SentSetpoint:
    """A step that has left.

    Parameters
    ----------
    step : SetpointStep
    time : float
        When [s].
    lateness : float
        How long after it was due [s].
    """

    step: SetpointStep
    time: float
    lateness: float


class DirectSender:
    """Sends one setpoint per slot in the thread that decides, as soon as it has decided.

    Attributes
    ----------
    decisions, departures : Schedule
        When the setpoint of each slot is to be decided, and when setpoints left.
    note : str or None
        What is to be said of it, once it is known.

    Parameters
    ----------
    link : Link
    clock : Clock
    rate, start : float
        Slot k is due at ``start + k / rate`` [Hz], [s].
    encode : callable
    """

    note: str | None = None

    def __init__(self, link: Link, clock: Clock, rate: float, start: float, encode: Encoder) -> None:
        self._link, self._clock, self._encode = link, clock, encode
        self.decisions = self.departures = Schedule(rate, start)

    def late(self, now: float) -> float:
        """Return how late the slot is that is due now [s]."""
        return max(0.0, now - self.decisions.due)

    def deliver(self, slot: int, step: SetpointStep, foreseen: Foreseer) -> list[SentSetpoint]:
        """Send the setpoint."""
        now = self._clock.now()
        if step.setpoint is not None:
            self._link.send(self._encode(step, round((now - self.decisions.start) * 1000)))
        return [SentSetpoint(step, now, self.departures.last_lateness)]

    def close(self) -> list[SentSetpoint]:
        """Nothing is left to be sent."""
        return []


class ThreadedSender:
    """Keeps the thread of the native core supplied with the setpoints of the next quarter of a second.

    Each slot is decided one slot before it is due. Whatever changes the rest of the flight, such as a rule that stops
    it, replaces what was prepared.

    Parameters
    ----------
    thread : NativeSender
    link : Link
        Its other messages are numbered together with those of the thread.
    rate, start : float
        Slot k is due at ``start + k / rate`` [Hz], [s].
    encode : callable
    """

    def __init__(self, thread: NativeSender, link: Link, rate: float, start: float, encode: Encoder) -> None:
        self._thread, self._link, self._encode, self._rate = thread, link, encode, rate
        self._ahead = min(MOST_AHEAD, max(2, math.ceil(SENDING.ahead * rate)))
        self.decisions, self.departures = Schedule(rate, start - 1.0 / rate), Schedule(rate, start)
        self._prepared: dict[int, SetpointStep] = {}
        self._left: list[SentSetpoint] = []
        self._emptied, self._generation = False, 0
        self.note: str | None = None
        link.numbering = thread.sequence

    @classmethod
    def open(cls, link: Link, rate: float, start: float, max_gap: float, encode: Encoder) -> ThreadedSender | None:
        """Start the thread; None where there is no native core, or the link's messages cannot leave from it."""
        way = link.outlet()
        if way is None:
            return None
        extra = load_dialect().MAVLink_set_position_target_local_ned_message.crc_extra
        thread = NativeSender.open(way[0], rate, start, max_gap, extra)
        return None if thread is None else cls(thread, link, rate, start, encode)

    def late(self, now: float) -> float:
        """Return the longest lateness since the last call, that of a slot that waits to be served included [s]."""
        before = len(self._left)
        self._collect()
        waiting = now - self.departures.due if self._prepared else 0.0
        return max(0.0, waiting, *(sent.lateness for sent in self._left[before:]))

    def _collect(self) -> None:
        for served in self._thread.drain():
            self.departures.take(served.time)
            step = self._prepared[served.slot]
            self._left.append(SentSetpoint(step, served.time, self.departures.last_lateness))
        self._emptied |= self._thread.generation != self._generation
        self._generation = self._thread.generation
        self.note = self.note or GRANTED.get(self._thread.granted)

    def deliver(self, slot: int, step: SetpointStep, foreseen: Foreseer) -> list[SentSetpoint]:
        """Prepare the slot and those after it, from the first on that differs from what is prepared already."""
        steps = [step, *(foreseen(number) for number in range(slot + 1, slot + self._ahead))]
        known = 0 if self._emptied else next((k for k, each in enumerate(steps) if self._differs(slot + k, each)), None)
        if known is not None:
            self._supply(slot + known, steps[known:])
        self._prepared = {number: each for number, each in self._prepared.items() if number >= slot - MOST_AHEAD}
        left, self._left = self._left, []
        return left

    def _differs(self, slot: int, step: SetpointStep) -> bool:
        before = self._prepared.get(slot)
        return before is None or (before.setpoint, before.index) != (step.setpoint, step.index)

    def _supply(self, first: int, steps: list[SetpointStep]) -> None:
        way = self._link.outlet()
        if way is None:
            return
        packed = [self._packed(first + k, step) for k, step in enumerate(steps)]
        flying = [step.index is not None for step in steps]
        self._prepared.update(enumerate(steps, first))
        self._emptied = not self._thread.supply(first, packed, flying, way[1])

    def _packed(self, slot: int, step: SetpointStep) -> bytes:
        if step.setpoint is None:
            return b""
        return self._link.packed(self._encode(step, round(1000 * slot / self._rate)))

    def close(self) -> list[SentSetpoint]:
        """Stop sending at once; return what has left since the last call."""
        self._thread.stop()
        self._collect()
        self._link.numbering = None
        self._thread.close()
        return self._left


SetpointSender = DirectSender | ThreadedSender


def open_sender(
    link: Link, clock: Clock, rate: float, max_gap: float, encode: Encoder, aligned: Callable[[float], float] = float
) -> SetpointSender:
    """Return the sender for a link: a thread of its own on real time, where the native core and the link allow it.

    ``aligned`` moves the instant of its first slot later.
    """
    if type(clock) is Clock:
        start = aligned(clock.now() + 1.0 / rate + SENDING.setting_up)
        threaded = ThreadedSender.open(link, rate, start, max_gap, encode)
        if threaded is not None:
            return threaded
    return DirectSender(link, clock, rate, aligned(clock.now()), encode)

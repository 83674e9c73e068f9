"""The flight of a fleet of Crazyflies that hold their curves: ways that are proved apart, a start of all, landing.

The ways begin where the vehicles say that they stand. All are watched until they land; where one is gone or cannot fly
on, the others are told to land straight down at once, each once.
"""

from __future__ import annotations

import math
import struct
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import zip_longest

import numpy as np

from minsnap.errors import FleetError, FlightError, LinkError
from minsnap.fleet import (
    LANDS,
    TAKES_OFF,
    Fleet,
    FleetApproach,
    WayMove,
    WayStage,
    WayTimes,
    approach_of,
    certify_fleet,
)
from minsnap.flight.crazyflie_log import FleetWatch
from minsnap.flight.crtp_link import CrtpLink, act_on_each
from minsnap.flight.high_level import GO_TO, LAND, TAKE_OFF, Volleys, command, start_group
from minsnap.shows.memory_parts import MemoryPart, Upload

Place = tuple[float, float]
"""Where a vehicle stands: x and y [m]."""

Say = Callable[[str], None]
"""Is told a sentence."""

Storing = Callable[[CrtpLink, Upload], Iterator[None]]
"""Writes a trajectory of a vehicle, a packet after the other."""

WRITES, WATCHES = 0.25, 0.25
"""For how long memories are written in flight before vehicles are watched again, and for how long they are [s]."""

WRITTEN = object()
"""Ends the packets of a trajectory."""

LATE = 0.1
"""From how late a part begins it is said [s]."""

ELSEWHERE = 0.3
"""Distance from where a file says that a vehicle stands at which it is said [m]."""


@dataclass(frozen=True)
class FlightTimes(WayTimes):
    """The same, with how often the start of all is sent.

    Parameters
    ----------
    start : Volleys
    """

    start: Volleys = Volleys()

    def landing_from(self, height: float) -> bytes:
        """Return the command to land from a height [m] or less, in place."""
        return struct.pack("<BBff?f", LAND, 0, 0.0, 0.0, True, self.lasting(self.landing, height, self.sink))


def proved_approach(fleet: Fleet, places: np.ndarray, times: WayTimes | None = None) -> FleetApproach:
    """Return the ways of a fleet; see ``approach_of``. Raise FlightError where they, or its curves, are not apart."""
    fault = certify_fleet(fleet).fault
    if fault is not None:
        raise FlightError(f"not flown: {fault}; nothing moved")
    try:
        return approach_of(fleet, places, times)
    except FleetError as error:
        raise FlightError(f"not flown: {error}; nothing moved") from error


def fly_swarm(
    fleet: Fleet,
    links: Sequence[CrtpLink],
    timing: FlightTimes,
    places: Sequence[Place | None],
    say: Say,
    parts: Sequence[MemoryPart],
    storing: Storing,
) -> None:
    """Fly curves that are in the memories of vehicles, from where they stand and back to the ground.

    Parameters
    ----------
    fleet : Fleet
    links : sequence of CrtpLink
    timing : FlightTimes
    places : sequence of (x, y) or None
        Where a file says that they stand [m]: it is said where a vehicle is far from it.
    say : callable
    parts : sequence of MemoryPart
        The curves as they lie in the memories, of which the first two are there.
    storing : callable
        Writes one of a vehicle's trajectories, a packet after the other.

    Raises
    ------
    LinkError, FlightError
        If a vehicle is gone, refuses or cannot fly on; in the air, all were told to land.
    """
    watch = FleetWatch(links)
    states = watch.states()
    for link, state, place in zip(links, states, places, strict=True):
        if state.unfit is not None:
            raise FlightError(f"not flown: {link.name} {state.unfit}; nothing moved")
        if place is not None and math.dist(place, state.place[:2]) > ELSEWHERE:
            say(f"{link.name} is {math.dist(place, state.place[:2]):.2f} m from where its file says: its word counts")
    approach = proved_approach(fleet, np.array([state.place for state in states]), timing)
    for sentence in approach.sentences(fleet):
        say(sentence)
    _Flight(fleet, links, timing, approach, watch, say, parts, storing).fly()


class _Flight:
    """One flight; who was told to land is not told again."""

    def __init__(
        self,
        fleet: Fleet,
        links: Sequence[CrtpLink],
        timing: FlightTimes,
        approach: FleetApproach,
        watch: FleetWatch,
        say: Say,
        parts: Sequence[MemoryPart],
        storing: Storing,
    ) -> None:
        self._parts, self._storing = parts, storing
        self._fleet, self._links, self._timing = fleet, links, timing
        self._approach, self._watch, self._say = approach, watch, say
        self._yaws = [[float(curve.yaw(np.array(at))) for at in (0.0, curve.duration)] for curve in fleet]
        self._up: set[int] = set()
        self._down: set[int] = set()

    def fly(self) -> None:
        """Fly ways and curves; an early end lands all in place."""
        try:
            for stage in self._approach.there:
                self._pass(stage, 0)
            self._up = set(range(len(self._links)))
            self._fly_parts()
            self._watch(self._timing.settle)
            *ways, landing = self._approach.back
            for stage in ways:
                self._pass(stage, 1)
            self._say("landing")
            self._pass(landing, 1, watched=False)
        except BaseException:
            self._land_all()
            raise

    def _fly_parts(self) -> None:
        """Fly one part after the other; while one is flown, the next but one is written where it lay."""
        due = time.monotonic()
        for number, (part, after) in enumerate(zip_longest(self._parts, self._parts[1:])):
            if time.monotonic() - due > LATE:
                late = time.monotonic() - due
                self._say(f"part {number + 1} begins {late:.1f} s late: its memories were not written before")
            started = start_group(self._links, self._timing.start, part.slot)
            self._say(str(started) if len(self._parts) == 1 else f"part {number + 1} of {len(self._parts)} {started}")
            due = started.began + (part.ends if after is None else after.begins) - part.begins
            if number and after is not None:
                self._write(after)
            self._watch(max(due - time.monotonic(), 0.0))

    def _write(self, part: MemoryPart) -> None:
        """Write a part while another is flown, and watch in between."""
        writers = [self._storing(link, own) for link, own in zip(self._links, part.uploads, strict=True)]
        left = [True] * len(writers)

        def write(_: CrtpLink, i: int) -> None:
            end = time.monotonic() + WRITES
            while left[i] and time.monotonic() < end:
                left[i] = next(writers[i], WRITTEN) is not WRITTEN

        while any(left):
            act_on_each(self._links, write)
            self._watch(WATCHES)

    def _pass(self, stage: WayStage, end: int, *, watched: bool = True) -> None:
        """Tell all moves of a stage, and watch until they have ended."""
        told = sorted(stage.moves)
        if not told:  # all stand where it leads
            return

        def tell(link: CrtpLink, i: int) -> None:
            move = stage.moves[told[i]]
            if move.kind == LANDS:
                self._down.add(told[i])
            self._up.add(told[i])
            command(link, self._packet(move, self._yaws[told[i]][end], stage.seconds))

        act_on_each([self._links[i] for i in told], tell)
        if watched:
            self._watch(stage.seconds + self._timing.settle)

    def _packet(self, move: WayMove, yaw: float, seconds: float) -> bytes:
        if move.kind == TAKES_OFF:
            return struct.pack("<BBff?f", TAKE_OFF, 0, move.goal[2], 0.0, True, seconds)
        if move.kind == LANDS:
            return struct.pack("<BBff?f", LAND, 0, 0.0, 0.0, True, seconds)
        return struct.pack("<BBBBfffff", GO_TO, 0, 0, 0, *move.goal, yaw, seconds)

    def _land_all(self) -> None:
        """Tell every vehicle that flies and was not told yet to land in place, whether or not others answer."""
        left = sorted(self._up - self._down)
        gone: list[str] = []
        tops = [max(float(curve.control_points[..., 2].max()), self._approach.highest) for curve in self._fleet]

        def land(link: CrtpLink, i: int) -> None:
            try:
                command(link, self._timing.landing_from(tops[left[i]]))
            except (LinkError, FlightError):
                gone.append(link.name)

        if left:
            act_on_each([self._links[i] for i in left], land)
        self._say("told all that fly to land" + (f"; no answer from {', '.join(gone)}" if gone else ""))

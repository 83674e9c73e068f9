"""The flights of a show, planned one after the other, each kept in a folder once it is planned.

A flight takes the shortest time that was found, or the time that its act gives it: then its curves have little snap.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import partial
from math import ceil, inf
from pathlib import Path
from typing import Any

import numpy as np

from minsnap.basics.arrays import FloatArray, IntArray
from minsnap.basics.storage.atomic import atomic_write, make_folder
from minsnap.basics.storage.table import read_archive
from minsnap.basics.storage.text import FileName, reading
from minsnap.basics.tolerances import EXACT
from minsnap.corridors import Room
from minsnap.errors import FileError, MinsnapError, TimingError, UnprovedError
from minsnap.fleet import Fleet, Separation, certify_fleet, least_times, plan_fleet
from minsnap.limits import Limits
from minsnap.shows.acts import Show
from minsnap.shows.climb_turns import backwards
from minsnap.shows.crazyswarm_folder import refuse_long
from minsnap.shows.file_limits import ROUNDED_KINDS, SLOWING, played, stretches
from minsnap.shows.firmware_take_off import late_by
from minsnap.shows.timeline import (
    UNTIMED,
    GivenTime,
    PlannedFlight,
    Stage,
    delayed,
    joined,
    slower,
    stages_of,
    timed,
    waiting,
)
from minsnap.trajectory import Trajectory

SKYBRUSH = ("skyb", "skyc")
"""Formats whose reader takes off by a rule of its own."""

Told = Callable[[str], None]


@dataclass(frozen=True, eq=False)
class FlightTask:
    """The question of one flight.

    Parameters
    ----------
    ways : ndarray, shape (vehicles, 2, 3)
        From where to where [m].
    limits : Limits
    room : Room
    delays : ndarray, shape (vehicles,), or None
        How long after the first each leaves [s].
    early : ndarray, shape (vehicles,), or None
        How long before the last each arrives [s].
    beside : tuple of Trajectory
        What others fly meanwhile.
    """

    ways: FloatArray
    limits: Limits
    room: Room
    delays: FloatArray | None = None
    early: FloatArray | None = None
    beside: tuple[Trajectory, ...] = ()

    @property
    def late(self) -> FloatArray:
        """How long after the first each leaves, and before the last it arrives, shape (vehicles, 2) [s]."""
        none = np.zeros(len(self.ways))
        return np.column_stack([none if each is None else each for each in (self.delays, self.early)])

    @property
    def least(self) -> float:
        """A time that its slowest vehicle takes at least [s]; 0 where some leave late."""
        return 0.0 if self.late.any() else float(least_times(self.ways, self.limits).max())

    def is_apart(self, curves: Sequence[Trajectory], separation: Separation) -> bool:
        """Whether curves are apart from each other, and from those of others."""
        return certify_fleet([*curves, *self.beside], separation).ok


@dataclass(eq=False)
class ShowCourse:
    """Flights one after the other: where the vehicles are, and what they have flown.

    A flight is planned, or taken from the folder ``kept``, where an earlier run has stored it.
    """

    show: Show
    kept: FileName | None
    progress: bool
    told: Told | None
    now: FloatArray
    to: str
    flights: list[PlannedFlight] = field(default_factory=list)
    stretched: list[float] = field(default_factory=list)
    """By how much each is stretched: guessed as it is planned, where an act is at an instant; then by ``timeline``."""
    waits: float = field(init=False)
    """How long all stand on the ground before they climb [s]."""

    def __post_init__(self) -> None:
        self.waits = self.show.wait or 0.0
        self._clocked = any(act.at is not None for act in self.show.formations)

    def fly(
        self,
        name: str,
        goals: FloatArray,
        vertical: float | None = None,
        hold: float = 0.0,
        given: GivenTime = UNTIMED,
        delays: FloatArray | None = None,
    ) -> None:
        """Fly to goals, shape (vehicles, 3), up and down no faster than that [m/s], and hold; see ``add``."""
        task = self.task(self.now, goals, vertical, delays)
        lasts = given.lasts(self.begins(name, given))
        try:
            curves, method = self._flight(name, task, lasts, given)
        except MinsnapError as error:
            error.args = (f"the flight to {name}: {error}",)
            raise
        self.add(name, curves, method, hold, given, least=task.least if given == UNTIMED and curves else 0.0)

    def task(
        self, now: FloatArray, goals: FloatArray, vertical: float | None = None, delays: FloatArray | None = None
    ) -> FlightTask:
        """Return the question of a flight from places to goals, (vehicles, 3) [m], up and down no faster than that."""
        return FlightTask(np.stack([now, goals], axis=1), self._vertical(vertical), self._room(now, goals), delays)

    def begins(self, name: str, given: GivenTime) -> float:
        """Return when the next flight begins [s]; a FleetError says where its own time is before that."""
        if given.at is not None:
            self.settle_wait()
        whole = [*self.flights, PlannedFlight(name, [], "", 0.0, given)]
        return stages_of(whole, np.array([*self.stretched, 1.0]), self.waits)[-1].start

    def climb(self, name: str) -> None:
        """Climb straight from home, at once or in turn."""
        show = self.show
        if show.turns is None:
            self.fly(name, show.above, show.climb_speed)
            return
        climbs = show.turns.climbs(show.home, self._vertical(show.climb_speed))
        self.add(name, self._in_turn(name, climbs), f"{len(show.turns.below)} groups in turn")

    def land(self, name: str, order: IntArray) -> None:
        """Land straight down, at once or in turn, each on the home of a vehicle, shape (vehicles,)."""
        show = self.show
        if show.turns is None:
            self.fly(name, show.home[order], show.descent_speed)
            return
        climbs = show.turns.climbs(show.home, self._vertical(show.descent_speed))
        landings = [backwards(climbs[place]) for place in order]
        self.add(name, self._in_turn(name, landings), f"{len(show.turns.below)} groups in turn")

    def _in_turn(self, name: str, curves: list[Trajectory]) -> list[Trajectory]:
        """Return curves of groups that fly in turn, or raise UnprovedError where they are not proved apart."""
        fault = certify_fleet(curves, self.show.separation, room=self.show.room).fault
        if fault is not None:
            raise UnprovedError(f"the flight to {name}, in turn: {fault}: give home more room, or take_off a height")
        return curves

    def _vertical(self, speed: float | None) -> Limits:
        """Return the limits of flights that go up and down no faster than that [m/s]."""
        limits = self.show.flown_limits
        return limits if speed is None else replace(limits, vertical_speed=min(speed, limits.vertical_speed or inf))

    def _flight(
        self, name: str, task: FlightTask, lasts: float | None, given: GivenTime
    ) -> tuple[list[Trajectory], str]:
        """Return the curves of a flight, and how they were planned."""
        if np.abs(task.ways[:, 1] - task.ways[:, 0]).max() <= EXACT:
            return [], "stays"
        if lasts is None:
            return self._kept(task, None)
        with suppress(TimingError, UnprovedError):
            curves, method = self._kept(task, lasts)
            if self.slowing(curves) == 1.0:
                return curves, method
        curves, method = self._kept(task, None)
        shortest = max(curve.duration for curve in curves) * self.slowing(curves)
        if shortest > lasts * (1.0 + EXACT):
            raise too_short(name, given, lasts, shortest)
        return curves, f"{method}, slower"

    def _kept(self, task: FlightTask, lasts: float | None) -> tuple[list[Trajectory], str]:
        """Return curves of a time [s], or the shortest, as they were stored, or planned anew."""
        file = None if self.kept is None else Path(self.kept) / f"{self._key(task, lasts)}.npz"
        with suppress(FileError):
            if file is not None:
                return _stored(file, task.ways), "kept"
        fleet = self._planned(task, lasts)
        report = fleet.report
        if report is not None and report.stopped:
            return list(fleet), f"{report.method}, ended by {report.stopped}"
        if file is not None:
            _store(file, list(fleet))
        return list(fleet), report.method if report else ""

    def beside(
        self, name: str, task: FlightTask, lasts: float | None, given: GivenTime, begins: float, more: float = 1.0
    ) -> tuple[list[Trajectory], str]:
        """Return the curves of a flight beside what others fly, as files can hold them from an instant on [s].

        They take a time [s], or ``more`` times the shortest.

        Raises
        ------
        UnprovedError
            If none are found.
        """
        if lasts is not None:
            return self._beside_in(name, task, lasts, given, begins)
        curves, method = self._kept(task, None)
        for _ in range(SLOWING.rounds):
            factor = self.slowing(curves, begins)
            if factor == more == 1.0:
                return curves, method
            factor, more = (factor, more) if factor > 1.0 else (more, 1.0)
            needed = factor * max(curve.duration for curve in curves)
            curves = slower(curves, factor)
            if not task.is_apart(curves, self.show.separation.aloft):
                curves, method = self._kept(task, needed)
        raise too_short(name, given, max(curve.duration for curve in curves), needed)

    def _beside_in(
        self, name: str, task: FlightTask, lasts: float, given: GivenTime, begins: float
    ) -> tuple[list[Trajectory], str]:
        """Return the curves of a flight beside what others fly, planned for a time [s], or the shortest, slower."""
        try:
            curves, method = self._kept(task, lasts)
            factor = self.slowing(curves, begins)
            if factor == 1.0:
                return curves, method
            failed: MinsnapError = too_short(name, given, lasts, factor * lasts)
        except (TimingError, UnprovedError) as error:
            failed = error
        curves, method = self._kept(replace(task, early=None), None)
        shortest = max(curve.duration for curve in curves)
        needed = shortest * self.slowing(curves, begins)
        if needed > lasts * (1.0 + EXACT):
            raise too_short(name, given, lasts, needed) from None
        curves = slower(curves, lasts / shortest)
        if not task.late.any() and task.is_apart(curves, self.show.separation.aloft):
            return curves, f"{method}, slower"
        raise failed

    def _planned(self, task: FlightTask, lasts: float | None) -> Fleet:
        show = self.show
        how: dict[str, Any] = {"room": task.room, "seed": show.seed, "progress": self.progress}
        question = partial(plan_fleet, task.ways, task.limits, show.separation.aloft, **how)
        if not (task.late.any() or task.beside):
            return self._fenced(question, total_time=lasts)
        spent = float(task.late.sum(axis=1).max())
        if lasts is not None and lasts <= spent:
            raise TimingError(f"of {lasts:g} s {spent:g} s are waits before it and after it")
        if task.early is None:
            with suppress(UnprovedError):
                alone = self._alone(question, task, lasts)
                inside = show.fence is None or show.fence.margin_of(alone) >= -EXACT
                if inside and task.is_apart(alone, show.separation.aloft):
                    return alone
        holds = list(task.late) if task.late.any() else None
        planned = self._fenced(question, fixed=task.beside or None, total_time=lasts, holds=holds)
        return Fleet(planned[: len(task.ways)], report=planned.report)

    def _alone(self, question: Callable[..., Fleet], task: FlightTask, lasts: float | None) -> Fleet:
        """Return curves as if nobody flew beside, those that leave late as if they did not."""
        late = float(task.late[:, 0].max())
        together = question(total_time=None if lasts is None else lasts - late)
        curves = delayed(list(together), task.late[:, 0], together.duration + late)
        return Fleet(tuple(curves), report=together.report)

    def _fenced(self, question: Callable[..., Fleet], **how: Any) -> Fleet:
        """Return a fleet that is inside of the fence: straight lines are, others may need its walls as obstacles."""
        fence, fleet = self.show.fence, question(**how)
        if fence is None or fence.margin_of(fleet) >= -EXACT:
            return fleet
        fleet = question(avoid=fence.obstacles(), **how)
        beyond = -fence.margin_of(fleet)
        if beyond > EXACT:
            raise UnprovedError(f"the curves found are {beyond:.3g} m beyond a margin of the fence: give it more room")
        return fleet

    def slowing(self, curves: list[Trajectory], begins: float = 0.0) -> float:
        """Return by how much curves of one flight, after a wait [s], are to be stretched so that files keep limits."""
        factor = 1.0
        for _ in range(SLOWING.rounds if self.to in ROUNDED_KINDS and curves else 0):
            whole = [joined([*waiting(curve(0.0), begins), curve]) for curve in slower(curves, factor)]
            held = Fleet(tuple(played(curve, self.to) for curve in whole))
            more = float(stretches(held, [(0.0, held.duration)], self.show.limits)[0])
            if more == 1.0:
                break
            factor *= more
        return factor

    def _room(self, now: FloatArray, goals: FloatArray) -> Room:
        """Return the room of a flight: nobody goes around another below its lowest point and the end of the climb."""
        lower, upper = self.show.room or (np.full(3, -np.inf), np.full(3, np.inf))
        floor = min(float(places[:, 2].min()) for places in (now, goals, self.show.above))
        return Room(np.maximum(lower, (-np.inf, -np.inf, floor)), upper)

    def _key(self, task: FlightTask, lasts: float | None) -> str:
        """Return a name of the question of a flight."""
        corners = [corner.tolist() for corner in (task.room.lower, task.room.upper)]
        delays = None if task.delays is None else task.delays.tolist()
        others = [(curve.control_points.tolist(), curve.durations.tolist()) for curve in task.beside]
        beside = [] if task.early is None and not others else [task.late.tolist(), others]
        plain = self.show.separation.aloft.plain.values()
        fence = None if self.show.fence is None else [each.tolist() for each in vars(self.show.fence).values()]
        question = (
            task.ways.tolist(),
            repr(task.limits),
            *plain,
            corners,
            self.show.seed,
            lasts,
            delays,
            fence,
            *beside,
        )
        return hashlib.sha256(repr(question).encode()).hexdigest()[:24]

    def add(
        self,
        name: str,
        curves: list[Trajectory],
        method: str,
        hold: float = 0.0,
        given: GivenTime = UNTIMED,
        inner: Sequence[Stage] = (),
        least: float = 0.0,
    ) -> None:
        """Fly and hold; without curves all stay where they are."""
        self.now = np.stack([curve.control_points[-1, -1] for curve in curves]) if curves else self.now
        self.flights.append(PlannedFlight(name, curves, method, hold, given, tuple(inner), least))
        if self.to == "crazyswarm2":
            refuse_long([(flight.name, flight.curves) for flight in self.flights[-2:] if not flight.inner])
        self.stretched.append(self.slowing(curves) if given == UNTIMED and self._clocked else 1.0)
        self.tell(f"{name}: {self.flights[-1].duration:.2f} s ({method})")

    def tell(self, sentence: str) -> None:
        """Tell a sentence to who wants to know."""
        if self.told is not None:
            self.told(sentence)

    def settle_wait(self) -> None:
        """Wait on the ground for as long as Skybrush's firmware needs for what is flown so far."""
        if self.to not in SKYBRUSH or self.show.wait is not None or not any(flight.curves for flight in self.flights):
            return
        late = late_by(self._timed()[0])
        if 0.0 < late < inf:
            self.waits += ceil(10.0 * late) / 10.0

    def _timed(self) -> tuple[list[Trajectory], list[Stage]]:
        return timed(self.flights, np.array(self.stretched), self.waits, self.show.home)

    def timeline(self) -> tuple[list[Trajectory], list[Stage]]:
        """Return the curves and the stages, flights stretched until the files keep the limits, after a wait.

        Raises
        ------
        UnprovedError
            If the files do not keep them in the time that a flight is given.
        """
        self.stretched = [1.0] * len(self.flights)
        self.settle_wait()
        if self.waits != (self.show.wait or 0.0):
            self.tell(f"take-off: after {self.waits:g} s on the ground, as Skybrush's firmware climbs before the curve")
        curves, stages = self._timed()
        for _ in range(SLOWING.rounds if self.to in ROUNDED_KINDS else 0):
            held = Fleet(tuple(played(curve, self.to) for curve in curves))
            more = stretches(held, [(stage.start, stage.arrival) for stage in stages], self.show.limits)
            if (more == 1.0).all():
                break
            for flight, stage, factor in zip(self.flights, stages, more.tolist(), strict=True):
                if factor > 1.0 and flight.given != UNTIMED:
                    lasts = stage.arrival - stage.start
                    raise too_short(flight.name, flight.given, lasts, factor * lasts, bool(flight.inner))
            self.stretched = (np.array(self.stretched) * more).tolist()
            curves, stages = self._timed()
        for flight, factor in zip(self.flights, self.stretched, strict=True):
            if factor > 1.0:
                more_time = f"{100.0 * (factor - 1.0):.1f} %"
                self.tell(f"{flight.name}: slowed by {more_time}, so that the files keep the limits")
        return curves, stages


def too_short(name: str, given: GivenTime, lasts: float, needed: float, grouped: bool = False) -> UnprovedError:
    """Say that a flight does not fit into its time [s], and which time the shortest that was found takes."""
    if given.at is not None and given.seconds is None:
        later = ceil(100.0 * (given.at + needed - lasts)) / 100.0
        text = f"at {given.at:g} s, {lasts:.2f} s are left for it, and the shortest found takes {needed:.2f} s"
        return UnprovedError(f"{text}: give {name!r} at: {later:.2f} or later, or shorten what is before it")
    longer = ceil(100.0 * needed) / 100.0
    text = f"it is to last {lasts:.4g} s, and the shortest found takes {needed:.2f} s"
    if given.at is not None and grouped:
        return UnprovedError(f"{text}: give acts of {name!r} that have seconds, or are at instants, more time")
    return UnprovedError(f"{text}: give {name!r} seconds: {longer:.2f} or more")


def _stored(file: Path, ways: FloatArray) -> list[Trajectory]:
    """Return the curves along ``ways`` that a file holds; raise FileError where it is not there or holds others."""
    with reading(file, "the flights that were stored in it"):
        stored = read_archive(file)
        curves = [Trajectory(stored[f"p{i}"], stored[f"d{i}"]) for i in range(len(ways))]
        ends = np.stack([curve([0.0, curve.duration]) for curve in curves])
        if np.abs(ends - ways).max() > EXACT:
            raise FileError(f"{file} holds other flights")
    return curves


def _store(file: Path, curves: list[Trajectory]) -> None:
    make_folder(file.parent)
    arrays: dict[str, Any] = {f"p{i}": curve.control_points for i, curve in enumerate(curves)}
    arrays |= {f"d{i}": curve.durations for i, curve in enumerate(curves)}
    with atomic_write(file, "wb") as stream:
        np.savez(stream, **arrays)

"""A show: formations one after the other, and the flights between them, planned one by one and kept once planned.

From home all climb straight up, fly to the acts, each by the assignment of least squared way, hold each, return above
home and land. A formation may move (``moves``).

A show that is flown from files is planned for these: with their distance from the curves added to the separation, and
flights slowed until the files keep the limits.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from math import ceil, inf
from pathlib import Path
from typing import Any

import numpy as np

from minsnap.basics.arrays import FloatArray, IntArray
from minsnap.basics.checks import LONGEST
from minsnap.basics.storage.atomic import atomic_write, make_folder
from minsnap.basics.storage.table import read_archive
from minsnap.basics.storage.text import FileName, reading
from minsnap.basics.tolerances import EXACT
from minsnap.corridors.boxes import Room
from minsnap.errors import FileError, FleetError, MinsnapError
from minsnap.files.formats.cubic_segments import worst_distance
from minsnap.files.formats.skybrush import Lights
from minsnap.fleet.assignment import assign
from minsnap.fleet.common_clock import Fleet, Separation
from minsnap.fleet.fleet_certificate import certify_fleet, extent_of
from minsnap.fleet.fleet_planner import plan_fleet
from minsnap.fleet.fleet_task import table_of
from minsnap.limits.limits import Limits
from minsnap.limits.ordinary import ORDINARY
from minsnap.shows.crazyswarm_folder import refuse_long
from minsnap.shows.file_limits import ROUNDED_KINDS, SLOWING, played, stretches
from minsnap.shows.firmware_take_off import late_by
from minsnap.shows.formations import spacing_of
from minsnap.shows.moves import Move, moved
from minsnap.shows.skyc import ShowSheet
from minsnap.shows.timeline import PlannedFlight, Stage, timed
from minsnap.trajectory.trajectory import Trajectory

BUILT_UP = 1.0 / 3.0
"""Time in which a flight builds up its acceleration: what limits the jerk of a show that says none [s].

Without a limit a straight flight jumps from one acceleration to another, which no file of whole millimetres holds.
"""

GENTLE = 1.0
"""Speed of take-off and landing in Skybrush's files unless a show says another: its firmware takes off at it [m/s]."""

SKYBRUSH = ("skyb", "skyc")

Told = Callable[[str], None]


@dataclass(frozen=True, eq=False)
class Act:
    """One formation of a show.

    Parameters
    ----------
    name : str
    points : ndarray, shape (vehicles, 3)
        [m].
    hold : float
        How long it stands [s].
    colour : tuple of int, ndarray of shape (vehicles, 3), or None
        Red, green, blue of all lamps, or of the lamp at each point, from 0 to 255; None: as before.
    fade : bool
        The colour is reached during the flight there, else on arrival.
    moves : tuple of Move
        What the formation does after its hold, one after the other.
    """

    name: str
    points: FloatArray
    hold: float = 3.0
    colour: tuple[int, int, int] | FloatArray | None = None
    fade: bool = False
    moves: tuple[Move, ...] = ()


@dataclass(frozen=True, eq=False)
class Show:
    """What is to be flown.

    Parameters
    ----------
    home : ndarray, shape (vehicles, 3)
        Where each stands and lands [m].
    acts : tuple of Act
    separation : Separation
    limits : Limits
    take_off : float
        How far above home the vehicles climb straight [m].
    layers : int
        Number of heights, each the separation times the downwash above the one before, neighbours into other ones.
    land : str
        ``"own"``: each lands where it took off; ``"any"``: at any vehicle's place, where that is shorter.
    room : pair of corners or None
    seed : int
    smooth : bool
        Whether flights build up their acceleration in ``BUILT_UP`` where the limits name no jerk.
    climb_speed, descent_speed : float or None
        Of take-off and landing [m/s]; None: as the limits allow, or ``GENTLE`` in Skybrush's files.
    wait : float or None
        How long all stand on the ground before they climb [s]; None: none, or what Skybrush's firmware needs.
    environment : {"outdoor", "indoor"}
    """

    home: FloatArray
    acts: tuple[Act, ...]
    separation: Separation
    limits: Limits
    take_off: float = 2.0
    room: tuple[FloatArray, FloatArray] | None = None
    seed: int = 0
    layers: int = 1
    land: str = "own"
    smooth: bool = True
    climb_speed: float | None = None
    descent_speed: float | None = None
    wait: float | None = None
    environment: str = "outdoor"

    @property
    def flown_limits(self) -> Limits:
        """Limits that flights are planned within."""
        if self.limits.jerk is not None or not self.smooth:
            return self.limits
        hardest = float(table_of(self.limits)[1].min())
        return replace(self.limits, jerk=(hardest if hardest < inf else ORDINARY["acceleration"]) / BUILT_UP)

    @property
    def above(self) -> FloatArray:
        """Where the climb ends, shape (vehicles, 3) [m]."""
        gap = self.separation.downwash * 2.0 * float(self.separation.radii_of(len(self.home)).max())
        places = self.home + (0.0, 0.0, self.take_off)
        places[:, 2] += gap * (np.arange(len(places)) % self.layers)
        return np.asarray(places)

    @property
    def reach(self) -> float:
        """Largest coordinate of any formation [m]."""
        points = [self.above, *(act.points for act in self.acts)]
        return float(max(np.abs(place).max() for place in points))

    def check(self) -> None:
        """Refuse limits that leave a climb free, and acts that do not fit, are below home, or stand too close."""
        times = [("take_off", self.take_off), ("the wait before take_off", self.wait or 0.0)]
        for name, value in (*times, *((f"hold of act {act.name!r}", act.hold) for act in self.acts)):
            if not 0.0 <= value <= LONGEST:
                raise FleetError(f"{name} is {value}: give a number from 0 to {LONGEST:g}")
        for name, speed in (("take_off", self.climb_speed), ("land", self.descent_speed)):
            if speed is not None and not 0.0 < speed < inf:
                raise FleetError(f"the speed of {name} is {speed}: give a positive number [m/s]")
        if not np.isfinite(table_of(self.limits)[:2, 2:4]).any():
            raise FleetError("nothing limits how fast vehicles climb: give limits such as {speed: 4, acceleration: 3}")
        if self.home.ndim != 2 or self.home.shape[1] != 3 or not len(self.home):
            raise FleetError(f"home has the shape {self.home.shape}: give (vehicles, 3)")
        places = [("home", self.home), *((f"act {act.name!r}", act.points) for act in self.acts)]
        for name, points in places:
            if points.shape != self.home.shape:
                raise FleetError(f"{name} has {len(points)} points, and home has {len(self.home)}: give as many")
            if not np.isfinite(points).all():
                raise FleetError(f"{name} has a point that is not finite")
            below = float(self.home[:, 2].min() - points[:, 2].min())
            if below > EXACT:
                raise FleetError(f"{name} is {below:g} m below the lowest home: raise it")
            if len(points) < 2:
                continue
            least, pair = spacing_of(self.separation.flat(points))
            apart = self.separation.between(*pair)
            if least < apart:
                text = f"points {pair[0]} and {pair[1]} of {name} are {least:.3f} m apart, {apart - least:.3f} m less"
                give = "spread it, or give it fewer vehicles"
                raise FleetError(f"{text} than the separation of {apart:g} m: {give}", pair=pair)


@dataclass(frozen=True, eq=False)
class FlownShow:
    """A show as trajectories.

    Parameters
    ----------
    fleet : Fleet
    lights : tuple of Lights
        Of each vehicle.
    stages : tuple of Stage
    """

    fleet: Fleet
    lights: tuple[Lights, ...]
    stages: tuple[Stage, ...]

    def sheet(self, show: Show, title: str) -> ShowSheet:
        """Return what a Skybrush show says of itself: a cue for each act, take-off, show and landing."""
        up, down, end = self.stages[0], self.stages[-1], self.stages[-1].end
        spans = {"takeoff": (0.0, up.end), "show": (up.end, down.start), "landing": (down.start, end)}
        names = {act.name for act in show.acts}
        cues = tuple((stage.arrival, stage.name) for stage in self.stages if stage.name in names)
        highest = None if show.room is None else float(show.room[1][2])
        segments = {name: span for name, span in spans.items() if span[1] > span[0]}
        return ShowSheet(title, show.environment, show.limits, highest, cues, segments)


def fly(
    show: Show, kept: FileName | None = None, told: Told | None = None, progress: bool = False, to: str = "csv"
) -> FlownShow:
    """Plan every flight of a show.

    Ctrl-C ends the search for one flight with the best certified so far. That is flown, but not stored: the next run
    searches again.

    Parameters
    ----------
    show : Show
    kept : str or path, optional
        Folder in which planned flights are stored; those of an earlier run with equal conditions are not planned
        again.
    told : callable, optional
        Is told a sentence after each flight.
    progress : bool
        Show a line on the terminal while a flight is searched for.
    to : str
        Format of the files from which it is flown, as in ``write_fleet``. Where these round, twice their distance from
        the curves is added to the separation, and flights are slowed until the files keep the limits.

    Raises
    ------
    FleetError
        If acts and vehicles do not fit together.
    UnprovedError
        If a search ends without a flight; says which.
    FileError
        If no file of the format holds a curve.
    """
    show.check()
    asked, show = show, _prepared(show, to)
    course = _Course(show, kept, progress, told, show.home, [], to)
    course.refuse_long(show.acts)
    course.fly("take-off", show.above, show.climb_speed)
    shown = []
    for number, act in enumerate(show.acts):
        course.refuse_long(show.acts[number:])
        order = assign(course.now, act.points)
        course.fly(act.name, act.points[order], hold=act.hold)
        shown.append((order, len(course.flights) - 1))
        for move in act.moves:
            limits = show.limits if move.seconds is not None else show.flown_limits
            course.add(f"{act.name} moves", _checked(moved(move, course.now, limits), show, act.name), "move")
    course.refuse_long(())
    order = _return(show, course.now)
    course.fly("return", show.above[order])
    course.fly("landing", show.home[order], show.descent_speed)
    curves, stages = _timed(show, course, to)
    at = [(order, stages[number]) for order, number in shown]
    lights = tuple(_lights(show, at, stages[-1].end, vehicle) for vehicle in range(len(show.home)))
    return FlownShow(Fleet(tuple(curves), None, asked.separation), lights, tuple(stages))


def _prepared(show: Show, to: str) -> Show:
    """Return the show as it is planned for files: apart by what they may lose too, gentle where Skybrush flies it."""
    if to not in ROUNDED_KINDS:
        return show
    apart, more = show.separation, 2.0 * worst_distance(show.reach)
    show = replace(show, separation=Separation((apart.distance or 0.0) + more, apart.downwash))
    if to not in SKYBRUSH:
        return show
    up, down = (GENTLE if speed is None else speed for speed in (show.climb_speed, show.descent_speed))
    return replace(show, climb_speed=up, descent_speed=down)


def _timed(show: Show, course: _Course, to: str) -> tuple[list[Trajectory], list[Stage]]:
    """Return the curves and the stages, flights stretched until the files keep the limits, after a wait."""
    flights, stretched, wait = course.flights, np.ones(len(course.flights)), show.wait or 0.0
    curves, stages = timed(flights, stretched, wait, show.home)
    late = late_by(curves) if to in SKYBRUSH and show.wait is None else 0.0
    if 0.0 < late < inf:
        wait = ceil(10.0 * late) / 10.0
        course.tell(
            f"take-off: after {wait:g} s on the ground, as Skybrush's firmware begins its climb before the curve"
        )
        curves, stages = timed(flights, stretched, wait, show.home)
    for _ in range(SLOWING.rounds if to in ROUNDED_KINDS else 0):
        held = Fleet(tuple(played(curve, to) for curve in curves))
        more = stretches(held, [(stage.start, stage.arrival) for stage in stages], show.limits)
        if (more == 1.0).all():
            break
        stretched = stretched * more
        curves, stages = timed(flights, stretched, wait, show.home)
    for flight, factor in zip(flights, stretched.tolist(), strict=True):
        if factor > 1.0:
            course.tell(f"{flight.name}: slowed by {100.0 * (factor - 1.0):.1f} %, so that the files keep the limits")
    return curves, stages


@dataclass(eq=False)
class _Course:
    """Flights one after the other: where the vehicles are, and what they have flown.

    A flight is planned, or taken from the folder ``kept``, where an earlier run has stored it.
    """

    show: Show
    kept: FileName | None
    progress: bool
    told: Told | None
    now: FloatArray
    flights: list[PlannedFlight]
    to: str

    def fly(self, name: str, goals: FloatArray, vertical: float | None = None, hold: float = 0.0) -> None:
        """Fly to goals, shape (vehicles, 3), up and down no faster than that [m/s], and hold; see ``add``."""
        limits = self.show.flown_limits
        if vertical is not None:
            limits = replace(limits, vertical_speed=min(vertical, limits.vertical_speed or inf))
        self.add(name, *self._flight(name, goals, limits), hold)

    def _flight(self, name: str, goals: FloatArray, limits: Limits) -> tuple[list[Trajectory], str]:
        """Return the curves to goals, and how they were planned; an UnprovedError says of which flight it is."""
        if np.abs(goals - self.now).max() <= EXACT:
            return [], "stays"
        show, room = self.show, self._room(goals)
        file = None if self.kept is None else Path(self.kept) / f"{self._key(goals, room, limits)}.npz"
        ways = np.stack([self.now, goals], axis=1)
        with suppress(FileError):
            if file is not None:
                return _stored(file, ways), "kept"
        try:
            fleet = plan_fleet(ways, limits, show.separation, room, seed=show.seed, progress=self.progress)
        except MinsnapError as error:
            error.args = (f"the flight to {name}: {error}",)
            raise
        report = fleet.report
        if report is not None and report.stopped:
            return list(fleet), f"{report.method}, ended by {report.stopped}"
        if file is not None:
            _store(file, list(fleet))
        return list(fleet), report.method if report else ""

    def refuse_long(self, acts: Sequence[Act]) -> None:
        """Refuse too many pieces for crazyswarm2: those that are planned, and the least for these acts and landing."""
        if self.to != "crazyswarm2":
            return
        counts = [max((len(curve.durations) for curve in flight.curves), default=0) for flight in self.flights]
        planned = sum(counts) + sum(flight.hold > 0.0 for flight in self.flights)
        held = sum((act.hold > 0.0) + len(act.moves) for act in acts) + 2 * (self.show.take_off > 0.0)
        last = f", of which {planned} are planned up to {self.flights[-1].name}," if self.flights else ", at least,"
        refuse_long(planned + held, last)

    def _room(self, goals: FloatArray) -> Room:
        """Return the room of a flight: nobody goes around another below its lowest point and the end of the climb."""
        lower, upper = self.show.room or (np.full(3, -np.inf), np.full(3, np.inf))
        floor = min(float(places[:, 2].min()) for places in (self.now, goals, self.show.above))
        return Room(np.maximum(lower, (-np.inf, -np.inf, floor)), upper)

    def _key(self, goals: FloatArray, room: Room, limits: Limits) -> str:
        """Return a name of the question of a flight."""
        show, corners = self.show, [corner.tolist() for corner in (room.lower, room.upper)]
        apart = show.separation.plain.values()
        question = (self.now.tolist(), goals.tolist(), repr(limits), *apart, corners, show.seed)
        return hashlib.sha256(repr(question).encode()).hexdigest()[:24]

    def add(self, name: str, curves: list[Trajectory], method: str, hold: float = 0.0) -> None:
        """Fly and hold; without curves all stay where they are."""
        self.now = np.stack([curve.control_points[-1, -1] for curve in curves]) if curves else self.now
        self.flights.append(PlannedFlight(name, curves, method, hold))
        self.tell(f"{name}: {self.flights[-1].duration:.2f} s ({method})")

    def tell(self, sentence: str) -> None:
        """Tell a sentence to who wants to know."""
        if self.told is not None:
            self.told(sentence)


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


def _return(show: Show, now: FloatArray) -> IntArray:
    """Return above whose place each vehicle returns: its own, or any where the longest way is then shorter."""
    own = np.arange(len(now))
    if show.land == "own":
        return own
    order = np.asarray(assign(now, show.above))
    ways = [float(np.linalg.norm(show.above[each] - now, axis=1).max()) for each in (own, order)]
    return own if ways[0] <= ways[1] else order


def _checked(curves: list[Trajectory], show: Show, name: str) -> list[Trajectory]:
    """Return the curves of a move, or raise FleetError where they come too near, leave the room or go underground."""
    if not curves:
        return curves
    below = float(show.home[:, 2].min()) - min(float(extent_of(curve.control_points)[0][2]) for curve in curves)
    if below > EXACT:
        raise FleetError(f"a move of {name!r} goes {below:.3g} m below the lowest home: raise the act, or move it less")
    certificate = certify_fleet(curves, show.separation, room=show.room)
    near = certificate.closest
    if near is not None and near.share < 1.0 - EXACT:
        text = f"vehicles {near.pair[0]} and {near.pair[1]} come within {near.distance:.3f} m of {near.required:g} m"
        raise FleetError(f"{text} in a move of {name!r}: shrink it less", pair=near.pair)
    if certificate.room_margin is not None and certificate.room_margin < -EXACT:
        raise FleetError(f"a move of {name!r} leaves the room by {-certificate.room_margin:.3g} m: move it less far")
    return curves


def _lights(show: Show, shown: list[tuple[IntArray, Stage]], end: float, vehicle: int) -> Lights:
    """Return the colours of the acts at a vehicle's points, white until the first one, dark after the landing."""
    keys: list[tuple[float, Any, bool]] = [(0.0, (255, 255, 255), False)]
    for act, (order, stage) in zip(show.acts, shown, strict=True):
        if act.colour is None:
            continue
        if act.fade:
            keys.append((stage.start, keys[-1][1], False))
        own = np.asarray(act.colour)
        keys.append((stage.arrival, own if own.ndim == 1 else own[order[vehicle]], act.fade))
    instants, colours, fades = zip(*keys, (end, (0, 0, 0), False), strict=True)
    return Lights(np.array(instants), np.array(colours, dtype=np.float64), np.array(fades))

"""A show: formations one after the other, and the flights between them, planned one by one and kept once planned.

From home all climb straight up, fly to the acts, each by the assignment of least squared way, hold each, return above
home and land. A formation may move: it turns about the vertical, grows or shrinks, and its center goes along a curve.
All vehicles share three polynomials, of the cosine, the sine and the scale, so that it keeps its shape: its distances
are those that it has, times the scale. At knots they have the exact values and three derivatives.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from math import ceil, pi
from pathlib import Path
from typing import Any

import numpy as np

from minsnap.basics.arrays import FloatArray, IntArray
from minsnap.basics.checks import LONGEST, point_text
from minsnap.basics.storage.atomic import atomic_write, make_folder
from minsnap.basics.storage.table import read_archive
from minsnap.basics.storage.text import FileName, reading
from minsnap.basics.tolerances import EXACT
from minsnap.corridors.boxes import Room
from minsnap.errors import FileError, FleetError, MinsnapError
from minsnap.files.formats.skybrush import Lights
from minsnap.fleet.assignment import assign
from minsnap.fleet.common_clock import Fleet, Separation
from minsnap.fleet.fleet_certificate import certify_fleet, extent_of
from minsnap.fleet.fleet_planner import plan_fleet
from minsnap.fleet.fleet_task import table_of
from minsnap.fleet.time_search import slowed
from minsnap.limits.limits import Limits
from minsnap.planning.planner import plan
from minsnap.shows.formations import spacing_of
from minsnap.trajectory.trajectory import Trajectory

PIECE = pi / 24.0
"""Angle of a piece: cosine and sine are then met to 2e-10."""

LEAST_PIECES = 4


@dataclass(frozen=True, eq=False)
class Move:
    """How a formation moves, from rest to rest.

    Parameters
    ----------
    turn : float
        About the vertical through its center, counter-clockwise [rad].
    scale : float
        How many times as large it is in the end.
    along : ndarray, shape (n, 3), or None
        Way of its center, from where it is: ``[[0, 0, 0], [5, 0, 2]]`` [m].
    seconds : float or None
        How long it takes; by default as short as the limits allow [s].
    """

    turn: float = 0.0
    scale: float = 1.0
    along: FloatArray | None = None
    seconds: float | None = None


def moved(move: Move, points: FloatArray, limits: Limits) -> list[Trajectory]:
    """Return the curves of a formation (vehicles, 3), in its seconds or the shortest time; none if that is zero.

    Raises
    ------
    FleetError
        If it does not keep the limits in its seconds, or its way does not begin at the center.
    """
    if move.along is not None and move.along[:1].any():
        raise FleetError(
            f"the way of a move begins at {point_text(move.along[0])}: it is counted from the center of the formation, "
            "so begin it at (0, 0, 0)"
        )
    way = None if move.along is None else plan(move.along, total_time=1.0)
    count = max(LEAST_PIECES, ceil(abs(move.turn) / PIECE))
    breaks = np.union1d(np.linspace(0.0, 1.0, count + 1), [] if way is None else way.breaks[1:-1])
    curves = _pieces(breaks, np.stack(_shape(move, breaks), axis=2))
    center, durations = points.mean(axis=0), np.diff(breaks)
    shift = np.zeros((*curves.shape[:2], 3))
    if way is not None:
        shift = _pieces(breaks, np.stack([way(np.minimum(breaks, way.duration), q) for q in range(4)], axis=1))
    moves = []
    for x, y, z in points - center:
        x_y = curves[..., :1] * (x, y) + curves[..., 1:2] * (-y, x)
        moves.append(Trajectory(center + shift + np.concatenate((x_y, curves[..., 2:] * z), axis=2), durations))
    time = slowed(moves, limits) if move.seconds is None else move.seconds
    if time == 0.0 and move.seconds is None:
        return []
    if not 0.0 < time <= LONGEST:
        raise FleetError(f"a move takes {time:g} s: give it a number of seconds up to {LONGEST:g}")
    flown = [Trajectory(curve.control_points, curve.durations * time) for curve in moves]
    for used in () if move.seconds is None else certify_fleet(flown, limits=limits).utilisation:
        if used.use.fraction > 1.0 + EXACT:
            beyond = f"{used.use.name} {used.use.value:.4g} of {used.use.limit:g}"
            raise FleetError(f"a move in {time:g} s does not keep the limits ({beyond}): give it more seconds")
    return flown


def _shape(move: Move, breaks: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return values and three derivatives of cosine, sine and scale at knots of a unit of time, (knots, 4) each."""
    rise = Trajectory(np.repeat([0.0, 1.0], 4)[None, :, None], np.ones(1)).states(breaks, 4)[..., 0]
    angle, scale = move.turn * rise, (move.scale - 1.0) * rise + (1.0, 0.0, 0.0, 0.0)
    ones = np.exp(1j * angle[:, 0])
    first, second, third = 1j * angle[:, 1], 1j * angle[:, 2], 1j * angle[:, 3]
    chain = (np.ones(len(ones)), first, first**2 + second, first**3 + 3.0 * first * second + third)
    turned = np.stack([ones * each for each in chain], axis=1)
    # the product with the scale is differentiated as a whole
    whole = np.zeros_like(turned)
    for order, weights in enumerate(((1,), (1, 1), (1, 2, 1), (1, 3, 3, 1))):
        for k, weight in enumerate(weights):
            whole[:, order] += weight * turned[:, k] * scale[:, order - k]
    return whole.real, whole.imag, scale


def _pieces(breaks: FloatArray, data: FloatArray) -> FloatArray:
    """Return the control points of degree 7 that have values and three derivatives at knots: (pieces, 8, dim)."""
    from scipy.interpolate import BPoly

    return np.asarray(BPoly.from_derivatives(breaks, data).c.transpose(1, 0, 2))


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
        times = [("take_off", self.take_off), *((f"hold of act {act.name!r}", act.hold) for act in self.acts)]
        for name, value in times:
            if not 0.0 <= value <= LONGEST:
                raise FleetError(f"{name} is {value}: give a number from 0 to {LONGEST:g}")
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


@dataclass(frozen=True)
class Stage:
    """One flight of a show, and the hold after it.

    Parameters
    ----------
    name : str
        Where it leads.
    start, arrival, end : float
        [s].
    method : str
        How it was planned, or ``"kept"`` from an earlier run.
    """

    name: str
    start: float
    arrival: float
    end: float
    method: str


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


def fly(
    show: Show,
    kept: FileName | None = None,
    told: Told | None = None,
    progress: bool = False,
    refuse: Callable[[int, str], None] = lambda pieces, what: None,
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
    refuse : callable, optional
        Called before each flight to an act with the least number of pieces that a vehicle will have, and what is known
        of them, in words; raises what ends the show.

    Raises
    ------
    FleetError
        If acts and vehicles do not fit together.
    UnprovedError
        If a search ends without a flight; says which.
    """
    show.check()
    course = _Course(show, kept, progress, told, show.home, [], [[] for _ in show.home], refuse)
    course.refuse_long(show.acts)
    course.fly("take-off", show.above)
    shown = []
    for number, act in enumerate(show.acts):
        course.refuse_long(show.acts[number:])
        order = assign(course.now, act.points)
        shown.append((order, course.fly(act.name, act.points[order], act.hold)))
        for move in act.moves:
            course.add(f"{act.name} moves", _checked(moved(move, course.now, show.limits), show, act.name), "move", 0.0)
    course.refuse_long(())
    order = _return(show, course.now)
    course.fly("return", show.above[order])
    end = course.fly("landing", show.home[order]).end
    fleet = Fleet(tuple(_joined(part) for part in course.parts), None, show.separation)
    lights = tuple(_lights(show, shown, end, vehicle) for vehicle in range(len(show.home)))
    return FlownShow(fleet, lights, tuple(course.stages))


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
    stages: list[Stage]
    parts: list[list[Trajectory]]
    refuse: Callable[[int, str], None]

    def fly(self, name: str, goals: FloatArray, hold: float = 0.0) -> Stage:
        """Fly to goals, shape (vehicles, 3), and hold, and return the stage; see ``add``."""
        return self.add(name, *self._flight(name, goals), hold)

    def _flight(self, name: str, goals: FloatArray) -> tuple[list[Trajectory], str]:
        """Return the curves to goals, and how they were planned; an UnprovedError says of which flight it is."""
        if np.abs(goals - self.now).max() <= EXACT:
            return [], "stays"
        show, room = self.show, self._room(goals)
        file = None if self.kept is None else Path(self.kept) / f"{self._key(goals, room)}.npz"
        ways = np.stack([self.now, goals], axis=1)
        with suppress(FileError):
            if file is not None:
                return _stored(file, ways), "kept"
        try:
            fleet = plan_fleet(ways, show.limits, show.separation, room, seed=show.seed, progress=self.progress)
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
        """Ask whether the pieces are too many: those that are planned, and the least for these acts and the landing."""
        planned = max(sum(len(part.durations) for part in parts) for parts in self.parts)
        held = sum((act.hold > 0.0) + len(act.moves) for act in acts) + 2 * (self.show.take_off > 0.0)
        last = f", of which {planned} are planned up to {self.stages[-1].name}," if self.stages else ", at least,"
        self.refuse(planned + held, last)

    def _room(self, goals: FloatArray) -> Room:
        """Return the room of a flight: nobody goes around another below its lowest point and the end of the climb."""
        lower, upper = self.show.room or (np.full(3, -np.inf), np.full(3, np.inf))
        floor = min(float(places[:, 2].min()) for places in (self.now, goals, self.show.above))
        return Room(np.maximum(lower, (-np.inf, -np.inf, floor)), upper)

    def _key(self, goals: FloatArray, room: Room) -> str:
        """Return a name of the question of a flight."""
        show, corners = self.show, [corner.tolist() for corner in (room.lower, room.upper)]
        apart = show.separation.plain.values()
        question = (self.now.tolist(), goals.tolist(), repr(show.limits), *apart, corners, show.seed)
        return hashlib.sha256(repr(question).encode()).hexdigest()[:24]

    def add(self, name: str, curves: list[Trajectory], method: str, hold: float) -> Stage:
        """Fly and hold, and return the stage; without curves all stay where they are."""
        start = self.stages[-1].end if self.stages else 0.0
        arrival = start + max((curve.duration for curve in curves), default=0.0)
        self.now = np.stack([curve.control_points[-1, -1] for curve in curves]) if curves else self.now
        for i, (part, goal) in enumerate(zip(self.parts, self.now, strict=True)):
            flown = curves[i : i + 1]
            part.extend([*flown, *_wait(goal, arrival - start - sum(curve.duration for curve in flown) + hold)])
        self.stages.append(Stage(name, start, arrival, arrival + hold, method))
        if self.told is not None:
            self.told(f"{name}: {arrival - start:.2f} s ({method})")
        return self.stages[-1]


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


def _wait(point: FloatArray, duration: float) -> list[Trajectory]:
    return [Trajectory(np.tile(point, (1, 8, 1)), np.array([duration]))] if duration > 1e-9 else []


def _joined(parts: list[Trajectory]) -> Trajectory:
    """Return curves one after the other; all rest where they meet."""
    if not parts:
        raise FleetError("nothing moves in this show: give it a climb, or acts")
    points, durations = zip(*((part.control_points, part.durations) for part in parts), strict=True)
    return Trajectory(np.concatenate(points), np.concatenate(durations))


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

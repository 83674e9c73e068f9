"""A course: what is flown through, in which order, and within which limits."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from math import cos, inf, pi, radians, sin, tan
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np

from minsnap.basics.arrays import FloatArray, set_fields
from minsnap.basics.checks import (
    FREE,
    check_array,
    check_degree,
    check_distance,
    check_number,
    check_positive,
    check_switch,
    is_number,
)
from minsnap.basics.messages import explains_names, shown
from minsnap.basics.schema import (
    ANY,
    FLAG,
    NUMBER,
    POINT,
    TEXT,
    WHOLE,
    Key,
    either,
    mapping,
    refuse_unknown,
    several,
    word,
)
from minsnap.basics.storage.text import FileName, load_yaml, read_text, reading
from minsnap.corridors.boxes import Boxes, Room
from minsnap.corridors.constraint import Constraint
from minsnap.corridors.gates import Ball, Gate, center_of
from minsnap.corridors.half_spaces import HalfSpaces
from minsnap.corridors.keep_out import Avoided, as_obstacles, named_obstacle, named_obstacles
from minsnap.corridors.tubes import Tube
from minsnap.errors import FileError, WaypointError
from minsnap.files import request_yaml
from minsnap.files.limits_yaml import DESCRIBED, limits_of
from minsnap.files.waypoints import has_holds, read_held
from minsnap.limits.limits import Limits
from minsnap.limits.ordinary import ordinary_limits
from minsnap.paths.missions.foreign_courses import translated
from minsnap.paths.missions.race_track import translated_track
from minsnap.planning.request import PlanRequest
from minsnap.trajectory.look_at import LookAt
from minsnap.trajectory.velocity_heading import Velocity

LEAN = tan(radians(1.0))
"""How much the velocity may lean towards a side of a gate that is passed straight."""


TRACK = ".toml"
ENDINGS = (".yaml", ".yml", TRACK)
"""Files that describe courses; another one is a table of waypoints."""

MOST_LAPS, MOST_DEEP = 1000, 1e5
"""Most laps of a course, and greatest height of its floor above or below zero [m]."""


@dataclass(frozen=True, eq=False)
class Stop:
    """One entry of a course: a point, or a gate.

    Parameters
    ----------
    place : ndarray, shape (2,) or (3,), or Gate
        [m].
    ball : float
        Radius within which a point is passed [m]; 0: exactly.
    hold : float
        How long the vehicle stays there, at rest [s].
    straight : float
        Distance before and after a gate over which the path is perpendicular to it, by a degree towards each side, and
        stays inside the prism over its opening [m].
    """

    place: FloatArray | Gate
    ball: float = 0.0
    hold: float = 0.0
    straight: float = 0.0

    def __post_init__(self) -> None:
        if self.gate is None:
            give = "a gate, or two or three finite numbers"
            place = check_array("the place of a stop", self.place, ((2,), (3,)), give, WaypointError)
            set_fields(self, place=place)
        for name in ("ball", "hold", "straight"):
            what, give = f"{name} of a waypoint", "give a number, 0 or more"
            check_number(what, getattr(self, name), 0.0, inf, give, WaypointError)
        if self.ball and self.gate is not None:
            raise WaypointError(
                "a gate is passed anywhere in its opening: leave out the ball, or make the gate smaller"
            )
        if self.straight and not (self.gate and self.gate.crossing):
            raise WaypointError("only a gate with a crossing, 1 or -1, is passed straight: give both, or leave it out")

    @property
    def gate(self) -> Gate | None:
        """The gate; None at a point."""
        return self.place if isinstance(self.place, Gate) else None

    @property
    def center(self) -> FloatArray:
        """The point, or the middle of the gate [m]."""
        return np.asarray(center_of(self.place))

    def is_at(self, other: Stop) -> bool:
        """Whether this is no more than another one, or than its point."""
        plain = self.gate is None and not self.hold and self.ball in (0.0, other.ball)
        return plain and np.array_equal(self.center, other.center)


@dataclass(frozen=True, eq=False)
class Course:
    """Waypoints and gates in order, and how they are flown.

    Parameters
    ----------
    stops : tuple of Stop
        Two or more; empty where boxes say the way.
    closed : bool
        A lap, which ends in the state that it begins with; where the last stop is the first one again, it is left out.
    laps : int
        How often it is flown.
    limits : Limits or None
        By default 3 m/s, 6 m/s^2 and 30 m/s^3.
    tube : float or None
        Half-width of a corridor around the legs [m].
    boxes : Boxes or None
        Instead of stops, with ``start`` and ``end``.
    start, end : mapping
        States at the ends, as :func:`minsnap.plan` takes them.
    tolerance : float
        Half-width of the boxes around inner waypoints [m].
    yaw : float, str, sequence or None
        As :func:`minsnap.plan` takes it, and of the whole flight: a sequence has an angle for each waypoint, take-off,
        landing, all laps and the points beside straight gates among them.
    takeoff, land : sequence of float, bool
        Whether, or from and to where [m], the vehicle takes off and lands; True: at an altitude of 0 below where the
        course begins and ends.
    name : str
        What figures call it.
    degree, pieces
        Of the polynomials of the course, as :func:`minsnap.plan` takes them.
    takeoff_speed, land_speed : float or None
        Greatest speeds of take-off and landing [m/s]; by default 1 and 0.5.
    avoid : obstacles, or tuple of (name, numbers)
        What the course keeps out of; by names as :func:`~minsnap.corridors.keep_out.named_obstacle` has them.
    tracking, wind : Loop and float, or None
        The vehicle's loop, which keeps all of it, and the largest change of the wind [m/s].
    floor : float or None
        Least height of the path [m]; by default that of the ground, 0 or where the vehicle takes off or lands, unless
        a stop is lower.
    """

    stops: tuple[Stop, ...]
    closed: bool = False
    laps: int = 1
    limits: Limits | None = None
    tube: float | None = None
    boxes: Boxes | None = None
    start: Mapping[str, Any] | None = None
    end: Mapping[str, Any] | None = None
    tolerance: float = 0.0
    yaw: Any = None
    takeoff: Sequence[float] | bool = False
    land: Sequence[float] | bool = False
    name: str = "course"
    degree: int = 7
    pieces: int | Literal["auto"] | None = None
    avoid: Any = ()
    takeoff_speed: float | None = None
    land_speed: float | None = None
    tracking: Any = None
    wind: float | None = None
    floor: float | None = None

    def __post_init__(self) -> None:
        if not isinstance(self.stops, (tuple, list)) or not all(isinstance(stop, Stop) for stop in self.stops):
            raise WaypointError(f"the stops are {shown(self.stops)}: give a tuple of Stop")
        if isinstance(self.yaw, (list, np.ndarray)):
            set_fields(self, yaw=tuple(np.asarray(self.yaw).tolist()))
        check_switch("closed", self.closed)
        if self.closed and len(self.stops) > 2 and self.stops[-1].is_at(self.stops[0]):
            set_fields(self, stops=self.stops[:-1])
        check_distance("the tolerance", self.tolerance, WaypointError)
        if self.tolerance and any(stop.ball for stop in self.stops):
            raise WaypointError("a course has a tolerance around all waypoints, or balls around some: leave out one")
        give = f"give a whole number from 1 to {MOST_LAPS}"
        check_number("laps", self.laps, 1, MOST_LAPS, give, WaypointError, whole=True)
        for name in ("takeoff", "land"):
            if not isinstance(getattr(self, name), bool):
                give = "True, False, or where on the ground, (x, y, z)"
                check_array(name, getattr(self, name), ((3,),), give, WaypointError)
        for name, planned in (("takeoff_speed", self.takeoff), ("land_speed", self.land)):
            speed = getattr(self, name)
            if speed is not None:
                check_positive(name, speed, "m/s", WaypointError)
                if planned is False:
                    raise WaypointError(
                        f"{name} is {speed:g}, and {name.removesuffix('_speed')} is not planned: give both"
                    )
        self._check_ends()
        if self.floor is not None:
            check_number("floor", self.floor, -MOST_DEEP, MOST_DEEP, "give a height [m]", WaypointError)
        check_degree(self.degree)
        if self.boxes is None and len(self.stops) < 2:
            raise WaypointError(f"a course has at least 2 waypoints or gates, not {len(self.stops)}")
        if self.boxes is not None and (self.laps > 1 or self.closed or self.stops):
            raise WaypointError("a course through boxes has a start and an end: give no waypoints, laps or closed")

    def _check_ends(self) -> None:
        """Refuse states at ends that are at rest."""
        for name, end, ground in (("start", 0, "takeoff"), ("end", -1, "land")):
            held = bool(self.stops) and self.stops[end].hold > 0.0
            if getattr(self, name) and (held or getattr(self, ground) is not False):
                why = f"a hold is at its {name}" if held else f"{ground} is planned"
                raise WaypointError(f"the course has a state at its {name}, where it rests since {why}: leave one out")

    @property
    def bounds(self) -> Limits:
        """The limits, or the ordinary ones where there are none."""
        return ordinary_limits() if self.limits is None else self.limits

    @property
    def periodic(self) -> bool:
        """Whether laps are flown without a stop."""
        return self.closed and not any(stop.hold for stop in self.stops)

    @property
    def points(self) -> list[FloatArray | Gate]:
        """Waypoints and gates of one lap, as :func:`minsnap.plot.plot_path` draws them."""
        return [stop.place for stop in self.stops]

    @property
    def centers(self) -> FloatArray:
        """Where one lap leads, (n, dim) [m]: centers of the stops, or of the boxes."""
        if self.boxes is not None:
            return np.asarray(0.5 * (self.boxes.lower + self.boxes.upper))
        stops = [*self.stops, self.stops[0]] if self.closed else self.stops
        return np.array([stop.center for stop in stops], dtype=np.float64)

    @property
    def obstacles(self) -> tuple[Avoided, ...]:
        """What the course keeps out of."""
        plain = isinstance(self.avoid, tuple) and all(isinstance(each, tuple) for each in self.avoid)
        return tuple(named_obstacle(*each) for each in self.avoid) if plain else as_obstacles(self.avoid)

    @property
    def walls(self) -> list[Constraint]:
        """Boxes, tube and floor."""
        walls: list[Constraint] = [] if self.boxes is None else [self.boxes]
        walls += [] if self.tube is None else [Tube(np.array(self.tube))]
        above = Room((-inf, -inf, -inf if self.floor is None else self.floor), (inf, inf, inf))
        return walls if self.floor is None else [*walls, above]

    @property
    def ground(self) -> float | None:
        """Height of the ground where no floor is said [m]: no stop is below it; None where that is not known."""
        if self.floor is not None or self.boxes is not None or self.centers.shape[1] != 3:
            return None
        said = [float(end[2]) for end in (self.takeoff, self.land) if not isinstance(end, bool)]
        ground = min(said, default=0.0)
        return ground if self.centers[:, 2].min() > ground else None

    @property
    def request(self) -> PlanRequest:
        """How parts of the course are planned, which have their own places, and further walls.

        Its heading is one angle or a rule; others are for all of the course.
        """
        ruled = isinstance(self.yaw, (str, Velocity, LookAt)) or is_number(self.yaw)
        return PlanRequest(
            waypoints=None,
            limits=self.bounds,
            corridor=self.walls or None,
            degree=self.degree,
            yaw=self.yaw if ruled else None,
            pieces=self.pieces,
            avoid=self.obstacles,
        )

    def changed(self, **others: Any) -> Course:
        """Return the course with other fields."""
        return replace(self, **others)

    def sequence(self) -> list[Stop]:
        """Return the stops in the order of the flight, all laps, with the first one again at the end of each lap."""
        if self.closed:
            return [*self.laps * list(self.stops), self.stops[0]]
        lap = list(self.stops)
        again = lap[1:] if np.array_equal(lap[0].center, lap[-1].center) else lap
        return lap + (self.laps - 1) * again


class Section(NamedTuple):
    """Stops flown without a pause between.

    Parameters
    ----------
    request : PlanRequest
        How they are planned.
    places : list
        Waypoints and gates; a gate that is passed straight is three.
    walls : list of Constraint
    knots : list of int
        Which of the places each stop is.
    """

    request: PlanRequest
    places: list[FloatArray | Gate]
    walls: list[Constraint]
    knots: list[int]

    @property
    def legs(self) -> int:
        """Number of legs."""
        return len(self.places) - 1


def section_of(stops: Sequence[Stop], course: Course, closed: bool) -> Section:
    """Return a section of a course; ends of an open one are points, at which the vehicle rests."""
    if closed and stops[0].straight:
        raise WaypointError("the first gate of a closed lap cannot be passed straight: begin the lap at another one")
    places: list[FloatArray | Gate] = []
    balls: list[float] = []
    knots: list[int] = []
    walls = course.walls
    for index, stop in enumerate(stops):
        inner = closed or 0 < index < len(stops) - 1
        if stop.gate is not None and inner and stop.straight:
            walls += _straight_passage(len(places), stop.gate)
            knots.append(len(places) + 1)
            step = stop.gate.crossing * stop.straight * stop.gate.normal
            places += [stop.gate.moved(-step), stop.gate, stop.gate.moved(step)]
            balls += [0.0] * 3
            continue
        knots.append(len(places))
        places.append(stop.place if inner else stop.center)
        balls.append(stop.ball if inner else 0.0)
    if closed:
        places[-1] = places[0]
    tolerance = Ball(balls) if any(balls) else course.tolerance or None
    own: dict[str, Any] = {"waypoints": places, "corridor": walls or None, "waypoint_tolerance": tolerance}
    return Section(replace(course.request, **own, closed=closed), places, walls, knots)


def _straight_passage(knot: int, gate: Gate) -> list[Constraint]:
    """Return the prism over a gate's opening, and the directions in it, for the two legs from a knot on."""
    sides, offsets = gate.edges()
    legs, leaning = (knot, knot + 1), sides - LEAN * gate.crossing * gate.normal
    prism = HalfSpaces(sides, offsets + sides @ gate.center, legs)
    return [prism, HalfSpaces(leaning, np.zeros(len(sides)), legs, order=1)]


MOST_TURNED = 2.0 * pi
"""Heading of a gate above which it is refused as one in degrees [rad]."""

LENGTH = Key(NUMBER, "[m]")
PASSED = {
    "hold": Key(NUMBER, "time at rest there [s]"),
    "straight": Key(NUMBER, "how far before and behind a gate the path stays in the prism over its opening [m]"),
}
LISTED = several(NUMBER, "a list of numbers")
EDGES = {
    "corners": Key(several(LISTED, "a list of points"), "[m]; in place of all that follows"),
    "margin": Key(NUMBER, "how far the path stays from the edges [m]"),
    "crossing": Key(WHOLE, "1: along the normal, -1: against it, 0: either way"),
}
FRAMED = {
    "frame": Key(NUMBER, "width of the bars around the opening, which are obstacles, kept clear of by the margin [m]"),
    "frame_depth": Key(NUMBER, "how deep they are along the way [m], by default as wide"),
}
GATE = mapping(
    {"center": Key(LISTED, "[m]")}
    | EDGES
    | {
        "normal": Key(LISTED, "direction through the opening"),
        "heading": Key(NUMBER, "direction of flight through it [rad]"),
        "heading_deg": Key(NUMBER, "the same [degrees]"),
        "width": LENGTH,
        "height": LENGTH,
        "up": Key(LISTED, "direction of the height"),
        "radius": LENGTH,
    }
    | FRAMED
    | PASSED,
    "a gate",
    marks=("center", "corners", "centre"),
)
ENTRY = mapping(
    {
        "x": Key(NUMBER, needed=True),
        "y": Key(NUMBER, needed=True),
        "z": LENGTH,
        "ball": Key(NUMBER, "radius within which the point is passed [m]"),
    }
    | PASSED,
    "a mapping of x, y and z",
)
STOP = either(POINT, GATE, ENTRY)
GROUND = either(FLAG, several(NUMBER, "where on the ground, [x, y, z]", 3, 3))
STATES = ("position", "velocity", "acceleration", "jerk", "snap")
STATE = mapping(
    {name: Key(LISTED if name == "position" else either(LISTED, word(FREE))) for name in STATES}, "derivatives by name"
)
CORNERS = Key(several(LISTED, "a list of corners"), "[m]", needed=True)
COURSE = mapping(
    {
        "name": Key(TEXT),
        "waypoints": Key(several(STOP, "a list of waypoints and gates")),
        "gates": Key(several(GATE, "a list of gates")),
        "boxes": Key(mapping({"lower": CORNERS, "upper": CORNERS}, "their corners as lower and upper, a list of each")),
        "start": Key(STATE),
        "end": Key(STATE),
        **request_yaml.SHARED,
        "laps": Key(WHOLE, "how often it is flown"),
        "takeoff": Key(GROUND, "from the ground below the start, or from a point"),
        "land": Key(GROUND, "on the ground below the end, or at a point"),
        "takeoff_speed": Key(NUMBER, "greatest speed of the take-off [m/s], by default 1"),
        "land_speed": Key(NUMBER, "greatest speed of the landing [m/s], by default 0.5"),
        "tube": Key(NUMBER, "half-width around the legs [m]"),
        "ball": Key(either(NUMBER, LISTED), "of all waypoints, or of each [m]"),
        "margin": Key(NUMBER, "of all gates [m]"),
        **{name: Key(NUMBER, f"of all gates: {key.text}") for name, key in FRAMED.items()},
        "tolerance": Key(NUMBER, "half-width of the boxes around inner waypoints [m]"),
        "floor": Key(NUMBER, "least height of the path [m], by default that of the ground, unless a stop is lower"),
        "yaw": request_yaml.PLAIN["yaw"],
        "vehicle": Key(DESCRIBED),
        "best": Key(ANY, "a remark"),
        "published": Key(ANY, "a remark"),
    },
    "a mapping with waypoints",
)
"""The whole file."""


def _content(path: FileName) -> Any:
    """Return the content of a file of a course: YAML as it is, a configuration of a race in TOML translated.

    Raises
    ------
    FileError
        If it cannot be read.
    ImportError
        If Python is older than its reader of TOML.
    """
    if isinstance(path, str | Path) and Path(path).suffix.lower() == TRACK:
        try:
            import tomllib
        except ModuleNotFoundError:
            raise ImportError("reading .toml needs Python 3.11 or newer: write the course as YAML") from None
        with reading(path, "TOML"):
            try:
                return translated_track(f"{path}", tomllib.loads(read_text(path)))
            except tomllib.TOMLDecodeError as error:
                raise FileError(f"{path}: {error}") from None
    return load_yaml(path)


def is_course(path: FileName, wanted: bool = True) -> bool:
    """Whether a file describes a course: YAML with more than waypoints, headings and durations, and no request.

    Points with ``limits`` alone may be either, and are a course where one is wanted.

    Raises
    ------
    FileError
        If it cannot be read, or has keys that only a course has and others that only a request has.
    """
    suffix = Path(path).suffix.lower() if isinstance(path, str | Path) else ".yaml"
    if suffix not in ENDINGS:
        return has_holds(path)
    content = _content(path)
    if suffix == TRACK or translated(f"{path}", content) is not None:
        return True
    if request_yaml.is_request(content):
        _refuse_both(f"{path}", content)
        return False
    keys = content if isinstance(content, dict) else {"waypoints": content}
    plain = {"waypoints", *request_yaml.PLAIN, *(() if wanted else ("limits",))}
    return not keys.keys() <= plain or not request_yaml.has_points(keys.get("waypoints"))


def _refuse_both(where: str, content: Mapping[str, Any]) -> None:
    """Raise FileError for a request that has keys of a course, too."""
    entries = content["waypoints"] if isinstance(content.get("waypoints"), list) else []
    inner = {key for entry in entries if isinstance(entry, dict) for key in entry} - {*"xyz"}
    courses, requests = COURSE.json["properties"].keys(), request_yaml.REQUEST.json["properties"].keys()
    of_course = [key for key in content if key in courses - requests]
    of_course += [key for key in (*GATE.json["properties"], *ENTRY.json["properties"]) if key in inner]
    of_plan = [key for key in content if key in request_yaml.FURTHER.keys() - courses]
    if of_course and of_plan:
        raise FileError(
            f"{where}: {of_course[0]!r} is for a course, and {of_plan[0]!r} for a plan through waypoints: leave out one"
        )


@explains_names({})
def read_course(path: FileName) -> Course:
    """Read a course from YAML, or waypoints of a table with a column ``hold``; all in SI units, angles in radians.

    The keys are those of :data:`COURSE`. ``waypoints`` are points, mappings with ``x``, ``y``, ``z``, or gates:
    mappings with ``center``, a direction (``heading``, ``heading_deg``, or ``normal`` and ``crossing``) and ``width``,
    ``height`` or a ``radius``; or ``corners`` alone. ``gates`` alone is the same. The files of rpg_time_optimal,
    pmm_uav_planner, TOGT-Planner, waypoint_navigator and lsy_drone_racing (TOML) are read as they are.

    Raises
    ------
    FileError
        If the file is malformed; says where.
    ImportError
        If PyYAML is not there, or for TOML a Python older than 3.11.
    """
    if isinstance(path, str | Path) and Path(path).suffix.lower() not in ENDINGS:
        held = read_held(path)
        stops = (Stop(point, hold=float(hold)) for point, hold in zip(held.points, held.holds, strict=True))
        return Course(tuple(stops), name=Path(path).stem)
    content = _content(path)
    content = content if isinstance(content, dict) else {"waypoints": content}
    content = translated(f"{path}", content) or content
    with reading(path, "a course"):
        known = COURSE.json["properties"] | request_yaml.REQUEST.json["properties"]  # it may be either
        refuse_unknown(f"{path}", content, known)
        return _course(f"{path}", COURSE.read(f"{path}", content), Path(path))


def _course(where: str, content: Mapping[str, Any], path: Path) -> Course:
    entries = [*content.get("waypoints", ()), *content.get("gates", ())]
    balls, margin = content.get("ball", 0.0), content.get("margin", 0.0)
    if isinstance(balls, tuple) and len(balls) != len(entries):
        raise FileError(f"{where}: {len(balls)} balls for {len(entries)} waypoints: give one, or one for each")
    balls = balls if isinstance(balls, tuple) else (balls,) * len(entries)
    named = [f"{where}: {key} {i}" for key in ("waypoints", "gates") for i in range(len(content.get(key, ())))]
    stops = [_stop(name, entry, ball, margin) for name, entry, ball in zip(named, entries, balls, strict=True)]
    framed = {name: content[name] for name in FRAMED if name in content}
    bars = [bar for number, entry in enumerate(entries) for bar in _frame(number, stops[number], framed, entry)]
    values = {field.name: content[field.name] for field in fields(Course) if field.name in content}
    boxes = Boxes(**content["boxes"]) if "boxes" in content else None
    own: dict[str, Any] = {"limits": _limits(path.parent, content), "boxes": boxes}
    own |= {"avoid": (*content.get("avoid", ()), *named_obstacles(bars))} if bars else {}
    own |= request_yaml.tracking_of(f"{where}: tracking", content, path.parent)
    return Course(tuple(stops), **{"name": path.stem} | values | own)


def _frame(number: int, stop: Stop, framed: Mapping[str, Any], entry: Any) -> tuple[Avoided, ...]:
    """Return the bars of one gate, where it has any."""
    own = dict(framed) | ({name: entry[name] for name in FRAMED if name in entry} if isinstance(entry, dict) else {})
    if stop.gate is None or "frame" not in own:
        return ()
    return stop.gate.frame(own["frame"], own.get("frame_depth"), stop.gate.margin, number)


def stop_of(where: str, content: Any) -> Stop:
    """Return one entry of a course, or raise FileError, which says where it stands."""
    return _stop(where, STOP.read(where, content), 0.0, 0.0)


def _stop(where: str, entry: Any, ball: float, margin: float) -> Stop:
    if isinstance(entry, tuple):
        return Stop(np.array(entry), ball)
    options = {name: entry[name] for name in PASSED if name in entry}
    if GATE.fits(entry):
        return Stop(_gate(where, {"margin": margin} | entry), **options)
    point = np.array([entry[axis] for axis in "xyz" if axis in entry])
    return Stop(point, entry.get("ball", ball), **options)


def _gate(where: str, entry: Mapping[str, Any]) -> Gate:
    how = {name: entry[name] for name in ("crossing", "margin") if name in entry}
    if "corners" in entry:
        if set(entry) - {"corners", *how, *FRAMED, *PASSED}:
            raise FileError(f"{where}: a gate with corners has no center, direction or size besides")
        return Gate.polygon(entry["corners"], **how)
    directions = [name for name in ("normal", "heading", "heading_deg") if name in entry]
    if len(directions) != 1 or ("width" in entry) == ("radius" in entry):
        raise FileError(
            f"{where}: a gate has a center, a width or a radius, and one of normal, heading and heading_deg"
        )
    if "radius" in entry and entry.keys() & {"height", "up"}:
        raise FileError(f"{where}: a gate with a radius is round: leave out its height and up, or give a width")
    made = Gate.circle if "radius" in entry else Gate
    values = how | {name: entry[name] for name in ("center", "radius", "width", "height", "up") if name in entry}
    if directions[0] == "normal":
        return made(normal=entry["normal"], **values)
    angle = entry[directions[0]]
    if directions[0] == "heading" and abs(angle) > MOST_TURNED:
        raise FileError(f"{where}: heading is {angle:g} rad, beyond a turn: write heading_deg: {angle:g} for degrees")
    angle = radians(angle) if directions[0] == "heading_deg" else angle
    flat = [cos(angle), sin(angle), 0.0][: len(values["center"])]
    return made(normal=flat, **{"crossing": 1} | values)


def _limits(folder: Path, content: Mapping[str, Any]) -> Limits | None:
    named, vehicle = content.get("limits", {}), content.get("vehicle")
    if vehicle is None:
        return limits_of("limits", named, folder, timed=False) if named else None
    return limits_of("limits", named, folder, vehicle=vehicle, name=content.get("name", "vehicle"))

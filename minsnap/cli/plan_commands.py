"""The commands that plan through the waypoints of a file, fly its course, or go through a map."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import takewhile
from math import isfinite
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Annotated, Any

from typer.core import TyperCommand

import minsnap
from minsnap.basics.storage.atomic import refuse_source
from minsnap.basics.storage.text import name_as_text
from minsnap.cli import options
from minsnap.cli.app import command
from minsnap.cli.options import vehicle_of
from minsnap.cli.output import Destination, nearest_place, on_terminal
from minsnap.cli.planning import Planning, TimingOptions, standing
from minsnap.errors import FrameError, InputError

if TYPE_CHECKING:
    from minsnap.corridors import Constraint
    from minsnap.files import FileRequest
    from minsnap.paths.missions import Mission
    from minsnap.planning import PlanRequest
    from minsnap.vehicle import Loop

BESIDE_LINES = 0.1
"""Distance from the lines of a mission from which on it is told [m]."""

QUICK = 1000.0
"""Longest search for a lap after which laps from a standing start are searched for, too [ms]."""


@dataclass(frozen=True)
class GroundOptions:
    """The ground that all legs stay above."""

    terrain: Annotated[
        Path | None, "FILE", "Heights of the ground, a GeoTIFF or an ESRI ASCII grid: all legs stay above it."
    ] = None
    above: Annotated[float | None, "M", "With --terrain: least height above the ground [m]."] = None
    below: Annotated[float | None, "M", "With --terrain: greatest height above the ground [m]."] = None

    def __post_init__(self) -> None:
        if (self.terrain is None) != (self.above is None) or (self.terrain is None and self.below is not None):
            raise InputError("--terrain and --above go together, and --below with them: give the file and the height")
        for name, height in (("above", self.above), ("below", self.below)):
            if height is not None and not (isfinite(height) and height >= 0.0):
                raise InputError(f"--{name} is {height:g}: give a height [m] of 0 or more")
        if self.above is not None and self.below is not None and self.below <= self.above:
            raise InputError(f"--above is {self.above:g} and --below {self.below:g}: give the lower height first")

    def refuse(self, file: Path, what: str) -> None:
        """Raise InputError where there is terrain for what is no plan through waypoints."""
        if self.terrain is not None:
            raise InputError(f"{file} is {what}: --terrain is for a plan through waypoints")

    def walls(self, request: FileRequest, file: Path) -> list[Constraint]:
        """Return walls in which the legs of a request stay above the ground; none without terrain."""
        if self.terrain is None or self.above is None:
            return []
        import numpy as np

        from minsnap.paths.routes import BESIDE, build_terrain_walls, read_terrain

        if request.room is not None or len(request.waypoints[0]) != 3:
            what = "a room of its own" if request.room is not None else "no altitudes"
            raise InputError(f"{file} has {what}: --terrain is for waypoints x,y,z without a room")
        beside = BESIDE if request.corridor is None else min(BESIDE, *request.corridor)
        points = np.array(request.waypoints, dtype=np.float64)
        return [build_terrain_walls(read_terrain(self.terrain), points, self.above, self.below, beside)]


@command()
def plan(
    planning: Planning,
    ground: GroundOptions,
    destination: Destination,
    file: Annotated[Path, "FILE", "x,y,z[,yaw][,speed][,duration] in CSV; YAML; a mission; a plan."],
    *,
    closed: Annotated[
        bool, "A closed lap without a stop; appends the first waypoint where the last is another."
    ] = False,
    laps: Annotated[int | None, "How often the course is flown."] = None,
    from_frame: Annotated[str | None, "Axes of the waypoints: by default enu, or ned, …"] = None,
    takeoff: Annotated[bool, "Climb from the ground below the first waypoint."] = False,
    land: Annotated[bool, "Descend to the ground below the last waypoint."] = False,
    origin: options.Origin = None,
    within: options.Within = None,
) -> None:
    """Plan through the waypoints of a file, or fly a course in YAML.

    Without times and limits, the time is the shortest found within 3 m/s, 6 m/s^2 and 30 m/s^3. A course may have
    gates, balls, holds, laps, take-off and landing.

    A YAML file may also hold total time, limits, corridor and more, as the studio saves it. Options take precedence.
    The limits of the file also hold for another time. A plan in .json or .yaml is not planned again: it is certified
    again, with its corridor and limits.
    """
    from minsnap.files import read_request, vehicle_files
    from minsnap.files.formats import is_polynomials

    refuse_source(destination.output, file)
    if is_polynomials(file):
        ground.refuse(file, "a plan already")
        destination.check_mission(origin, within)
        again = closed or bool(laps) or takeoff or land or from_frame is not None
        _deliver_again(file, planning, destination, again, origin=origin, within=within)
        return
    refuse_source(destination.output, *vehicle_files(file))
    known = _of_mission(file, origin) | {"within": within}
    place = origin if "note" in known else None
    destination.check_mission(known.get("origin"), within)
    course = _course(file, closed, laps, takeoff, land, place)
    if course is not None:
        if from_frame not in (None, "enu"):
            raise InputError(f"{file} is flown as a course, which is in ENU: leave out --from-frame {from_frame}")
        ground.refuse(file, "flown as a course")
        known |= _without_speeds(file, place, known)
        fly_course(course, planning, destination, **known)
        return
    read = _in_frame(read_request(file, place), file, from_frame)
    in_loop, chosen = planning.in_loop(read), _chosen(planning)
    chosen = chosen | in_loop
    chosen.pop("corridor", None)
    timed = read.durations is not None or read.total_time is not None
    chosen = _beside_those_of(read, chosen, planning, timed)
    searched = bool(chosen.keys() & {"total_time", "time_weight", "limits"})
    if read.bounds is None:
        planning.refuse_idle(altitudes=read.room is None and len(read.waypoints[0]) == 3)
    read = _with_corridor(_closed(read, file, searched) if closed or read.closed else read, planning)
    heights = ground.walls(read, file)
    if "split" in chosen and not searched and read.total_time is None and not read.limits:
        raise InputError(f"--split {chosen['split']} says how the legs share a time: give --time or limits with it")
    limited = "limits" in chosen or read.bounds is None
    request = _timed(read, chosen | {"on_interrupt": "return"}, searched).within(*heights)
    walls, timed = request.corridor, request.durations is not None or request.total_time is not None
    if limited and not (timed or heights or read.room or read.boxes):
        request = request.within(*planning.altitudes(read.waypoints))

    def planned(progress: bool | None = None, **changes: Any) -> minsnap.Trajectory:
        return minsnap.plan(**request.changed(**changes).arguments(), progress=progress)

    path = planned(on_terminal(destination.json))
    figures = standing(lambda: planned(closed=False), path) if request.closed and request.durations is None else {}
    how: dict[str, Any] = {"limits": request.limits, "further": figures, "avoid": request.avoid, "gates": read.gates}
    how |= {"tolerance": request.waypoint_tolerance} | known | in_loop
    how["note"] = "; ".join(filter(None, (known.get("note"), _beside_lines(file, path, walls, request.waypoints))))
    destination.deliver(path, walls, request.waypoints, **how)


def _in_frame(request: FileRequest, file: Path, frame: str | None) -> FileRequest:
    """Return a request in ENU whose file has other axes; one below ground throughout has to say which."""
    from minsnap.files import in_enu, is_mission

    heights = [point[2] for point in request.waypoints if len(point) == 3]
    if frame is None and heights and max(heights) <= 0.0 and min(heights) < 0.0:
        below = "its origin" if is_mission(file) else "ground"
        low = f"{file} lies below {below} throughout (z from {min(heights):.4g} to {max(heights):.4g} m)"
        if is_mission(file):
            raise InputError(
                f"{low}: both altitudes are above the sea; for heights above the ground, give --origin LAT LON 0"
            )
        raise FrameError(f"{low} and does not say its frame: give --from-frame ned, or enu")
    if frame is not None and is_mission(file):
        raise InputError(f"{file} is a mission by latitude and longitude: leave out --from-frame {frame}")
    return request if frame is None else in_enu(request, frame)


def _beside_lines(file: Path, path: minsnap.Trajectory, walls: Any, waypoints: Any) -> str:
    """Return a note on how far a mission's path leaves the lines between its waypoints, if no walls hold it there."""
    from minsnap.files import is_mission

    if walls or not is_mission(file):
        return ""
    points = path.control_points.reshape(-1, path.dim)
    wide = 1.0 + 2.0 * float((points.max(axis=0) - points.min(axis=0)).max())
    margin = minsnap.certify(path, waypoints, corridor=wide).corridor_margin
    if margin is None or wide - margin < BESIDE_LINES:
        return ""
    beside = f"the path leaves the lines between waypoints by up to {wide - margin:.2f} m"
    return f"{beside}: --corridor 0.5 keeps it within half a metre"


def _of_mission(file: Path, origin: options.Triple | None) -> dict[str, Any]:
    """Return the origin of the waypoints of a mission, and a note on what they leave out; nothing of another file."""
    from minsnap.files import is_mission, read_mission

    if not is_mission(file):
        return {} if origin is None else {"origin": origin}
    mission = read_mission(file, origin)
    return {"origin": tuple(mission.home.tolist()), "note": mission.left_out}


def _without_speeds(file: Path, origin: options.Triple | None, known: dict[str, Any]) -> dict[str, Any]:
    """Return the note on a mission, with one on the speeds of its legs, which no course has."""
    from minsnap.files import is_mission, read_mission

    if not is_mission(file) or read_mission(file, origin).speeds is None:
        return {}
    return {
        "note": "; ".join(filter(None, (known.get("note"), "a course has one speed: those of the legs are left out")))
    }


def _course(
    file: Path, closed: bool, laps: int | None, takeoff: bool, land: bool, origin: options.Triple | None
) -> minsnap.Course | None:
    """Return the course: that of a file, or waypoints with laps, take-off or landing; None without these."""
    from minsnap.basics.storage.text import load_yaml
    from minsnap.files import is_request
    from minsnap.paths.missions import is_course, read_course

    wanted = laps is not None or takeoff or land
    described = is_course(file, wanted)
    if not (described or wanted):
        return None
    if not described and file.suffix.lower() in (".yaml", ".yml") and is_request(load_yaml(file)):
        raise InputError(f"{file} says how to plan its waypoints: --laps, --takeoff and --land are for a course")
    course = read_course(file) if described else course_of(file, origin)
    named = options.present(closed=closed or None, laps=laps, takeoff=takeoff or None, land=land or None)
    return course.changed(**named)


def _deliver_again(file: Path, planning: Planning, destination: Destination, closed: bool, **place: Any) -> None:
    from minsnap.files.formats import read_polynomials

    if planning != Planning() or closed:
        raise InputError(f"{file} is a plan already: leave out the options of planning, or plan through its waypoints")
    stored = read_polynomials(file)
    how = {name: getattr(stored, name) for name in ("limits", "gates", "avoid", "tolerance", "pins", "stops")}
    how["note"] = "; ".join(stored.certified()[1])
    destination.deliver(stored.trajectory, stored.corridor, stored.places, **how, **place)


def _closed(request: FileRequest, file: Path, searched: bool) -> FileRequest:
    """Return the request of a lap, whose last leg must have a duration if the others have theirs."""
    lap = request.as_lap()
    if lap.durations is None and request.durations is not None and not searched:
        raise InputError(
            f"{file} has no duration for the leg that closes the lap: append the first waypoint and give one, or --time"
        )
    return lap


def _with_corridor(request: FileRequest, planning: Planning) -> FileRequest:
    """Return the request with the half-widths of the option in place of its own."""
    widths = planning.walls
    if widths is None:
        return request
    return replace(request, corridor=tuple(widths) if isinstance(widths, list) else (widths,) * max(request.legs, 1))


def _chosen(planning: Planning) -> dict[str, Any]:
    """Return the arguments of the options that differ from their defaults."""
    defaults = Planning().arguments()
    return {name: value for name, value in planning.arguments().items() if value != defaults.get(name)}


def _beside_those_of(
    said: FileRequest | minsnap.Course, chosen: dict[str, Any], planning: Planning, timed: bool = False
) -> dict[str, Any]:
    """Return the chosen arguments, with the limits of a file that no option names, and with its obstacles."""
    own: dict[str, Any] = {}
    if "limits" in chosen:
        own["limits"] = planning.limits_over(said.bounds, timed)
    if "avoid" in chosen:
        own["avoid"] = [*said.obstacles, *chosen["avoid"]]
    return chosen | own


def _timed(request: FileRequest, chosen: dict[str, Any], searched: bool) -> PlanRequest:
    """Return the question with the options in place of the file's own, and ordinary limits where nothing times it.

    Times are in place of times, and limits of limits, alone or with the times: its own limits hold for other times.
    """
    own: dict[str, Any] = {"durations": None, "total_time": None, "time_weight": None} if searched else {}
    own |= {"time_limit": None} if chosen.get("total_time") is not None else {}
    own |= {"split": "optimal"} if chosen.get("time_weight") is not None else {}
    timed = request if searched else request.within_ordinary()
    return timed.request().changed(**own | chosen)


def course_of(file: Path, origin: options.Triple | None = None) -> minsnap.Course:
    """Return the waypoints of a file as a course, those of a mission about an origin."""
    points = minsnap.read_waypoints(file, origin)
    if points.durations is not None or points.yaw is not None:
        what = "durations" if points.durations is not None else "a yaw for each waypoint"
        raise InputError(f"{file} has {what}: --laps, --takeoff and --land go by limits and one --yaw; leave them out")
    return minsnap.Course(tuple(minsnap.Stop(point) for point in points.points), name=name_as_text(file.stem))


def fly_course(
    course: minsnap.Course, planning: Planning, destination: Destination, note: str = "", **how: Any
) -> None:
    """Plan a course and deliver it, with a note and what else is known of it."""
    from minsnap.planning import plan_arguments

    if planning.no_limit == "altitude":
        planning.refuse_idle()
    in_loop, named = planning.in_loop(course), _chosen(planning)
    refused = [name for name in ("total_time", "time_weight", "split") if name in named]
    if refused:
        option = "--" + {"total_time": "time"}.get(refused[0], refused[0]).replace("_", "-")
        raise InputError(f"{option} is for a plan through waypoints: a course is flown as fast as its limits allow")
    named = _beside_those_of(course, named, planning)
    arguments = plan_arguments({"yaw": course.yaw} | named | in_loop | destination.search)
    own = {"limits": "limits", "yaw": "yaw", "tube": "corridor"}
    chosen = {name: arguments.pop(argument, None) for name, argument in own.items()}
    flown = course.changed(**options.present(**chosen))
    began = perf_counter()
    mission = minsnap.plan_mission(flown, **arguments)
    took = 1e3 * (perf_counter() - began)
    parts = [{"name": part.name, "start": part.start, "duration": part.duration} for part in mission.parts]
    figures: dict[str, Any] = {"parts": parts, "interrupted": "yes" if mission.interrupted else None}
    figures |= {} if mission.interrupted or in_loop else _standing(flown, arguments, mission, took)
    figures |= _in_loop(mission, **in_loop)
    how |= {"limits": mission.limits, "further": figures, "gates": mission.gates, "avoid": flown.obstacles}
    how |= {"pins": mission.pins, "stops": mission.passed_stops}
    how["note"] = "; ".join(filter(None, (*mission.notes, note, _other_vehicle(mission, destination))))
    how["draw"] = lambda **view: minsnap.plot.plot_mission(mission, **view)
    how["sensitivities"] = lambda: mission.sensitivities
    destination.deliver(mission.trajectory, mission.corridor or None, **how)


def _standing(course: minsnap.Course, arguments: dict[str, Any], mission: Mission, took: float) -> dict[str, Any]:
    """Return how long flying laps, all of them, last from a standing start, where that is found quickly."""
    if not course.closed or course.laps * took > QUICK:
        return {}
    quiet = {name: value for name, value in arguments.items() if name not in ("search", "progress")}
    laps = course.changed(closed=False, stops=(*course.stops, *course.stops[:1]))
    return standing(lambda: minsnap.plan_mission(laps, **quiet).trajectory, mission.trajectory)


def _in_loop(mission: Mission, tracking: Loop | None = None, wind: float = 0.0) -> dict[str, Any]:
    """Return what the summary says of the vehicle in its loop, if one is given."""
    if tracking is None:
        return {}
    tube = mission.in_loop(tracking, wind)
    return {"tube": tube.error, "strongest_wind": tube.strongest, "wind": wind}


def _other_vehicle(mission: Mission, destination: Destination) -> str:
    """Return a note where the feed-forward is of another vehicle than the one that the course is flown by, else ""."""
    from minsnap.limits import VehicleLimits
    from minsnap.vehicle import description_of

    if destination.vehicle is None or not isinstance(mission.limits, VehicleLimits):
        return ""
    course, offset = mission.limits.vehicle, vehicle_of(destination.vehicle)
    if description_of(course) == description_of(offset):
        return ""
    return f"the course is planned for {course.name}, and the feed-forward offsets the drag of {offset.name}"


POINT_OPTIONS = ("--start", "--goal", "--origin")


class PointCommand(TyperCommand):
    """A command whose options ``--start``, ``--goal`` and ``--origin`` take two or three numbers each."""

    def parse_args(self, context: Any, args: list[str]) -> list[str]:
        """Join the numbers after such an option to one text before the command reads them."""
        return super().parse_args(context, joined_points(args))


def joined_points(arguments: list[str]) -> list[str]:
    """Return the arguments with ``--start 1 -2`` written as ``--start=1,-2``."""
    joined: list[str] = []
    rest = list(arguments)
    while rest:
        word = rest.pop(0)
        numbers = list(takewhile(_is_number, rest)) if word in POINT_OPTIONS else []
        joined.append(f"{word}={','.join(numbers)}" if numbers else word)
        del rest[: len(numbers)]
    return joined


def parse_point(option: str, text: str) -> tuple[float, ...]:
    """Return the coordinates of a point, two or three [m].

    Raises
    ------
    InputError
        If the text is not as many numbers.
    """
    words = text.split(",")
    if len(words) not in (2, 3) or not all(map(_is_number, words)):
        raise InputError(f"{option} is {text!r}: give X Y or X Y Z [m]")
    return tuple(map(float, words))


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True


@dataclass(frozen=True)
class MapOptions:
    """How a map is read."""

    clearance: Annotated[float, "M", "Least distance to all that is occupied [m]."] = 0.3
    resolution: Annotated[float | None, "M", "Side of a cell of an array or a cloud [m]."] = None
    origin: Annotated[str | None, "X,Y[,Z]", "Corner of an array [m]; by default zero."] = None
    threshold: Annotated[float | None, "P", "Probability from which a cell is occupied."] = None
    unknown: Annotated[str, "Unknown cells are occupied or free."] = "occupied"
    altitudes: Annotated[tuple[float, float] | None, "LOW HIGH", "Cells to fly through [m]."] = None
    transpose: Annotated[bool, "The first axis of the array is y."] = False

    def arguments(self) -> dict[str, Any]:
        """Return the arguments of a route that the options name."""
        chosen = options.present(threshold=self.threshold, altitudes=self.altitudes, resolution=self.resolution)
        corner = None if self.origin is None else options.parse_numbers("--origin", self.origin)
        return chosen | options.present(origin=corner) | {"clearance": self.clearance, "unknown": self.unknown}


@command(cls=PointCommand)
def route(
    reading: MapOptions,
    timing: TimingOptions,
    destination: Destination,
    map_file: Annotated[Path, "MAP", "map_server YAML, OctoMap, .npy (axes x, y[, z]), or a cloud."],
    *,
    start: Annotated[str, "X Y [Z]", "Where to fly from [m]."],
    goal: Annotated[str, "X Y [Z]", "Where to fly to [m]."],
    fence: Annotated[Path | None, "FILE", "Geofence of a QGroundControl plan (.plan), in metres from its home."] = None,
    studio: Annotated[bool, "Show map, polytopes and flight in the browser, until Ctrl-C."] = False,
) -> None:
    """Plan from a start to a goal through the free cells of a map.

    The path keeps a distance from all occupied cells. Without --time and limits, the time is the shortest found within
    3 m/s, 6 m/s^2 and 30 m/s^3. Exit status 1 if no way is wide enough.
    """
    from minsnap.paths.routes import files_of, plan_through
    from minsnap.planning import plan_arguments

    for written in (destination.output, destination.plot):
        refuse_source(written, *files_of(map_file))
    timing.refuse_idle()
    ends = parse_point("--start", start), parse_point("--goal", goal)
    arguments = reading.arguments() | timing.arguments() | destination.search
    arguments["avoid"] = options.avoided(None, fence)
    planned = plan_through(_source(map_file, reading.transpose), *ends, **plan_arguments(arguments))
    figures = nearest_place(planned.trajectory, planned.distance, planned.approach.instant, None)
    figures["altitude"] = 0.0 if planned.dim == 2 else None
    how: dict[str, Any] = {"corridor": planned.corridor, "limits": planned.limits, "further": figures}
    how["draw"] = lambda **view: minsnap.plot.plot_route(planned, title=name_as_text(map_file.name), **view)
    destination.deliver(planned.trajectory, **how)
    if studio:
        from minsnap.studio import show

        show(planned, block=True)


def _source(file: Path, transpose: bool) -> Any:
    if not transpose:
        return file
    if file.suffix.lower() != ".npy":
        raise InputError(f"--transpose is for arrays: {file} says which axis is which")
    from minsnap.paths.routes import read_array

    cells = read_array(file)
    return cells.swapaxes(0, 1) if cells.ndim > 1 else cells

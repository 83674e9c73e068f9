"""The command that plans through the waypoints of a file."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from minsnap.cli.command import command
from minsnap.cli.missions import course_of, fly_course
from minsnap.cli.output import Destination, on_terminal
from minsnap.cli.planning import Planning, altitudes_of, gain, standing
from minsnap.errors import FrameError, InputError

if TYPE_CHECKING:
    from minsnap.paths.missions.course import Course
    from minsnap.planning.request import PlanRequest
    from minsnap.trajectory.trajectory import Trajectory


@command()
def plan(
    planning: Planning,
    destination: Destination,
    file: Annotated[Path, "FILE", "x,y,z[,yaw][,duration] in CSV; YAML; .plan; a plan."],
    *,
    closed: Annotated[
        bool, "A closed lap without a stop; appends the first waypoint where the last is another."
    ] = False,
    laps: Annotated[int | None, "How often the course is flown."] = None,
    from_frame: Annotated[str | None, "Axes of the waypoints: by default enu, or ned, …"] = None,
    takeoff: Annotated[bool, "Climb from the ground below the first waypoint."] = False,
    land: Annotated[bool, "Descend to the ground below the last waypoint."] = False,
) -> None:
    """Plan through the waypoints of a file; at 1 m/s on average unless times or limits are given.

    A course in YAML may have gates, balls, holds, laps, take-off and landing; it is flown as fast as its limits allow,
    3 m/s and 6 m/s^2 unless it says others.

    A YAML file may also say how: total time, limits, corridor and more, as the studio saves it; options come first. A
    plan that was written as .json or .yaml is taken as it is, with its corridor and limits, and certified again.
    """
    from minsnap.basics.storage.atomic import refuse_source
    from minsnap.files.formats.polynomials import is_polynomials
    from minsnap.files.request_yaml import read_request
    from minsnap.planning.planner import plan as plan_path

    refuse_source(destination.output, file)
    if file.suffix.lower() in (".json", ".yaml", ".yml") and is_polynomials(file):
        _deliver_again(file, planning, destination, closed or bool(laps) or takeoff or land or from_frame is not None)
        return
    course = _course(file, closed, laps, takeoff, land)
    if course is not None:
        if from_frame not in (None, "enu"):
            raise InputError(f"{file} is flown as a course, which is in ENU: leave out --from-frame {from_frame}")
        fly_course(course, planning, destination)
        return
    read, chosen = _in_frame(read_request(file), file, from_frame), _chosen(planning)
    searched = bool(chosen.keys() & {"total_time", "time_weight", "limits"})
    request = _with_corridor(_closed(read, file, searched) if closed else read, planning)
    if "split" in chosen and not searched and request.total_time is None and not request.limits:
        raise InputError(f"--split {chosen['split']} says how the legs share a time: give --time or limits with it")
    request, walls = _timed(request, chosen | {"on_interrupt": "return"}, searched), request.walls
    if request.room is None and "limits" in chosen and not request.boxes:
        request = replace(request, **altitudes_of(planning, request.waypoints))

    def planned(progress: bool | None = None, **changes: Any) -> Trajectory:
        return plan_path(**request.changed(**changes).arguments(), progress=progress)

    path = planned(on_terminal(destination.json))
    figures: dict[str, Any] = {}
    if path.report is not None and not path.report.interrupted and planning.pieces is None and _fastest(request):
        figures = gain(planned, path, path.report.milliseconds)
    if request.closed and searched:
        figures |= standing(lambda: planned(closed=False), path)
    how: dict[str, Any] = {"limits": request.bounds, "origin": _home(file), "further": figures}
    how |= {"avoid": request.obstacles, "gates": request.gates}
    points = path(path.leg_breaks) if request.openings else request.waypoints
    destination.deliver(path, walls, points, **how)


def _in_frame(request: PlanRequest, file: Path, frame: str | None) -> PlanRequest:
    """Return a request in ENU whose file has other axes; one below ground throughout has to say which."""
    from minsnap.files.request_yaml import in_enu

    heights = [point[2] for point in request.waypoints if len(point) == 3]
    if frame is None and heights and max(heights) <= 0.0 and min(heights) < 0.0:
        raise FrameError(
            f"{file} lies below ground throughout (z from {min(heights):g} to {max(heights):g} m) and does not say its "
            "frame: give --from-frame ned, or enu"
        )
    if frame is not None and file.suffix.lower() == ".plan":
        raise InputError(f"{file} is a mission by latitude and longitude: leave out --from-frame {frame}")
    return request if frame is None else in_enu(request, frame)


def _home(file: Path) -> tuple[float, ...] | None:
    """Return latitude, longitude [degrees] and altitude [m] of a mission's home, the origin of its waypoints."""
    if file.suffix.lower() != ".plan":
        return None
    from minsnap.files.waypoints import read_mission

    return tuple(read_mission(file).home.tolist())


def _course(file: Path, closed: bool, laps: int | None, takeoff: bool, land: bool) -> Course | None:
    """Return the course: that of a file, or waypoints with laps, take-off or landing; None without these."""
    from minsnap.files.request_yaml import is_request
    from minsnap.paths.missions.course_file import is_course, read_course

    wanted = laps is not None or takeoff or land
    described = file.suffix.lower() in (".yaml", ".yml") and not is_request(file) and is_course(file, wanted)
    if not (described or wanted):
        return None
    course = read_course(file) if described else course_of(file)
    options = {"closed": closed, "laps": laps, "takeoff": takeoff, "land": land}
    return course.changed(
        **{name: value for name, value in options.items() if value is not None and value is not False}
    )


def _deliver_again(file: Path, planning: Planning, destination: Destination, closed: bool) -> None:
    from minsnap.files.formats.polynomials import read_polynomials

    if planning != Planning() or closed:
        raise InputError(f"{file} is a plan already: leave out the options of planning, or plan through its waypoints")
    stored = read_polynomials(file)
    problems = stored.certified()[1]
    note = {"note": "; ".join(problems)} if problems else {}
    how: dict[str, Any] = {"limits": stored.limits, "gates": stored.gates, "further": note}
    destination.deliver(stored.trajectory, stored.corridor, stored.waypoints, **how)


def _closed(request: PlanRequest, file: Path, searched: bool) -> PlanRequest:
    """Return the request of a lap, whose last leg must have a duration if the others have theirs."""
    lap = request.as_lap()
    if lap.durations is None and request.durations is not None and not searched:
        raise InputError(
            f"{file} has no duration for the leg that closes the lap: append the first waypoint and give one, or --time"
        )
    return lap


def _with_corridor(request: PlanRequest, planning: Planning) -> PlanRequest:
    """Return the request with the half-widths of the option in place of its own."""
    widths = planning.walls
    if widths is None:
        return request
    return replace(request, corridor=tuple(widths) if isinstance(widths, list) else (widths,) * max(request.legs, 1))


def _chosen(planning: Planning) -> dict[str, Any]:
    """Return the arguments of the options that differ from their defaults, half-widths left out."""
    defaults = Planning().arguments()
    values = {name: value for name, value in planning.arguments().items() if value != defaults.get(name)}
    values.pop("corridor", None)
    return values


def _fastest(request: PlanRequest) -> bool:
    """Whether the shortest time within limits is searched for as usual, with one polynomial per leg."""
    from minsnap.time_allocation.search_options import Search

    timed = request.durations is not None or request.total_time is not None or request.continuity is not None
    usual = request.pieces == 1 and request.search == Search(on_interrupt="return")
    return usual and not timed and request.bounds is not None


def _timed(request: PlanRequest, chosen: dict[str, Any], searched: bool) -> PlanRequest:
    """Return the request with the options in place of its own, and durations from the average speed without any."""
    import numpy as np

    from minsnap.paths.shapes.straight import leg_durations

    own = {"durations": None, "total_time": None, "limits": (), "rotors": None} if searched else {}
    timed = request.changed(**own | chosen)
    if timed.durations is not None or timed.total_time is not None or (timed.search and timed.search.time_weight):
        return timed
    limits = timed.bounds
    if limits is None:
        return replace(timed, durations=leg_durations(np.array(timed.waypoints)))
    if list(limits.given()) != ["yaw_rate"]:
        return timed
    times = request.durations or leg_durations(np.array(request.waypoints))  # a yaw rate alone limits no time
    return replace(timed, total_time=request.total_time or float(np.sum(times)))

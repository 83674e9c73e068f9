"""Courses on the command line: their options, their summary and their figure."""

from __future__ import annotations

from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Any

from minsnap.cli.output import Destination
from minsnap.cli.planning import QUICK, Planning, gain, standing
from minsnap.cli.vehicles import vehicle_of
from minsnap.errors import InputError

if TYPE_CHECKING:
    from minsnap.paths.missions.course import Course
    from minsnap.paths.missions.mission import Mission
    from minsnap.trajectory.trajectory import Trajectory


def course_of(file: Path) -> Course:
    """Return the waypoints of a file as a course."""
    from minsnap.files.waypoints import read_waypoints
    from minsnap.paths.missions.course import Course, Stop

    points = read_waypoints(file)
    if points.durations is not None or points.yaw is not None:
        what = "durations" if points.durations is not None else "a yaw for each waypoint"
        raise InputError(f"{file} has {what}: --laps, --takeoff and --land go by limits and one --yaw; leave them out")
    return Course(tuple(Stop(point) for point in points.points), name=file.stem)


def fly_course(course: Course, planning: Planning, destination: Destination) -> None:
    """Plan a course and deliver it."""
    from minsnap.paths.missions.mission import plan_mission
    from minsnap.planning.request import plan_arguments

    named = planning.arguments()
    refused = [name for name in ("total_time", "time_weight", "split") if name in named]
    if refused:
        option = "--" + {"total_time": "time"}.get(refused[0], refused[0]).replace("_", "-")
        raise InputError(f"{option} is for a plan through waypoints: a course is flown as fast as its limits allow")
    arguments = plan_arguments({"yaw": course.yaw} | named | destination.search)
    chosen = {
        "limits": arguments.pop("limits", None),
        "yaw": arguments.pop("yaw", None),
        "tube": arguments.pop("corridor", None),
    }
    flown = course.changed(**{name: value for name, value in chosen.items() if value is not None})
    began = perf_counter()
    mission = plan_mission(flown, **arguments)
    took = 1e3 * (perf_counter() - began)
    parts = [{"name": part.name, "start": part.start, "duration": part.duration} for part in mission.parts]
    figures: dict[str, Any] = {"parts": parts} | _other_vehicle(mission, destination)
    figures |= _beside(flown, arguments, mission, took)
    how: dict[str, Any] = {"limits": mission.limits, "further": figures, "gates": mission.gates}
    destination.deliver(mission.trajectory, mission.corridor or None, **how, draw=lambda: _figure(mission, destination))


def _beside(course: Course, arguments: dict[str, Any], mission: Mission, took: float) -> dict[str, Any]:
    """Return how long the course would last with more pieces, and a flying lap from a standing start."""
    from minsnap.paths.missions.mission import plan_mission
    from minsnap.planning.request import plan_arguments

    quiet = {name: value for name, value in arguments.items() if name not in ("search", "progress")}
    lap = course.changed(closed=False, laps=1, stops=(*course.stops, *course.stops[:1]))

    def again(**changes: Any) -> Trajectory:
        return plan_mission(course, **quiet, **plan_arguments(changes)).trajectory

    shorter = {} if quiet.keys() & {"pieces", "continuity"} else gain(again, mission.trajectory, took)
    if not course.closed or took > QUICK:
        return shorter
    return shorter | standing(lambda: plan_mission(lap, **quiet).trajectory, mission.trajectory)


def _other_vehicle(mission: Mission, destination: Destination) -> dict[str, str]:
    """Return a note where the feed-forward is of another vehicle than the one that the course is flown by."""
    from minsnap.limits.limits import VehicleLimits
    from minsnap.vehicle.yaml import description_of

    if destination.vehicle is None or not isinstance(mission.limits, VehicleLimits):
        return {}
    course, offset = mission.limits.vehicle, vehicle_of(destination.vehicle)
    if description_of(course) == description_of(offset):
        return {}
    return {"note": f"the course is planned for {course.name}, and the feed-forward offsets the drag of {offset.name}"}


def _figure(mission: Mission, wanted: Destination) -> Any:
    from minsnap.plot.overviews import plot_mission

    return plot_mission(mission, view=wanted.view or "xy", colour_by=wanted.colour_by)

"""The command that plans through the waypoints of a file."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from minsnap.cli import options
from minsnap.cli.app import app
from minsnap.cli.output import Destination, delivers

if TYPE_CHECKING:
    from minsnap.files.waypoints import Waypoints


@app.command()
@delivers
def plan(
    destination: Destination,
    file: Annotated[Path, typer.Argument(metavar="FILE", help="Waypoints: x,y,z[,yaw][,duration] in CSV, or YAML.")],
    corridor: options.Corridor = None,
    closed: Annotated[bool, typer.Option("--closed", help="End in the state it starts with, at speed.")] = False,
    time: options.Time = None,
    split: options.Split = None,
    max_speed: options.MaxSpeed = None,
    max_acceleration: options.MaxAcceleration = None,
    max_jerk: options.MaxJerk = None,
    yaw: options.Yaw = None,
    degree: options.Degree = 7,
    continuity: options.Continuity = None,
    solver: options.Solver = "auto",
) -> None:
    """Plan through the waypoints of a file; at 1 m/s on average unless times or limits are given."""
    from minsnap.files.waypoints import read_waypoints

    found = read_waypoints(file)
    limits = options.build_limits(max_speed, max_acceleration, max_jerk)
    walls = options.parse_corridor(corridor)
    asked = options.given(
        corridor=walls, limits=limits, yaw=_yaw(options.parse_yaw(yaw), found), split=split, continuity=continuity
    )
    times = {"total_time": time} if time is not None else {} if limits is not None else _times(found)
    from minsnap.planner import plan as plan_path

    path = plan_path(found.points, closed=closed, degree=degree, solver=solver, **times, **asked)
    destination.deliver(path, walls, found.points, limits=limits)


def _yaw(given: float | str | None, found: Waypoints) -> Any:
    return found.yaw if given is None else given


def _times(found: Waypoints) -> dict[str, Any]:
    """Return the durations of the file, or those of an average speed."""
    from minsnap.shapes.straight import leg_durations

    return {"durations": leg_durations(found.points) if found.durations is None else found.durations}

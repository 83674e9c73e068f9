"""Commands for shapes: rect, line, circle, helix, eight."""

from __future__ import annotations

from math import radians
from typing import Annotated, Any

import minsnap
from minsnap.cli import options
from minsnap.cli.app import ARGUMENTS, command
from minsnap.cli.output import Destination
from minsnap.cli.planning import Climbing, RectanglePlanning, TimingOptions, Turning
from minsnap.errors import TimingError

StartAngle = Annotated[float, "DEG", "Where it begins [degrees]."]


@command()
def rect(
    planning: RectanglePlanning,
    destination: Destination,
    *,
    width: Annotated[float, "M", "Side along x [m]."] = 6.0,
    length: Annotated[float, "M", "Side along y [m]."] = 4.0,
    altitude: options.Altitude = 1.5,
    laps: Annotated[int, "Number of laps, without a stop between them."] = 1,
    start_corner: Annotated[int, "0 to 3, from the least x and y."] = 0,
    clockwise: options.Clockwise = False,
    center: options.Center = (0.0, 0.0),
) -> None:
    """Plan a rectangle from rest to rest, inside a corridor.

    The corridor is around the sides. Without --time and limits, the time is the shortest found within 3 m/s, 6
    m/s^2 and 30 m/s^3.
    """
    from minsnap.planning import plan_arguments

    planning.refuse_idle()
    place: dict[str, Any] = {"altitude": altitude, "start_corner": start_corner, "center": center}
    in_loop = planning.in_loop()
    arguments = planning.arguments() | {"corridor": planning.walls} | in_loop | destination.search
    path = minsnap.rectangle(width, length, **place, laps=laps, clockwise=clockwise, **plan_arguments(arguments))
    avoided = options.avoided(planning.avoid, planning.fence) or ()
    destination.deliver(path, planning.walls, limits=planning.held, avoid=avoided, **in_loop)


@command()
def line(
    timing: TimingOptions,
    destination: Destination,
    *,
    start: Annotated[options.Triple, "X Y Z", "First end [m]."] = (0.0, 1.0, 1.5),
    goal: Annotated[options.Triple, "X Y Z", "Other end [m]."] = (7.0, 1.0, 1.5),
    constant_speed: Annotated[bool, "Equal steps from end to end."] = False,
) -> None:
    """Plan a straight line, from rest to rest or at constant speed.

    Without --time and limits, the time is the shortest found within 3 m/s, 6 m/s^2 and 30 m/s^3.
    """
    from minsnap.planning import plan_arguments

    timing.refuse_idle(altitudes=True)
    arguments = timing.arguments()
    if constant_speed and (given := sorted(arguments.keys() - {"total_time", "yaw"})):
        unused = ", ".join(ARGUMENTS[name] for name in given)
        raise TimingError(f"a line at constant speed has nothing to plan: leave out {unused}")
    if not constant_speed:
        arguments |= destination.search | options.present(corridor=timing.altitudes([start, goal]) or None)
    path = minsnap.line(start, goal, constant_speed=constant_speed, **plan_arguments(arguments))
    destination.deliver(path, limits=None if constant_speed else timing.held)


@command()
def circle(
    turning: Turning,
    destination: Destination,
    *,
    radius: Annotated[float, "M", "Radius [m]."] = 3.0,
    start_angle: StartAngle = 0.0,
) -> None:
    """Trace a circle, from rest to rest unless the ramp is 0."""
    from minsnap.paths import circle as trace

    destination.deliver(trace(radius, start_angle=radians(start_angle), **turning.arguments()), limits=turning.limits)


@command()
def helix(
    turning: Climbing,
    destination: Destination,
    *,
    radius: Annotated[float, "M", "Radius [m]."] = 1.0,
    pitch: Annotated[float, "M", "Climb per lap [m]."] = 0.5,
    start_angle: StartAngle = 0.0,
) -> None:
    """Trace a helix upwards, or downwards with a negative pitch."""
    destination.deliver(
        minsnap.helix(radius, pitch, start_angle=radians(start_angle), **turning.arguments()), limits=turning.limits
    )


@command()
def eight(
    turning: Turning,
    destination: Destination,
    *,
    length: Annotated[float, "M", "Extent along x [m]."] = 6.0,
    width: Annotated[float, "M", "Extent along y [m]."] = 3.0,
) -> None:
    """Trace a figure of eight (a lemniscate) from its crossing."""
    destination.deliver(minsnap.lemniscate(length, width, **turning.arguments()), limits=turning.limits)

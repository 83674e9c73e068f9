"""Commands for shapes: rect, circle, line, helix, eight."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from minsnap.cli import options
from minsnap.cli.app import app
from minsnap.cli.output import Destination, delivers

Center = Annotated[tuple[float, float], typer.Option("--center", metavar="X Y", help="Centre [m].")]
Altitude = Annotated[float, typer.Option("--altitude", metavar="M", help="z [m].")]
Clockwise = Annotated[bool, typer.Option("--clockwise", help="Turn clockwise seen from above.")]
Period = Annotated[float | None, typer.Option("--period", metavar="S", help="Seconds a lap at full speed; 6 [s].")]
Speed = Annotated[float | None, typer.Option("--speed", metavar="M/S", help="Full speed, instead of the period [m/s].")]
Ramp = Annotated[
    float | None, typer.Option("--ramp", metavar="RAD", help="Angle of spin-up and spin-down; pi/2. 0 starts at speed.")
]
Laps = Annotated[float, typer.Option("--laps", help="Turns, spin-up and spin-down included.")]
StartAngle = Annotated[float, typer.Option("--start-angle", metavar="RAD", help="Where it begins.")]
Point = tuple[float, float, float]


@app.command()
@delivers
def rect(
    destination: Destination,
    width: Annotated[float, typer.Option("--width", metavar="M", help="Side along x [m].")] = 6.0,
    length: Annotated[float, typer.Option("--length", metavar="M", help="Side along y [m].")] = 4.0,
    altitude: Altitude = 1.5,
    corridor: options.Corridor = "0.3",
    no_corridor: Annotated[bool, typer.Option("--no-corridor", help="Leave the sides free.")] = False,
    laps: Annotated[int, typer.Option("--laps", help="Times round.")] = 1,
    start_corner: Annotated[int, typer.Option("--start-corner", help="0 to 3, from the least x and y.")] = 0,
    clockwise: Clockwise = False,
    center: Center = (0.0, 0.0),
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
    """Plan a rectangle, corner by corner from rest to rest, inside a corridor around its sides."""
    walls = None if no_corridor else options.parse_corridor(corridor)
    limits = options.build_limits(max_speed, max_acceleration, max_jerk)
    asked = options.given(
        total_time=time, limits=limits, yaw=options.parse_yaw(yaw), split=split, continuity=continuity
    )
    from minsnap.shapes import rectangle

    path = rectangle(
        width,
        length,
        altitude=altitude,
        corridor=walls,
        laps=laps,
        start_corner=start_corner,
        clockwise=clockwise,
        center=center,
        degree=degree,
        solver=solver,
        **asked,
    )
    destination.deliver(path, walls, path(path.leg_breaks), limits=limits)


@app.command()
@delivers
def line(
    destination: Destination,
    start: Annotated[Point, typer.Option("--start", metavar="X Y Z", help="First end [m].")] = (0.0, 1.0, 1.5),
    goal: Annotated[Point, typer.Option("--goal", metavar="X Y Z", help="Other end [m].")] = (7.0, 1.0, 1.5),
    time: options.Time = None,
    max_speed: options.MaxSpeed = None,
    max_acceleration: options.MaxAcceleration = None,
    max_jerk: options.MaxJerk = None,
    constant_speed: Annotated[bool, typer.Option("--constant-speed", help="Equal steps from end to end.")] = False,
    yaw: options.Yaw = None,
) -> None:
    """Plan a straight line, from rest to rest or at constant speed."""
    limits = options.build_limits(max_speed, max_acceleration, max_jerk)
    asked = options.given(total_time=time, limits=limits, yaw=options.parse_yaw(yaw))
    from minsnap.shapes import line as plan_line

    destination.deliver(plan_line(start, goal, constant_speed=constant_speed, **asked), limits=limits)


@app.command()
@delivers
def circle(
    destination: Destination,
    radius: Annotated[float, typer.Option("--radius", metavar="M", help="Radius [m].")] = 3.0,
    period: Period = None,
    speed: Speed = None,
    laps: Laps = 1.0,
    ramp: Ramp = None,
    center: Center = (0.0, 0.0),
    altitude: Altitude = 1.5,
    start_angle: StartAngle = 0.0,
    clockwise: Clockwise = False,
    yaw: options.Yaw = None,
) -> None:
    """Trace a circle, from rest to rest unless the ramp is 0."""
    measures = {
        "laps": laps,
        "center": center,
        "altitude": altitude,
        "start_angle": start_angle,
        "clockwise": clockwise,
    }
    _trace("circle", destination, measures | {"radius": radius}, period, speed, ramp, yaw)


@app.command()
@delivers
def helix(
    destination: Destination,
    radius: Annotated[float, typer.Option("--radius", metavar="M", help="Radius [m].")] = 1.0,
    pitch: Annotated[float, typer.Option("--pitch", metavar="M", help="Climb a lap [m].")] = 0.5,
    period: Period = None,
    speed: Speed = None,
    laps: Laps = 3.0,
    ramp: Ramp = None,
    center: Center = (0.0, 0.0),
    altitude: Altitude = 1.0,
    start_angle: StartAngle = 0.0,
    clockwise: Clockwise = False,
    yaw: options.Yaw = None,
) -> None:
    """Trace a helix from an altitude upwards, or downwards with a negative pitch."""
    measures = {
        "laps": laps,
        "center": center,
        "altitude": altitude,
        "start_angle": start_angle,
        "clockwise": clockwise,
    }
    _trace("helix", destination, measures | {"radius": radius, "pitch": pitch}, period, speed, ramp, yaw)


@app.command()
@delivers
def eight(
    destination: Destination,
    length: Annotated[float, typer.Option("--length", metavar="M", help="Extent along x [m].")] = 6.0,
    width: Annotated[float, typer.Option("--width", metavar="M", help="Extent along y [m].")] = 3.0,
    period: Period = None,
    speed: Speed = None,
    laps: Laps = 1.0,
    ramp: Ramp = None,
    center: Center = (0.0, 0.0),
    altitude: Altitude = 1.5,
    clockwise: Clockwise = False,
    yaw: options.Yaw = None,
) -> None:
    """Trace a figure of eight (a lemniscate) from its crossing."""
    measures = {"laps": laps, "center": center, "altitude": altitude, "clockwise": clockwise}
    _trace("lemniscate", destination, measures | {"length": length, "width": width}, period, speed, ramp, yaw)


def _trace(
    shape: str,
    destination: Destination,
    measures: dict[str, Any],
    period: float | None,
    speed: float | None,
    ramp: float | None,
    yaw: str | None,
) -> None:
    from minsnap import shapes

    asked = options.given(period=period, speed=speed, ramp=ramp, yaw=options.parse_yaw(yaw))
    destination.deliver(getattr(shapes, shape)(**measures, **asked))

"""The command that flies a setpoint file."""

from __future__ import annotations

import sys
from math import inf
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from minsnap.cli import options
from minsnap.cli.command import command
from minsnap.cli.flying import FlightOptions, flight_summary, fly, fly_fleet, one_of
from minsnap.cli.options import vehicle_of
from minsnap.errors import FlightError, InputError

if TYPE_CHECKING:
    from minsnap.cli.companion import Listening


@command()
def stream(
    flying: FlightOptions,
    file: Annotated[
        Path, "FILE", "Setpoint CSV or a file of polynomials; a folder of a fleet; with --listen a course."
    ],
    *,
    connect: options.Connect,
    rate: Annotated[float | None, "HZ", "By default the file's own."] = None,
    fields: Annotated[str | None, "Fields to send, of position,velocity,acceleration,yaw,yaw_rate."] = None,
    frame: options.ReadFrame = None,
    laps: Annotated[int, "How often to fly it."] = 1,
    autopilot: Annotated[str, "auto, px4, ardupilot or generic."] = "auto",
    origin: Annotated[
        str, "file; current: start at the vehicle's x and y; current-height: at its height as well."
    ] = "file",
    max_start_distance: Annotated[
        float, "M", "Largest distance of the vehicle from the start; inf: not checked."
    ] = 1.0,
    delay: Annotated[float | None, "S", "The vehicle's delay, as fit finds it; --vehicle has one."] = None,
    on_abort: Annotated[str, "hold, land or rtl: what to do when a rule stops the flight."] = "hold",
    give_up: Annotated[float, "S", "End a hold when the vehicle is silent for so long."] = 30.0,
    system: Annotated[int | None, "The vehicle's MAVLink system id."] = None,
    signing_key: Annotated[Path | None, "FILE", "MAVLink 2 signing key: 32 bytes or 64 hex."] = None,
    wait: Annotated[float, "S", "For the vehicle's heartbeat, its position, and its arming."] = 30.0,
    drag: options.OffsetDrag = 0.0,
    vehicle: options.OffsetVehicle = None,
    lead: options.Lead = 0.0,
    log: Annotated[Path | None, "FILE", "CSV of all messages sent and received."] = None,
    listen: Annotated[bool, "Plan a course and take orders as lines of JSON from the standard input."] = False,
    room: Annotated[str | None, "X,Y,Z,X,Y,Z", "With --listen: two corners of where orders may lead."] = None,
    port: Annotated[str | None, "[HOST:]PORT", "With --listen: orders by UDP instead."] = None,
) -> int:
    """Fly a setpoint file over MAVLink, by PX4's offboard or ArduPilot's guided mode.

    The start is streamed for 2 s at least; the trigger then lets the flight go once the vehicle is in its mode; the end
    is held. Ctrl-C stops and holds until the mode is left; a second one leaves the vehicle to its own failsafe. Exit
    status 1 if the flight was refused or stopped by a rule of safety.
    """
    from minsnap.flight.mavlink.setpoints import FeedForward

    craft = None if vehicle is None else vehicle_of(vehicle)
    heard = _listening(file, flying.trigger, port, room) if listen else None
    settings = flying.settings(
        max_start_distance,
        rate=rate,
        fields=None if fields is None else [name.strip() for name in fields.split(",")],
        frame=frame,
        laps=laps,
        autopilot=one_of("--autopilot", autopilot, ("auto", "px4", "ardupilot", "generic")),
        relative=one_of("--origin", origin, ("file", "current", "current-height")) != "file",
        relative_height=origin == "current-height",
        on_abort=one_of("--on-abort", on_abort, ("hold", "land", "rtl")),
        give_up=give_up,
        wait=wait,
        log=log,
        feed_forward=FeedForward(drag, craft, lead),
        delay=delay,
        stays=listen,
        fastest=0.0 if heard is None else heard.limits.speed or 0.0,
    )
    if file.is_dir() or file.suffix.lower() == ".skyc":
        flights = fly_fleet(file, connect, settings, signing_key, flying.preflight)
        for name, one in flights.items():
            print(f"{name}: {one if isinstance(one, FlightError) else flight_summary(one).splitlines()[0]}")
        return 0 if all(not isinstance(one, FlightError) and one.completed for one in flights.values()) else 1
    source = file if heard is None else heard.flown
    report = fly(source, connect, settings, system, signing_key, flying.preflight, heard)
    print(flight_summary(report), file=sys.stderr if listen else sys.stdout)
    return 0 if report.completed else 1


def _listening(file: Path, trigger: str, port: str | None, room: str | None) -> Listening:
    """Plan the course that is flown until something else is ordered."""
    import numpy as np

    from minsnap.cli.companion import Listening
    from minsnap.corridors.boxes import Room
    from minsnap.paths.missions.course_file import read_course
    from minsnap.paths.missions.mission import plan_mission

    if file.suffix.lower() not in (".yaml", ".yml"):
        raise InputError(f"{file} is no course: --listen plans from what is flown, so give a course in YAML")
    if trigger == "enter" and port is None:
        raise InputError("--listen takes orders from the standard input: give --trigger mode or now, or --port")
    mission = plan_mission(read_course(file))
    if room is not None and room.count(",") != 5:
        raise InputError(f"--room is {room}: give two corners, six numbers with commas")
    floor = min(0.0, float(mission.trajectory.control_points[..., 2].min()))
    sides = [-inf, -inf, floor, inf, inf, inf] if room is None else options.parse_numbers("--room", room)
    return Listening(mission.trajectory, mission.limits, Room(*np.reshape(sides, (2, 3))), port)

"""The command that flies a setpoint file."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from math import inf
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from minsnap.cli import options
from minsnap.cli.command import command
from minsnap.cli.flying import FlightOptions, flight_summary, fly, fly_fleet, one_of
from minsnap.cli.options import vehicle_of
from minsnap.errors import FlightError, InputError

if TYPE_CHECKING:
    from minsnap.cli.companion import Listening
    from minsnap.flight.mavlink.stream_options import StreamOptions


@dataclass(frozen=True)
class StreamedFlight(FlightOptions):
    """The same, with what ``stream`` alone lets one choose."""

    autopilot: Annotated[str, "auto, px4, ardupilot or generic."] = "auto"
    origin: Annotated[str, "file; current: start at the vehicle's x and y; current-height: at its height as well."] = (
        "file"
    )
    max_start_distance: Annotated[float, "M", "Largest distance of the vehicle from the start; inf: not checked."] = 1.0
    on_abort: Annotated[str, "hold, land or rtl: what to do when a rule stops the flight."] = "hold"
    give_up: Annotated[float, "S", "End a hold when the vehicle is silent for so long."] = 30.0
    wait: Annotated[float, "S", "For the vehicle's heartbeat, its position, and its arming."] = 30.0
    log: Annotated[Path | None, "FILE", "CSV of all messages sent and received."] = None

    def settings(self, **others: Any) -> StreamOptions:
        """Return the options of the stream, with others of it."""
        from minsnap.flight.mavlink.stream_options import SafetyRules

        return super().settings(
            rules=SafetyRules(self.max_start_distance, self.abort_distance),
            autopilot=one_of("--autopilot", self.autopilot, ("auto", "px4", "ardupilot", "generic")),
            relative=one_of("--origin", self.origin, ("file", "current", "current-height")) != "file",
            relative_height=self.origin == "current-height",
            on_abort=one_of("--on-abort", self.on_abort, ("hold", "land", "rtl")),
            give_up=self.give_up,
            wait=self.wait,
            log=self.log,
            **others,
        )


@dataclass(frozen=True)
class SentSetpoints:
    """What of a file is sent, and what is offset."""

    rate: Annotated[float | None, "HZ", "By default the file's own."] = None
    fields: Annotated[str | None, "Fields to send, of position,velocity,acceleration,yaw,yaw_rate."] = None
    frame: options.ReadFrame = None
    laps: Annotated[int, "How often to fly it."] = 1
    delay: Annotated[float | None, "S", "The vehicle's delay, as fit finds it; --vehicle has one."] = None
    drag: options.OffsetDrag = 0.0
    vehicle: options.OffsetVehicle = None
    lead: options.Lead = 0.0

    def settings(self) -> dict[str, Any]:
        """Return them as options of the stream."""
        from minsnap.flight.mavlink.setpoints import FeedForward

        offset = FeedForward(self.drag, None if self.vehicle is None else vehicle_of(self.vehicle), self.lead)
        fields = None if self.fields is None else [name.strip() for name in self.fields.split(",")]
        own = {"rate": self.rate, "frame": self.frame, "laps": self.laps, "delay": self.delay}
        return {**own, "fields": fields, "feed_forward": offset}


@dataclass(frozen=True)
class OrderOptions:
    """Whether a flight takes orders, and where from."""

    listen: Annotated[bool, "Plan a course and take orders as lines of JSON from the standard input."] = False
    room: Annotated[str | None, "X,Y,Z,X,Y,Z", "With --listen: two corners of where orders may lead."] = None
    port: Annotated[str | None, "[HOST:]PORT", "With --listen: orders by UDP instead."] = None

    def listening(self, file: Path, trigger: str) -> Listening | None:
        """Plan the course that is flown until something else is ordered; None where nobody listens."""
        if not self.listen:
            return None
        import numpy as np

        from minsnap.cli.companion import Listening
        from minsnap.corridors.boxes import Room
        from minsnap.paths.missions.course import read_course
        from minsnap.paths.missions.mission import plan_mission

        if file.suffix.lower() not in (".yaml", ".yml"):
            raise InputError(f"{file} is no course: --listen plans from what is flown, so give a course in YAML")
        if trigger == "enter" and self.port is None:
            raise InputError("--listen takes orders from the standard input: give --trigger mode or now, or --port")
        mission = plan_mission(read_course(file))
        if self.room is not None and self.room.count(",") != 5:
            raise InputError(f"--room is {self.room}: give two corners, six numbers with commas")
        floor = min(0.0, float(mission.trajectory.control_points[..., 2].min()))
        sides = [-inf, -inf, floor, inf, inf, inf] if self.room is None else options.parse_numbers("--room", self.room)
        return Listening(mission.trajectory, mission.limits, Room(*np.reshape(sides, (2, 3))), self.port)


@command()
def stream(
    flying: StreamedFlight,
    sent: SentSetpoints,
    orders: OrderOptions,
    file: Annotated[
        Path, "FILE", "Setpoint CSV or a file of polynomials; a folder of a fleet; with --listen a course."
    ],
    *,
    connect: options.Connect,
    system: Annotated[int | None, "The vehicle's MAVLink system id."] = None,
    signing_key: Annotated[Path | None, "FILE", "MAVLink 2 signing key: 32 bytes or 64 hex."] = None,
) -> int:
    """Fly a setpoint file over MAVLink, by PX4's offboard or ArduPilot's guided mode.

    The start is streamed for 2 s at least; the trigger then lets the flight go once the vehicle is in its mode; the end
    is held. Ctrl-C stops and holds until the mode is left; a second one leaves the vehicle to its own failsafe. Exit
    status 1 if the flight was refused or stopped by a rule of safety.
    """
    heard = orders.listening(file, flying.trigger)
    fastest = 0.0 if heard is None else heard.limits.speed or 0.0
    settings = flying.settings(**sent.settings(), stays=orders.listen, fastest=fastest)
    if file.is_dir() or file.suffix.lower() == ".skyc":
        flights = fly_fleet(file, connect, settings, signing_key, flying.preflight)
        for name, one in flights.items():
            print(f"{name}: {one if isinstance(one, FlightError) else flight_summary(one).splitlines()[0]}")
        return 0 if all(not isinstance(one, FlightError) and one.completed for one in flights.values()) else 1
    source = file if heard is None else heard.flown
    report = fly(source, connect, settings, system, signing_key, flying.preflight, heard)
    print(flight_summary(report), file=sys.stderr if orders.listen else sys.stdout)
    return 0 if report.completed else 1

"""The command that flies a setpoint file."""

from __future__ import annotations

import os
import select
import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from math import inf
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from minsnap.cli import options
from minsnap.cli.app import app
from minsnap.cli.vehicles import vehicle_of
from minsnap.errors import InputError

if TYPE_CHECKING:
    from minsnap.cli.companion import Listening
    from minsnap.flight.mavlink.link import Link
    from minsnap.flight.mavlink.schedule import Clock
    from minsnap.flight.mavlink.stream_options import StreamOptions, StreamReport
    from minsnap.flight.mavlink.streaming import Streamer
    from minsnap.trajectory.trajectory import Trajectory


class EnterKey:
    """A trigger that fires when Enter is pressed; the end of the input does not count as Enter."""

    def __init__(self) -> None:
        self._ended = False

    def __call__(self) -> bool:
        """Return whether Enter has been pressed."""
        if self._ended or not select.select([sys.stdin], [], [], 0.0)[0]:
            return False
        typed = os.read(sys.stdin.fileno(), 4096)
        self._ended = not typed
        return b"\n" in typed


@app.command()
def stream(
    file: Annotated[
        Path, typer.Argument(metavar="FILE", help="Setpoint CSV or a file of polynomials; with --listen a course.")
    ],
    connect: Annotated[
        str,
        typer.Option("--connect", metavar="LINK", help="udpin:, udpout:, tcp: or tcpin:HOST:PORT, serial:DEVICE:BAUD."),
    ],
    rate: Annotated[float | None, typer.Option("--rate", metavar="HZ", help="The file's own unless given.")] = None,
    fields: Annotated[
        str | None, typer.Option("--fields", help="Fields to send, of position,velocity,acceleration,yaw,yaw_rate.")
    ] = None,
    frame: options.ReadFrame = None,
    laps: Annotated[int, typer.Option("--laps", help="How often to fly it.")] = 1,
    autopilot: Annotated[str, typer.Option("--autopilot", help="auto, px4, ardupilot or generic.")] = "auto",
    trigger: Annotated[
        str, typer.Option("--trigger", help="enter, mode (when the vehicle enters OFFBOARD or GUIDED) or now.")
    ] = "enter",
    origin: Annotated[
        str,
        typer.Option(
            "--origin", help="file; current: start at the vehicle's x and y; current-height: at its height as well."
        ),
    ] = "file",
    max_start_distance: Annotated[
        float,
        typer.Option(
            "--max-start-distance",
            metavar="M",
            help="Largest distance of the vehicle from the start; inf: not checked.",
        ),
    ] = 1.0,
    abort_distance: Annotated[
        float | None,
        typer.Option(
            "--abort-distance",
            metavar="M",
            help="Distance of the vehicle from the plan at which the flight stops; fits its lag unless given.",
        ),
    ] = None,
    delay: Annotated[
        float | None,
        typer.Option("--delay", metavar="S", help="The vehicle's delay, as fit finds it; --vehicle has one."),
    ] = None,
    arm: Annotated[bool, typer.Option("--arm", help="Change the mode and arm. Never done without this.")] = False,
    land: Annotated[bool, typer.Option("--land", help="Land at the end instead of holding.")] = False,
    on_abort: Annotated[
        str, typer.Option("--on-abort", help="hold, land or rtl: what to do when a rule stops the flight.")
    ] = "hold",
    give_up: Annotated[
        float, typer.Option("--give-up", metavar="S", help="End a hold when the vehicle is silent for so long.")
    ] = 30.0,
    system: Annotated[int | None, typer.Option("--system", help="The vehicle's MAVLink system id.")] = None,
    signing_key: Annotated[
        Path | None, typer.Option("--signing-key", metavar="FILE", help="MAVLink 2 signing key: 32 bytes or 64 hex.")
    ] = None,
    wait: Annotated[
        float, typer.Option("--wait", metavar="S", help="For the vehicle's heartbeat, its position, and its arming.")
    ] = 30.0,
    preflight: Annotated[
        bool,
        typer.Option("--preflight/--no-preflight", help="Check parameters and state first; refuse what must end."),
    ] = True,
    drag: options.OffsetDrag = 0.0,
    vehicle: options.OffsetVehicle = None,
    lead: options.Lead = 0.0,
    log: Annotated[
        Path | None, typer.Option("--log", metavar="FILE", help="CSV of all messages sent and received.")
    ] = None,
    listen: Annotated[
        bool, typer.Option("--listen", help="Plan a course and take orders as lines of JSON from the standard input.")
    ] = False,
    room: Annotated[
        str | None,
        typer.Option("--room", metavar="X,Y,Z,X,Y,Z", help="With --listen: two corners of where orders may lead."),
    ] = None,
    port: Annotated[
        str | None, typer.Option("--port", metavar="[HOST:]PORT", help="With --listen: orders by UDP instead.")
    ] = None,
) -> int:
    """Fly a setpoint file over MAVLink, by PX4's offboard or ArduPilot's guided mode.

    The start is streamed for 2 s at least; the trigger then lets the flight go once the vehicle is in its mode; the end
    is held. Ctrl-C stops and holds until the mode is left; a second one leaves the vehicle to its own failsafe. Exit
    status 1 if the flight was refused or stopped by a rule of safety.
    """
    from minsnap.flight.mavlink.compensation import FeedForward
    from minsnap.flight.mavlink.safety import SafetyRules
    from minsnap.flight.mavlink.stream_options import StreamOptions

    craft = None if vehicle is None else vehicle_of(vehicle)
    heard = _listening(file, trigger, port, room) if listen else None
    settings = StreamOptions(
        rate=rate,
        fields=None if fields is None else [name.strip() for name in fields.split(",")],
        frame=frame,
        laps=laps,
        autopilot=_one_of("--autopilot", autopilot, ("auto", "px4", "ardupilot", "generic")),
        trigger=_trigger(trigger),
        relative=_one_of("--origin", origin, ("file", "current", "current-height")) != "file",
        relative_height=origin == "current-height",
        arm=arm,
        land=land,
        on_abort=_one_of("--on-abort", on_abort, ("hold", "land", "rtl")),
        give_up=give_up,
        rules=SafetyRules(max_start_distance=max_start_distance, abort_distance=abort_distance),
        wait=wait,
        log=log,
        feed_forward=FeedForward(drag, craft, lead),
        delay=delay,
        stays=listen,
        fastest=0.0 if heard is None else heard.limits.speed or 0.0,
    )
    source = file if heard is None else heard.flown
    report = _fly(source, connect, settings, system, signing_key, preflight, heard)
    print(_summary(report), file=sys.stderr if listen else sys.stdout)
    return 0 if report.completed else 1


def _listening(file: Path, trigger: str, port: str | None, room: str | None) -> Listening:
    """Plan the course that is flown until something else is ordered."""
    import numpy as np

    from minsnap.cli.companion import Listening
    from minsnap.corridors.room import Room
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


def _fly(
    source: Path | Trajectory,
    connect: str,
    settings: StreamOptions,
    system: int | None,
    key: Path | None,
    preflight: bool,
    listening: Listening | None,
) -> StreamReport:
    """Fly with a display on stderr; Ctrl-C stops the flight and holds."""
    from minsnap.cli.companion import Companion
    from minsnap.flight.mavlink.link import open_link
    from minsnap.flight.mavlink.offboard import prepare
    from minsnap.flight.mavlink.schedule import Clock
    from minsnap.flight.mavlink.streaming import Streamer

    table, clock = prepare(source, settings), Clock()
    link = open_link(connect, clock, system=system, signing_key=key)
    try:
        if preflight:
            _check(link, clock, source, settings)
        with Companion(callable(settings.trigger), listening) as beside:
            streamer = beside.streamer = Streamer(table, link, settings, clock, beside.event, beside.status)
            with _stopped_by_signals(streamer):
                return streamer.run()
    finally:
        link.close()


def _check(link: Link, clock: Clock, source: Path | Trajectory, settings: StreamOptions) -> None:
    """Say what of a vehicle does not fit the flight; refuse it if something must end it."""
    from minsnap.errors import FlightError
    from minsnap.flight.mavlink.autopilot import get_autopilot
    from minsnap.flight.mavlink.offboard import sampled
    from minsnap.flight.mavlink.setpoints import vehicle_frame
    from minsnap.flight.mavlink.vehicle_check import check_vehicle

    autopilot = get_autopilot(settings.autopilot, link.wait_for_vehicle(settings.wait))
    samples, frame = sampled(source, settings)
    found = check_vehicle(link, clock, autopilot, settings.feed_forward.stated(samples), vehicle_frame(frame))
    wrong = [finding for finding in found if finding.problem is not None]
    for finding in wrong:
        print(f"preflight: {finding.name}: {finding.problem}", file=sys.stderr)
    grave = next((finding for finding in wrong if finding.grave), None)
    if grave is not None:
        raise FlightError(f"not flown: {grave.problem}; nothing was sent (--no-preflight flies all the same)")


def _trigger(name: str) -> str | Callable[[], bool]:
    return EnterKey() if _one_of("--trigger", name, ("enter", "mode", "now")) == "enter" else name


def _one_of(option: str, value: str, choices: tuple[str, ...]) -> str:
    if value not in choices:
        raise InputError(f"{option} is {value!r}: choose {', '.join(choices[:-1])} or {choices[-1]}")
    return value


@contextmanager
def _stopped_by_signals(streamer: Streamer) -> Iterator[None]:
    """Convert Ctrl-C and SIGTERM to a stop that holds."""

    def stop(*_: Any) -> None:
        streamer.stop()

    before = {number: signal.signal(number, stop) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _summary(report: StreamReport) -> str:
    """Return the result of the flight in a few lines."""
    late = report.schedule
    milliseconds = [1e3 * value for value in (late.median, late.p99, late.p999, late.worst)]
    lines = [
        "completed" if report.completed else f"not completed: {report.reason}",
        f"{report.flown} setpoints of the flight, {late.sent} in all at {late.rate:.4f} Hz, {late.skipped} left out",
        "late by {:.2f} ms (median), {:.2f} ms (99 %), {:.2f} ms (99.9 %), {:.2f} ms (at most)".format(*milliseconds),
    ]
    if report.rmse is not None:
        lines.append(f"tracking error {report.rmse:.3f} m (rms), {report.worst_error:.3f} m (at most)")
    return "\n".join(lines)

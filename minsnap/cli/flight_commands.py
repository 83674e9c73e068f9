"""The command that flies over MAVLink: stream; and how a flight begins, ends and stops, which tune shares."""

from __future__ import annotations

import os
import re
import select
import signal
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, closing, contextmanager
from dataclasses import dataclass, replace
from math import inf
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import minsnap
import minsnap.flight
from minsnap.basics.interrupts import HANGUP
from minsnap.cli import options
from minsnap.cli.app import command
from minsnap.cli.companion import Companion, Listening
from minsnap.errors import FlightError, InputError
from minsnap.flight.mavlink.vehicle_messages import get_autopilot

if TYPE_CHECKING:
    from minsnap.flight.mavlink.link import Clock, Link
    from minsnap.flight.mavlink.stream_options import StreamOptions, StreamReport

    Source = Path | minsnap.Samples | minsnap.Trajectory


@dataclass(frozen=True)
class FlightOptions:
    """How a flight begins, ends and stops."""

    trigger: Annotated[str, "enter, mode (when the vehicle enters OFFBOARD or GUIDED) or now."] = "enter"
    abort_distance: Annotated[
        float | None, "M", "Distance of the vehicle from the plan at which the flight stops; by default fits its lag."
    ] = None
    arm: Annotated[bool, "Change the mode and arm. Never done without this."] = False
    land: Annotated[bool, "Land at the end instead of holding."] = False
    preflight: Annotated[
        bool, "--preflight/--no-preflight", "Check parameters and state first; refuse what must end."
    ] = True
    origin: Annotated[str, "file; current: start at the vehicle's x and y; current-height: at its height as well."] = (
        "file"
    )

    def settings(self, **others: Any) -> StreamOptions:
        """Return the options of the stream, with others of it.

        Raises
        ------
        InputError
            If trigger or origin is unknown.
        """
        from minsnap.flight.mavlink.stream_options import StreamOptions

        named = one_of("--trigger", self.trigger, ("enter", "mode", "now"))
        own: dict[str, Any] = {"trigger": EnterKey() if named == "enter" else named}
        own |= {"rules": minsnap.flight.SafetyRules(abort_distance=self.abort_distance)}
        place = one_of("--origin", self.origin, ("file", "current", "current-height"))
        own |= {"relative": place != "file", "relative_height": place == "current-height"}
        return StreamOptions(arm=self.arm, land=self.land, **{**own, **others})


class EnterKey:
    """A trigger that fires when Enter is pressed once it is asked for, which is when all that was typed before is read.

    The end of the input does not count as Enter.
    """

    def __init__(self) -> None:
        self._ended = self._asked = False
        self._say: Callable[[str], None] | None = None

    def begin(self, say: Callable[[str], None]) -> None:
        """Ask anew, for a flight that comes, by telling ``say`` a sentence."""
        self._asked, self._say = False, say

    def __call__(self) -> bool:
        """Return whether Enter has been pressed."""
        if self._ended:
            return False
        if not select.select([sys.stdin], [], [], 0.0)[0]:
            if not self._asked and self._say is not None:
                self._say("press Enter to fly (the vehicle must be armed and in its mode)")
            self._asked = True
            return False
        typed = os.read(sys.stdin.fileno(), 4096)
        self._ended = not typed
        return self._asked and b"\n" in typed


def _ask_by(settings: StreamOptions, say: Callable[[str], None]) -> None:
    if isinstance(settings.trigger, EnterKey):
        settings.trigger.begin(say)


def fly(
    source: Source, connect: str, settings: StreamOptions, preflight: bool, heard: Listening | None = None, **how: Any
) -> StreamReport:
    """Fly with a display on stderr, by a link that is opened so; Ctrl-C stops the flight and holds."""
    from minsnap.flight.mavlink.link import Clock, open_link
    from minsnap.flight.mavlink.offboard import prepare
    from minsnap.flight.mavlink.streaming import Streamer

    table, clock = prepare(source, settings), Clock()
    with closing(open_link(connect, clock, **how)) as link:
        if preflight:
            _check(link, clock, source, settings)
        with Companion(heard) as beside:
            _ask_by(settings, beside.event)
            streamer = beside.streamer = Streamer(table, link, settings, clock, beside.event, beside.status)
            with _stopped_by_signals(streamer.stop):
                return streamer.run()


def _plain(name: str) -> str:
    """Return the name of a vehicle as a part of a file's name, without spaces and separators of folders."""
    return re.sub(r"[^\w.+-]+", "_", name)


def fly_fleet(
    folder: Path, connect: str, settings: StreamOptions, system: str | None, key: Path | None, preflight: bool
) -> dict[str, StreamReport | FlightError]:
    """Fly a fleet from files, each vehicle over its own link; Ctrl-C stops all and holds."""
    from minsnap.flight.mavlink.link import Clock, open_link
    from minsnap.flight.mavlink.offboard import prepare, stream_together
    from minsnap.shows.fleet_files import read_origin

    fleet, clock, origin = minsnap.shows.read_fleet(folder), Clock(), read_origin(folder)
    names = [fleet.name(vehicle) for vehicle in range(len(fleet))]
    ways = zip(names, links_of(connect, len(fleet)), systems_of(system, len(fleet)), fleet, strict=True)
    if preflight:
        check_apart(fleet)
    log = None if settings.log is None else Path(settings.log)
    each = [replace(settings, log=log and log.with_name(f"{log.stem}-{_plain(name)}{log.suffix}")) for name in names]
    tables = [prepare(curve, how) for curve, how in zip(fleet, each, strict=True)]
    links: list[Link] = []
    with ExitStack() as opened:
        for name, address, number, curve in ways:
            links.append(opened.enter_context(closing(open_link(address, clock, system=number, signing_key=key))))
            if preflight:
                stands = None if origin is None else origin.geodetic(curve(0.0))[:2].tolist()
                _check(links[-1], clock, curve, settings, f"{name}: ", stands)
        with Companion() as beside:
            one_by_one = threading.Lock()

            def told(text: str) -> None:
                with one_by_one:
                    beside.event(text)

            _ask_by(settings, told)
            _say_unproved(fleet, settings, told)
            how = (tables, links, each, names, clock, told)
            with _stopped_by_signals() as stops:
                found = stream_together(*how, begun=stops.append, separation=fleet.separation)
                return dict(zip(names, found, strict=True))


def _say_unproved(fleet: minsnap.Fleet, settings: StreamOptions, told: Callable[[str], None]) -> None:
    """Say what of the flight of a fleet is not proved apart."""
    from minsnap.fleet import nearest_from_above

    if settings.relative:
        told("each vehicle counts from its own place: the fleet is apart if they stand as their paths begin")
    if settings.after_stop == "rtl":
        told("what returns all when a rule stops one (--on-abort rtl) is not proved apart")
    lands = settings.after_stop == "land" and fleet.separation is not None
    near = nearest_from_above(fleet) if lands else None
    if near is not None and not near.apart:
        pair = f"{fleet.names_of(near.pair)} come within {near.distance:.3g} m, seen from above"
        told(f"what lands all when a rule stops one (--on-abort) is not proved apart: {pair}")


def links_of(connect: str, count: int) -> list[str]:
    """Return the link of each vehicle: a list with commas, or one whose port counts up, by a ``+`` at its end."""
    if connect.endswith("+"):
        kind, _, port = connect[:-1].rpartition(":")
        if not port.isdecimal():
            raise InputError(f"--connect {connect} ends in no port that could count up")
        return [f"{kind}:{int(port) + vehicle}" for vehicle in range(count)]
    links = connect.split(",")
    if len(links) != count:
        raise InputError(f"{len(links)} links for {count} vehicles: give one each, with commas, or udpin:HOST:PORT+")
    return links


def systems_of(system: str | None, count: int) -> list[int | None]:
    """Return the MAVLink system id of each vehicle, from a list with commas; None where it is not given."""
    if system is None:
        return [None] * count
    ids = options.parse_numbers("--system", system, None)
    if len(ids) != count or not all(number in range(1, 256) for number in ids):
        raise InputError(f"--system is {system!r}: give an id from 1 to 255 for each vehicle ({count}), with commas")
    return list(map(int, ids))


def check_apart(fleet: minsnap.Fleet) -> None:
    """Refuse a fleet whose vehicles jump, or do not keep the separation that its files ask for."""
    if len(fleet) > 1 and fleet.separation is None:
        print("preflight: the files do not say how far apart the vehicles must be", file=sys.stderr)
    certificate = minsnap.certify_fleet(fleet)
    if not certificate.ok:
        raise FlightError(f"not flown: {certificate.fault}; nothing was sent")


def _check(
    link: Link,
    clock: Clock,
    source: Source,
    settings: StreamOptions,
    who: str = "",
    stands: Sequence[float] | None = None,
) -> None:
    """Say what of a vehicle, of a fleet with its name, does not fit the flight; refuse it if something must end it."""
    from minsnap.flight.mavlink.offboard import sampled
    from minsnap.flight.mavlink.preflight import check_vehicle
    from minsnap.flight.mavlink.setpoints import vehicle_frame

    autopilot = get_autopilot(settings.autopilot, link.wait_for_vehicle(settings.wait))
    samples, frame = sampled(source, settings)
    stated = settings.feed_forward.stated(samples)
    told = lambda text: print(f"preflight: {who}{text}", file=sys.stderr)  # noqa: E731
    findings = check_vehicle(link, clock, autopilot, stated, vehicle_frame(frame), settings, stands, told)
    wrong = [finding for finding in findings if finding.problem is not None]
    for finding in wrong:
        print(f"preflight: {who}{finding.name}: {finding.problem}", file=sys.stderr)
    grave = next((finding for finding in wrong if finding.grave), None)
    if grave is not None:
        raise FlightError(f"not flown: {who}{grave.problem}; nothing was sent (--no-preflight flies all the same)")


def one_of(option: str, value: str, choices: tuple[str, ...]) -> str:
    """Return a value that is one of the choices, or raise InputError."""
    if value not in choices:
        raise InputError(f"{option} is {value!r}: choose {', '.join(choices[:-1])} or {choices[-1]}")
    return value


@contextmanager
def _stopped_by_signals(*stop: Callable[[], None]) -> Iterator[list[Callable[[], None]]]:
    """Convert Ctrl-C, SIGTERM and SIGHUP to a stop that holds; yield what is called then, for more to be added."""
    stops = list(stop)

    def stop_all(number: int, _: Any) -> None:
        if number == HANGUP:  # a terminal that is closed may send it twice, and does not insist
            signal.signal(number, signal.SIG_IGN)
        for each in stops:
            each()

    numbers = [signal.SIGINT, signal.SIGTERM]
    if HANGUP is not None and signal.getsignal(HANGUP) is not signal.SIG_IGN:
        numbers.append(HANGUP)
    before = {number: signal.signal(number, stop_all) for number in numbers}
    try:
        yield stops
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def flight_summary(report: StreamReport) -> str:
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


@dataclass(frozen=True)
class StreamedFlight(FlightOptions):
    """The same, with what ``stream`` alone lets one choose."""

    autopilot: Annotated[str, "auto, px4, ardupilot or generic."] = "auto"
    max_start_distance: Annotated[float, "M", "Largest distance of the vehicle from the start; inf: not checked."] = 1.0
    on_abort: Annotated[
        str | None,
        "WAY",
        "After a stop by a rule: hold, land, rtl or hand-back (to HOLD or BRAKE). By default land with --land, else "
        "hand-back with --arm, else hold.",
    ] = None
    give_up: Annotated[float, "S", "End a hold when the vehicle is silent for so long."] = 30.0
    wait: Annotated[float, "S", "For the vehicle's heartbeat, its position, and its arming."] = 30.0
    log: Annotated[Path | None, "FILE", "CSV of all messages sent and received."] = None

    def settings(self, **others: Any) -> StreamOptions:
        """Return the options of the stream, with others of it."""
        from minsnap.flight.mavlink.stream_options import ON_ABORT

        return super().settings(
            rules=minsnap.flight.SafetyRules(self.max_start_distance, self.abort_distance),
            autopilot=one_of("--autopilot", self.autopilot, ("auto", "px4", "ardupilot", "generic")),
            on_abort=None if self.on_abort is None else one_of("--on-abort", self.on_abort, ON_ABORT),
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
        fields = None if self.fields is None else [name.strip() for name in self.fields.split(",")]
        own = {"rate": self.rate, "frame": self.frame, "laps": self.laps, "delay": self.delay}
        return {**own, "fields": fields, "feed_forward": options.feed_forward_of(self)}


_BESIDE = {"--listen": "orders in flight", "--explore": "what a sensor tells in flight"}


@dataclass(frozen=True)
class OrderOptions:
    """Whether a flight takes orders, or what a sensor tells, and where from."""

    listen: Annotated[bool, "Plan a course and take orders as lines of JSON from the standard input."] = False
    room: Annotated[str | None, "X,Y,Z,X,Y,Z", "With --listen: two corners of where orders may lead."] = None
    port: Annotated[str | None, "[HOST:]PORT", "With --listen or --explore: lines by UDP instead."] = None
    explore: Annotated[bool, "Fly to the end of a course of two waypoints through what a sensor tells, in JSON."] = (
        False
    )
    clearance: Annotated[float | None, "M", "With --explore: least distance to what is seen; 0.3."] = None
    sensing: Annotated[float | None, "M", "With --explore: range of the sensor; 15."] = None
    resolution: Annotated[float | None, "M", "With --explore: side of a cell; 0.25."] = None
    plane: Annotated[bool, "With --explore: the sensor sees at one height, in two coordinates."] = False
    lost: Annotated[float | None, "S", "With --explore: time without an observation after which it stops; 1."] = None

    def listening(self, file: Path, flying: FlightOptions) -> Listening | None:
        """Plan the course that is flown until something else is ordered or seen; None where nobody listens."""
        self._refuse_alone()
        if not (self.listen or self.explore):
            return None
        what = "--explore" if self.explore else "--listen"
        if file.suffix.lower() not in (".yaml", ".yml"):
            raise InputError(f"{file} is no course: {what} plans from what is flown, so give a course in YAML")
        if flying.trigger == "enter" and self.port is None:
            raise InputError(f"{what} reads lines from the standard input: give --trigger mode or now, or --port")
        if self.explore and flying.origin != "file":
            raise InputError(
                "--origin: what a sensor tells with --explore is in the axes of the course, so leave it out"
            )
        return self._exploring(file) if self.explore else self._ordered(file)

    def _refuse_alone(self) -> None:
        """Refuse options whose flight is not asked for."""
        if self.listen and self.explore:
            raise InputError("--listen and --explore: a flight takes orders, or what a sensor tells")
        own = ("clearance", "sensing", "resolution", "plane", "lost")
        given = [name for name in (*own, "room", "port") if getattr(self, name) not in (None, False)]
        if given and not (self.listen or self.explore):
            wanted = "--explore" if given[0] in own else "--listen"
            raise InputError(f"--{given[0]} is of {_BESIDE[wanted]}: give {wanted} with it")
        other = [name for name in given if name in (("room",) if self.explore else own)]
        if other:
            wanted = "--listen" if self.explore else "--explore"
            raise InputError(f"--{other[0]} is of {_BESIDE[wanted]}: leave it out, or give {wanted}")

    def _exploring(self, file: Path) -> Listening:
        """Return a flight from the first waypoint of a course to the second."""
        from minsnap.flight.mavlink.explored_stream import exploring_course

        chosen = {name: getattr(self, name) for name in ("clearance", "sensing", "resolution", "lost")}
        given = {name: value for name, value in chosen.items() if value is not None}
        exploring = exploring_course(minsnap.read_course(file), str(file), plane=self.plane, **given)
        return Listening(exploring.flown, exploring.limits, exploring=exploring, port=self.port)

    def _ordered(self, file: Path) -> Listening:
        """Return the flight of a course that takes orders."""
        import numpy as np

        mission = minsnap.plan_mission(minsnap.read_course(file))
        if self.room is not None and self.room.count(",") != 5:
            raise InputError(f"--room is {self.room}: give two corners, six numbers with commas")
        floor = min(0.0, float(mission.trajectory.control_points[..., 2].min()))
        sides = [-inf, -inf, floor, inf, inf, inf] if self.room is None else options.parse_numbers("--room", self.room)
        room = minsnap.Room(*np.reshape(sides, (2, 3)))
        return Listening(mission.trajectory, mission.limits, room, port=self.port)


@command()
def stream(
    flying: StreamedFlight,
    sent: SentSetpoints,
    orders: OrderOptions,
    file: Annotated[
        Path, "FILE", "Setpoint CSV or a file of polynomials; a folder of a fleet; with --listen or --explore a course."
    ],
    *,
    connect: options.Connect,
    system: Annotated[str | None, "ID", "MAVLink system id of the vehicle; of a fleet one each, with commas."] = None,
    signing_key: Annotated[Path | None, "FILE", "MAVLink 2 signing key: 32 bytes or 64 hex."] = None,
) -> int:
    """Fly a file over MAVLink, with PX4 or ArduPilot.

    Streams the start for at least 2 s, flies when the trigger fires and the vehicle is in OFFBOARD or GUIDED, and holds
    the end. Ctrl-C stops, and holds until the vehicle leaves the mode. A second Ctrl-C ends the stream: then the
    vehicle's own failsafe acts. Exit status 1 if the flight was refused, or stopped by a safety rule.
    """
    heard = orders.listening(file, flying)
    fastest = 0.0 if heard is None else heard.limits.speed or 0.0
    settings = flying.settings(**sent.settings(), stays=heard is not None, fastest=fastest)
    if file.is_dir() or file.suffix.lower() == ".skyc":
        flights = fly_fleet(file, connect, settings, system, signing_key, flying.preflight)
        for name, one in flights.items():
            print(f"{name}: {one if isinstance(one, FlightError) else flight_summary(one).splitlines()[0]}")
        return 0 if all(not isinstance(one, FlightError) and one.completed for one in flights.values()) else 1
    source = file if heard is None else heard.flown
    how: dict[str, Any] = {"system": systems_of(system, 1)[0], "signing_key": signing_key}
    report = fly(source, connect, settings, flying.preflight, heard, **how)
    print(flight_summary(report), file=sys.stdout if heard is None else sys.stderr)
    return 0 if report.completed else 1

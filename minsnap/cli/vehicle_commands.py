"""The commands that ask a vehicle or write to it: preflight, limits, relay, upload."""

from __future__ import annotations

import signal
import sys
from collections.abc import Callable, Mapping, Sequence
from contextlib import closing
from functools import partial
from math import sqrt
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import minsnap
import minsnap.flight
from minsnap.basics.storage.atomic import make_folder, write_file
from minsnap.cli import options
from minsnap.cli.app import command, tell
from minsnap.cli.options import vehicle_of
from minsnap.cli.output import as_json
from minsnap.errors import FleetError, LinkError
from minsnap.flight.mavlink.vehicle_messages import TEXTS, get_autopilot, read_events

if TYPE_CHECKING:
    from minsnap.fleet import FleetApproach
    from minsnap.flight.mavlink.preflight import Finding
    from minsnap.shows.crazyswarm_folder import Robot
    from minsnap.vehicle import Quadrotor


@command()
def preflight(
    file: Annotated[Path | None, "[FILE]", "Setpoint CSV that is to be flown: its speeds count."] = None,
    *,
    connect: options.Connect,
    change: Annotated[list[str] | None, "--set", "NAME=VALUE", "Set a parameter first; may be repeated."] = None,
    frame: options.ReadFrame = None,
    autopilot: Annotated[str, "auto, px4 or ardupilot."] = "auto",
    events: Annotated[Path | None, "FILE", "all_events.json of the vehicle's build of PX4: texts of checks."] = None,
    wait: Annotated[float, "S", "For the vehicle's heartbeat."] = 30.0,
    json: options.Json = False,
) -> int:
    """Check the parameters and the state of a vehicle for a flight.

    Prints what does not fit the flight, and why. Writes no parameter but those of --set. Exit status 1 if something
    does not fit.
    """
    from minsnap.files import frame_of, read_csv
    from minsnap.flight.mavlink.link import Clock, open_link
    from minsnap.flight.mavlink.parameters import Parameters
    from minsnap.flight.mavlink.preflight import check_vehicle
    from minsnap.flight.mavlink.setpoints import vehicle_frame

    samples = None if file is None else read_csv(file, frame)
    axes = "ned" if file is None else vehicle_frame(frame_of(file, frame))
    wanted, clock = _assignments(change or []), Clock()
    with closing(open_link(connect, clock, events=TEXTS if events is None else read_events(events))) as link:
        stack = get_autopilot(autopilot, link.wait_for_vehicle(wait))
        if stack.name == "generic":
            raise LinkError("the autopilot is neither PX4 nor ArduPilot: there are no rules for its parameters")
        taken = {}
        for name, value in wanted.items():
            taken[name] = Parameters(link, clock).write(name, value)
            print(f"set {taken[name]}", file=sys.stderr)
        findings = check_vehicle(link, clock, stack, samples, axes)
        kept = Parameters(link, clock).read(taken)
    _say(findings, json)
    for name, set_to in taken.items():
        if kept.get(name) != set_to:
            raise LinkError(f"{set_to} was set, and now the vehicle has {kept.get(name, 'no answer')}: did it restart?")
    return 1 if any(finding.problem for finding in findings) else 0


def _assignments(texts: list[str]) -> dict[str, float]:
    """Parse NAME=VALUE, before anything is sent."""
    values = {}
    for text in texts:
        name, _, value = text.partition("=")
        refusal = f"--set is {text!r}: give NAME=VALUE with a number, such as COM_OBL_RC_ACT=4"
        values[name.strip()] = options.read_number(value, refusal)
    return values


def _say(findings: list[Finding], json: bool) -> None:
    if json:
        print(as_json({finding.name: _as_dict(finding) for finding in findings}))
        return
    for finding in findings:
        verdict = "not answered" if not finding.known else "does not fit" if finding.problem else "fits"
        named = finding.name if finding.seen is None else f"{finding.name} ({finding.seen})"
        values = ", ".join(map(str, finding.parameters or finding.unanswered)) or named
        print(f"{verdict:13} {values}" + (f": {finding.problem}" if finding.problem else ""))


def _as_dict(finding: Finding) -> dict[str, object]:
    values = {parameter.name: parameter.value for parameter in finding.parameters}
    seen, fits = {} if finding.seen is None else {"seen": finding.seen}, not finding.problem if finding.known else None
    return {"parameters": values, **seen, "fits": fits, "problem": finding.problem}


@command()
def limits(
    *,
    connect: options.Connect,
    drag: Annotated[float, "K", "Drag over mass of the vehicle [1/s]."] = 0.0,
    vehicle: options.OffsetVehicle = None,
    output: Annotated[Path | None, "--output", "-o", "FILE", "YAML to add waypoints to, for plan."] = None,
    loop: Annotated[Path | None, "FILE", "Control loop from the vehicle's gains, for --tracking and --tube."] = None,
    autopilot: Annotated[str, "auto, px4 or ardupilot."] = "auto",
    wait: Annotated[float, "S", "For the vehicle's heartbeat."] = 30.0,
    json: options.Json = False,
) -> None:
    """Read limits for a plan from the vehicle's own parameters.

    A tenth of each is reserved for the controller. The tilt that drag needs (--drag, or --vehicle as fit writes it)
    reduces the acceleration and the speed. A plan of the file keeps these limits, and no others of ordinary flight.
    """
    from minsnap.flight.mavlink.link import Clock, open_link
    from minsnap.flight.mavlink.parameters import PARAMETERS, Parameters, autopilot_limits
    from minsnap.limits import written_in_file
    from minsnap.vehicle import AUTOPILOTS, loop_parameters

    given, clock = minsnap.flight.FeedForward(drag, None if vehicle is None else vehicle_of(vehicle)), Clock()
    with closing(open_link(connect, clock)) as link:
        stack = get_autopilot(autopilot, link.wait_for_vehicle(wait)).name
        parameters = Parameters(link, clock).read_known(PARAMETERS.get(stack, ()))
        asked = loop_parameters(stack) if loop is not None and stack in AUTOPILOTS else []
        gains = {name: each.value for name, each in Parameters(link, clock).read(asked).items()}
    within = partial(autopilot_limits, stack, {name: each.value for name, each in parameters.items()})
    values = (within(drag) if given.vehicle is None else _with_drag_of(given.vehicle, within)).given()
    if output is not None:
        write_file(output, _limits_text(written_in_file(values)))
    if loop is not None:
        own = given.drag if given.vehicle is None else 0.0
        write_file(loop, _loop_text(stack, gains, own))
    print(as_json(values) if json else _limits_text(values).rstrip())


def _limits_text(values: Mapping[str, float | None]) -> str:
    """Return limits as YAML; none is said as null, so that no ordinary one holds in its place."""
    said = {name: "null" if value is None else f"{value:g}" for name, value in values.items()}
    return "limits:\n" + "".join(f"  {name}: {value}\n" for name, value in said.items())


def _loop_text(stack: str, gains: Mapping[str, float], drag: float) -> str:
    """Return the control loop of an autopilot with these gains as YAML."""
    import yaml

    from minsnap.basics.arrays import significant

    values: dict[str, object] = {
        "autopilot": stack,
        "parameters": {name: significant(value, 7) for name, value in gains.items()},
    }
    return str(yaml.safe_dump(values | ({"drag": drag} if drag else {}), sort_keys=False))


def _with_drag_of(craft: Quadrotor, within: Callable[[float], minsnap.Limits]) -> minsnap.Limits:
    """Return the limits for the drag over mass [1/s] that a vehicle has at the greatest speed that they leave to it."""
    import numpy as np

    def lean(speed: float) -> float:
        return float(np.abs(craft.drag.force(speed * np.eye(3)[:2])).max()) / (craft.mass * speed)

    speed = within(0.0).horizontal_speed or 1.0
    for _ in range(30):  # halves the distance, in the exponent, to the speed that leaves itself
        speed = sqrt(speed * (within(lean(speed)).horizontal_speed or 1.0))
    return within(lean(speed))


@command()
def relay(
    *,
    source: Annotated[str, "--from", "SOURCE", "natnet:SERVER[,LOCAL], udp:[HOST:]PORT or csv:FILE."],
    target: Annotated[str, "--to", "LINK", "MAVLink connection, as for stream."],
    message: Annotated[str, "vision (VISION_POSITION_ESTIMATE), odometry, odometry-mocap or mocap."] = "vision",
    frame: Annotated[str, "Of the source: optitrack, flu, enu …"] = "optitrack",
    rate: Annotated[float, "HZ", "Poses per second at most."] = 50.0,
    max_age: Annotated[float, "S", "Older poses are not sent."] = 0.1,
    body: Annotated[str | None, "Which body; by default the first that is seen, and no other."] = None,
) -> int:
    """Send motion-capture poses to an autopilot's estimator.

    Ends with Ctrl-C, or at the end of a file. PX4's default estimator fuses vision and odometry; it does not read the
    topics of odometry-mocap (ODOMETRY as from motion capture) and mocap (ATT_POS_MOCAP). Rate and latency are printed
    once per second.
    """
    from minsnap.flight.mavlink.link import Clock, open_link

    clock = Clock()
    with closing(open_link(target, clock)) as link:
        with closing(minsnap.flight.open_source(source, body, clock)) as poses:
            runner = minsnap.flight.Relay(poses, link, clock, message, frame, rate, max_age)
            for number in (signal.SIGINT, signal.SIGTERM):
                signal.signal(number, lambda *_: runner.stop())
            report = runner.run(lambda so_far: print(_line(so_far), file=sys.stderr, flush=True))
    print(_line(report))
    return 0 if report.sent else 1


def _line(report: minsnap.flight.RelayReport) -> str:
    """Return a report in one line."""
    return (
        f"{report.sent} poses at {report.rate:.1f} Hz, {1e3 * report.latency:.1f} ms old (99 %: "
        f"{1e3 * report.latency_p99:.1f} ms), {report.stale} slots without a fresh one, {report.rejected} rejected"
    )


@command()
def upload(
    folder: Annotated[Path, "FLEET", "Folder of a fleet, or a .skyc."],
    *,
    uri: Annotated[list[str] | None, "URI", "Of each vehicle, in order; else from crazyflies.yaml in FLEET."] = None,
    start: Annotated[bool, "Take off, fly it, and land."] = False,
    dry_run: Annotated[bool, "Say what would be written and which ways would be flown, without a link."] = False,
    prove: Annotated[bool, "Prove the ways from crazyflies.yaml, and write them for fly.py, without a link."] = False,
) -> int:
    """Write a fleet into the memories of Crazyflies, and fly it.

    Each memory is read back; nothing takes off before all agree. It flies with --start only, from where the vehicles
    say that they stand, on ways that are proved apart. Ctrl-C, or a vehicle that is lost, lands all vehicles in place.
    """
    from minsnap.cli.flight_commands import check_apart
    from minsnap.flight import swarm_upload
    from minsnap.shows.crazyswarm_folder import ROBOTS, flown_files, read_robots
    from minsnap.shows.fleet_files import read_acts

    fleet, acts = minsnap.shows.read_fleet(folder), read_acts(folder)
    nameless = dry_run and not uri and not (folder / ROBOTS).exists()
    robots = [] if uri or nameless else read_robots(folder)
    uris = list(uri or [robot.uri for robot in robots])
    if dry_run:
        _say_contents(fleet, uris, ROBOTS, acts)
    if dry_run or prove:
        approach = _say_ways(fleet, robots)
        if prove:
            for name, text in flown_files(fleet, [robot.name for robot in robots], approach, acts).items():
                make_folder((folder / name).parent)
                write_file(folder / name, text)
        return 0
    if start:
        check_apart(fleet)
    places = [robot.place and robot.place[:2] for robot in robots] or None
    swarm_upload.upload(fleet, uris, start=start, told=tell, places=places, acts=acts)
    return 0


def _say_contents(fleet: minsnap.Fleet, uris: list[str], robots: str, acts: Sequence[tuple[str, float]]) -> None:
    """Say what would be written into which memory, and how all would be started."""
    from minsnap.flight import swarm_upload
    from minsnap.flight.high_level import planned_ways
    from minsnap.shows.memory_parts import COMPRESSED

    names = uris or list(map(fleet.name, range(len(fleet))))
    parts = swarm_upload.uploads(fleet, names, acts)
    for number, part in enumerate(parts, 1):
        if len(parts) > 1:
            print(f"part {number} of {len(parts)}, from {part.begins:.2f} to {part.ends:.2f} s:")
        for address, own in zip(names, part.uploads, strict=True):
            form = "compressed" if own.kind == COMPRESSED else "polynomials"
            off = f"at most {1e3 * own.distance:.2g} mm from the curve"
            print(f"{address}: {own.pieces} pieces, {len(own.content)} bytes, {form}, {off}")
    print(f"start: {planned_ways(uris) or f'as the addresses say, of --uri or {robots}'}")


def _say_ways(fleet: minsnap.Fleet, robots: list[Robot]) -> FleetApproach:
    """Say what is proved of the ways from where files say that the vehicles stand, and return them."""
    from minsnap.cli.flight_commands import check_apart
    from minsnap.flight.swarm_flight import proved_approach
    from minsnap.shows.crazyswarm_folder import places_of

    if robots and len(robots) != len(fleet):
        raise FleetError(f"there are {len(robots)} robots for {len(fleet)} vehicles: give one for each")
    check_apart(fleet)
    approach = proved_approach(fleet, places_of(fleet, robots))
    for sentence in approach.sentences(fleet):
        print(sentence)
    return approach

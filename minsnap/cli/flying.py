"""Flying from the command line: options, preflight, a companion that shows the flight, signals that stop it."""

from __future__ import annotations

import os
import select
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import ExitStack, closing, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from minsnap.errors import FlightError, InputError

if TYPE_CHECKING:
    from minsnap.cli.companion import Listening
    from minsnap.fleet.common_clock import Fleet
    from minsnap.flight.mavlink.link import Clock, Link
    from minsnap.flight.mavlink.stream_options import StreamOptions, StreamReport
    from minsnap.trajectory.samples import Samples
    from minsnap.trajectory.trajectory import Trajectory


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

    def settings(self, **others: Any) -> StreamOptions:
        """Return the options of the stream, with others of it.

        Raises
        ------
        InputError
            If the trigger is unknown.
        """
        from minsnap.flight.mavlink.stream_options import SafetyRules, StreamOptions

        own = {"trigger": trigger_of(self.trigger), "rules": SafetyRules(abort_distance=self.abort_distance)}
        return StreamOptions(arm=self.arm, land=self.land, **{**own, **others})


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


def fly(
    source: Path | Samples | Trajectory,
    connect: str,
    settings: StreamOptions,
    system: int | None,
    key: Path | None,
    preflight: bool,
    listening: Listening | None,
) -> StreamReport:
    """Fly with a display on stderr; Ctrl-C stops the flight and holds."""
    from minsnap.cli.companion import Companion
    from minsnap.flight.mavlink.link import Clock, open_link
    from minsnap.flight.mavlink.offboard import prepare
    from minsnap.flight.mavlink.streaming import Streamer

    table, clock = prepare(source, settings), Clock()
    with closing(open_link(connect, clock, system=system, signing_key=key)) as link:
        if preflight:
            _check(link, clock, source, settings)
        with Companion(callable(settings.trigger), listening) as beside:
            streamer = beside.streamer = Streamer(table, link, settings, clock, beside.event, beside.status)
            with _stopped_by_signals(streamer.stop):
                return streamer.run()


def fly_fleet(
    folder: Path, connect: str, settings: StreamOptions, key: Path | None, preflight: bool
) -> dict[str, StreamReport | FlightError]:
    """Fly a fleet from files, each vehicle over its own link; Ctrl-C stops all and holds."""
    from minsnap.cli.companion import Companion
    from minsnap.flight.mavlink.link import Clock, open_link
    from minsnap.flight.mavlink.offboard import prepare, stream_together
    from minsnap.shows.fleet_files import read_fleet

    fleet, clock = read_fleet(folder), Clock()
    names = [fleet.name(vehicle) for vehicle in range(len(fleet))]
    addresses = links_of(connect, len(fleet))
    if preflight:
        _check_apart(fleet)
    each = [replace(settings, log=_log_of(settings.log, name)) for name in names]
    tables = [prepare(curve, how) for curve, how in zip(fleet, each, strict=True)]
    links: list[Link] = []
    with ExitStack() as opened:
        for address, curve in zip(addresses, fleet, strict=True):
            links.append(opened.enter_context(closing(open_link(address, clock, signing_key=key))))
            if preflight:
                _check(links[-1], clock, curve, settings)
        with Companion(callable(settings.trigger)) as beside:
            one_by_one = threading.Lock()

            def told(text: str) -> None:
                with one_by_one:
                    beside.event(text)

            how = (tables, links, each, names, clock, told)
            with _stopped_by_signals() as stops:
                return dict(zip(names, stream_together(*how, begun=stops.append), strict=True))


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


def _check_apart(fleet: Fleet) -> None:
    """Refuse a fleet whose vehicles do not keep the separation that its files ask for."""
    from minsnap.fleet.fleet_certificate import certify_fleet

    if fleet.separation is None:
        print("preflight: the files do not say how far apart the vehicles must be", file=sys.stderr)
        return
    certificate = certify_fleet(fleet, fleet.separation)
    if not certificate.ok:
        raise FlightError(f"not flown: two vehicles come within {certificate.least_distance:.3f} m; nothing was sent")


def _log_of(log: str | os.PathLike[str] | None, name: str) -> Path | None:
    return None if log is None else Path(log).with_name(f"{Path(log).stem}-{name}{Path(log).suffix}")


def _check(link: Link, clock: Clock, source: Path | Samples | Trajectory, settings: StreamOptions) -> None:
    """Say what of a vehicle does not fit the flight; refuse it if something must end it."""
    from minsnap.flight.mavlink.offboard import sampled
    from minsnap.flight.mavlink.preflight import check_vehicle
    from minsnap.flight.mavlink.setpoints import vehicle_frame
    from minsnap.flight.mavlink.vehicle_messages import get_autopilot

    autopilot = get_autopilot(settings.autopilot, link.wait_for_vehicle(settings.wait))
    samples, frame = sampled(source, settings)
    findings = check_vehicle(link, clock, autopilot, settings.feed_forward.stated(samples), vehicle_frame(frame))
    wrong = [finding for finding in findings if finding.problem is not None]
    for finding in wrong:
        print(f"preflight: {finding.name}: {finding.problem}", file=sys.stderr)
    grave = next((finding for finding in wrong if finding.grave), None)
    if grave is not None:
        raise FlightError(f"not flown: {grave.problem}; nothing was sent (--no-preflight flies all the same)")


def trigger_of(name: str) -> str | Callable[[], bool]:
    """Return the trigger that --trigger names."""
    return EnterKey() if one_of("--trigger", name, ("enter", "mode", "now")) == "enter" else name


def one_of(option: str, value: str, choices: tuple[str, ...]) -> str:
    """Return a value that is one of the choices, or raise InputError."""
    if value not in choices:
        raise InputError(f"{option} is {value!r}: choose {', '.join(choices[:-1])} or {choices[-1]}")
    return value


@contextmanager
def _stopped_by_signals(*stop: Callable[[], None]) -> Iterator[list[Callable[[], None]]]:
    """Convert Ctrl-C and SIGTERM to a stop that holds; yield what is called then, to which more can be added."""
    stops = list(stop)

    def stop_all(*_: Any) -> None:
        for each in stops:
            each()

    before = {number: signal.signal(number, stop_all) for number in (signal.SIGINT, signal.SIGTERM)}
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

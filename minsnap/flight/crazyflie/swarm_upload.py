"""Upload of a fleet to Crazyflies, and its flight: take-off, to the starts, a start of all, landing.

Nothing takes off before every memory was read back. A vehicle that is gone in the air makes all others land in place.
"""

from __future__ import annotations

import struct
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from minsnap.errors import FleetError, FlightError, LinkError
from minsnap.fleet.common_clock import Fleet
from minsnap.flight.crazyflie.crtp_link import CrtpLink, act_on_each, open_link
from minsnap.flight.crazyflie.group_start import Volleys, start_group
from minsnap.flight.crazyflie.trajectory_memory import Upload, command, store, upload_of

TAKE_OFF, LAND, GO_TO = 7, 8, 12


@dataclass(frozen=True)
class FlightTimes:
    """How long the parts around the trajectories take.

    Parameters
    ----------
    take_off : float
        Climb to the height of the start [s].
    approach : float
        Straight way to the start [s].
    landing : float
        [s].
    settle : float
        Wait after each of these [s].
    start : Volleys
        How often the start of all is sent.
    """

    take_off: float = 2.5
    approach: float = 3.0
    landing: float = 3.0
    settle: float = 0.5
    start: Volleys = Volleys()


def uploads(fleet: Fleet, uris: Sequence[str]) -> list[Upload]:
    """Return the memory of each vehicle, without a link.

    Raises
    ------
    FleetError
        If there are not as many addresses as vehicles, or one is named twice.
    FileError
        If a trajectory does not fit.
    """
    if len(uris) != len(fleet):
        raise FleetError(f"there are {len(uris)} addresses for {len(fleet)} vehicles: give one for each")
    twice = next((uri for uri in uris if list(uris).count(uri) > 1), None)
    if twice is not None:
        raise FleetError(f"the address {twice} stands twice: each vehicle needs its own")
    return [upload_of(curve) for curve in fleet]


def upload(
    fleet: Fleet,
    uris: Sequence[str],
    *,
    start: bool = False,
    timing: FlightTimes | None = None,
    told: Callable[[str], None] | None = None,
) -> None:
    """Write a fleet into the memories of its vehicles, and fly it if ``start`` says so.

    Parameters
    ----------
    fleet : Fleet
    uris : sequence of str
        Address of each vehicle: ``udp://host:port``, or what cflib knows.
    start : bool
        Take off, fly to the starts, start all together, and land at the end.
    timing : FlightTimes, optional
    told : callable, optional
        Is told a sentence after each step.

    Raises
    ------
    LinkError
        If a vehicle does not answer; in the air, all others were told to land.
    FlightError
        If a memory reads otherwise than written, or a vehicle refuses.
    """
    contents = uploads(fleet, uris)
    say = told or (lambda line: None)
    links: list[CrtpLink] = []
    try:
        for uri in uris:
            links.append(open_link(uri))
        act_on_each(links, lambda link, i: store(link, contents[i]))
        say(f"{len(links)} memories written and read back, {sum(len(part.content) for part in contents)} bytes")
        if start:
            _fly(fleet, links, timing or FlightTimes(), say)
    finally:
        for link in links:
            link.close()


def _fly(fleet: Fleet, links: Sequence[CrtpLink], timing: FlightTimes, say: Callable[[str], None]) -> None:
    """Fly the uploaded curves; an early end lands all in place."""
    starts = [curve(0.0) for curve in fleet]
    yaws = [float(curve.yaw(np.array(0.0))) for curve in fleet]
    landing = struct.pack("<BBff?f", LAND, 0, 0.0, 0.0, True, timing.landing)
    try:
        climbs = [struct.pack("<BBff?f", TAKE_OFF, 0, place[2], 0.0, True, timing.take_off) for place in starts]
        act_on_each(links, lambda link, i: command(link, climbs[i]))
        time.sleep(timing.take_off + timing.settle)
        ways = [(*place, yaw, timing.approach) for place, yaw in zip(starts, yaws, strict=True)]
        act_on_each(links, lambda link, i: command(link, struct.pack("<BBBBfffff", GO_TO, 0, 0, 0, *ways[i])))
        time.sleep(timing.approach + timing.settle)
        say(str(start_group(links, timing.start)))
        time.sleep(fleet.duration + timing.settle)
        act_on_each(links, lambda link, i: command(link, landing))
        say("landing")
    except BaseException:
        _land_all(links, landing, say)
        raise


def _land_all(links: Sequence[CrtpLink], landing: bytes, say: Callable[[str], None]) -> None:
    """Tell every vehicle to land in place, whether or not others answer."""
    gone = []

    def land(link: CrtpLink, _: int) -> None:
        try:
            command(link, landing)
        except (LinkError, FlightError):
            gone.append(link.name)

    act_on_each(links, land)
    say("told all to land" + (f"; no answer from {', '.join(gone)}" if gone else ""))

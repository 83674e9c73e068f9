"""The start of all trajectories at once: by one broadcast for each radio channel, else link by link without a wait.

Vehicles answer on their own links. A start is sent a few times against loss, as crazyswarm2 does with broadcasts: the
firmware begins anew with each, so all begin between the first and the last. Where a vehicle heard none, all are told
again: one alone would be late by the wait.
"""

from __future__ import annotations

import struct
import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack, closing
from dataclasses import dataclass

from minsnap.errors import FlightError, LinkError
from minsnap.flight.crazyflie.crtp_link import LINK_BITS, CrtpLink, act_on_each
from minsnap.flight.crazyflie.radio_broadcast import RadioBroadcast, channel_of
from minsnap.flight.crazyflie.trajectory_memory import COMMAND_PORT, GROUP, SLOT

START = 13


@dataclass(frozen=True)
class Volleys:
    """How often a start is sent.

    Parameters
    ----------
    copies : int
        Packets of a volley.
    pause : float
        Between two of them [s].
    most : int
        Volleys before a vehicle that does not answer counts as gone.
    hearing : float
        Wait for the answers to one [s].
    """

    copies: int = 3
    pause: float = 1e-3
    most: int = 3
    hearing: float = 0.25


@dataclass(frozen=True)
class GroupStart:
    """How a fleet was started.

    Parameters
    ----------
    channels : tuple of str
        Radio channels with a broadcast.
    alone : int
        Vehicles that were told on links of their own.
    spread : float
        Time from before the first packet to after the last [s]; no two vehicles began further apart.
    volleys : int
        1, or more where a vehicle heard none.
    """

    channels: tuple[str, ...]
    alone: int
    spread: float
    volleys: int

    def __str__(self) -> str:
        again = f", told {self.volleys} times" if self.volleys > 1 else ""
        return f"started {ways(self.channels, self.alone)}, all within {1e3 * self.spread:.1f} ms{again}"


def ways(channels: Sequence[str], alone: int) -> str:
    """Return how vehicles are started, in words."""
    words = [f"by a broadcast on {', '.join(channels)}"] if channels else []
    words += [f"link by link ({alone} without a broadcast)"] if alone else []
    return " and ".join(words)


def planned_ways(uris: Sequence[str]) -> str:
    """Return how vehicles of these addresses would be started, in words."""
    channels = [channel_of(uri) for uri in uris]
    return ways(sorted({one for one in channels if one}), channels.count(None))


def start_group(links: Sequence[CrtpLink], volleys: Volleys) -> GroupStart:
    """Start the trajectories of all vehicles at one instant, or as near to it as their links allow.

    Raises
    ------
    LinkError
        If a vehicle does not answer.
    FlightError
        If one refuses.
    """
    channels = {link.name: channel_of(link.name) for link in links}
    named = sorted({channel for channel in channels.values() if channel})
    with ExitStack() as opened:
        casts = [opened.enter_context(closing(RadioBroadcast(channel))) for channel in named]
        alone = [link for link in links if channels[link.name] is None]
        sends = [cast.send for cast in casts] + [link.send for link in alone]
        for number in range(1, volleys.most + 1):
            act_on_each(links, _forget)
            spread = _send_copies(sends, volleys)
            heard: list[bool] = act_on_each(links, lambda link, _: _is_heard(link, volleys.hearing))
            if all(heard):
                return GroupStart(tuple(named), len(alone), spread, number)
    deaf = ", ".join(link.name for link, told in zip(links, heard, strict=True) if not told)
    raise LinkError(f"{deaf} does not answer to the start: out of reach, or on another channel than its address says")


def _forget(link: CrtpLink, _: int) -> None:
    """Drop what has come, such as answers to a start before."""
    while link.receive(1e-3):
        pass


def _send_copies(sends: Sequence[Callable[[bytes], None]], volleys: Volleys) -> float:
    """Send all copies of the start, and return how long that took [s]."""
    packet = bytes([COMMAND_PORT << 4 | LINK_BITS]) + struct.pack("<BBBBBBf", START, GROUP, 0, 0, 0, SLOT, 1.0)
    began = time.monotonic()
    for copy in range(volleys.copies):
        if copy:
            time.sleep(volleys.pause)
        for send in sends:
            send(packet)
    return time.monotonic() - began


def _is_heard(link: CrtpLink, wait: float) -> bool:
    """Whether a vehicle answers that it has begun."""
    end = time.monotonic() + wait
    while (left := end - time.monotonic()) > 0.0:
        packet = link.receive(left)
        if packet and packet[0] & ~LINK_BITS == COMMAND_PORT << 4 and packet[1] == START and len(packet) >= 5:
            if packet[4]:
                raise FlightError(f"{link.name} refuses to start with error {packet[4]}")
            return True
    return False

"""Commands to the high-level commander of Crazyflies, each until it is answered, and the start of all at one instant.

A start is sent a few times against loss, as crazyswarm2 does with broadcasts: the firmware begins anew with each, so
all begin between the first and the last. Where a vehicle heard none, all are told again: one alone would be late by the
wait.
"""

from __future__ import annotations

import struct
import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack, closing
from dataclasses import dataclass

from minsnap.errors import FlightError, LinkError
from minsnap.flight.crtp_link import LINK_BITS, CrtpLink, RadioBroadcast, act_on_each, ask_counted, channel_of, heard

COMMAND_PORT = 8
SLOT, GROUP = 1, 1
"""Number of the trajectory in a vehicle, and the group that is started."""

TAKE_OFF, LAND, GO_TO, START = 7, 8, 12, 13
ONCE, TAKEN = (TAKE_OFF, LAND), 1
"""Commands that the planner refuses with this error while it follows one of them (planner.c)."""


def command(link: CrtpLink, body: bytes) -> None:
    """Give a command until it is answered, or raise FlightError if it is refused.

    A take-off or a landing that is sent again, because its answer was lost, and is refused for being flown already, was
    taken.
    """
    answer, sent = ask_counted(link, COMMAND_PORT, 0, body, lambda reply: reply[:1] == body[:1] and len(reply) >= 4)
    taken = sent > 1 and body[0] in ONCE and answer[3] == TAKEN
    if answer[3] and not taken:
        raise FlightError(f"{link.name} refuses command {body[0]} with error {answer[3]}")


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
    ways : str
        By which broadcasts, and how many vehicles on links of their own, in words.
    spread : float
        Time from before the first packet to after the last [s]; no two vehicles began further apart.
    volleys : int
        1, or more where a vehicle heard none.
    began : float
        When all had begun, on the clock of ``time.monotonic`` [s].
    """

    ways: str
    spread: float
    volleys: int
    began: float = 0.0

    def __str__(self) -> str:
        again = f", told {self.volleys} times" if self.volleys > 1 else ""
        return f"started {self.ways}, all within {1e3 * self.spread:.1f} ms{again}"


def planned_ways(uris: Sequence[str]) -> str:
    """Return how vehicles of these addresses would be started, in words."""
    channels = [channel_of(uri) for uri in uris]
    named, alone = sorted({one for one in channels if one}), channels.count(None)
    words = [f"by a broadcast on {', '.join(named)}"] if named else []
    words += [f"link by link ({alone} without a broadcast)"] if alone else []
    return " and ".join(words)


def start_group(links: Sequence[CrtpLink], volleys: Volleys, slot: int = SLOT) -> GroupStart:
    """Start the trajectories with a number in all vehicles at one instant, or as near to it as their links allow.

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
            spread = _send_copies(sends, volleys, slot)
            began = time.monotonic()
            begun: list[bool] = act_on_each(links, lambda link, _: _has_begun(link, volleys.hearing))
            if all(begun):
                return GroupStart(planned_ways([link.name for link in links]), spread, number, began)
    deaf = ", ".join(link.name for link, told in zip(links, begun, strict=True) if not told)
    raise LinkError(f"{deaf} does not answer to the start: out of reach, or on another channel than its address says")


def _forget(link: CrtpLink, _: int) -> None:
    """Drop what has come, such as answers to a start before."""
    while link.receive(1e-3):
        pass


def _send_copies(sends: Sequence[Callable[[bytes], None]], volleys: Volleys, slot: int) -> float:
    """Send all copies of the start, and return how long that took [s]."""
    packet = bytes([COMMAND_PORT << 4 | LINK_BITS]) + struct.pack("<BBBBBBf", START, GROUP, 0, 0, 0, slot, 1.0)
    began = time.monotonic()
    for copy in range(volleys.copies):
        if copy:
            time.sleep(volleys.pause)
        for send in sends:
            send(packet)
    return time.monotonic() - began


def _has_begun(link: CrtpLink, wait: float) -> bool:
    """Whether a vehicle answers that it has begun."""
    answer = heard(link, COMMAND_PORT << 4, lambda body: body[:1] == bytes([START]) and len(body) >= 4, wait)
    if answer is not None and answer[3]:
        raise FlightError(f"{link.name} refuses to start with error {answer[3]}")
    return answer is not None

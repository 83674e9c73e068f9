"""What Crazyflies say of themselves: a block of log variables each sends by itself, and a watch over all of a fleet.

The log of the firmware (log.c): port 5, channel 0 the table of variables, channel 1 blocks of them, channel 2 their
values. The table is the same for all vehicles of one build, which its checksum tells: it is read once.
"""

from __future__ import annotations

import struct
import time
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_EXCEPTION, ThreadPoolExecutor, wait
from dataclasses import dataclass
from threading import Event

from minsnap.errors import FlightError, LinkError
from minsnap.flight.crtp_link import CrtpLink, act_on_each, ask, heard

LOG_PORT, TABLE, CONTROL, VALUES = 5, 0, 1, 2
ITEM, TABLE_SIZE = 2, 3
START_BLOCK, RESET, CREATE = 3, 5, 6
BLOCK = 1
"""Number of the block."""

EXISTS = 17
"""Error of a block that is there already: the first of two requests was taken."""

VARIABLES = {
    "stateEstimate.x": (7, "f"),
    "stateEstimate.y": (7, "f"),
    "stateEstimate.z": (7, "f"),
    "pm.state": (4, "b"),
    "supervisor.info": (2, "H"),
}
"""What is logged: the firmware's number of the type in which it is sent, and that of ``struct``."""

PLACE = 3
"""The first so many are needed; of the others those are logged that a firmware has."""

LOW, SHUT_DOWN = 3, 4
"""States of the battery, of which the second ends a flight."""

FAULTS = {5: "has tumbled", 6: "is locked", 7: "has crashed"}
"""Bits of ``supervisor.info``."""


@dataclass(frozen=True)
class LogSettings:
    """How vehicles are watched.

    Parameters
    ----------
    period : float
        Of the values that each sends [s].
    silence : float
        A vehicle that has sent nothing for so long is gone [s].
    first : float
        How long its first values are waited for [s].
    """

    period: float = 0.2
    silence: float = 1.0
    first: float = 2.0


WATCH = LogSettings()


@dataclass(frozen=True)
class CrazyflieState:
    """What a vehicle said last.

    Parameters
    ----------
    place : tuple of 3
        Its own estimate of where it is [m].
    power, supervisor : int
        State of its battery, and the bits of its supervisor; 0 where its firmware has none.
    """

    place: tuple[float, float, float]
    power: int = 0
    supervisor: int = 0

    @property
    def fault(self) -> str | None:
        """Why it cannot fly on, or None."""
        found = [text for bit, text in FAULTS.items() if self.supervisor >> bit & 1]
        return found[0] if found else "shuts down for its battery" if self.power == SHUT_DOWN else None

    @property
    def unfit(self) -> str | None:
        """Why it must not take off, or None."""
        return self.fault or ("has a low battery" if self.power == LOW else None)


class FleetWatch:
    """Watches over vehicles on links that nobody else reads meanwhile.

    Parameters
    ----------
    links : sequence of CrtpLink
    settings : LogSettings

    Raises
    ------
    LinkError
        If a vehicle does not answer.
    FlightError
        If its firmware does not log where it is.
    """

    def __init__(self, links: Sequence[CrtpLink], settings: LogSettings = WATCH) -> None:
        self._links, self._settings = links, settings
        tables = act_on_each(links, lambda link, _: _table(link))
        known: dict[bytes, dict[str, int]] = {}
        for link, table in zip(links, tables, strict=True):
            if table not in known:
                known[table] = _numbers(link, struct.unpack_from("<H", table)[0])
        self._names = [[name for name in VARIABLES if name in known[table]] for table in tables]
        act_on_each(links, lambda link, i: _begin(link, [known[tables[i]][name] for name in self._names[i]],
                                                  self._names[i], settings.period))  # fmt: skip

    def states(self) -> list[CrazyflieState]:
        """Return what each vehicle says now.

        Raises
        ------
        LinkError
            If one says nothing.
        """

        def now(link: CrtpLink, i: int) -> CrazyflieState:
            while link.receive(1e-3):
                pass  # older ones
            state = self._next(link, i, self._settings.first)
            if state is None:
                raise LinkError(f"{link.name} does not say where it is")
            return state

        return act_on_each(self._links, now)

    def __call__(self, seconds: float) -> None:
        """Watch for some time [s].

        Raises
        ------
        LinkError
            As soon as one has been silent for too long.
        FlightError
            As soon as one cannot fly on.
        """
        end, ended = time.monotonic() + seconds, Event()

        def watched(link: CrtpLink, i: int) -> None:
            last = time.monotonic()
            while (now := time.monotonic()) < end and not ended.is_set():
                state = self._next(link, i, min(end - now, 0.5 * self._settings.period))
                if state is not None and state.fault is not None:
                    raise FlightError(f"{link.name} {state.fault}")
                last = time.monotonic() if state is not None else last
                if time.monotonic() - last > self._settings.silence:
                    raise LinkError(f"{link.name} has been silent for {self._settings.silence:g} s")

        with ThreadPoolExecutor(len(self._links)) as pool:
            all_of_them = [pool.submit(watched, link, i) for i, link in enumerate(self._links)]
            try:
                wait(all_of_them, return_when=FIRST_EXCEPTION)
            finally:
                ended.set()
        for each in all_of_them:
            each.result()

    def _next(self, link: CrtpLink, i: int, patience: float) -> CrazyflieState | None:
        form = "<" + "".join(VARIABLES[name][1] for name in self._names[i])
        size = 4 + struct.calcsize(form)
        values: Callable[[bytes], bool] = lambda body: body[:1] == bytes([BLOCK]) and len(body) >= size  # noqa: E731
        body = heard(link, LOG_PORT << 4 | VALUES, values, patience)
        if body is None:
            return None
        said = dict(zip(self._names[i], struct.unpack_from(form, body, 4), strict=True))
        x, y, z = (said[name] for name in list(VARIABLES)[:PLACE])
        return CrazyflieState((x, y, z), said.get("pm.state", 0), said.get("supervisor.info", 0))


def _table(link: CrtpLink) -> bytes:
    """Return the size and the checksum of the table of variables."""
    size = bytes([TABLE_SIZE])
    return ask(link, LOG_PORT, TABLE, size, lambda body: body[:1] == size and len(body) >= 7)[1:7]


def _numbers(link: CrtpLink, count: int) -> dict[str, int]:
    """Return the numbers of the variables that are logged."""
    found: dict[str, int] = {}
    for number in range(count):
        request = struct.pack("<BH", ITEM, number)
        body = ask(link, LOG_PORT, TABLE, request, lambda body, request=request: body[:3] == request and len(body) > 5)  # type: ignore[misc]
        name = ".".join(part.decode("ascii", "replace") for part in body[4:].split(b"\0")[:2])
        if name in VARIABLES:
            found[name] = number
        if len(found) == len(VARIABLES):
            break
    missing = [name for name in list(VARIABLES)[:PLACE] if name not in found]
    if missing:
        raise FlightError(f"{link.name} does not log {', '.join(missing)}: its firmware is too old")
    return found


def _begin(link: CrtpLink, numbers: Sequence[int], names: Sequence[str], period: float) -> None:
    """Make the block, and let the vehicle send it."""
    _told(link, bytes([RESET]))
    entries = b"".join(
        struct.pack("<BH", VARIABLES[name][0], number) for name, number in zip(names, numbers, strict=True)
    )
    _told(link, bytes([CREATE, BLOCK]) + entries)
    _told(link, bytes([START_BLOCK, BLOCK, round(100 * period)]))


def _told(link: CrtpLink, body: bytes) -> None:
    answer = ask(link, LOG_PORT, CONTROL, body, lambda reply: reply[:1] == body[:1] and len(reply) >= 3)
    if answer[2] not in (0, EXISTS):
        raise FlightError(f"{link.name} refuses to log: error {answer[2]} of request {body[0]}")

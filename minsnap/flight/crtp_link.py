"""Links to Crazyflies over CRTP: packets by UDP or radio, requests, and one packet for all of a channel.

A packet is a byte, port << 4 | channel, and at most 30 bytes. Over UDP one datagram is one packet, without a checksum.

Every Crazyflie listens to the address 0xFFE7E7E7E7 beside its own, and acknowledges nothing that comes there (esb.c of
crazyflie2-nrf-firmware). The dongle therefore sends such a packet as often as it retries one that is not acknowledged,
four times as cflib sets it. Its retries stay on: without them cflib waits a second for an answer of the dongle.
"""

from __future__ import annotations

import os
import socket
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, suppress
from typing import Any, TypeVar
from urllib.parse import urlparse

from minsnap.basics.optional_packages import optional
from minsnap.errors import LinkError

LINK_BITS = 0x0C
"""Bits of the header that belong to the link, and are set by the one who asks."""

TRIES, WAIT = 8, 0.25
"""How often a question is sent before a vehicle counts as gone, and how long an answer is waited for [s]."""

Result = TypeVar("Result")


class UdpLink:
    """A vehicle behind a UDP port, such as ``udp://127.0.0.1:19850``."""

    def __init__(self, uri: str) -> None:
        place = urlparse(uri)
        self.name = uri
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            if not place.hostname or not place.port:
                raise ValueError("give udp://HOST:PORT")
            self._socket.connect((place.hostname, place.port))
        except (OSError, ValueError) as error:
            self._socket.close()
            raise LinkError(f"{uri} cannot be reached: {error}") from error

    def send(self, packet: bytes) -> None:
        """Send a packet; a port where nobody listens is told by the silence that follows."""
        with suppress(ConnectionRefusedError):
            self._socket.send(packet)

    def receive(self, timeout: float) -> bytes | None:
        """Return the next packet, or None after a time [s]."""
        self._socket.settimeout(max(timeout, 1e-3))
        try:
            return self._socket.recv(64) or None
        except TimeoutError:
            return None
        except ConnectionRefusedError:
            time.sleep(timeout)
            return None

    def close(self) -> None:
        """Close the port."""
        self._socket.close()


PLUG_IN = "plug in the Crazyradio"


@contextmanager
def _radio(name: str, what: str) -> Iterator[None]:
    """Tell any exception of cflib and of the USB library below it, which have no class in common, as a LinkError."""
    try:
        yield
    except Exception as error:
        said = f"{error}".strip().partition("\n")[0] or type(error).__name__
        raise LinkError(f"{name} {what}: {said}; {PLUG_IN}, and see that no other program has it") from error


class RadioLink:
    """A vehicle behind one of cflib's drivers, such as ``radio://0/80/2M/E7E7E7E701``."""

    def __init__(self, uri: str) -> None:
        drivers = optional("cflib.crtp", f"{uri} needs cflib", "crazyflie")
        self.name = uri
        with _radio(uri, "cannot be opened"):
            drivers.init_drivers()
            driver: Any = drivers.get_link_driver(uri, None, None)
        if driver is None:
            raise LinkError(f"{uri} cannot be opened: {PLUG_IN}, and write addresses as radio://0/80/2M/E7E7E7E701")
        self._driver = driver

    def send(self, packet: bytes) -> None:
        """Send a packet."""
        from cflib.crtp.crtpstack import CRTPPacket

        with _radio(self.name, "cannot be reached"):
            self._driver.send_packet(CRTPPacket(packet[0], bytearray(packet[1:])))

    def receive(self, timeout: float) -> bytes | None:
        """Return the next packet, or None after a time [s]."""
        with _radio(self.name, "cannot be reached"):
            packet = self._driver.receive_packet(timeout)
        return None if packet is None else bytes([packet.header]) + bytes(packet.data)

    def close(self) -> None:
        """Close the driver."""
        self._driver.close()


CrtpLink = UdpLink | RadioLink
"""A way to one vehicle; packets have their headers."""


def open_link(uri: str) -> CrtpLink:
    """Return a link of the kind that an address names."""
    return UdpLink(uri) if uri.startswith("udp://") else RadioLink(uri)


def act_on_each(links: Sequence[CrtpLink], act: Callable[[CrtpLink, int], Result]) -> list[Result]:
    """Act on all links at once, and raise the first error after all have ended."""
    with ThreadPoolExecutor(len(links)) as pool:
        ended = [pool.submit(act, link, i) for i, link in enumerate(links)]
    return [future.result() for future in ended]


def ask(link: CrtpLink, port: int, channel: int, body: bytes, answers: Callable[[bytes], bool]) -> bytes:
    """Send a packet until it is answered, and return the body of the answer.

    Parameters
    ----------
    link : CrtpLink
    port, channel : int
    body : bytes
    answers : callable
        Whether a body from that port and channel is the answer.

    Raises
    ------
    LinkError
        If there is no answer after ``TRIES`` times ``WAIT``.
    """
    return ask_counted(link, port, channel, body, answers)[0]


def ask_counted(
    link: CrtpLink, port: int, channel: int, body: bytes, answers: Callable[[bytes], bool]
) -> tuple[bytes, int]:
    """Do the same, and return how often it was sent as well."""
    head = port << 4 | channel
    for number in range(TRIES):
        link.send(bytes([head | LINK_BITS]) + body)
        answer = heard(link, head, answers, WAIT)
        if answer is not None:
            return answer, number + 1
    raise LinkError(f"{link.name} does not answer: it is off, out of reach, or another program has its link")


def heard(link: CrtpLink, head: int, answers: Callable[[bytes], bool], wait: float) -> bytes | None:
    """Return the body of the first packet with this head that is an answer, or None after a time [s]."""
    end = time.monotonic() + wait
    while (left := end - time.monotonic()) > 0.0:
        packet = link.receive(left)
        if packet and packet[0] & ~LINK_BITS == head and answers(packet[1:]):
            return packet[1:]
    return None


ADDRESS = (0xFF, 0xE7, 0xE7, 0xE7, 0xE7)


def channel_of(uri: str) -> str | None:
    """Return dongle, channel and data rate of an address, ``radio://0/80/2M``; None where there is no broadcast."""
    if not uri.startswith("radio://") or os.environ.get("USE_CFLINK") == "cpp":
        return None
    dongle, *parts = uri.partition("?")[0].removeprefix("radio://").strip("/").split("/")
    channel, rate = (*parts[:2], *("2", "2M")[len(parts[:2]) :])
    return f"radio://{dongle}/{channel}/{rate}"


class RadioBroadcast:
    """The vehicles of a dongle, a channel and a data rate.

    Parameters
    ----------
    channel : str
        From :func:`channel_of`, of links that are open.
    """

    def __init__(self, channel: str) -> None:
        from cflib.crtp.radiodriver import RadioDriver, RadioManager

        self.name = channel
        with _radio(channel, "cannot be opened"):
            dongle, number, rate, *_ = RadioDriver.parse_uri(channel)
            self._radio: Any = RadioManager.open(dongle)
            self._radio.set_channel(number)
            self._radio.set_data_rate(rate)
            self._radio.set_address(ADDRESS)

    def send(self, packet: bytes) -> None:
        """Send a packet, and return when the dongle has."""
        with _radio(self.name, "cannot be reached"):
            self._radio.send_packet(packet)

    def close(self) -> None:
        """Give the radio back to the links."""
        self._radio.close()

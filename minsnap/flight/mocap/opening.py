"""Open a source of poses by its name."""

from __future__ import annotations

import ipaddress

from minsnap.errors import LinkError
from minsnap.flight.mavlink.schedule import Clock
from minsnap.flight.mocap.replay import ReplaySource
from minsnap.flight.mocap.sources import NatNetSource, PoseSource, UdpJsonSource


def open_source(text: str, body: str | None, clock: Clock) -> PoseSource:
    """Open ``natnet:SERVER[,LOCAL]``, ``udp:[HOST:]PORT`` or ``csv:FILE``.

    Raises
    ------
    LinkError
        If it is none of them or nobody answers.
    """
    kind, _, rest = text.partition(":")
    if kind == "csv" and rest:
        return ReplaySource(rest, clock)
    if kind == "udp" and rest.rpartition(":")[2].isdecimal():
        host, _, port = rest.rpartition(":")
        return UdpJsonSource(host or "127.0.0.1", int(port), body, clock)
    if kind == "natnet" and rest:
        server, _, local = rest.partition(",")
        return NatNetSource(server, local or "127.0.0.1", body, not _is_loopback(server), clock)
    raise LinkError(f"cannot understand the source {text!r}: give natnet:SERVER, udp:PORT or csv:FILE", address=text)


def _is_loopback(host: str) -> bool:
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"
